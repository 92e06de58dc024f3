//! Documents and packages: guides open with the lines of `Cargo.toml` that they need, packages are
//! complete, links lead somewhere, lines of comments end in time, and guides lead to all that is
//! public.

mod lines;
mod manifests;
mod markdown;
mod ways;

use lightshed_house::{Interface, Package, packages, repository};
use manifests::{Dependency, dependencies, features, quoted, table};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Documents that are no guides to crates.
const NO_GUIDES: [&str; 12] = [
    "architecture",
    "costs",
    "distribution",
    "glossary",
    "performance",
    "performance-gpu",
    "performance-lights",
    "performance-media",
    "performance-rays",
    "performance-reuse",
    "precision",
    "testing",
];

fn read(path: impl AsRef<Path>) -> String {
    let path = repository().join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Files below `folder` with one of the extensions, in a fixed order; without what is built or
/// hidden.
fn files(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    entries.sort();
    let mut found = Vec::new();
    for path in entries {
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() {
            if !name.starts_with('.') && !["target", "out", "artifacts"].contains(&name) {
                found.extend(files(&path, extensions));
            }
        } else if path
            .extension()
            .is_some_and(|of| extensions.iter().any(|one| of == *one))
        {
            found.push(path);
        }
    }
    found
}

fn shown(path: &Path) -> String {
    path.strip_prefix(repository()).unwrap().display().to_string()
}

/// The guides, by name.
fn guides() -> BTreeMap<String, String> {
    let all = files(&repository().join("docs"), &["md"]);
    let all = all.into_iter().map(|path| {
        let text = read(&path);
        (path.file_stem().unwrap().to_str().unwrap().to_owned(), text)
    });
    all.filter(|(name, _)| !NO_GUIDES.contains(&name.as_str()))
        .collect()
}

/// Manifests by package.
fn manifests() -> BTreeMap<String, String> {
    let of = |package: Package| (format!("lightshed-{}", package.name), package.manifest);
    let mut all: BTreeMap<String, String> = packages().into_iter().map(of).collect();
    all.insert("lightshed".to_owned(), read("Cargo.toml"));
    all
}

/// What is wrong with the dependencies that a document gives: crates or features that are not
/// there, crates that its code uses and it does not name. Versions are those of the workspace,
/// paths lead into `crates`.
fn wrong_dependencies(name: &str, text: &str, manifests: &BTreeMap<String, String>) -> Vec<String> {
    let (_, blocks) = markdown::parts(text);
    let Some(first) = blocks.first().filter(|block| block.info == "toml") else {
        return vec![format!("{name}: its first code is not the lines of Cargo.toml")];
    };
    let mut wrong = Vec::new();
    if first.line > 20 {
        wrong.push(format!("{name}: the lines of Cargo.toml come late"));
    }
    let given = dependencies(&first.text);
    let version = table(&manifests["lightshed"], "workspace.package")["version"].replace('"', "");
    let (version, _) = version.rsplit_once('.').unwrap();
    for Dependency {
        name: of,
        version: asked,
        path,
        features: wanted,
    } in &given
    {
        let Some(manifest) = manifests.get(of) else {
            if of.starts_with("lightshed") {
                wrong.push(format!("{name}: there is no {of}"));
            }
            continue;
        };
        let known = features(manifest);
        let unknown = wanted.iter().filter(|feature| !known.contains(*feature));
        wrong.extend(unknown.map(|feature| format!("{name}: {of} has no feature {feature}")));
        let folder = of
            .strip_prefix("lightshed-")
            .map_or("../lightshed".to_owned(), |of| {
                format!("../lightshed/crates/{of}")
            });
        if path.as_ref().is_some_and(|path| *path != folder)
            || path.is_none() && asked.as_deref() != Some(version)
        {
            wrong.push(format!("{name}: {of} is not {folder} or version {version}"));
        }
    }
    let used = blocks
        .iter()
        .filter(|block| block.info.is_empty() || block.info.starts_with("rust"));
    let words: BTreeSet<String> = used
        .flat_map(|block| {
            block
                .text
                .split(|c: char| !(c.is_alphanumeric() || c == '_'))
                .map(str::to_owned)
                .collect::<Vec<_>>()
        })
        .collect();
    for manifest in manifests
        .keys()
        .filter(|name| name.contains('-') && words.contains(&name.replace('-', "_")))
    {
        if !given.iter().any(|dependency| dependency.name == *manifest) {
            wrong.push(format!(
                "{name}: its code uses {manifest}, which it does not give"
            ));
        }
    }
    wrong
}

#[test]
fn guides_open_with_their_dependencies() {
    let manifests = manifests();
    let guides = guides();
    assert!(guides.len() > 15);
    let wrong = guides
        .iter()
        .flat_map(|(name, text)| wrong_dependencies(name, text, &manifests));
    let wrong: Vec<String> = wrong.collect();
    assert!(wrong.is_empty(), "{wrong:#?}");

    // The test sees what is wrong.
    let sound = &guides["bvh"];
    for (of, to, message) in [
        (
            "lightshed-bvh = {",
            "lightshed-tree = {",
            "there is no lightshed-tree",
        ),
        (
            "crates/bvh\"",
            "crates/bvh\", features = [\"none\"]",
            "no feature none",
        ),
        (
            "crates/bvh\"",
            "crates/lights\"",
            "is not ../lightshed/crates/bvh",
        ),
        (
            "path = \"../lightshed/crates/bvh\"",
            "version = \"9.1\"",
            "or version 0.1",
        ),
        ("```toml", "```text", "first code"),
        (
            "use lightshed_bvh",
            "use lightshed_sampling",
            "which it does not give",
        ),
    ] {
        let wrong = wrong_dependencies("bvh", &sound.replacen(of, to, 1), &manifests);
        assert!(
            wrong.iter().any(|line| line.contains(message)),
            "{of} → {to}: {wrong:?}"
        );
    }
}

/// What a package lacks.
fn lacks(package: &Package, page: &str, manifests: &BTreeMap<String, String>) -> Vec<String> {
    let full = format!("lightshed-{}", package.name);
    let about = table(&package.manifest, "package");
    let mut lacks = Vec::new();
    for key in ["description", "documentation", "readme", "keywords", "categories"] {
        if !about.contains_key(key) {
            lacks.push(format!("{full}: no {key}"));
        }
    }
    let keywords = about.get("keywords").map_or(Vec::new(), |value| quoted(value));
    if keywords.len() > 5 || keywords.iter().any(|keyword| keyword.len() > 20) {
        lacks.push(format!(
            "{full}: a registry takes five keywords of twenty letters"
        ));
    }
    if !package.manifest.contains("\n[package.metadata.docs.rs]\n") {
        lacks.push(format!("{full}: no metadata for docs.rs"));
    }
    if package.manifest.contains("publish") {
        lacks.push(format!("{full}: it is not to be published"));
    }
    if !page.starts_with("# ") || !page.contains("MIT or Apache-2.0") {
        lacks.push(format!("{full}: its page has no title or licence"));
    }
    lacks.extend(wrong_dependencies(&format!("{full}'s page"), page, manifests));
    for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
        let own = Path::new("crates").join(&package.name).join(licence);
        if !repository().join(&own).exists() || read(&own) != read(licence) {
            lacks.push(format!("{full}: {licence} is not the workspace's"));
        }
    }
    lacks
}

