//! `ground size`: what a firmware image takes of flash and RAM, and in how many places it may panic, against ceilings.
//!
//! In: an ELF file. Out: text, data and bss in bytes, as `size` counts them: text is all that is only read, data what is
//! copied from flash to RAM at start, bss what is cleared; and the places that may panic, by why (panics.rs) and by where
//! (origin.rs); and the checksum that the unit tells of it. Refuses a file that is no ELF, and one over a ceiling.
//!
//! A future that is polled after its end panics too. No byte from outside can do that: `await`, `join` and `select` poll none
//! that has ended, and neither do the unit's own `Within` and `Waiting`. So these places count among all, and not among those
//! that data may reach.

mod origin;
mod panics;

use std::{
    cmp::Reverse,
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use object::{Object, ObjectSection, SectionFlags, elf};

use origin::{Origin, Sources};
use panics::Call;

/// Prints the sizes of a firmware image and fails over a ceiling
#[derive(clap::Args)]
pub struct SizeArguments {
    /// The image, an ELF file
    image: PathBuf,
    /// Bytes of flash it may take (text and data)
    #[arg(long, default_value_t = u64::MAX, hide_default_value = true)]
    flash_ceiling: u64,
    /// Bytes of RAM it may take (data and bss)
    #[arg(long, default_value_t = u64::MAX, hide_default_value = true)]
    ram_ceiling: u64,
    /// Places that may panic
    #[arg(long, default_value_t = u64::MAX, hide_default_value = true)]
    panic_ceiling: u64,
    /// Those of them in code that takes bytes from outside
    #[arg(long, default_value_t = u64::MAX, hide_default_value = true)]
    data_panic_ceiling: u64,
    /// Prints each of these places
    #[arg(long)]
    places: bool,
    /// Print all of it as JSON
    #[arg(long)]
    pub json: bool,
}

/// Why an image is refused.
#[derive(Debug, thiserror::Error)]
pub enum SizeError {
    /// It cannot be read.
    #[error("{0}: {1}; build it with `cargo build --release`")]
    Read(PathBuf, std::io::Error),
    /// It is no ELF file.
    #[error("{0}: {1}")]
    Parse(PathBuf, object::read::Error),
    /// Its debug information cannot be read.
    #[error("{0}: debug information: {1}; build it with `cargo build --release`")]
    Debug(PathBuf, addr2line::gimli::Error),
    /// It has too much of something.
    #[error("{what} takes {bytes} of {ceiling}")]
    Ceiling {
        /// What.
        what: &'static str,
        /// What the image takes.
        bytes: u64,
        /// What it may take.
        ceiling: u64,
    },
}

/// Bytes of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Sizes {
    text: u64,
    data: u64,
    bss: u64,
}

/// Prints the sizes.
///
/// # Errors
///
/// An image that cannot be read, or is over a ceiling.
pub fn size(arguments: &SizeArguments) -> Result<(), SizeError> {
    let path = &arguments.image;
    let bytes = std::fs::read(path).map_err(|error| SizeError::Read(path.clone(), error))?;
    let Sizes { text, data, bss } = sizes(&bytes).map_err(|error| SizeError::Parse(path.clone(), error))?;
    let checksum = emulated::image::checksum(&bytes);
    let places = places(&bytes, path)?;
    let by_data: Vec<_> = places.iter().filter(|place| place.is_reachable_from_data()).collect();
    let by_why = counted(places.iter().map(|place| place.why.as_str()));
    let by_file = counted(places.iter().map(|place| place.origin.file.as_str()));
    let by_data_why = counted(by_data.iter().map(|place| place.why.as_str()));
    let (flash, ram) = (text + data, data + bss);
    if arguments.json {
        let object = |counts: Vec<(&str, u32)>| -> serde_json::Map<_, _> {
            let pairs = counts.into_iter().map(|(name, count)| (name.to_owned(), count.into()));
            pairs.collect()
        };
        let sizes = serde_json::json!({
            "text": text, "data": data, "bss": bss, "flash": flash, "ram": ram,
            "checksum": checksum,
            "may_panic": places.len(), "by_why": object(by_why), "by_file": object(by_file),
            "reachable_from_data": by_data.len(), "reachable_by_why": object(by_data_why),
            "places": places.iter().map(|place| format!("{}: {}", place.origin, place.why)).collect::<Vec<_>>(),
        });
        println!("{sizes}");
    } else {
        println!("text {text}, data {data}, bss {bss}: flash {flash}, RAM {ram}");
        if let Some(checksum) = checksum {
            println!("checksum {checksum:08X}, as G_ST tells it of the flash");
        }
        println!("places that may panic {}: {}", places.len(), listed(&by_why));
        println!("  by file: {}", listed(&by_file));
        println!("  reachable from data {}: {}", by_data.len(), listed(&by_data_why));
        if arguments.places {
            places
                .iter()
                .for_each(|place| println!("  {}: {}", place.origin, place.why));
        }
    }
    below("flash", text + data, arguments.flash_ceiling)?;
    below("static RAM", data + bss, arguments.ram_ceiling)?;
    below(
        "the image in places that may panic",
        places.len() as u64,
        arguments.panic_ceiling,
    )?;
    below(
        "the image in places that data may reach and that may panic",
        by_data.len() as u64,
        arguments.data_panic_ceiling,
    )
}

