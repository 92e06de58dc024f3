//! The crates of the workspace.

use std::path::{Path, PathBuf};

/// A crate of the workspace.
pub struct Package {
    /// Its name without `lightshed-`.
    pub name: String,
    /// The text of its `Cargo.toml`.
    pub manifest: String,
    /// Files below `src` and their texts.
    pub sources: Vec<(PathBuf, String)>,
}

impl Package {
    /// A crate of such texts.
    pub fn new(name: &str, manifest: &str, sources: Vec<(PathBuf, String)>) -> Self {
        let (name, manifest) = (name.to_owned(), manifest.to_owned());
        Self {
            name,
            manifest,
            sources,
        }
    }

    /// Reads the crate in `folder`.
    pub fn read(folder: &Path) -> Self {
        let source = folder.join("src");
        let mut files = Vec::new();
        rust_files(&source, &mut files);
        files.sort();
        let read = |path: PathBuf| {
            let text = std::fs::read_to_string(&path).unwrap();
            (path.strip_prefix(&source).unwrap().to_owned(), text)
        };
        let name = folder.file_name().unwrap().to_str().unwrap();
        let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        Self::new(name, &manifest, files.into_iter().map(read).collect())
    }
}

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// The folder of the repository.
pub fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// The crates below `crates`, by name.
pub fn packages() -> Vec<Package> {
    let mut folders: Vec<_> = std::fs::read_dir(repository().join("crates"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    folders.retain(|folder| folder.join("Cargo.toml").exists());
    folders.sort();
    folders.iter().map(|folder| Package::read(folder)).collect()
}
