//! Where the files of a recording are: in a folder, or in memory.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use sha2::{Digest as _, Sha256};

use super::error::{LARGEST_FILE, ReadError};
use super::files::{HEADER, read_bytes, text_of, within};
use super::table::{Sheet, Values};

/// Where the files of a recording are.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// In a folder.
    Folder(PathBuf),
    /// In memory: nothing is read from the file system.
    Memory(Memory),
}

/// Files of a recording that are in memory. A copy shares them.
///
/// ```
/// use missing_physics_domains::recording::{Memory, Source, Values};
///
/// let header = "format = 1\ndomain = \"trajectory\"\ndata = \"data.csv\"\n";
/// let t_s: Vec<f64> = (0..30).map(|i| f64::from(i) / 30.0).collect();
/// let z_m = t_s.iter().map(|t| 2.0 - 4.903 * t * t + 0.002 * (700.0 * t).sin()).collect();
/// let labels = vec!["a".to_owned(); 30];
/// let columns = [("run", Values::Labels(labels)), ("t_s", Values::Numbers(t_s)), ("z_m", Values::Numbers(z_m))];
/// let memory = Memory::new("drop")
///     .with_file("recording.toml", header)
///     .with_columns("data.csv", columns.map(|(name, values)| (name.to_owned(), values)));
/// let (domain, checked) = missing_physics_domains::check_source(&Source::Memory(memory))?;
/// assert_eq!((domain.id(), checked.contents.runs[0].rows), ("trajectory", 30));
/// # Ok::<(), missing_physics_domains::recording::ReadError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Memory {
    name: String,
    files: BTreeMap<String, Content>,
}

/// What a file in memory holds.
#[derive(Debug, Clone, PartialEq)]
enum Content {
    Bytes(Arc<[u8]>),
    Columns(Arc<[(String, Values)]>),
}

impl Memory {
    /// A recording without files, by the name with which errors begin.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), files: BTreeMap::new() }
    }

    /// The same with a file: the header (`recording.toml`), a table as CSV, a picture, a sound, a mesh.
    #[must_use]
    pub fn with_file(mut self, name: &str, bytes: impl AsRef<[u8]>) -> Self {
        self.files.insert(name.to_owned(), Content::Bytes(bytes.as_ref().into()));
        self
    }

    /// The same with a table that is there as columns, by name; all as long as the first.
    #[must_use]
    pub fn with_columns(mut self, name: &str, columns: impl IntoIterator<Item = (String, Values)>) -> Self {
        self.files.insert(name.to_owned(), Content::Columns(columns.into_iter().collect()));
        self
    }

    fn content(&self, name: &str) -> Result<&Content, ReadError> {
        let plain = name.strip_prefix("./").unwrap_or(name);
        self.files
            .get(plain)
            .ok_or_else(|| ReadError::Open { file: self.shown(name), why: "no such file".into() })
    }

    fn shown(&self, name: &str) -> String {
        if self.name.is_empty() { name.to_owned() } else { format!("{}/{name}", self.name) }
    }
}

impl Source {
    /// The files of a folder.
    pub fn folder(path: impl Into<PathBuf>) -> Self {
        Self::Folder(path.into())
    }

    /// The recording's name, as errors begin with it: the folder's path, or the name in memory.
    pub fn name(&self) -> String {
        match self {
            Self::Folder(path) => path.display().to_string(),
            Self::Memory(memory) => memory.name.clone(),
        }
    }

    /// The folder in which a program that the recording names is started: the recording's, or the present one.
    pub fn working_folder(&self) -> &Path {
        match self {
            Self::Folder(path) => path,
            Self::Memory(_) => Path::new("."),
        }
    }

    /// A file, as errors name it.
    pub(super) fn shown(&self, name: &str) -> String {
        match self {
            Self::Folder(path) => path.join(name).display().to_string(),
            Self::Memory(memory) => memory.shown(name),
        }
    }

    /// The bytes of a file.
    pub(super) fn bytes(&self, name: &str) -> Result<Vec<u8>, ReadError> {
        let memory = match self {
            Self::Folder(path) => return read_bytes(&path.join(name)),
            Self::Memory(memory) => memory,
        };
        match memory.content(name)? {
            Content::Bytes(bytes) if bytes.len() as u64 > LARGEST_FILE => {
                Err(ReadError::TooLarge { file: memory.shown(name), bytes: bytes.len() as u64 })
            }
            Content::Bytes(bytes) => Ok(bytes.to_vec()),
            Content::Columns(_) => {
                Err(ReadError::Open { file: memory.shown(name), why: "a table, expected a file".into() })
            }
        }
    }

