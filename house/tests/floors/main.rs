//! The floors of `docs/architecture.md`: crates depend downward only, and no crate has a circle of
//! modules.
//!
//! A plain scan of `Cargo.toml` files and sources. It knows no Rust but paths, `use` trees and
//! `cfg(test)`.
//!
//! **Arrows between crates.** A crate may depend on crates of lower floors only. Dev-dependencies
//! and code under `cfg(test)` are apart.
//!
//! **Circles of modules.** A file that names something of another module has an arrow to the module
//! that defines it; re-exports are followed. At each level of the module tree, an arrow from below
//! `a` to below its sibling `b` is an arrow from `a` to `b`. Siblings must not form a circle.
//! Arrows between a module and one that it contains are not counted: a parent declares and
//! re-exports its children, and children may use what the parent defines for them.

mod crates;

use lightshed_house::{Circle, Modules, Package, packages, repository};

/// Each crate's floor, from the bottom. Crates of one floor do not know each other.
const FLOORS: [&[&str]; 9] = [
    &["lanes", "testkit", "shaders"],
    &["sampling"],
    &["film", "resampling", "spatial", "volume"],
    &["bvh", "evaluate", "shift"],
    &["caching", "lights"],
    &["guiding", "scene"],
    &[],
    &["integrator"],
    &["gpu"],
];

/// Crates that still have a circle. A crate that has lost its last one is to be taken off.
const CIRCLES_LEFT: [&str; 0] = [];

/// Lines of the programs in `examples/users` that connect a renderer with crates: all of `main.rs`
/// but blank lines, comments, imports and `main` itself.
const MOST_GLUE: usize = 60;

#[test]
fn users_programs_need_little_glue() {
    let users = repository().join("examples/users");
    for name in ["own_lights", "own_medium", "own_shader", "own_spheres"] {
        let text = std::fs::read_to_string(users.join(name).join("src/main.rs")).unwrap();
        let (before_main, _) = text.split_once("\nfn main()").unwrap();
        let is_glue = |line: &&str| {
            let line = line.trim();
            !(line.is_empty() || ["//", "use ", "mod "].iter().any(|start| line.starts_with(start)))
        };
        let count = before_main.lines().filter(is_glue).count();
        assert!((20..=MOST_GLUE).contains(&count), "{name}: {count} lines of glue");
        let manifest = std::fs::read_to_string(users.join(name).join("Cargo.toml")).unwrap();
        assert!(
            manifest.contains("path = \"../../../crates/"),
            "{name} depends on no crate by path"
        );
    }
}

