//! Crates and the arrows between them.

use crate::modules::Modules;
use crate::scan;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A crate of the workspace.
pub struct Package {
    /// Its name without `lightshed-`.
    pub name: String,
    manifest: String,
    /// Files below `src` and their texts.
    pub sources: Vec<(PathBuf, String)>,
}

impl Package {
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

    /// The crates of the workspace that this one names, in its dependencies or outside tests in its
    /// sources.
    pub fn arrows(&self) -> BTreeSet<String> {
        let mut arrows = BTreeSet::new();
        let mut in_dependencies = false;
        for line in self.manifest.lines().map(str::trim) {
            if let Some(section) = line.strip_prefix('[') {
                let section = section.trim_end_matches(']');
                let (table, name) = match section.rsplit_once('.') {
                    Some((table, name)) if name.starts_with("lightshed-") => (table, Some(name)),
                    _ => (section, None),
                };
                in_dependencies = is_dependencies(table);
                arrows.extend(name.filter(|_| in_dependencies).and_then(crate_name));
            } else if in_dependencies {
                let name = line.split(['.', '=', ' ']).next().unwrap_or("");
                arrows.extend(crate_name(name.trim_matches('"')));
            }
        }
        for (_, code) in Modules::new(&self.sources).codes() {
            let names = scan::tokens(code)
                .into_iter()
                .filter_map(|word| word.strip_prefix("lightshed_"));
            arrows.extend(names.map(str::to_owned));
        }
        arrows
    }
}

/// Whether a table of a manifest holds dependencies, those for tests apart.
fn is_dependencies(table: &str) -> bool {
    let last = table.rsplit_once("'.").map_or(table, |(_, last)| last);
    matches!(last, "dependencies" | "build-dependencies")
}

fn crate_name(dependency: &str) -> Option<String> {
    dependency.strip_prefix("lightshed-").map(str::to_owned)
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

/// Arrows that do not lead to a lower floor, and crates without a floor.
pub fn wrong_arrows(packages: &[Package], floors: &[&[&str]]) -> Vec<String> {
    let floor = |name: &str| floors.iter().position(|floor| floor.contains(&name));
    let mut wrong = Vec::new();
    for package in packages {
        let from = &package.name;
        let Some(height) = floor(from) else {
            wrong.push(format!("{from} has no floor"));
            continue;
        };
        for to in package.arrows() {
            match floor(&to) {
                Some(below) if below < height => (),
                Some(other) => wrong.push(format!("{from} (floor {height}) → {to} (floor {other})")),
                // A word of a crate's own that begins like a crate's name.
                None => (),
            }
        }
    }
    wrong
}
