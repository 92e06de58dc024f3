//! Each crate's public interface, recorded in `docs/api`: a change of it shows in the diff.
//!
//! `LIGHTSHED_INTERFACE=write cargo test -p lightshed-house --test interface` writes the lists
//! anew.

mod numbers;
mod reexports;

use lightshed_house::{Interface, Package, packages, repository};
use std::collections::BTreeSet;

/// What every change of an interface is told.
const HOW: &str = "LIGHTSHED_INTERFACE=write cargo test -p lightshed-house --test interface";

#[test]
fn interfaces_are_those_recorded() {
    let folder = repository().join("docs/api");
    let writes = std::env::var_os("LIGHTSHED_INTERFACE").is_some();
    let (mut changed, mut files) = (Vec::new(), BTreeSet::new());
    for package in packages() {
        let found = Interface::of(&package).text();
        let path = folder.join(&package.name).with_extension("txt");
        if writes {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&path, &found).unwrap();
        }
        let recorded = std::fs::read_to_string(&path).unwrap_or_default();
        let differences = differences(&recorded, &found);
        changed.extend(differences.iter().map(|line| format!("{}: {line}", package.name)));
        files.insert(path);
    }
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if !files.contains(&path) {
            changed.push(format!("{} is of no crate", path.display()));
        }
    }
    assert!(
        changed.is_empty(),
        "public interfaces changed; if that is meant, write them anew:\n{HOW}\n{}",
        changed.join("\n")
    );
}

/// Lines that are in one text only, or more often.
fn differences(recorded: &str, found: &str) -> Vec<String> {
    if recorded == found {
        return Vec::new();
    }
    let only = |sign: char, a: &str, b: &str| -> Vec<String> {
        let there: BTreeSet<&str> = b.lines().collect();
        let lines = a.lines().filter(|line| !there.contains(line));
        lines.map(|line| format!("{sign} {}", line.trim())).collect()
    };
    let mut all = only('-', recorded, found);
    all.extend(only('+', found, recorded));
    if all.is_empty() {
        all.push("lines stand elsewhere, or more often".to_owned());
    }
    all
}

fn planted(lib: &str, a: &str) -> String {
    let sources = [("lib.rs", lib), ("a.rs", a)].map(|(file, text)| (file.into(), text.into()));
    Interface::of(&Package::new("planted", "", sources.into())).text()
}

const LIB: &str = "mod a;\npub use a::{Kind, Lamp, Sees, measure_of as measure};\n";
const A: &str = "
use crate::Sees as S;
/// A lamp.
#[derive(Clone, Debug)]
pub struct Lamp<T = f32> {
    /// Its power.
    pub power: T,
    hidden: u32,
}
impl<T: Copy> Lamp<T> {
    /// Makes one.
    pub fn new(power: T) -> Self { Self { power, hidden: 1 } }
    fn private(&self) -> u32 { self.hidden }
}
impl<T> S for Lamp<T> { type Seen = u8; fn sees(&self, at: &[f32; 3]) -> bool { true } }
pub trait Sees { type Seen; fn sees(&self, at: &[f32; 3]) -> bool; }
#[non_exhaustive]
pub enum Kind { One, Two { size: u32 } }
pub fn measure_of(lamp: &Lamp) -> f32 { lamp.power }
pub struct Unseen { pub x: u32 }
#[cfg(test)]
mod tests { pub struct Lamp2; }
";

