//! One file of a sound recording gives way to any bytes: what the fuzzer's targets do, and the test that reads again what they found.

use std::path::Path;

use missing_physics_domains as domains;
use missing_physics_domains::custom::read_answer;

use super::{Kind, kinds};

/// The targets, one for each reader.
pub const TARGETS: [&str; 7] =
    ["recording_toml", "table_csv", "depth_png", "mesh_stl", "mesh_obj", "sound_wav", "answer_json"];

/// The recordings that one target feeds, and which of their files.
pub struct Fed {
    kinds: Vec<Kind>,
    victim: usize,
    folder: tempfile::TempDir,
}

impl Fed {
    /// What `target` feeds.
    pub fn new(target: &str) -> Self {
        let (victim, name) = match target {
            "recording_toml" => (0, None),
            "table_csv" => (1, None),
            "depth_png" => (2, Some("png")),
            "mesh_stl" => (2, Some("stl")),
            "mesh_obj" => (2, Some("obj")),
            "sound_wav" => (2, Some("wav")),
            "answer_json" => (2, Some("json-lines")),
            other => panic!("no target is called {other}"),
        };
        let fed = |kind: &Kind| name.map_or_else(|| kind.victims.contains(&victim), |name| name == kind.name);
        Self {
            kinds: kinds().into_iter().filter(fed).collect(),
            victim,
            folder: tempfile::tempdir().unwrap(),
        }
    }

    /// What the fuzzer begins with: a sound file of each kind. The first byte says which.
    pub fn sound(&self) -> impl Iterator<Item = Vec<u8>> {
        let first = |(at, kind): (usize, &Kind)| {
            let mut bytes = vec![at as u8];
            bytes.extend(&kind.files[self.victim].1);
            bytes
        };
        self.kinds.iter().enumerate().map(first)
    }

    /// Reads a recording with `bytes`, after their first, in the victim's place.
    ///
    /// # Panics
    /// If reading panics, or refuses in words that are none.
    pub fn read(&self, bytes: &[u8]) {
        let Some((first, bytes)) = bytes.split_first() else { return };
        let kind = &self.kinds[usize::from(*first) % self.kinds.len()];
        if kind.name == "json-lines" {
            return answered(bytes);
        }
        for (at, (name, sound)) in kind.files.iter().enumerate() {
            std::fs::write(self.folder.path().join(name), if at == self.victim { bytes } else { sound })
                .unwrap();
        }
        // Doughs and heaps are learned once they are read, which takes seconds: too slow for a fuzzer.
        let learned = ["dough-roll", "png"].contains(&kind.name);
        let folder = self.folder.path();
        let refused = if learned { domains::check(folder).err() } else { domains::load(folder).err() };
        said(refused.map(|e| e.to_string()));
    }
}

/// The lines of a simulator, each the answer to a question of its own.
fn answered(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    for (line, id) in text.lines().zip(1..) {
        let mut out = [f64::NAN; 12];
        match read_answer(line, id, &["y_m".into()], &mut out) {
            Ok(()) => assert!(out.iter().all(|v| v.is_finite()), "read {out:?}"),
            Err(failure) => said(Some(failure.to_string())),
        }
    }
}

/// A refusal is one line, not empty and no whole file.
fn said(refusal: Option<String>) {
    assert_eq!(refusal.as_deref().and_then(wordless), None);
}

/// What is wrong with a refusal, if anything is.
pub fn wordless(line: &str) -> Option<String> {
    (line.trim().is_empty() || line.contains('\n') || line.len() > 2000).then(|| format!("said {line:?}"))
}

/// Where the fuzzer keeps what broke a reader.
pub fn kept(target: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds").join(target)
}
