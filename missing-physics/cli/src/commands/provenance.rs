//! What an answer was made from: version, options, and the files that were read.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::Path;

use missing_physics::engine::Options;
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};

/// Version, seed, alpha, and the SHA-256 of the header and of every file in the recording's folder that the header names.
pub(super) fn provenance(folder: &Path, options: &Options) -> Value {
    json!({"version": env!("CARGO_PKG_VERSION"), "seed": options.seed, "alpha": options.alpha, "sha256": hashes(folder)})
}

fn hashes(folder: &Path) -> BTreeMap<String, String> {
    let header = std::fs::read_to_string(folder.join("recording.toml")).unwrap_or_default();
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let read = names.filter(|name| name == "recording.toml" || header.contains(name.as_str()));
    read.filter_map(|name| Some((name.clone(), hash(&folder.join(name))?))).collect()
}

fn hash(path: &Path) -> Option<String> {
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
    Some(hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of "abc", as FIPS 180-4 has it; a file that the header does not name is not among them.
    #[test]
    fn every_named_file_has_its_hash() {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in
            [("recording.toml", "data = \"data.csv\""), ("data.csv", "abc"), ("notes.txt", "abc")]
        {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let found = provenance(folder.path(), &Options::default());
        assert_eq!((&found["seed"], &found["alpha"]), (&json!(1), &json!(0.05)));
        let hashes = found["sha256"].as_object().unwrap();
        assert_eq!(hashes.keys().collect::<Vec<_>>(), ["data.csv", "recording.toml"]);
        assert_eq!(hashes["data.csv"], "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }
}
