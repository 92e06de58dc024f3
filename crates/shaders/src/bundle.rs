//! Several modules as one text of plain WGSL, without a linker.
//!
//! Each linked module keeps the names of its own declarations and has the names of others with
//! their path in front. Two texts therefore cannot simply be joined: both contain what both need.
//! Here every declaration is known by its module and its name, and is in the bundle once.

use crate::{Module, module};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// What the linker puts before the names of declarations of other modules.
const PREFIX: &str = "package_lightshed_";

/// Why modules do not make a bundle.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BundleError {
    /// There is no module of this name.
    Unknown(String),
    /// The module needs functions of the program, and therefore a linker.
    NeedsHost {
        /// The module.
        module: &'static str,
        /// What it needs from the program.
        host: &'static [&'static str],
    },
    /// Two of the modules have different declarations of one name.
    Collision {
        /// The name.
        name: String,
        /// The modules.
        modules: [&'static str; 2],
    },
}

impl fmt::Display for BundleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(name) => write!(f, "there is no shader module {name}"),
            Self::NeedsHost { module, host } => {
                let host = host.join(", ");
                write!(
                    f,
                    "the shader module {module} needs a linker: the program supplies {host}"
                )
            }
            Self::Collision { name, modules } => {
                let [a, b] = modules;
                write!(
                    f,
                    "the shader modules {a} and {b} both declare {name}, differently"
                )
            }
        }
    }
}

impl std::error::Error for BundleError {}

/// The modules of these names as one text of WGSL that any device takes, each declaration once.
///
/// Declarations of these modules have their own names. Declarations that they need from other
/// modules have the name of their module in front. Put your own code behind the text; it binds
/// nothing and has no entry point.
///
/// ```
/// let library = lightshed_shaders::bundle(&["warp", "mis"])?;
/// assert!(library.contains("fn cosine_hemisphere("));
/// let program = format!("{library}
///     @compute @workgroup_size(64) fn main() {{ }}");
/// # let _ = program;
/// # Ok::<(), lightshed_shaders::BundleError>(())
/// ```
///
/// # Errors
/// A name that no module has, a module that needs a host (see [`Module::host`]), or two modules
/// that declare one name differently.
pub fn bundle(names: &[&str]) -> Result<String, BundleError> {
    let mut asked: BTreeMap<&'static str, &'static str> = BTreeMap::new();
    for &name in names {
        let Module { name, wgsl, host, .. } =
            *module(name).ok_or_else(|| BundleError::Unknown(name.to_owned()))?;
        let wgsl = wgsl.ok_or(BundleError::NeedsHost { module: name, host })?;
        asked.insert(name, wgsl);
    }
    let mut text = format!(
        "// Modules of lightshed: {}.\n",
        asked.keys().copied().collect::<Vec<_>>().join(", ")
    );
    // By name, the module of a declaration, and its text.
    let mut own: BTreeMap<String, (&str, String)> = BTreeMap::new();
    let mut others = BTreeSet::new();
    for (&module, wgsl) in &asked {
        for declaration in declarations(wgsl) {
            let declaration = renamed(declaration, &asked);
            let name = name_of(&declaration).to_owned();
            if name.starts_with(PREFIX) {
                if others.insert(name) {
                    text += &format!("\n{declaration}\n");
                }
                continue;
            }
            match own.get(&name) {
                None => {
                    text += &format!("\n{declaration}\n");
                    own.insert(name, (module, declaration));
                }
                Some((_, known)) if *known == declaration => {}
                Some(&(other, _)) => {
                    return Err(BundleError::Collision {
                        name,
                        modules: [other, module],
                    });
                }
            }
        }
    }
    Ok(text)
}

/// The declarations of a linked text without the comments between them: a blank line ends each, and
/// no declaration contains a blank line.
fn declarations(wgsl: &str) -> impl Iterator<Item = &str> {
    let parts = wgsl.split("\n\n").map(str::trim);
    parts.filter(|part| !part.is_empty() && !part.starts_with("//"))
}

/// The name that a declaration declares: the word behind the keyword.
fn name_of(declaration: &str) -> &str {
    let keywords = ["fn ", "const ", "struct ", "alias ", "override ", "var "];
    let start = keywords
        .iter()
        .filter_map(|keyword| Some(declaration.find(keyword)? + keyword.len()))
        .min()
        .unwrap_or(0);
    let rest = &declaration[start..];
    let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
    &rest[..end]
}

/// The text, with the names of the requested modules as these modules have them.
fn renamed(text: &str, asked: &BTreeMap<&'static str, &'static str>) -> String {
    let mut result = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(PREFIX) {
        let (before, from) = rest.split_at(at);
        let length = from.find(|c| !is_word(c)).unwrap_or(from.len());
        let word = &from[..length];
        result += before;
        match parts(word) {
            Some((module, name)) if asked.contains_key(module) => result += name,
            _ => result += word,
        }
        rest = &from[length..];
    }
    result + rest
}

/// Module and name of a linked name. If a part contains underscores, the linker writes their number
/// in front of it: `package_lightshed_turn__2sin_cos_turns`.
fn parts(word: &str) -> Option<(&str, &str)> {
    let (underscores, rest) = counted(word.strip_prefix(PREFIX)?);
    let (end, _) = rest.match_indices('_').nth(underscores)?;
    let (_, name) = counted(&rest[end + 1..]);
    Some((&rest[..end], name))
}

/// The number of underscores in a part, and the part.
fn counted(part: &str) -> (usize, &str) {
    let Some(rest) = part.strip_prefix('_') else {
        return (0, part);
    };
    let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    match rest[..end].parse() {
        Ok(count) => (count, &rest[end..]),
        Err(_) => (0, part),
    }
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linked_names_are_taken_apart() {
        let cases = [
            ("package_lightshed_vector_dot3", Some(("vector", "dot3"))),
            (
                "package_lightshed_turn__2sin_cos_turns",
                Some(("turn", "sin_cos_turns")),
            ),
            (
                "package_lightshed__1grid_light_kernel",
                Some(("grid_light", "kernel")),
            ),
            (
                "package_lightshed__1grid_light__1two_words",
                Some(("grid_light", "two_words")),
            ),
            ("package_lightshed_x", None),
            ("other_name", None),
        ];
        for (word, expected) in cases {
            assert_eq!(parts(word), expected, "{word}");
        }
    }

    #[test]
    fn what_is_no_bundle_is_refused() {
        assert_eq!(bundle(&["none"]), Err(BundleError::Unknown("none".to_owned())));
        let refused = bundle(&["warp", "light_tree"]).unwrap_err();
        assert!(
            matches!(&refused, BundleError::NeedsHost { module: "light_tree", host } if !host.is_empty())
        );
        assert!(refused.to_string().contains("load_leaf_of"), "{refused}");
    }
}
