//! How many files and lines every folder has.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::{Error, packages, root, sources};

/// Files and lines of a package.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Size {
    /// The package's folder below the root.
    pub package: PathBuf,
    /// Files and lines of each of its folders, to two levels.
    pub folders: BTreeMap<PathBuf, [usize; 2]>,
}

impl Size {
    /// Files and lines in all.
    pub fn total(&self) -> [usize; 2] {
        self.folders.values().fold([0, 0], |[files, lines], more| [files + more[0], lines + more[1]])
    }

    /// A row of the table in ARCHITECTURE.md.
    pub fn row(&self) -> String {
        let [files, lines] = self.total();
        let folders = self.folders.iter().map(|(folder, [files, lines])| {
            let name = if *folder == Path::new("") { "top".into() } else { folder.display().to_string() };
            format!("{name} {files}, {lines}")
        });
        let folders: Vec<String> = folders.collect();
        format!("| `{}/` | {files} | {lines} | {} |\n", self.package.display(), folders.join(" · "))
    }
}

/// The sizes of all packages, by their folders' names.
///
/// # Errors
/// Where cargo's metadata or a file cannot be read.
pub fn sizes() -> Result<Vec<Size>, Error> {
    let mut sizes = Vec::new();
    for package in packages()? {
        let whole = root().join(&package.folder);
        let mut folders: BTreeMap<PathBuf, [usize; 2]> = BTreeMap::new();
        for file in sources(&whole)? {
            let folder = file.strip_prefix(&whole)?.parent().unwrap_or(Path::new(""));
            let [files, lines] = folders.entry(folder.components().take(2).collect()).or_default();
            (*files, *lines) = (*files + 1, *lines + std::fs::read_to_string(&file)?.lines().count());
        }
        sizes.push(Size { package: package.folder, folders });
    }
    sizes.sort_by(|a, b| a.package.cmp(&b.package));
    Ok(sizes)
}
