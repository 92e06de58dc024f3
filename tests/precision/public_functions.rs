//! The public functions of a crate that take or return real numbers, by a scan of its formatted
//! sources.
//!
//! It knows no Rust but what `rustfmt` makes of it: items start in the first column, functions of
//! types and traits in the fifth.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What is public in a crate.
#[derive(Default)]
pub struct Surface {
    /// `function`, `Type::function` or `Trait::function`, whatever it is about.
    pub functions: BTreeSet<String>,
    /// Those that take or return real numbers.
    pub numeric: BTreeSet<String>,
    /// `(Trait, Type)`.
    pub implementations: BTreeSet<(String, String)>,
}

/// Types that are real numbers or made of them: a function that names one in its signature, or
/// belongs to one, is about real numbers.
const NUMERIC: &str = "f32 f64 Vec2 Vec3 Vec3A DVec2 DVec3 Rgb Real Density Lanes L Jacobian MeasuredJacobian ContributionWeight Tractable \
    CompensatedSum Moments Reservoir DomainReservoir Merged Shifted Pulled Ray FieldRay Hit SurfacePoint Interval Light LightChoice Bounds \
    FieldBounds OrientationCone PhaseSample ScatteringAngle RgbImage PixelStatistics";

/// Whose functions are being listed.
enum Owner {
    /// The module.
    Module,
    /// A type or a trait, and what public functions start with.
    Named(String, &'static str),
    /// A type, for a trait: no names of its own.
    Implementation,
}

impl Surface {
    /// Scans the crate in `folder`.
    pub fn of(folder: &Path) -> Self {
        let source = folder.join("src");
        let files: Vec<(PathBuf, String)> = rust_files(&source)
            .into_iter()
            .map(|path| {
                (
                    path.strip_prefix(&source).unwrap().to_owned(),
                    std::fs::read_to_string(&path).unwrap(),
                )
            })
            .collect();
        let lines_of = |name: &Path| {
            files
                .iter()
                .find(|(path, _)| path == name)
                .map_or("", |(_, text)| text)
                .lines()
        };
        // What leaves the crate, by its root and by its public modules.
        let root = Path::new("lib.rs");
        let modules = lines_of(root)
            .filter_map(|line| line.strip_prefix("pub mod "))
            .map(|name| Path::new(name.trim_end_matches(';')).join("mod.rs"));
        let mut exported = BTreeSet::new();
        for module in modules.chain([root.to_owned()]) {
            let lines: Vec<&str> = lines_of(&module).collect();
            for (i, _) in lines
                .iter()
                .enumerate()
                .filter(|(_, line)| line.starts_with("pub "))
            {
                exported.extend(words(&declaration(&lines[i..])).map(str::to_owned));
            }
        }
        let mut surface = Self::default();
        for (path, text) in &files {
            // Modules of tests are files of their own, or last in a file.
            let is_test =
                ["tests", "testing", "properties"].contains(&path.file_stem().unwrap().to_str().unwrap());
            if !is_test {
                surface.scan(text.split("\nmod tests {").next().unwrap(), &exported);
            }
        }
        surface
    }

    fn scan(&mut self, text: &str, exported: &BTreeSet<String>) {
        let numeric: BTreeSet<&str> = NUMERIC.split_whitespace().collect();
        let lines: Vec<&str> = text.lines().collect();
        let mut owner = Owner::Module;
        for (i, line) in lines.iter().enumerate() {
            if line.starts_with('}') {
                owner = Owner::Module;
            } else if let Some(name) = line.strip_prefix("pub trait ") {
                owner = Owner::Named(words(name).next().unwrap().to_owned(), "fn ");
            } else if line.starts_with("impl") {
                // An arrow closes no bracket.
                let whole = declaration(&lines[i..]).replace("->", "--");
                let target = after_generics(&whole["impl".len()..]);
                owner = match target.split_once(" for ") {
                    Some((name, of)) => {
                        self.implementations.insert((type_name(name), type_name(of)));
                        Owner::Implementation
                    }
                    None => Owner::Named(type_name(target), "pub fn "),
                };
            }
            let (start, scope) = match &owner {
                Owner::Module => ("pub fn ", None),
                Owner::Named(name, start) => (*start, Some(name)),
                Owner::Implementation => continue,
            };
            let indent = if scope.is_some() { "    " } else { "" };
            let plain = line.replacen("const fn", "fn", 1);
            let Some(rest) = plain
                .strip_prefix(indent)
                .and_then(|line| line.strip_prefix(start))
            else {
                continue;
            };
            let name = words(rest).next().unwrap();
            let key = scope.map_or(name.to_owned(), |scope| format!("{scope}::{name}"));
            if !exported.contains(scope.map_or(name, String::as_str)) {
                continue;
            }
            let about_numbers = words(&declaration(&lines[i..])).any(|word| numeric.contains(word))
                || scope.is_some_and(|scope| numeric.contains(scope.as_str()));
            if about_numbers {
                self.numeric.insert(key.clone());
            }
            self.functions.insert(key);
        }
    }
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_'))
        .filter(|word| !word.is_empty())
}

/// The text from the start of `lines` to what opens a body or ends a declaration.
fn declaration(lines: &[&str]) -> String {
    let end = lines
        .iter()
        .position(|line| line.ends_with(['{', ';', '}']) && !line.ends_with("::{"));
    lines[..=end.unwrap_or(0)].join(" ")
}

/// What follows the generic parameters that `text` may start with.
fn after_generics(text: &str) -> &str {
    let mut depth = 0;
    for (i, c) in text.char_indices() {
        match c {
            '<' => depth += 1,
            '>' => depth -= 1,
            _ if depth == 0 => return text[i..].trim_start(),
            _ => (),
        }
    }
    text
}

/// The last name of a path, without arguments: `Type` of `module::Type<T>`.
fn type_name(path: &str) -> String {
    let end = path.find(['<', ' ', '{']).unwrap_or(path.len());
    path[..end].rsplit("::").next().unwrap_or_default().to_owned()
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    entries.sort();
    entries
        .into_iter()
        .flat_map(|path| match path.is_dir() {
            true => rust_files(&path),
            false => vec![path],
        })
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .collect()
}
