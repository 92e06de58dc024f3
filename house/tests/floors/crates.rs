//! Arrows between crates.

use lightshed_house::{Modules, Package, scan};
use std::collections::BTreeSet;

/// The crates of the workspace that this one names, in its dependencies or outside tests in its
/// sources.
pub fn arrows(package: &Package) -> BTreeSet<String> {
    let mut arrows = BTreeSet::new();
    let mut in_dependencies = false;
    for line in package.manifest.lines().map(str::trim) {
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
    for (_, code) in Modules::new(&package.sources).codes() {
        let names = scan::tokens(code)
            .into_iter()
            .filter_map(|word| word.strip_prefix("lightshed_"));
        arrows.extend(names.map(str::to_owned));
    }
    arrows
}

/// Whether a table of a manifest holds dependencies, those for tests apart.
fn is_dependencies(table: &str) -> bool {
    let last = table.rsplit_once("'.").map_or(table, |(_, last)| last);
    matches!(last, "dependencies" | "build-dependencies")
}

fn crate_name(dependency: &str) -> Option<String> {
    dependency.strip_prefix("lightshed-").map(str::to_owned)
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
        for to in arrows(package) {
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
