//! Prints the files and lines of every folder, or writes them into ARCHITECTURE.md: `cargo run -p house [-- --write]`.
#![allow(clippy::print_stdout, reason = "what it prints is its purpose")]

/// The line after which the rows of the table begin; an empty line ends them.
const HEAD: &str = "| folder | files | lines | its folders: files, lines |\n|---|---|---|---|\n";

fn main() -> Result<(), house::Error> {
    let rows: String = house::sizes()?.iter().map(house::Size::row).collect();
    if std::env::args().all(|a| a != "--write") {
        print!("{rows}");
        return Ok(());
    }
    let path = house::root().join("ARCHITECTURE.md");
    let text = std::fs::read_to_string(&path)?;
    let (before, old) = text.split_once(HEAD).ok_or("ARCHITECTURE.md has no table of sizes")?;
    let (_, after) = old.split_once("\n\n").ok_or("the table of sizes has no end")?;
    Ok(std::fs::write(path, format!("{before}{HEAD}{rows}\n{after}"))?)
}