/// A place that may panic.
struct Place {
    why: String,
    origin: Origin,
}

/// As the compiler names polling a future after its end.
const RESUMED: &str = "async fn resumed";

impl Place {
    fn is_reachable_from_data(&self) -> bool {
        self.origin.takes_data() && self.why != RESUMED
    }
}

/// The places that may panic, by where they stand.
fn places(image: &[u8], path: &Path) -> Result<Vec<Place>, SizeError> {
    let parsed = |error| SizeError::Parse(path.into(), error);
    let understood = |error| SizeError::Debug(path.into(), error);
    let file = object::File::parse(image).map_err(parsed)?;
    let sources = Sources::of(&file).map_err(understood)?;
    let place = |call: Call| {
        let why = call.of.trim_start_matches("panic_const_").replace('_', " ");
        Ok(Place {
            why,
            origin: sources.origin(call.at).map_err(understood)?,
        })
    };
    let mut places: Vec<Place> = panics::calls(&file)
        .map_err(parsed)?
        .into_iter()
        .map(place)
        .collect::<Result<_, _>>()?;
    places.sort_by(|one, other| one.origin.cmp(&other.origin));
    Ok(places)
}

/// How often each name comes, most first.
fn counted<'a>(names: impl Iterator<Item = &'a str>) -> Vec<(&'a str, u32)> {
    let mut counts = BTreeMap::new();
    names.for_each(|name| *counts.entry(name).or_insert(0_u32) += 1);
    let mut counts: Vec<_> = counts.into_iter().collect();
    counts.sort_by_key(|(_, count)| Reverse(*count));
    counts
}

fn listed(counts: &[(&str, u32)]) -> String {
    let counts: Vec<_> = counts.iter().map(|(name, count)| format!("{count} {name}")).collect();
    counts.join(", ")
}

fn below(what: &'static str, bytes: u64, ceiling: u64) -> Result<(), SizeError> {
    if bytes <= ceiling {
        Ok(())
    } else {
        Err(SizeError::Ceiling { what, bytes, ceiling })
    }
}

fn sizes(image: &[u8]) -> object::read::Result<Sizes> {
    let mut sizes = Sizes::default();
    for section in object::File::parse(image)?.sections() {
        let SectionFlags::Elf { sh_flags } = section.flags() else {
            continue;
        };
        let sh_flags = u32::try_from(sh_flags).unwrap_or(0);
        let counted = if sh_flags & elf::SHF_ALLOC == 0 {
            continue;
        } else if section.kind() == object::SectionKind::UninitializedData {
            &mut sizes.bss
        } else if sh_flags & elf::SHF_WRITE != 0 {
            &mut sizes.data
        } else {
            &mut sizes.text
        };
        *counted += section.size();
    }
    Ok(sizes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_elf_is_refused_and_so_is_one_over_its_ceiling() {
        assert!(sizes(b"not an image").is_err());
        assert!(below("flash", 10, 10).is_ok());
        let refused = below("flash", 11, 10).map_err(|error| error.to_string());
        assert_eq!(refused, Err("flash takes 11 of 10".into()));
    }

    #[test]
    fn this_program_has_code_and_data() {
        let image = std::fs::read(std::env::current_exe().expect("a path")).expect("a file");
        let sizes = sizes(&image).expect("an ELF file");
        assert!(sizes.text > sizes.data && sizes.data > 0 && sizes.bss > 0, "{sizes:?}");
    }
}
