//! Types of other crates in public signatures: a crate that shows one re-exports it, or its crate,
//! so that a user depends on one crate.

use lightshed_house::{Interface, Kind, Package, items, scan};
use std::collections::BTreeSet;

/// Types of crates from elsewhere that stand in signatures, and the crate that stands for it where
/// it is re-exported.
const ELSEWHERE: [(&str, &str); 2] = [
    (
        "glam",
        "Affine3A DVec2 DVec3 IVec3 Mat3 Mat4 Quat UVec2 UVec3 Vec2 Vec3 Vec3A",
    ),
    ("rand", "Rng SeedableRng TryRng"),
];

fn words(text: &str) -> BTreeSet<&str> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_')).collect()
}

/// What `package` shows of other crates without re-exporting it.
pub fn missing(package: &Package) -> Vec<String> {
    let interface = Interface::of(package);
    let text = interface.text();
    let (exports, others): (Vec<&str>, Vec<&str>) = text.lines().partition(|line| line.contains("pub use "));
    // Names of variants and of what implements are no types that a user has to name.
    let is_variant = |line: &&&str| line.starts_with("    ") && line.trim().starts_with(char::is_uppercase);
    let shown = others.iter().filter(|line| !is_variant(line)).copied();
    let shown = shown.collect::<Vec<_>>().join("\n");
    let shown = words(&shown);
    let has = |of: &str| {
        exports
            .iter()
            .any(|line| line.contains(&format!("pub use {of} as ")))
    };
    let has_item = |of: &str, name: &str| {
        let export = format!("pub use {of}::{name} as ");
        exports.iter().any(|line| line.contains(&export))
    };
    let mut missing = BTreeSet::new();
    for (of, types) in ELSEWHERE {
        // `lightshed-sampling` re-exports both.
        let through = of == "rand" && has("lightshed_sampling");
        let export = format!("::{of} as {of}");
        if !through
            && !has(of)
            && !exports.iter().any(|line| line.ends_with(&export))
            && types.split(' ').any(|name| shown.contains(name))
        {
            missing.insert(format!("{}: {of}", package.name));
        }
    }
    for (_, text) in &package.sources {
        let (code, _) = scan::without_tests(&scan::without_comments(text));
        let uses = items(&code).into_iter().filter(|item| item.kind == Kind::Use);
        for mention in uses.flat_map(|item| scan::mentions(&item.head.join(" "))) {
            let [of, .., name] = &mention.path[..] else {
                continue;
            };
            // Functions are not what a signature shows.
            let is_type = name.starts_with(char::is_uppercase);
            let is_ours = interface.names.contains_key(name) || !is_type;
            if of.starts_with("lightshed_")
                && shown.contains(name.as_str())
                && !is_ours
                && !has(of)
                && !has_item(of, name)
            {
                missing.insert(format!("{}: {of}::{name}", package.name));
            }
        }
    }
    missing.into_iter().collect()
}