#[test]
fn packages_are_complete() {
    let manifests = manifests();
    for package in packages() {
        let page = read(Path::new("crates").join(&package.name).join("README.md"));
        assert_eq!(lacks(&package, &page, &manifests), Vec::<String>::new());
        let planted = |manifest: &str, page: &str| {
            let package = Package::new(&package.name, manifest, Vec::new());
            lacks(&package, page, &manifests).len()
        };
        assert_eq!(planted(&package.manifest.replace("keywords", "words"), &page), 1);
        let private = package
            .manifest
            .replacen("[package]\n", "[package]\npublish = false\n", 1);
        assert_eq!(planted(&private, &page), 1);
        assert!(planted(&package.manifest, &page.replacen("\"0.1\"", "\"0.0\"", 1)) >= 1);
    }
}

/// Dependencies whose lowest version is not the one in the lock file, with which all is tested.
fn untested_bounds(manifest: &str, lock: &str) -> Vec<String> {
    let mut locked = BTreeSet::new();
    for entry in lock.split("[[package]]").skip(1) {
        let field = |name: &str| {
            let line = entry.lines().find(|line| line.starts_with(name)).unwrap();
            quoted(line).remove(0)
        };
        locked.insert((field("name = "), field("version = ")));
    }
    let mut wrong = Vec::new();
    for (name, value) in table(manifest, "workspace.dependencies") {
        let version = value
            .split_once("version = ")
            .map_or(value.as_str(), |(_, rest)| rest);
        let bound = quoted(version).remove(0);
        let bound = bound.trim_start_matches('=').to_owned();
        if !locked.contains(&(name.clone(), bound.clone())) {
            wrong.push(format!("{name} {bound}"));
        }
    }
    wrong
}

