//! Where a place of an image stands in the sources, by its debug information.
//!
//! In: an ELF file with DWARF, as the release profile makes it; an address. Out: the file below the repository
//! (`src/packet.rs`, `drivers/src/lis331hh.rs`) or the package (`embassy-sync`, `core`), and the line. Of functions inlined into
//! each other the innermost that is not `core`'s counts: a checked sum or an index stands where it was written. Code that the
//! compiler merged from several lines has line 0.

use std::fmt;

use addr2line::{
    Context,
    gimli::{Dwarf, EndianSlice, Error, LittleEndian, SectionId},
};
use object::{Object, ObjectSection};

/// Parts of the unit that take bytes from outside, beside the drivers: from the umbilical and the recorder.
const DATA: [&str; 5] = ["calibration", "command", "flight_log", "nand", "packet"];

/// Where a place stands.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Origin {
    /// File below the repository, or package.
    pub file: String,
    /// Its line; 0 where it stands for several.
    pub line: u32,
}

impl Origin {
    /// Whether it stands in a part of the unit that takes bytes from outside.
    pub fn takes_data(&self) -> bool {
        let below = self.file.strip_prefix("src/").unwrap_or_default();
        let part = below.split(['/', '.']).next().unwrap_or_default();
        self.file.starts_with("drivers/") || DATA.contains(&part)
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file, self.line)
    }
}

/// The sources of an image.
pub struct Sources<'a>(Context<EndianSlice<'a, LittleEndian>>);

impl<'a> Sources<'a> {
    /// Of an ELF file.
    pub fn of(file: &object::File<'a>) -> Result<Self, Error> {
        let section = |id: SectionId| {
            let data = file.section_by_name(id.name()).and_then(|section| section.data().ok());
            Ok::<_, Error>(EndianSlice::new(data.unwrap_or_default(), LittleEndian))
        };
        Ok(Sources(Context::from_dwarf(Dwarf::load(section)?)?))
    }

    /// Where the instruction at this address stands.
    pub fn origin(&self, address: u64) -> Result<Origin, Error> {
        let mut frames = self.0.find_frames(address).skip_all_loads()?;
        let mut found = Origin::default();
        while let Some(frame) = frames.next()? {
            let Some((path, line)) = frame.location.and_then(|at| Some((at.file?, at.line.unwrap_or(0)))) else {
                continue;
            };
            found = Origin {
                file: below_repository(path),
                line,
            };
            if !is_language(&found.file) {
                break;
            }
        }
        Ok(found)
    }
}

/// Whether it is a library of the language.
fn is_language(file: &str) -> bool {
    matches!(file, "core" | "alloc" | "compiler_builtins")
}

/// The file below the repository, or the package that it is of.
fn below_repository(path: &str) -> String {
    let behind = |mark: &str| path.rsplit_once(mark).map(|(_, below)| below);
    if let Some(below) = behind("/registry/src/") {
        let package = below.split('/').nth(1).unwrap_or(below);
        return package.rsplit_once('-').map_or(package, |(name, _)| name).into();
    }
    if path.starts_with("/rustc/")
        && let Some(below) = behind("/library/")
    {
        return below.split('/').next().unwrap_or(below).into();
    }
    for top in ["boards", "drivers", "src"] {
        if let Some(below) = behind(&format!("/{top}/")) {
            return format!("{top}/{below}");
        }
    }
    path.into()
}

#[cfg(test)]
mod tests {
    use object::ObjectSymbol;

    use super::*;

    #[test]
    fn a_file_is_named_below_the_repository_or_by_its_package() {
        let cases = [
            ("/home/me/emems/drivers/src/lib.rs", "drivers/src/lib.rs", true),
            ("/emems/src/packet.rs", "src/packet.rs", true),
            ("/emems/src/unit/calibration.rs", "src/unit/calibration.rs", false),
            (
                "/emems/src/../boards/stm32f407/bus.rs",
                "boards/stm32f407/bus.rs",
                false,
            ),
            (
                "/home/me/.cargo/registry/src/index-1f/embassy-sync-0.8.0/src/channel.rs",
                "embassy-sync",
                false,
            ),
            ("/rustc/59807616/library/core/src/slice/index.rs", "core", false),
        ];
        for (path, file, takes_data) in cases {
            let origin = Origin {
                file: below_repository(path),
                line: 1,
            };
            assert_eq!((origin.file.as_str(), origin.takes_data()), (file, takes_data));
        }
    }

    /// This program in place of an image: the address of a function is in its file.
    #[test]
    fn a_function_of_this_program_is_found_in_this_file() {
        let image = std::fs::read(std::env::current_exe().expect("a path")).expect("a file");
        let file = object::File::parse(&*image).expect("an ELF file");
        let is_it = |symbol: &object::Symbol| symbol.name().is_ok_and(|name| name.contains("below_repository"));
        let here = file.symbols().find(is_it).expect("a symbol").address();
        let origin = Sources::of(&file)
            .and_then(|sources| sources.origin(here))
            .expect("debug information");
        assert_eq!(origin.file, "src/size/origin.rs", "{origin}");
    }
}
