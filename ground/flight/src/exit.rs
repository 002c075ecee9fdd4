//! How a program ends whose output nobody reads any more.
//!
//! In: a panic of `print!`. Out: exit code 0 on a closed pipe, 1 with an error on a full disk; every other panic goes on.

/// Ends the program where `print!` cannot write: quietly on a closed pipe, with an error on a full disk. The standard
/// library panics there, since its macros have no other way out; every other panic goes on as it was.
pub fn without_panic_on_closed_output() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let text = panic.payload_as_str().unwrap_or_default();
        match text.strip_prefix("failed printing to stdout: ") {
            // As the standard library words EPIPE on every system it has.
            Some(why) if why.contains("Broken pipe") || why.contains("os error 232") => std::process::exit(0),
            Some(why) => {
                eprintln!("error: the output cannot be written: {why}");
                std::process::exit(1);
            }
            None => usual(panic),
        }
    }));
}
