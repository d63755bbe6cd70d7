//! Where results go: files whole or not at all, devices as they are, nothing over what is read.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::error::CommandError;

/// What a command says, and the files that it writes after that.
#[derive(Debug, Default)]
pub struct Said {
    /// For a person.
    pub text: String,
    /// What the person should know beside it, for standard error.
    pub note: Option<String>,
    /// What failed beside what is said, for the end: the exit status says it as well.
    pub failure: Option<String>,
    files: Vec<(Place, Vec<u8>)>,
}

/// Where an output goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Place {
    /// Standard output: `-` or `/dev/stdout`.
    Stdout,
    /// Standard error.
    Stderr,
    /// What is there and no regular file (a device, a pipe, an open descriptor): written to as it is.
    Device(PathBuf),
    /// A regular file, or none yet: what links lead to.
    File(PathBuf),
}

/// What tells two names of one file from two files.
#[derive(Debug, PartialEq, Eq)]
enum Identity {
    #[cfg(unix)]
    Node(u64, u64),
    Name(PathBuf),
}

impl From<String> for Said {
    fn from(text: String) -> Self {
        Self { text, ..Self::default() }
    }
}

impl Said {
    pub(super) fn write(&mut self, place: &Place, contents: impl Into<Vec<u8>>) {
        self.files.push((place.clone(), contents.into()));
    }

    /// Says and writes what another command says and writes as well.
    pub(super) fn join(&mut self, other: Self) {
        self.text.push_str(&other.text);
        self.files.extend(other.files);
        self.note = self.note.take().or(other.note);
        self.failure = self.failure.take().or(other.failure);
    }

    /// Whether a file goes to standard output, so that the text has to go elsewhere.
    pub fn takes_stdout(&self) -> bool {
        self.files.iter().any(|(place, _)| *place == Place::Stdout)
    }

    /// Writes the files.
    ///
    /// # Errors
    /// [`CommandError::Io`] of the first that cannot be written; it stays as it was, and the others are written.
    pub fn write_files(&self) -> Result<(), CommandError> {
        let mut failed = Ok(());
        for (place, contents) in &self.files {
            failed = failed.and(place.write(contents));
        }
        failed
    }
}

/// Where outputs go; nothing is written yet.
///
/// # Errors
/// [`CommandError`] where an output has no folder to be in, is a folder or write-protected, is one of the inputs, or is another's.
pub(super) fn places(outputs: &[&Path], inputs: &[PathBuf]) -> Result<Vec<Place>, CommandError> {
    let inputs: Vec<Identity> = inputs.iter().map(|path| identity(path)).collect();
    let mut places: Vec<Place> = Vec::new();
    let mut taken: Vec<Identity> = Vec::new();
    for path in outputs {
        let place = Place::of(path)?;
        let identity = match &place {
            Place::File(path) | Place::Device(path) => identity(path),
            Place::Stdout | Place::Stderr => Identity::Name(PathBuf::from(format!("{place:?}"))),
        };
        if matches!(place, Place::File(_)) && inputs.contains(&identity) {
            return Err(CommandError::IsInput { path: path.into() });
        }
        // What nobody reads may be written to twice.
        if taken.contains(&identity) && **path != *Path::new("/dev/null") {
            return Err(CommandError::Twice { path: path.into() });
        }
        taken.push(identity);
        places.push(place);
    }
    Ok(places)
}

fn identity(path: &Path) -> Identity {
    #[cfg(unix)]
    if let Ok(metadata) = std::fs::metadata(path) {
        use std::os::unix::fs::MetadataExt as _;
        return Identity::Node(metadata.dev(), metadata.ino());
    }
    let folder = folder(path);
    let folder = folder.canonicalize().unwrap_or(folder);
    Identity::Name(path.canonicalize().unwrap_or_else(|_| folder.join(path.file_name().unwrap_or_default())))
}

fn folder(path: &Path) -> PathBuf {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).into()
}

