//! Worst errors of numeric functions over hostile and random input, against `f64` or closed forms.
//! `docs/precision.md` has them, and misses no function.
//! `LIGHTSHED_PRECISION=docs/precision.md cargo test --release --test precision` writes it anew.

mod distributions;
mod elsewhere;
mod emitters;
mod film;
mod flights;
mod grid;
// A file of the testkit alone: the whole testkit would be built for every example of this package.
#[path = "../../crates/testkit/src/hostile_unit.rs"]
mod hostile_unit;
mod inverses;
mod lights;
mod materials;
mod medium;
mod public_functions;
mod resampling;
mod sampling;
mod scene;
mod shift;
mod table;
mod volume;
mod worst;

use public_functions::Surface;
use std::collections::BTreeSet;
use std::path::Path;
use table::{compare, rows, table};

/// No error is more than twice what the table says, and no function is in the one alone. A table
/// that says less, or lacks a row, is refused.
#[test]
fn errors_are_those_of_the_table() {
    let (rows, folder) = (rows(), Path::new(env!("CARGO_MANIFEST_DIR")));
    if let Some(path) = std::env::var_os("LIGHTSHED_PRECISION") {
        std::fs::write(folder.join(path), table(&rows)).unwrap();
    }
    let text = document();
    assert_eq!(compare(&rows, &text), Vec::<String>::new());

    let row = text.lines().find(|line| line.starts_with("| `remap`")).unwrap();
    let (head, worst) = row.rsplit_once(" | ").unwrap();
    let smaller = text.replace(row, &format!("{head} | 1.0e-9 |"));
    assert_ne!(worst, "1.0e-9 |");
    for (planted, message) in [(smaller, "the file says"), (text.replace(row, ""), "is missing")] {
        let found = compare(&rows, &planted);
        assert!(
            matches!(&found[..], [one] if one.contains("remap") && one.contains(message)),
            "{found:?}"
        );
    }
}

/// The crates that the tables are about.
const CRATES: [&str; 10] = [
    "lanes",
    "sampling",
    "spatial",
    "resampling",
    "shift",
    "lights",
    "volume",
    "scene",
    "film",
    "integrator",
];

fn surfaces() -> Vec<Surface> {
    let lists = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/api");
    let list = |name: &&str| std::fs::read_to_string(lists.join(name).with_extension("txt")).unwrap();
    CRATES.iter().map(|name| Surface::of(&list(name))).collect()
}

/// Public functions of real numbers that `text` does not name: a trait's function counts as named
/// by a type that has the trait.
fn unnamed(surfaces: &[Surface], text: &str) -> Vec<String> {
    let named: BTreeSet<&str> = text.split('`').skip(1).step_by(2).collect();
    let is_named = |function: &str| {
        let (owner, name) = function.split_once("::").unwrap_or(("", function));
        let implementations = surfaces.iter().flat_map(|surface| &surface.implementations);
        named.contains(function)
            || implementations
                .filter(|(of, _)| of == owner)
                .any(|(_, by)| named.contains(format!("{by}::{name}").as_str()))
    };
    let numeric = surfaces.iter().flat_map(|surface| &surface.numeric);
    numeric.filter(|function| !is_named(function)).cloned().collect()
}

fn document() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/precision.md")).unwrap()
}

/// Every public function that takes or returns real numbers is in the document, with a row or with
/// the reason why it has none.
#[test]
fn no_public_function_is_missing() {
    let (surfaces, text) = (surfaces(), document());
    let found = surfaces
        .iter()
        .map(|surface| surface.numeric.len())
        .collect::<Vec<_>>();
    assert!(found.iter().all(|&count| count > 10), "the lists have {found:?}");
    let missing = unnamed(&surfaces, &text);
    assert!(
        missing.is_empty(),
        "{missing:?}: each needs a row in tests/precision or a place in tests/precision/elsewhere.rs; then make docs/precision.md anew"
    );
    // Without its name, each kind of function is missed.
    for function in [
        "power_heuristic",
        "Bounds::half_area",
        "WorldLighting::emitted",
        "PixelStatistics::variance",
    ] {
        let without = text.replace(&format!("`{function}`"), "");
        assert_eq!(unnamed(&surfaces, &without), [function]);
    }
}

/// What the document says to be without a row exists.
#[test]
fn no_function_is_left_over() {
    let (surfaces, text) = (surfaces(), document());
    let (_, without_row) = text.split_once("## Without a row").unwrap();
    let known: BTreeSet<&String> = surfaces.iter().flat_map(|surface| &surface.functions).collect();
    let names = without_row
        .split('`')
        .skip(1)
        .step_by(2)
        .filter(|name| !name.starts_with("lightshed-"));
    let left_over: Vec<&str> = names.filter(|&name| !known.contains(&name.to_owned())).collect();
    assert_eq!(left_over, Vec::<&str>::new());
}

/// Members of implementations of traits have no names of their own, those of macros are left out,
/// and functions about other things are known but not numeric.
#[test]
fn lists_are_read() {
    let surface = Surface::of(
        "macro_rules! real\n    impl Real for $real\nimpl<T: Fn(u32) -> u32> Seen<T>\n    #[must_use] pub const fn length(&self) -> f64\n    \
         pub fn count(&self) -> u32\nimpl<T> Sees for Seen<T>\n    fn other(&self) -> f32\npub trait Sees: Copy\n    \
         fn sees(&self) -> Vec3\npub fn module::seen(x: f32) -> u32\n",
    );
    assert_eq!(
        surface.numeric.iter().collect::<Vec<_>>(),
        ["Seen::length", "Sees::sees", "seen"]
    );
    assert_eq!(surface.functions.len(), 4);
    assert!(surface.functions.contains("Seen::count"));
    assert_eq!(unnamed(&[surface], "`Seen::length` and `Seen::sees`"), ["seen"]);
}
