//! `ground completions` and `ground man`: what a shell and `man` are to know of the command line.
//!
//! In: the command line itself, as clap has it. Out: a completion script on standard output, or a folder with a page a
//! command. Nothing is written by hand, so that neither can be out of date.

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use clap_complete::Shell;
use packets::output;

/// Prints a completion script for a shell
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ground completions bash > ~/.local/share/bash-completion/completions/ground\n  ground completions zsh > ~/.zfunc/_ground"
)]
pub struct Completions {
    /// The shell
    pub shell: Shell,
}

/// Writes a manual page a command into a folder
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:\n  ground man ~/.local/share/man/man1 && man ground-calibrate")]
pub struct Man {
    /// Folder, made where it is not there
    pub dir: PathBuf,
}

/// Prints the script.
///
/// # Errors
/// When standard output cannot be written.
pub fn completions(arguments: &Completions, mut command: clap::Command) -> io::Result<()> {
    // The generator's own output panics where it cannot write.
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "ground", &mut script);
    io::stdout().write_all(&script)
}

/// Writes the pages; how many.
///
/// # Errors
/// When the folder or a page cannot be written.
pub fn man(arguments: &Man, command: clap::Command) -> io::Result<()> {
    fs::create_dir_all(&arguments.dir)?;
    let count = pages(&arguments.dir, command, "ground")?;
    println!("{count} pages in {}", arguments.dir.display());
    Ok(())
}

fn pages(folder: &Path, command: clap::Command, name: &str) -> io::Result<usize> {
    let mut count = 1;
    for below in command.get_subcommands().filter(|below| !below.is_hide_set()) {
        let name = format!("{name}-{}", below.get_name());
        // A command's own flags are known only once it is built as one below.
        count += pages(folder, below.clone(), &name)?;
    }
    let mut page = Vec::new();
    let name: &'static str = name.to_owned().leak();
    clap_mangen::Man::new(command.name(name)).render(&mut page)?;
    output::replace_with(&folder.join(format!("{name}.1")), page)?;
    Ok(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_a_page_and_hidden_ones_have_none() {
        let place = tempfile::tempdir().expect("temporary folder");
        let below = clap::Command::new("calibrate").subcommand(clap::Command::new("drift"));
        let hidden = clap::Command::new("secret").hide(true);
        let command = clap::Command::new("ground").subcommand(below).subcommand(hidden);
        assert_eq!(pages(place.path(), command, "ground").expect("pages"), 3);
        let page = fs::read_to_string(place.path().join("ground-calibrate-drift.1")).expect("page");
        assert!(page.contains("ground\\-calibrate\\-drift"), "{page}");
    }
}
