//! Prints the table of `attitude::broad` for a folder of recordings.
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "../shared/data/broad".into());
    let table = attitude::broad::run(folder.as_ref(), |_| {})?;
    print!("{}", attitude::broad::format(&table));
    Ok(())
}
