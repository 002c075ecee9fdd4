//! The firmware image: an ELF file for the STM32F407, read or built.
//!
//! In: a path, or the workspace this package belongs to. Out: an image the stand can run, its symbols, its log table.
//! Refuses a file that is no ELF file, and one for another processor, and says what to do instead.

use std::{
    fmt, io,
    path::{Path, PathBuf},
};

use defmt_decoder::Table;
use object::{
    Endianness, Object, ObjectSection, ObjectSymbol, SymbolKind,
    elf::PT_LOAD,
    read::elf::{ElfFile32, ProgramHeader},
};
use rigless::symbols::Symbols;

use crate::thumb;

/// ELF32, little endian, `e_machine` EM_ARM (ELF specification, header; ELF for the Arm architecture 5.2).
const ELF_MAGIC: [u8; 6] = [0x7F, b'E', b'L', b'F', 1, 1];
const MACHINE: usize = 18;
const EM_ARM: u16 = 40;

/// A firmware image.
#[derive(Clone, Debug)]
pub struct Image {
    path: PathBuf,
    pub(crate) placed: rigless::image::Image,
    symbols: Symbols,
}

/// Why there is no image, or not the wanted thing in it. The text says what to do.
#[derive(Debug)]
pub enum ImageError {
    /// The file could not be read.
    Read(PathBuf, io::Error),
    /// The file is not an ELF file.
    NotElf(PathBuf),
    /// An ELF file for another processor: its `e_machine`, or `None` if it is not even 32-bit little endian.
    Architecture(PathBuf, Option<u16>),
    /// The ELF file is damaged; the reader's text.
    Damaged(PathBuf, String),
    /// No static or function of this name.
    NoSymbol(PathBuf, String),
    /// The sources that this program was built from are no longer where they were.
    NoSources(PathBuf),
    /// The firmware does not compile; the compiler has said why.
    Compile,
    /// No compiler for the board could be had; what was tried.
    NoCompiler(Vec<String>),
}

impl std::error::Error for ImageError {}

impl ImageError {
    /// Whether it is the named file that is at fault, and not the sources or the compiler.
    pub fn is_of_the_file(&self) -> bool {
        use ImageError::{Architecture, Damaged, NoSymbol, NotElf, Read};
        matches!(
            self,
            Read(..) | NotElf(_) | Architecture(..) | Damaged(..) | NoSymbol(..)
        )
    }
}

impl fmt::Display for ImageError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ImageError::Read(path, error) => write!(
                formatter,
                "{}: {error}. Build the image with `cargo build --release` first, or name another file",
                path.display()
            ),
            ImageError::NotElf(path) => write!(
                formatter,
                "{} is not an ELF file. Name the file that `cargo build --release` leaves as \
                 target/thumbv7em-none-eabihf/release/emems, not a .bin or .hex made from it",
                path.display()
            ),
            ImageError::Architecture(path, machine) => {
                write!(formatter, "{} is for another processor (", path.display())?;
                match machine {
                    Some(machine) => write!(formatter, "ELF machine {machine}")?,
                    None => write!(formatter, "not 32-bit little endian")?,
                }
                write!(
                    formatter,
                    "; the board's is {EM_ARM}, 32-bit Arm). Build with `--target thumbv7em-none-eabihf`"
                )
            }
            ImageError::Damaged(path, text) => {
                write!(formatter, "{} is damaged: {text}. Build it again", path.display())
            }
            ImageError::NoSymbol(path, name) => write!(
                formatter,
                "{} has no symbol {name}. Keep its symbols (no `strip` in the profile), and mark the static \
                 `#[unsafe(no_mangle)]`",
                path.display()
            ),
            ImageError::NoSources(root) => write!(
                formatter,
                "this program has none within, and the sources to build it from are no longer in {}. Name an image with --image \
                 FILE, or build the program with one: EMEMS_IMAGE=FILE cargo install-ground",
                root.display()
            ),
            ImageError::Compile => write!(formatter, "the firmware does not compile; cargo's messages are above"),
            ImageError::NoCompiler(tried) => {
                writeln!(formatter, "no compiler for thumbv7em-none-eabihf:")?;
                for attempt in tried {
                    writeln!(formatter, "  {attempt}")?;
                }
                write!(
                    formatter,
                    "Install one of:\n  rustup target add thumbv7em-none-eabihf\n  \
                     apt-get install rustc-web cargo-web rust-web-src lld   (Debian)"
                )
            }
        }
    }
}