#[test]
fn planted_changes_are_seen() {
    let sound = planted(LIB, A);
    let expected = "\
#[non_exhaustive] pub enum Kind
    One
    Two { size: u32 }
#[derive(Clone, Debug)] pub struct Lamp<T = f32>
    (private fields)
    pub power: T
impl<T: Copy> Lamp<T>
    pub fn new(power: T) -> Self
impl<T> S for Lamp<T>
    type Seen = u8
pub trait Sees
    fn sees(&self, at: &[f32; 3]) -> bool
    type Seen
pub fn measure(lamp: &Lamp) -> f32
";
    assert_eq!(sound, expected);
    for (of, to) in [
        ("power: T)", "power: u32)"),
        ("-> Self {", "-> Option<Self> {"),
        ("pub power", "power"),
        ("Clone, Debug", "Clone"),
        ("T: Copy", "T: Clone"),
        ("#[non_exhaustive]\n", ""),
        ("One, ", ""),
        ("size: u32", "size: u64"),
        ("bool; }", "bool { true } }"),
        ("type Seen = u8", "type Seen = u16"),
        ("impl<T> S for Lamp<T>", "impl<T> S for Unseen"),
        ("fn private", "pub fn private"),
        ("hidden: u32,", "pub hidden: u32,"),
        ("lamp: &Lamp)", "lamp: Lamp)"),
    ] {
        let changed = planted(LIB, &A.replacen(of, to, 1));
        assert!(!differences(&sound, &changed).is_empty(), "{of} → {to}");
    }
    assert!(!differences(&sound, &planted(&LIB.replace(", Lamp", ""), A)).is_empty());
    // What nobody outside sees may change.
    for (of, to) in [
        ("A lamp", "A light"),
        ("hidden: 1", "hidden: 2"),
        ("fn private(&self)", "fn private(&mut self)"),
        ("pub x: u32", "pub x: u8"),
        ("Lamp2", "Lamp3"),
    ] {
        assert_eq!(planted(LIB, &A.replacen(of, to, 1)), sound, "{of} → {to}");
    }
}

/// Densities and weights are of types that say what they are, but for those with a reason.
#[test]
fn densities_and_weights_are_typed() {
    let mut wrong = Vec::new();
    for package in packages() {
        let found = numbers::bare(&Interface::of(&package));
        wrong.extend(numbers::without_reason(&package.name, &found));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn planted_numbers_are_found() {
    let a = A.replacen("-> bool", "-> f32", 2).replace("sees", "pdf");
    let sources = [("lib.rs", LIB), ("a.rs", &a)].map(|(file, text)| (file.into(), text.into()));
    let interface = Interface::of(&Package::new("planted", "", sources.into()));
    let found = numbers::bare(&interface);
    assert_eq!(found, ["Sees::pdf -> f32"]);
    let reported = numbers::without_reason("planted", &found);
    assert_eq!(reported, ["planted: Sees::pdf -> f32"]);
    // A reason that nothing needs any more is reported, too.
    assert!(!numbers::without_reason("volume", &[]).is_empty());
}

/// A user of one crate depends on that crate alone.
#[test]
fn types_in_signatures_are_exported() {
    let wrong: Vec<String> = packages().iter().flat_map(reexports::missing).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");

    let planted = |lib: &str| {
        let a = "use lightshed_sampling::{Density, Frame};\nuse glam::Vec3;\n\
            pub fn f(x: Vec3) -> Density { Frame::of(x) }\npub enum E { Frame }";
        let sources = [("lib.rs", lib), ("a.rs", a)].map(|(file, text)| (file.into(), text.into()));
        reexports::missing(&Package::new("planted", "", sources.into()))
    };
    let lib = "mod a;\npub use a::{E, f};\n";
    assert_eq!(
        planted(lib),
        ["planted: glam", "planted: lightshed_sampling::Density"]
    );
    assert_eq!(
        planted(&format!("{lib}pub use lightshed_sampling::{{Density, glam}};")),
        [""; 0]
    );
    assert_eq!(
        planted(&format!(
            "{lib}pub use lightshed_sampling as sampling;\npub use glam;"
        )),
        [""; 0]
    );
}

/// Options that cannot be stored, yet: of methods, of reports and of tests.
const NOT_STORED: [&str; 4] = ["evaluate", "integrator", "scene", "testkit"];

/// Options can be stored behind the feature `serde`.
#[test]
fn options_can_be_stored() {
    let without = |name: &str, text: &str| -> Vec<String> {
        let options = text.lines().filter(|line| {
            let word = line.split("pub struct ").nth(1).unwrap_or_default();
            word.split([' ', '<']).next().unwrap().ends_with("Options")
        });
        let wrong = options.filter(|line| !line.contains("derive(serde::Serialize, serde::Deserialize)"));
        wrong.map(|line| format!("{name}: {line}")).collect()
    };
    let (mut wrong, mut count) = (Vec::new(), 0);
    for package in packages() {
        let text = Interface::of(&package).text();
        count += text.matches("derive(serde::Serialize").count();
        if !NOT_STORED.contains(&package.name.as_str()) {
            wrong.extend(without(&package.name, &text));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(count > 20, "only {count} types can be stored");
    assert_eq!(
        without("planted", "#[derive(Clone)] pub struct PlantedOptions\n").len(),
        1
    );
}
