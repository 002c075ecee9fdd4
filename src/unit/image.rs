//! The firmware's own image, read again and again: a bit of the flash that flips is told (fault U10).
//!
//! In: the image, piece by piece. Out: its CRC-32 (ISO-HDLC) in the status, which is the one that `ground size` prints of the
//! file; and a line when another pass over it gives another one. A pass over 240 KiB takes 12 s. What has flipped before the
//! first pass only the ground can tell, by comparing.

use embassy_time::Duration;

use super::{clock::next_on_grid, shared::Shared};
use crate::{board::ReadImage, checksum::CRC};

/// Bytes at a time, and how often in a period: 4 KiB hold the processor for some 0.2 ms.
const PIECE: usize = 128;
const PIECES: usize = 32;

/// Reads for ever.
pub async fn run(shared: &Shared, read: ReadImage) -> ! {
    let period = Duration::from_millis(shared.settings.period_ms);
    // Of a period of 200 ms: after the cycle and its estimation, between two readings of the accelerometers and two fast samples.
    let phase = Duration::from_ticks(period.as_ticks().saturating_mul(2) / 3);
    loop {
        let (mut digest, mut at) = (CRC.digest(), 0);
        let mut left = true;
        while left {
            shared.clock.until(next_on_grid(period, phase)).await;
            for _ in 0..PIECES {
                let mut piece = [0; PIECE];
                let count = read(at, &mut piece);
                left = count > 0;
                digest.update(piece.get(..count).unwrap_or_default());
                at = at.saturating_add(count);
            }
        }
        let now = digest.finalize();
        if let Some(before) = shared.image.replace(Some(now)).filter(|before| *before != now) {
            shared.say(format_args!(
                "firmware image CHANGED: checksum {now:08X}, was {before:08X}"
            ));
        }
    }
}
