//! The image's flight in the place of the host's, which was shown first.
//!
//! In: the folder of the host's flight, and of the image's in it. Out: the first folder with the image's files, if both sent the same
//! packets, byte for byte; derived frames may differ by some microseconds of slot times. Otherwise both stay, and what differs is said.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use emems::packet::{PACKET_BYTES, encode};
use packets::stream::{Decoder, Item};

/// What a line said, in a flight's folder.
const PACKETS: &str = "packets.txt";

/// Why the host's flight stays where it is.
#[derive(Debug, thiserror::Error)]
pub enum ReplaceError {
    /// Two numbers of packets.
    #[error(
        "the image sent {image} packets, the host {host}; `ground compare {first} {second}` shows both",
        first = .first.display(), second = .second.display()
    )]
    Count {
        /// Of the image.
        image: usize,
        /// Of the host.
        host: usize,
        /// Folder of the host's flight.
        first: PathBuf,
        /// Folder of the image's.
        second: PathBuf,
    },
    /// Other packets.
    #[error(
        "{differing} of {count} packets of the image are not the host's, the first at number {number}; \
         `ground compare {first} {second}` shows both",
        first = .first.display(), second = .second.display()
    )]
    Differs {
        /// How many.
        differing: usize,
        /// Of how many.
        count: usize,
        /// The first of them, counted from 0.
        number: usize,
        /// Folder of the host's flight.
        first: PathBuf,
        /// Folder of the image's.
        second: PathBuf,
    },
    /// A file.
    #[error("{path}: {error}; the image's flight is in {second}", second = .second.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        error: io::Error,
        /// Folder of the image's flight.
        second: PathBuf,
    },
}

/// Puts the files of `second` over those of `first`, whose folder it is in; the page.
///
/// # Errors
/// See [`ReplaceError`].
pub fn replace(first: &Path, second: &Path) -> Result<PathBuf, ReplaceError> {
    let failed = |path: &Path| {
        let (path, second) = (path.to_owned(), second.to_owned());
        move |error| ReplaceError::File { path, error, second }
    };
    let read = |folder: &Path| sent(&folder.join(PACKETS)).map_err(failed(&folder.join(PACKETS)));
    let (host, image) = (read(first)?, read(second)?);
    let folders = || (first.to_owned(), second.to_owned());
    if host.len() != image.len() {
        let ((host, image), (first, second)) = ((host.len(), image.len()), folders());
        return Err(ReplaceError::Count {
            image,
            host,
            first,
            second,
        });
    }
    let pairs = || host.iter().zip(&image);
    if let Some(number) = pairs().position(|(host, image)| host != image) {
        let (first, second) = folders();
        return Err(ReplaceError::Differs {
            differing: pairs().filter(|(host, image)| host != image).count(),
            count: host.len(),
            number,
            first,
            second,
        });
    }
    eprintln!("{} packets of the image, all as the host sent them", image.len());
    for entry in fs::read_dir(second).map_err(failed(second))? {
        let entry = entry.map_err(failed(second))?;
        let to = first.join(entry.file_name());
        fs::rename(entry.path(), &to).map_err(failed(&to))?;
    }
    fs::remove_dir(second).map_err(failed(second))?;
    Ok(first.join("index.html"))
}

/// The packets in what a line said.
fn sent(path: &Path) -> io::Result<Vec<[u8; PACKET_BYTES]>> {
    let bytes = match fs::read(path) {
        // A flight that is over before the first packet.
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        read => read?,
    };
    let items = Decoder::default().push(&bytes);
    let packets = items.iter().filter_map(|item| match item {
        Item::Packet { reading, .. } => Some(encode(reading)),
        _ => None,
    });
    Ok(packets.collect())
}

#[cfg(test)]
mod tests {
    use emems::sample::Reading;

    use super::*;

    /// A first flight of these packets, and in it another's.
    fn flights(host: &[Reading], image: &[Reading]) -> (tempfile::TempDir, PathBuf, PathBuf) {
        let place = tempfile::tempdir().expect("temporary folder");
        let (first, second) = (place.path().join("rocket-1"), place.path().join("rocket-1/image"));
        fs::create_dir_all(&second).expect("folders");
        for (folder, readings, page) in [(&first, host, "host"), (&second, image, "image")] {
            let bytes: Vec<u8> = readings.iter().flat_map(encode).collect();
            fs::write(folder.join(PACKETS), bytes).expect("packets");
            fs::write(folder.join("index.html"), page).expect("page");
        }
        (place, first, second)
    }

    #[test]
    fn the_same_packets_give_the_image_the_place_of_the_host() {
        let readings = [1, 2, 3].map(Reading::unread);
        let (_place, first, second) = flights(&readings, &readings);
        fs::write(second.join("log.txt"), "INFO up").expect("log");
        let page = replace(&first, &second).expect("the same");
        assert_eq!(fs::read_to_string(page).expect("page"), "image");
        assert!(first.join("log.txt").exists() && !second.exists());
    }

    #[test]
    fn a_packet_that_differs_or_is_missing_leaves_both_and_is_named() {
        let host = [1, 2, 3].map(Reading::unread);
        let mut image = host;
        image[1].micro_g = !image[1].micro_g;
        let (_place, first, second) = flights(&host, &image);
        let error = replace(&first, &second).expect_err("one differs").to_string();
        assert!(
            error.starts_with("1 of 3 packets of the image are not the host's, the first at number 1; "),
            "{error}"
        );
        let page = |folder: &Path| fs::read_to_string(folder.join("index.html")).expect("page");
        assert_eq!([page(&first), page(&second)], ["host", "image"]);
        let (_place, first, second) = flights(&host, &host[..2]);
        let error = replace(&first, &second).expect_err("one is missing").to_string();
        assert!(error.starts_with("the image sent 2 packets, the host 3; "), "{error}");
    }
}
