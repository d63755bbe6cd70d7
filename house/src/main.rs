//! Prints the files and lines of every folder of the workspace's crates: `cargo run -p house`.
#![allow(clippy::print_stdout, reason = "what it prints is its purpose")]

use std::collections::BTreeMap;
use std::path::PathBuf;

fn main() -> Result<(), house::Error> {
    println!("| crate | files | lines | its folders: files, lines |\n|---|---|---|---|");
    for package in house::packages()? {
        let folder = house::root().join(&package.folder);
        let mut rooms: BTreeMap<PathBuf, [usize; 2]> = BTreeMap::new();
        for file in house::sources(&folder)? {
            let lines = std::fs::read_to_string(&file)?.lines().count();
            let below = file.strip_prefix(&folder)?;
            let room = below.parent().map(|p| p.components().take(2).collect()).unwrap_or_default();
            let [files, sum] = rooms.entry(room).or_default();
            (*files, *sum) = (*files + 1, *sum + lines);
        }
        let all = rooms.values().fold([0, 0], |all, room| [all[0] + room[0], all[1] + room[1]]);
        let named = rooms.iter().map(|(room, [files, lines])| {
            let name = room.display().to_string();
            format!("{} {files}, {lines}", if name.is_empty() { "top" } else { &name })
        });
        let named: Vec<String> = named.collect();
        println!("| `{}` | {} | {} | {} |", package.folder.display(), all[0], all[1], named.join(" · "));
    }
    Ok(())
}
