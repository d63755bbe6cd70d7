//! Packages and files of the workspace.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::Error;

/// The workspace's folder.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_owned()
}

/// A package of the workspace.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Package {
    /// Its name.
    pub name: String,
    /// Its folder, below [`root`].
    pub folder: PathBuf,
    /// Packages of the workspace on which it depends, those of its tests, examples and benches left out.
    pub dependencies: Vec<String>,
    /// Packages of the workspace on which its tests, examples and benches depend.
    pub dev_dependencies: Vec<String>,
    /// Kind (`lib`, `bin`, `example`, `test`, `bench`), name and root file of each target.
    pub targets: Vec<(String, String, PathBuf)>,
}

/// What `cargo metadata` answers to these arguments.
///
/// # Errors
/// Where cargo fails or answers something else than its metadata.
pub fn metadata(arguments: &[&str]) -> Result<serde_json::Value, Error> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1"])
        .args(arguments)
        .current_dir(root())
        .output()?;
    if output.status.success() {
        return Ok(serde_json::from_slice(&output.stdout)?);
    }
    Err(String::from_utf8_lossy(&output.stderr).into())
}

/// What cargo knows of the workspace's packages.
///
/// # Errors
/// As [`metadata`].
pub fn packages() -> Result<Vec<Package>, Error> {
    let metadata = metadata(&["--no-deps", "--offline"])?;
    let list = |value: &serde_json::Value| value.as_array().cloned().unwrap_or_default();
    let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
    let packages = list(&metadata["packages"]);
    let names: Vec<String> = packages.iter().map(|p| text(&p["name"])).collect();
    let package = |p: &serde_json::Value| {
        let manifest = PathBuf::from(text(&p["manifest_path"]));
        let folder = manifest.parent().unwrap_or(&manifest);
        let dependencies = |dev: bool| {
            list(&p["dependencies"])
                .iter()
                .filter(|d| (d["kind"] == "dev") == dev)
                .map(|d| text(&d["name"]))
                .filter(|name| names.contains(name))
                .collect()
        };
        Package {
            name: text(&p["name"]),
            folder: folder.strip_prefix(root()).unwrap_or(folder).to_owned(),
            dependencies: dependencies(false),
            dev_dependencies: dependencies(true),
            targets: list(&p["targets"])
                .iter()
                .map(|t| (text(&t["kind"][0]), text(&t["name"]), PathBuf::from(text(&t["src_path"]))))
                .collect(),
        }
    };
    Ok(packages.iter().map(package).collect())
}

/// Every Rust file below a folder, what is built or hidden left out.
///
/// # Errors
/// Where a folder cannot be read.
pub fn sources(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            found.extend(sources(&path)?);
        } else if name.ends_with(".rs") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}