impl Place {
    fn of(path: &Path) -> Result<Self, CommandError> {
        let text = path.to_string_lossy();
        let descriptor = ["/dev/fd/", "/proc/self/fd/"].iter().find_map(|folder| text.strip_prefix(folder));
        match (&*text, descriptor) {
            ("-" | "/dev/stdout", _) | (_, Some("1")) => return Ok(Self::Stdout),
            ("/dev/stderr", _) | (_, Some("2")) => return Ok(Self::Stderr),
            _ => {}
        }
        let io = |error| CommandError::Io { path: path.into(), error };
        if descriptor.is_some() {
            return std::fs::metadata(path).map(|_| Self::Device(path.into())).map_err(io);
        }
        match std::fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => Err(CommandError::NotAFile { path: path.into() }),
            Ok(metadata) if !metadata.is_file() => Ok(Self::Device(path.into())),
            Ok(metadata) if metadata.permissions().readonly() => {
                Err(io(io::Error::new(io::ErrorKind::PermissionDenied, "write-protected")))
            }
            Ok(_) => Ok(Self::File(path.canonicalize().map_err(io)?)),
            Err(_) => {
                let end = end_of_links(path).map_err(io)?;
                let folder = folder(&end);
                if !folder.is_dir() {
                    return Err(CommandError::NoFolder { folder });
                }
                if end.file_name().is_none() {
                    return Err(CommandError::NotAFile { path: path.into() });
                }
                Ok(Self::File(end))
            }
        }
    }

    pub(super) fn write(&self, contents: &[u8]) -> Result<(), CommandError> {
        let done = match self {
            Self::Stdout => {
                let mut out = io::stdout().lock();
                match out.write_all(contents).and_then(|()| out.flush()) {
                    // A reader that has gone away is no failure of ours.
                    Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
                    done => done,
                }
            }
            Self::Stderr => io::stderr().lock().write_all(contents),
            Self::Device(path) => {
                std::fs::OpenOptions::new().append(true).open(path).and_then(|mut f| f.write_all(contents))
            }
            Self::File(path) => write_file(path, contents),
        };
        let path = match self {
            Self::Stdout => PathBuf::from("standard output"),
            Self::Stderr => PathBuf::from("standard error"),
            Self::Device(path) | Self::File(path) => path.clone(),
        };
        done.map_err(|error| CommandError::Io { path, error })
    }
}

/// What a link leads to that leads to nothing yet.
fn end_of_links(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..40 {
        match std::fs::read_link(&path) {
            Ok(to) => path = folder(&path).join(to),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("links that lead in a circle"))
}

/// Writes a file beside its place, then moves it there: the old one stays until the new one is whole, and keeps its mode.
fn write_file(path: &Path, contents: &[u8]) -> io::Result<()> {
    let part = folder(path).join(format!(".missing-physics.{}.part", std::process::id()));
    let written = || -> io::Result<()> {
        let mut file = std::fs::File::create(&part)?;
        if let Ok(old) = std::fs::metadata(path) {
            file.set_permissions(old.permissions())?;
        }
        file.write_all(contents)?;
        // Some file systems say only here that they are full.
        file.sync_all()?;
        std::fs::rename(&part, path)
    };
    written().inspect_err(|_| {
        // The half that was written is of no use to anybody; that it cannot be removed changes nothing.
        let _ = std::fs::remove_file(&part);
    })
}

/// A file of a new folder.
pub(super) fn write_new(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), CommandError> {
    write_file(path, contents.as_ref()).map_err(|error| CommandError::Io { path: path.into(), error })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(outputs: &[&Path], inputs: &[PathBuf]) -> String {
        places(outputs, inputs).unwrap_err().to_string()
    }

    #[test]
    fn outputs_are_neither_inputs_nor_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("recording.toml"), "format = 1").unwrap();
        let input = vec![at("recording.toml")];
        assert!(refused(&[&at("recording.toml")], &input).contains("is read"));
        assert!(refused(&[&folder.path().join(".").join("recording.toml")], &input).contains("is read"));
        assert!(refused(&[&at("a"), &folder.path().join("./a")], &[]).contains("two outputs"));
        assert!(refused(&[Path::new("-"), Path::new("/dev/stdout")], &[]).contains("two outputs"));
        assert!(refused(&[&at("none/a")], &[]).contains("no such folder"));
        assert!(refused(&[folder.path()], &[]).contains("a folder"));
        assert_eq!(places(&[&at("a"), &at("b"), Path::new("-")], &input).unwrap().len(), 3);
    }

    #[cfg(unix)]
    #[test]
    fn links_and_hard_links_are_seen_through() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("data.csv"), "run\n").unwrap();
        std::os::unix::fs::symlink("data.csv", at("link")).unwrap();
        std::fs::hard_link(at("data.csv"), at("hard")).unwrap();
        for name in ["link", "hard"] {
            assert!(refused(&[&at(name)], &[at("data.csv")]).contains("is read"), "{name}");
        }
        // A link to nothing yet is written through, and stays a link.
        std::os::unix::fs::symlink("new.json", at("later")).unwrap();
        places(&[&at("later")], &[]).unwrap()[0].write(b"{}").unwrap();
        assert_eq!(std::fs::read(at("new.json")).unwrap(), b"{}");
        assert!(std::fs::symlink_metadata(at("later")).unwrap().is_symlink());
        std::os::unix::fs::symlink("circle", at("circle")).unwrap();
        assert!(refused(&[&at("circle")], &[]).contains("circle"));
    }

    #[cfg(unix)]
    #[test]
    fn modes_are_kept_and_devices_stay_devices() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        std::fs::write(&path, "old").unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o640)).unwrap();
        places(&[&path], &[]).unwrap()[0].write(b"new").unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o440)).unwrap();
        assert!(refused(&[&path], &[]).contains("write-protected"));
        let null = Path::new("/dev/null");
        for place in places(&[null, null], &[]).unwrap() {
            place.write(b"x").unwrap();
        }
        let full = places(&[Path::new("/dev/full")], &[]).unwrap();
        assert!(full[0].write(b"x").is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