#[test]
fn crates_depend_downward() {
    let packages = packages();
    assert!(packages.len() >= 13, "only {} crates were found", packages.len());
    // The scan reads what is there: some arrows that will stay.
    for (from, to) in [
        ("lights", "resampling"),
        ("integrator", "film"),
        ("gpu", "shaders"),
    ] {
        let package = packages.iter().find(|package| package.name == from).unwrap();
        assert!(crates::arrows(package).contains(to), "{from} → {to} was not seen");
    }
    let wrong = crates::wrong_arrows(&packages, &FLOORS);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn modules_form_no_circle() {
    let mut found = Vec::new();
    for package in packages() {
        let circles = Modules::new(&package.sources).circles();
        let is_left = CIRCLES_LEFT.contains(&package.name.as_str());
        match (circles.is_empty(), is_left) {
            (true, true) => found.push(format!(
                "{}: no circle is left; take it off the list",
                package.name
            )),
            (false, false) => found.extend(circles.iter().map(|circle| {
                format!(
                    "{}: {}\n    {}",
                    package.name,
                    circle.names(),
                    circle.reasons.join("\n    ")
                )
            })),
            _ => (),
        }
    }
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// A package without files, of sources `(file, text)`.
fn planted(name: &str, manifest: &str, sources: &[(&str, &str)]) -> Package {
    let sources = sources.iter().map(|&(file, text)| (file.into(), text.into()));
    Package::new(name, manifest, sources.collect())
}

#[test]
fn planted_arrows_are_found() {
    let sound = || {
        [
            planted(
                "lanes",
                "[dependencies]\nglam.workspace = true\n",
                &[("lib.rs", "")],
            ),
            planted(
                "sampling",
                "[dependencies]\nlightshed-lanes.workspace = true\n[dev-dependencies]\nlightshed-scene.workspace = true\n",
                &[(
                    "lib.rs",
                    "// use lightshed_scene::Rgb;\nuse lightshed_lanes::Lanes;\n#[cfg(test)]\nmod tests { use lightshed_scene::Rgb; }",
                )],
            ),
            planted(
                "volume",
                "[dependencies]\nlightshed-sampling = { workspace = true }\n",
                &[],
            ),
        ]
    };
    let wrong = |packages: &[Package]| crates::wrong_arrows(packages, &FLOORS);
    assert_eq!(wrong(&sound()), Vec::<String>::new());
    let plant = |index: usize, manifest: &str, source: &str| {
        let mut packages = sound();
        let name = packages[index].name.clone();
        packages[index] = planted(&name, manifest, &[("lib.rs", source)]);
        wrong(&packages)
    };
    // Upward, and along a floor; by the manifest, for one target only, or by a path alone.
    let upward = "[dependencies]\nlightshed-volume.workspace = true\n";
    assert_eq!(plant(1, upward, ""), ["sampling (floor 1) → volume (floor 2)"]);
    let along = "[target.'cfg(unix)'.dependencies]\nlightshed-film = { workspace = true, optional = true }\n";
    assert_eq!(plant(2, along, ""), ["volume (floor 2) → film (floor 2)"]);
    let table = "[dependencies.lightshed-shift]\nworkspace = true\n";
    assert_eq!(plant(0, table, ""), ["lanes (floor 0) → shift (floor 3)"]);
    let path = "fn f() -> f32 {\n    lightshed_gpu::Device::f()\n}\n";
    assert_eq!(plant(2, "", path), ["volume (floor 2) → gpu (floor 8)"]);
    let stranger = planted("attic", "", &[]);
    assert_eq!(wrong(&[stranger]), ["attic has no floor"]);
}

#[test]
fn planted_circles_are_found() {
    let circles = |sources: &[(&str, &str)]| -> Vec<String> {
        let package = planted("planted", "", sources);
        let circles = Modules::new(&package.sources).circles();
        circles.iter().map(Circle::names).collect()
    };
    let none: [String; 0] = [];
    // A tree of modules: children use what their parent defines, parents name their children.
    let root = (
        "lib.rs",
        "mod a;\nmod b;\npub use a::Inner;\npub use b::B;\npub struct Root;",
    );
    let a = (
        "a/mod.rs",
        "mod inner;\nmod other;\npub use inner::Inner;\npub(super) struct Shared;",
    );
    let inner = (
        "a/inner.rs",
        "use super::Shared;\nuse crate::{Root, b::B};\npub struct Inner(B);",
    );
    let other = ("a/other.rs", "use super::Inner;");
    let b = (
        "b.rs",
        "/// [`crate::a::Inner`]\npub struct B; // use crate::a;\nconst TEXT: &str = \"crate::a\";",
    );
    assert_eq!(circles(&[root, a, inner, other, b]), none);
    // By a path, by the crate's root, by a name that the parent imports, within a tree of `use`.
    for text in [
        "fn f(x: crate::a::Inner) {}",
        "use crate::Inner;",
        "use super::Inner as I;",
        "use crate::{\n    Root,\n    a::{self, Inner},\n};",
    ] {
        assert_eq!(
            circles(&[root, a, inner, other, ("b.rs", text)]),
            ["a → b → a"],
            "{text}"
        );
    }
    // Of children, and of three.
    let inner = ("a/inner.rs", "use super::other::Other;\npub struct Inner;");
    assert_eq!(
        circles(&[root, a, inner, other, b]),
        ["a::inner → a::other → a::inner"]
    );
    let three = [
        ("lib.rs", "mod a;\nmod b;\nmod c;\npub use c::C;"),
        ("a.rs", "pub use crate::b::*;"),
        ("b.rs", "use crate::C;"),
        (
            "c.rs",
            "pub struct C;\nimpl C {\n    fn f() {\n        super::a::g()\n    }\n}",
        ),
    ];
    assert_eq!(circles(&three), ["a → b → c → a"]);
    // Tests are apart: a module in the file, a file, a single `use`.
    let tests = [
        ("lib.rs", "mod a;\nmod b;"),
        (
            "a.rs",
            "use crate::b::B;\npub struct A;\n#[cfg(test)]\nmod tests;",
        ),
        ("a/tests.rs", "use crate::b::B;"),
        (
            "b/mod.rs",
            "pub struct B;\n#[cfg(test)]\nuse crate::a::A;\n#[cfg(test)]\nmod tests;\n#[cfg(all(test, unix))]\nmod x { use crate::a::A; }",
        ),
        ("b/tests.rs", "use crate::a::A;"),
    ];
    assert_eq!(circles(&tests), none);
}
