//! What came over a line or out of a file: bytes to readings, readings to channels with names and units, and whether numbers
//! can be in the unit that they are said to be in.
//!
//! ```
//! use emems::{packet, sample::Reading};
//! use packets::stream::{Bytes5To8, Decoder, Item};
//!
//! let mut stream = b"noise".to_vec();
//! stream.extend(packet::encode(&Reading::unread(7)));
//! let items = Decoder::new(Bytes5To8::Errors).push(&stream);
//! assert!(matches!(items[0], Item::Reject(_)));
//! assert!(matches!(&items[1], Item::Packet { offset: 5, reading } if reading.counter == 7));
//! ```

pub mod channel;
pub mod input;
pub mod magnitude;
pub mod output;
pub mod reach;
pub mod stream;
