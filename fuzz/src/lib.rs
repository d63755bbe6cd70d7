//! The targets feed one file of a sound recording, which the test `mutilated` of the tool mutilates as well.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a fuzz target stops where it fails, and says what it saw")]

#[path = "../../missing-physics/cli/tests/kinds/mod.rs"]
pub mod kinds;

/// Writes what the fuzzer begins with into the folder that the environment names as `SOUND`: a sound file of each kind.
///
/// # Panics
/// If the folder cannot be written.
pub fn begin(fed: &kinds::fed::Fed) {
    let Some(folder) = std::env::var_os("SOUND").map(std::path::PathBuf::from) else { return };
    std::fs::create_dir_all(&folder).unwrap();
    for (at, bytes) in fed.sound().enumerate() {
        std::fs::write(folder.join(at.to_string()), bytes).unwrap();
    }
}

/// A target of libFuzzer that feeds the reader of its name.
#[macro_export]
macro_rules! target {
    ($name:literal) => {
        thread_local!(static FED: $crate::kinds::fed::Fed = $crate::kinds::fed::Fed::new($name));
        libfuzzer_sys::fuzz_target!(
            init: { FED.with($crate::begin) },
            |bytes: &[u8]| FED.with(|fed| fed.read(bytes))
        );
    };
}
