//! What the page's worker calls: files and JSON in, JSON or one line of error out.

use missing_physics::observer::{Observer, Progress};
use serde::Serialize;
use serde::de::DeserializeOwned;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::error::WebError;

#[wasm_bindgen]
extern "C" {
    /// Takes note of how far a diagnosis is; the worker defines it.
    fn progressed(stage: &str, done: f64);
    /// Takes note of why the program stops for good; the worker defines it.
    fn stopped(why: &str);
}

/// Files in memory, filled by the worker.
#[wasm_bindgen]
#[derive(Debug, Default)]
pub struct Files(crate::files::Files);

#[wasm_bindgen]
impl Files {
    /// No files yet.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file.
    pub fn add(&mut self, name: &str, bytes: Vec<u8>) {
        self.0.add(name, bytes);
    }
}

struct Listener;

impl Observer for Listener {
    fn progress(&self, progress: Progress<'_>) -> bool {
        progressed(progress.stage, progress.done);
        true
    }
}

fn written(answer: &impl Serialize) -> Result<String, String> {
    serde_json::to_string(answer).map_err(|error| error.to_string())
}

fn asked<T: DeserializeOwned>(json: &str) -> Result<T, String> {
    serde_json::from_str(json).map_err(|error| WebError::Asked(error.to_string()).to_string())
}

/// Has what stops the program told to the worker: call it first.
#[wasm_bindgen(start)]
pub fn begin() {
    std::panic::set_hook(Box::new(|why| stopped(&why.to_string())));
}

/// The domains that the page can diagnose and the files that come with it: `{"version", "domains", "samples"}`.
///
/// # Errors
/// None that is known.
#[wasm_bindgen]
pub fn known() -> Result<String, String> {
    let version = env!("CARGO_PKG_VERSION");
    let (domains, samples) = (crate::domains(), crate::samples());
    written(&serde_json::json!({"version": version, "domains": domains, "samples": samples}))
}

/// [`crate::propose()`] with a [`crate::Wish`].
///
/// # Errors
/// One line.
#[wasm_bindgen]
pub fn propose(wish: &str, files: &Files) -> Result<String, String> {
    crate::propose(&asked(wish)?, &files.0).map_err(|e| e.to_string()).and_then(|p| written(&p))
}

/// [`crate::check`] of a recording of this name.
///
/// # Errors
/// One line.
#[wasm_bindgen]
pub fn check(name: &str, files: &Files) -> Result<String, String> {
    crate::check(name, &files.0).map_err(|e| e.to_string()).and_then(|c| written(&c))
}

/// [`crate::diagnose()`] as a [`crate::Asked`] says.
///
/// # Errors
/// One line.
#[wasm_bindgen]
pub fn diagnose(wish: &str, files: &Files) -> Result<String, String> {
    crate::diagnose(&asked(wish)?, &files.0, &Listener).map_err(|e| e.to_string()).and_then(|a| written(&a))
}