    /// A table: columns where it is there as columns, else the text of a file.
    pub(super) fn sheet(&self, name: &str) -> Result<Sheet, ReadError> {
        if let Self::Memory(memory) = self
            && let Content::Columns(columns) = memory.content(name)?
        {
            return Ok(Sheet::Columns(columns.clone()));
        }
        self.text(name).map(Sheet::Text)
    }

    /// The text of a file.
    pub(super) fn text(&self, name: &str) -> Result<String, ReadError> {
        text_of(self.shown(name), self.bytes(name)?)
    }

    /// SHA-256 of the header and of every file that the header names, in hexadecimal digits, by the file's name. Of a table that is there as
    /// columns: of its names and cells, numbers as eight bytes, the lowest first.
    pub fn sha256(&self) -> BTreeMap<String, String> {
        match self {
            Self::Folder(folder) => {
                let header = std::fs::read_to_string(folder.join(HEADER)).unwrap_or_default();
                let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
                let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
                let read = names.filter(|name| name == HEADER || header.contains(name.as_str()));
                read.filter_map(|name| Some((name.clone(), hash_of(&folder.join(name))?))).collect()
            }
            Self::Memory(memory) => {
                let header = self.text(HEADER).unwrap_or_default();
                let read = memory.files.iter().filter(|(name, _)| *name == HEADER || header.contains(*name));
                read.map(|(name, content)| (name.clone(), content.hash())).collect()
            }
        }
    }
}

impl Content {
    fn hash(&self) -> String {
        let mut hasher = Sha256::new();
        match self {
            Self::Bytes(bytes) => hasher.update(bytes),
            Self::Columns(columns) => {
                for (name, values) in columns.iter() {
                    hasher.update(name);
                    hasher.update([0]);
                    match values {
                        Values::Labels(labels) => labels.iter().for_each(|label| {
                            hasher.update(label);
                            hasher.update([0]);
                        }),
                        Values::Numbers(numbers) => {
                            numbers.iter().for_each(|v| hasher.update(v.to_le_bytes()))
                        }
                    }
                }
            }
        }
        hexadecimal(hasher)
    }
}

fn hash_of(path: &Path) -> Option<String> {
    if !path.is_file() {
        return None;
    }
    let mut file = std::fs::File::open(path).ok()?;
    let (mut hasher, mut buffer) = (Sha256::new(), [0; 1 << 16]);
    loop {
        match file.read(&mut buffer).ok()? {
            0 => break,
            read => hasher.update(&buffer[..read]),
        }
    }
    Some(hexadecimal(hasher))
}

fn hexadecimal(hasher: Sha256) -> String {
    hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A file that a recording names, as it was read.
#[derive(Debug, Clone)]
pub struct NamedFile {
    /// The file, as errors name it.
    pub file: String,
    /// What it holds.
    pub bytes: Vec<u8>,
}

impl Source {
    /// The file that a key of a recording names: it must lie in the recording's own folder.
    pub(super) fn named(&self, asked_by: &str, key: &str, name: &str) -> Result<NamedFile, ReadError> {
        within(asked_by, key, name)?;
        Ok(NamedFile { file: self.shown(name), bytes: self.bytes(name)? })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// Of "abc", as FIPS 180-4 has it; a file that the header does not name is not among them, in a folder or in memory.
    #[test]
    fn every_named_file_has_its_hash() {
        let files = [("recording.toml", "data = \"data.csv\""), ("data.csv", "abc"), ("notes.txt", "abc")];
        let folder = tempfile::tempdir().unwrap();
        let mut memory = Memory::new("m");
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
            memory = memory.with_file(name, text);
        }
        let hashes = Source::folder(folder.path()).sha256();
        assert_eq!(hashes.keys().collect::<Vec<_>>(), ["data.csv", "recording.toml"]);
        assert_eq!(hashes["data.csv"], "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        assert_eq!(Source::Memory(memory).sha256(), hashes);
    }

    /// A name that leads out of the recording is refused in memory as in a folder, and a file that is not there is named.
    #[test]
    fn memory_errs_as_a_folder_does() {
        let memory = Source::Memory(Memory::new("m").with_file("a.csv", "x"));
        assert_eq!(memory.named("m/recording.toml", "data", "./a.csv").unwrap().bytes, b"x");
        let said = |name| memory.named("m/recording.toml", "data", name).unwrap_err().to_string();
        assert_eq!(said("b.csv"), "m/b.csv: no such file");
        let inside = "m/recording.toml: key data is \"../a.csv\", expected a file in the recording's folder";
        assert_eq!(said("../a.csv"), inside);
    }
}
