//! Writes the bundled recordings: `cargo run -p worlds --example bundled`.

use std::path::Path;

fn main() -> std::io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../recordings");
    for recording in worlds::bundled::all() {
        let folder = root.join(recording.name);
        std::fs::create_dir_all(&folder)?;
        std::fs::write(folder.join("recording.toml"), recording.header)?;
        std::fs::write(folder.join("data.csv"), recording.data)?;
        std::fs::write(folder.join("README.md"), recording.readme)?;
    }
    Ok(())
}