impl Image {
    /// The image in the file at `path`.
    ///
    /// # Errors
    ///
    /// See [`ImageError`].
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let bytes = std::fs::read(path).map_err(|error| ImageError::Read(path.into(), error))?;
        Image::new(path, bytes)
    }

    /// The image `bytes`, called `path` in every error.
    ///
    /// # Errors
    ///
    /// See [`ImageError`].
    pub fn new(path: &Path, bytes: Vec<u8>) -> Result<Self, ImageError> {
        if bytes.get(..4) != Some(&ELF_MAGIC[..4]) {
            return Err(ImageError::NotElf(path.into()));
        }
        let machine = match bytes.get(MACHINE..MACHINE + 2) {
            Some(&[low, high]) if bytes.get(..6) == Some(&ELF_MAGIC) => Some(u16::from_le_bytes([low, high])),
            _ => None,
        };
        if machine != Some(EM_ARM) {
            return Err(ImageError::Architecture(path.into(), machine));
        }
        let damaged = |error: &dyn fmt::Display| ImageError::Damaged(path.into(), error.to_string());
        let symbols = Symbols::read(&bytes, std::convert::identity).map_err(|error| damaged(&error))?;
        let placed = rigless::image::Image::new(path, bytes, None).map_err(|error| damaged(&error))?;
        Ok(Image {
            path: path.into(),
            placed,
            symbols,
        })
    }

    /// The address of a static.
    ///
    /// # Errors
    ///
    /// [`ImageError::NoSymbol`].
    pub fn symbol(&self, name: &str) -> Result<u64, ImageError> {
        (self.symbols.get(name)).map_err(|_| ImageError::NoSymbol(self.path.clone(), name.into()))
    }

    /// This image with the first word of the function whose mangled name contains `part` written over, as a fault of the
    /// flash or of the firmware itself would.
    ///
    /// # Errors
    ///
    /// [`ImageError::NoSymbol`].
    pub fn with_code(&self, part: &str, word: u32) -> Result<Self, ImageError> {
        let mut bytes = self.placed.bytes().to_vec();
        let at = offset_of(&bytes, part).ok_or_else(|| ImageError::NoSymbol(self.path.clone(), part.into()))?;
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        Image::new(&self.path, bytes)
    }

    /// This image with the function whose mangled name contains `part` jumping to where some arithmetic panics for its overflow.
    ///
    /// # Errors
    ///
    /// [`ImageError::NoSymbol`]: of the function, or of an overflow that is seen.
    pub fn with_panic(&self, part: &str) -> Result<Self, ImageError> {
        let bytes = self.placed.bytes();
        let missing = |name: &str| ImageError::NoSymbol(self.path.clone(), name.into());
        let from = function(bytes, part).ok_or_else(|| missing(part))?;
        let to = thumb::call_with_place(bytes, OVERFLOW).ok_or_else(|| missing(OVERFLOW))?;
        self.with_code(part, thumb::branch(from, to))
    }

    /// Where an exception leads, by its number (ARMv7-M ARM, B1.5.3).
    pub fn vector(&self, exception: usize) -> Option<u32> {
        let vectors = flash(self.placed.bytes())?;
        Some(u32::from_le_bytes(*vectors.get(4 * exception..)?.first_chunk()?))
    }

    /// The checksum of what the flash holds of it.
    pub fn checksum(&self) -> Option<u32> {
        checksum(self.placed.bytes())
    }

    /// The table of log strings; `None` for an image that logs nothing, or in a format this reader does not know.
    pub fn log_table(&self) -> Option<Table> {
        Table::parse(self.placed.bytes()).ok().flatten()
    }
}

/// What overflow of an addition calls: it takes its place in the source, and never returns.
const OVERFLOW: &str = "panic_const_add_overflow";

