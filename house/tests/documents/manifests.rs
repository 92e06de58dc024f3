//! What `Cargo.toml` files say, read line by line.

use std::collections::{BTreeMap, BTreeSet};

/// Lines of a table of a manifest: keys and values.
pub fn table(manifest: &str, name: &str) -> BTreeMap<String, String> {
    let head = format!("[{name}]");
    let lines = manifest.lines().skip_while(|line| line.trim() != head).skip(1);
    let (mut table, mut open) = (BTreeMap::new(), None::<String>);
    for line in lines.take_while(|line| !line.starts_with('[')) {
        // Arrays may have several lines.
        if let Some(key) = &open {
            let value: &mut String = table.get_mut(key).unwrap();
            value.push_str(line.trim());
            if line.trim() == "]" {
                open = None;
            }
        } else if let Some((key, value)) = line.split_once('=') {
            let (key, value) = (key.trim().to_owned(), value.trim().to_owned());
            if value.ends_with('[') {
                open = Some(key.clone());
            }
            table.insert(key, value);
        }
    }
    table
}

/// Words in quotation marks.
pub fn quoted(value: &str) -> Vec<String> {
    value.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The features that a crate has: those of its table, and its optional dependencies.
pub fn features(manifest: &str) -> BTreeSet<String> {
    table(manifest, "features").into_keys().collect()
}

/// A dependency in a guide.
#[derive(Debug, PartialEq)]
pub struct Dependency {
    pub name: String,
    pub version: Option<String>,
    pub path: Option<String>,
    pub features: Vec<String>,
}

/// The dependencies in a block of TOML.
pub fn dependencies(text: &str) -> Vec<Dependency> {
    let head = |line: &&str| matches!(line.trim(), "[dependencies]" | "[dev-dependencies]");
    let lines = text.lines().skip_while(|line| !head(line)).skip(1);
    let lines = lines.filter(|line| !line.trim().is_empty() && !line.starts_with(['[', '#']));
    let field = |value: &str, name: &str| {
        let (_, rest) = value.split_once(&format!("{name} = "))?;
        Some(rest.split([']', '}']).next()?.to_owned())
    };
    lines
        .filter_map(|line| {
            let (name, value) = line.split_once('=')?;
            let first = |text: String| quoted(&text).into_iter().next();
            let plain = value.trim().starts_with('"').then(|| value.to_owned());
            Some(Dependency {
                name: name.trim().to_owned(),
                version: plain.or_else(|| field(value, "version")).and_then(first),
                path: field(value, "path").and_then(first),
                features: field(value, "features").map_or(Vec::new(), |list| quoted(&list)),
            })
        })
        .collect()
}
