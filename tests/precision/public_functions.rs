//! The public functions of a crate that take or return real numbers, from its list in `docs/api`.
//! A test of the house compares these lists with the sources.
//!
//! An item starts in the first column of a list, its members follow with four spaces.

use std::collections::BTreeSet;

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

impl Surface {
    /// Reads a list.
    pub fn of(list: &str) -> Self {
        let numeric: BTreeSet<&str> = NUMERIC.split_whitespace().collect();
        let mut surface = Self::default();
        // The type or trait whose members come; none for an implementation of a trait.
        let mut owner = None;
        for line in list.lines() {
            let member = line.strip_prefix("    ");
            let item = without_attributes(member.unwrap_or(line));
            if member.is_none() {
                owner = surface.owner(item);
            }
            let declaration = item.replacen("const fn", "fn", 1);
            let rest = match (member, &owner) {
                (None, _) => declaration.strip_prefix("pub fn "),
                (Some(_), Some(_)) => declaration
                    .strip_prefix("pub fn ")
                    .or_else(|| declaration.strip_prefix("fn ")),
                (Some(_), None) => None,
            };
            // Of `module::function`, the last name.
            let path = rest.and_then(|rest| rest.split(['(', '<']).next());
            let Some(name) = path.and_then(|path| path.rsplit("::").next()) else {
                continue;
            };
            let scope = owner.as_deref().filter(|_| member.is_some());
            let key = scope.map_or(name.to_owned(), |scope| format!("{scope}::{name}"));
            if words(&declaration).any(|word| numeric.contains(word))
                || scope.is_some_and(|scope| numeric.contains(scope))
            {
                surface.numeric.insert(key.clone());
            }
            surface.functions.insert(key);
        }
        surface
    }

    /// The type or trait that an item is about, if its members have names of their own.
    fn owner(&mut self, item: &str) -> Option<String> {
        if let Some(name) = item.strip_prefix("pub trait ") {
            return words(name).next().map(str::to_owned);
        }
        // An arrow closes no bracket.
        let item = item.replace("->", "--");
        let target = after_generics(item.strip_prefix("impl")?);
        match target.split_once(" for ") {
            Some((name, of)) => {
                self.implementations.insert((type_name(name), type_name(of)));
                None
            }
            None => Some(type_name(target)),
        }
    }
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_'))
        .filter(|word| !word.is_empty())
}

/// An item without the attributes before it.
fn without_attributes(item: &str) -> &str {
    match item.strip_prefix("#[").and_then(|rest| rest.split_once("] ")) {
        Some((_, rest)) => without_attributes(rest),
        None => item,
    }
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
