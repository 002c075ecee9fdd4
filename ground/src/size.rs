//! `ground size`: what a firmware image takes of flash and RAM, and in how many places it may panic, against ceilings.
//!
//! In: an ELF file. Out: text, data and bss in bytes, as `size` counts them: text is all that is only read, data what is
//! copied from flash to RAM at start, bss what is cleared; and the places that may panic, by why (panics.rs). Refuses a
//! file that is no ELF, and one over a ceiling.

mod panics;

use std::path::PathBuf;

use object::{Object, ObjectSection, SectionFlags, elf};

/// Prints the sizes of a firmware image and fails over a ceiling
#[derive(clap::Args)]
pub struct Arguments {
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
pub fn size(arguments: &Arguments) -> Result<(), SizeError> {
    let path = &arguments.image;
    let bytes = std::fs::read(path).map_err(|error| SizeError::Read(path.clone(), error))?;
    let Sizes { text, data, bss } = sizes(&bytes).map_err(|error| SizeError::Parse(path.clone(), error))?;
    println!(
        "text {text}, data {data}, bss {bss}: flash {}, RAM {}",
        text + data,
        data + bss
    );
    let panics = panics::sites(&bytes).map_err(|error| SizeError::Parse(path.clone(), error))?;
    let sites = panics.values().sum();
    let mut by_kind: Vec<_> = panics.into_iter().collect();
    by_kind.sort_by_key(|(name, count)| (std::cmp::Reverse(*count), name.clone()));
    let by_kind: Vec<String> = by_kind
        .into_iter()
        .map(|(name, count)| format!("{count} {}", name.trim_start_matches("panic_const_").replace('_', " ")))
        .collect();
    println!("places that may panic {sites}: {}", by_kind.join(", "));
    below("flash", text + data, arguments.flash_ceiling)?;
    below("static RAM", data + bss, arguments.ram_ceiling)?;
    below("the image in places that may panic", sites, arguments.panic_ceiling)
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
