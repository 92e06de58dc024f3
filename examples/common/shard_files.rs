//! Which files of a folder are shards.

use std::path::{Path, PathBuf};

/// The file itself, or those of shards in a folder.
pub fn files_of(path: &Path) -> Result<Vec<PathBuf>, String> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let failed = |error: std::io::Error| format!("{}: {error}", path.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(failed)? {
        let file = entry.map_err(failed)?.path();
        let name = file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        // What a process is writing, or was when it was killed, begins with a dot.
        if !name.starts_with('.') && name.contains(".shard-") && name.ends_with(".exr") {
            files.push(file);
        }
    }
    files.sort();
    Ok(files)
}