/// The lowest versions that manifests allow are those that tests run with. Resolving with
/// `cargo update -Z direct-minimal-versions` then gives these versions, too.
#[test]
fn lowest_versions_are_tested() {
    let (manifest, lock) = (read("Cargo.toml"), read("Cargo.lock"));
    assert_eq!(untested_bounds(&manifest, &lock), Vec::<String>::new());
    let lower = manifest.replacen("\nglam = { version = \"0.34.", "\nglam = { version = \"0.33.", 1);
    assert_eq!(untested_bounds(&lower, &lock).len(), 1);
    for package in packages() {
        // Each takes the workspace's versions.
        let own = package
            .manifest
            .lines()
            .filter(|line| line.contains("version = \""));
        assert_eq!(own.count(), 0, "{}", package.name);
    }
}

/// The package `lightshed` has each crate under its name, by a feature of that name, and hands on
/// features that several crates have.
#[test]
fn the_facade_has_every_crate() {
    let (manifest, lib) = (read("Cargo.toml"), read("src/lib.rs"));
    let own = table(&manifest, "features");
    let mut wrong = Vec::new();
    for package in packages() {
        let name = &package.name;
        if !own
            .get(name)
            .is_some_and(|value| value.contains(&format!("\"dep:lightshed-{name}\"")))
        {
            wrong.push(format!("no feature {name}"));
        }
        let export = format!(
            "#[cfg(feature = \"{name}\")]\npub use lightshed_{} as {name};",
            name.replace('-', "_")
        );
        if !lib.contains(&export) {
            wrong.push(format!("{name} is not exported"));
        }
        for shared in ["parallel", "serde"] {
            let passes = own[shared].contains(&format!("\"lightshed-{name}?/{shared}\""));
            if passes != features(&package.manifest).contains(shared) {
                wrong.push(format!("{shared} of {name} is not handed on, or not there"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Links of `text`, a file in `folder`, that lead nowhere in the repository.
fn dead_links(folder: &Path, text: &str) -> Vec<String> {
    let mut dead = Vec::new();
    for link in markdown::links(text) {
        if link.contains("://") || link.starts_with("mailto:") {
            continue;
        }
        let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
        let target = if file.is_empty() {
            None
        } else {
            Some(folder.join(file))
        };
        let there = match &target {
            Some(path) if !path.exists() => false,
            Some(path) if !anchor.is_empty() => {
                path.extension().is_some_and(|of| of == "md")
                    && markdown::anchors(&read(path)).contains(anchor)
            }
            Some(_) => true,
            None => markdown::anchors(text).contains(anchor),
        };
        if !there {
            dead.push(link);
        }
    }
    dead
}

#[test]
fn links_lead_somewhere() {
    let (mut count, mut dead) = (0, Vec::new());
    for path in files(repository(), &["md"]) {
        let text = read(&path);
        count += markdown::links(&text).len();
        let found = dead_links(path.parent().unwrap(), &text);
        dead.extend(found.into_iter().map(|link| format!("{}: {link}", shown(&path))));
    }
    assert!(count > 100, "only {count} links were found");
    assert!(dead.is_empty(), "{dead:#?}");
    // Planted: a file, an anchor, an image; code is no link.
    let docs = repository().join("docs");
    let planted =
        "# A b\n[x](#a-b) [x](none.md) [y](bvh.md#none) ![z](images/none.png) `[w](w.md)` [`v`](bvh.md)\n";
    assert_eq!(
        dead_links(&docs, planted),
        ["none.md", "bvh.md#none", "images/none.png"]
    );
}

#[test]
fn lines_of_comments_end_in_time() {
    let mut long = Vec::new();
    for path in files(repository(), &["rs", "wesl"]) {
        let found = lines::long(&read(&path));
        long.extend(found.into_iter().map(|line| format!("{}:{line}", shown(&path))));
    }
    assert!(long.is_empty(), "{} lines\n{}", long.len(), long.join("\n"));
}

/// Floors 0 to 4, `guiding`, and where their guides are.
const GUIDED: [(&str, &[&str]); 13] = [
    ("bvh", &["bvh"]),
    ("caching", &["caching"]),
    ("film", &["film", "distribution"]),
    ("guiding", &["guiding", "light_cache", "mixtures"]),
    ("lanes", &["lanes"]),
    ("lights", &["lights", "lighting-grid", "restir_di"]),
    ("resampling", &["resampling", "restir_di", "suffixes", "mixtures"]),
    ("sampling", &["sampling"]),
    ("shaders", &["gpu"]),
    ("shift", &["shift", "suffixes"]),
    ("spatial", &["spatial"]),
    ("testkit", &["testkit"]),
    ("volume", &["volume"]),
];

/// The guide of a crate, or the page of its root, leads to every public item: it names it, or what
/// it leads to names it in its documentation or signatures.
#[test]
fn guides_lead_to_all_that_is_public() {
    let mut unreached = Vec::new();
    for package in packages() {
        let Some((_, guides)) = GUIDED.iter().find(|(name, _)| *name == package.name) else {
            continue;
        };
        let texts = guides.iter().map(|guide| read(format!("docs/{guide}.md")));
        let (_, root) = package
            .sources
            .iter()
            .find(|(file, _)| file == Path::new("lib.rs"))
            .unwrap();
        let page: Vec<&str> = root.lines().filter(|line| line.starts_with("//!")).collect();
        let entry = texts.collect::<Vec<_>>().join("\n") + &page.join("\n");
        let interface = Interface::of(&package);
        let reach = interface.reach(&package, &entry);
        unreached.extend(
            reach
                .unreached
                .into_iter()
                .map(|name| format!("{}: {name}", package.name)),
        );
        // From nowhere nothing is reached.
        assert_eq!(
            interface.reach(&package, "").unreached.len(),
            interface.names.len()
        );
    }
    assert!(
        unreached.is_empty(),
        "{} items\n{}",
        unreached.len(),
        unreached.join("\n")
    );
}

/// What is wrong with the ways through the crates that a document describes: files that are not
/// there or lack what the step says, and ways that come back to a file.
fn wrong_ways(text: &str) -> Vec<String> {
    let mut wrong = Vec::new();
    for way in ways::ways(text) {
        for (number, step) in way.iter().enumerate() {
            let name = &step.name;
            if step.paths.is_empty() {
                wrong.push(format!("{name}: no file"));
            }
            let mut source = String::new();
            for path in &step.paths {
                let at = repository().join("crates").join(path);
                match (at.is_dir(), at.is_file()) {
                    (true, _) => source.extend(files(&at, &["rs"]).iter().map(read)),
                    (_, true) => source.push_str(&read(&at)),
                    _ => wrong.push(format!("{name}: there is no {path}")),
                }
                let before = &way[..number.saturating_sub(1)];
                if before.iter().any(|earlier| earlier.paths.contains(path)) {
                    wrong.push(format!("{name}: back to {path}"));
                }
            }
            let known: BTreeSet<&str> = source
                .split(|c: char| !(c.is_alphanumeric() || c == '_'))
                .collect();
            let unknown = step.words.iter().filter(|word| !known.contains(word.as_str()));
            wrong.extend(unknown.map(|word| format!("{name}: no {word} in {:?}", step.paths)));
        }
    }
    wrong
}

#[test]
fn ways_through_the_crates_lead_on() {
    let text = read("docs/architecture.md");
    assert_eq!(ways::ways(&text).iter().map(Vec::len).collect::<Vec<_>>(), [7, 8]);
    assert_eq!(wrong_ways(&text), [""; 0]);
    let way =
        "\n## From here\n\n1. `Light` (`lights/src/light.rs`).\n2. `Tree` (`lights/src/tree_sampler.rs`).\n";
    for (fault, found) in [
        ("3. `Light`, by nobody.\n", "no file"),
        (
            "3. `Light` (`lights/src/lamp.rs`).\n",
            "there is no lights/src/lamp.rs",
        ),
        ("3. `Lamp` (`lights/src/tree_sampler.rs`).\n", "no Lamp in"),
        (
            "3. `Light` (`lights/src/light.rs`).\n",
            "back to lights/src/light.rs",
        ),
    ] {
        let wrong = wrong_ways(&format!("{way}{fault}"));
        assert!(
            wrong.iter().any(|wrong| wrong.contains(found)),
            "{fault}: {wrong:?}"
        );
    }
}