/// The address of a function, by a piece of its mangled name.
fn function(elf: &[u8], part: &str) -> Option<u64> {
    let file = object::File::parse(elf).ok()?;
    let is_it = |name: &str| name.contains(part) && !name.contains("drop_in_place");
    let symbol = file
        .symbols()
        .find(|symbol| symbol.kind() == SymbolKind::Text && symbol.name().is_ok_and(is_it))?;
    // Bit 0 of a function's value says Thumb.
    Some(symbol.address() & !1)
}

/// CRC-32 (ISO-HDLC) of what the flash holds of an ELF file, which is what the unit reads there and `G_ST` tells; `None` for
/// another file.
pub fn checksum(elf: &[u8]) -> Option<u32> {
    Some(crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&flash(elf)?))
}

/// The bytes that are laid into flash, by the addresses they are loaded at: from the first to the last, erased between.
fn flash(elf: &[u8]) -> Option<Vec<u8>> {
    let file = ElfFile32::<Endianness>::parse(elf).ok()?;
    let little = Endianness::Little;
    let mut bytes = Vec::new();
    let segments = file.elf_program_headers().iter();
    let laid = segments.filter(|segment| segment.p_type(little) == PT_LOAD && segment.p_filesz(little) > 0);
    for segment in laid {
        let content = segment.data(little, elf).ok()?;
        let at = usize::try_from(segment.p_paddr(little).checked_sub(FLASH)?).ok()?;
        bytes.resize(bytes.len().max(at + content.len()), ERASED);
        bytes[at..at + content.len()].copy_from_slice(content);
    }
    Some(bytes)
}

/// Where the flash begins (RM0090 section 2.3), and what an erased byte of it is.
const FLASH: u32 = 0x0800_0000;
const ERASED: u8 = 0xFF;

/// Where in an ELF file the first word of a function stands, by a piece of its mangled name.
fn offset_of(elf: &[u8], part: &str) -> Option<usize> {
    let address = function(elf, part)?;
    let file = object::File::parse(elf).ok()?;
    file.sections().find_map(|section| {
        let (first, _) = section.file_range()?;
        let within = address.checked_sub(section.address())?;
        (within + 4 <= section.size()).then(|| usize::try_from(first + within).ok())?
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(bytes: &[u8]) -> String {
        Image::new(Path::new("a.elf"), bytes.to_vec()).unwrap_err().to_string()
    }

    #[test]
    fn a_raw_binary_is_refused_with_the_file_to_name_instead() {
        assert!(refused(&[0x00, 0x00, 0x02, 0x20]).contains("target/thumbv7em-none-eabihf/release/emems"));
        assert!(refused(b"").contains("not an ELF file"));
    }

    #[test]
    fn a_host_program_is_refused_with_the_target_to_build_for() {
        let mut header = [0; 64];
        header[..6].copy_from_slice(&[0x7F, b'E', b'L', b'F', 2, 1]);
        assert!(refused(&header).contains("not 32-bit little endian"));
        header[4] = 1;
        header[MACHINE] = 243;
        let text = refused(&header);
        assert!(
            text.contains("ELF machine 243") && text.contains("--target thumbv7em-none-eabihf"),
            "{text}"
        );
    }

    #[test]
    fn a_header_without_its_sections_is_damaged() {
        let mut header = [0; 52];
        header[..6].copy_from_slice(&ELF_MAGIC);
        header[MACHINE] = EM_ARM as u8;
        header[32] = 0xFF;
        header[48] = 1;
        assert!(refused(&header).contains("Build it again"), "{}", refused(&header));
    }

    #[test]
    fn a_machine_without_a_compiler_for_the_board_is_told_what_to_install() {
        let text = ImageError::NoCompiler(vec!["rustup does not start: no such file".into()]).to_string();
        assert!(text.contains("rustup does not start"));
        assert!(text.contains("rustup target add thumbv7em-none-eabihf"));
        assert!(text.contains("apt-get install rustc-web cargo-web rust-web-src lld"));
    }

    #[test]
    fn a_file_that_is_not_there_is_named_with_the_way_to_make_it() {
        let text = Image::read(Path::new("no/such/image")).unwrap_err().to_string();
        assert!(
            text.starts_with("no/such/image: ") && text.contains("cargo build --release"),
            "{text}"
        );
    }
}
