//! Options of methods as text: what they are called and what they accept.

use std::str::FromStr;

/// An option that some methods take, as a command line or a name like `path:bvh` gives it.
#[derive(Clone, Copy, Debug)]
pub struct MethodOption {
    /// Its name, without dashes before it.
    pub name: &'static str,
    /// What help calls its value; `None` for a switch, whose values are `true` and `false`.
    pub value: Option<&'static str>,
    /// The value if none is given. Empty if that is none.
    pub default: &'static str,
    /// What it does, in a sentence.
    pub help: &'static str,
    /// Whether it accepts a value; if not, why.
    pub check: fn(&str) -> Result<(), String>,
}

impl MethodOption {
    /// An option with a value.
    pub const fn new(
        name: &'static str,
        value: &'static str,
        default: &'static str,
        check: fn(&str) -> Result<(), String>,
        help: &'static str,
    ) -> Self {
        Self {
            name,
            value: Some(value),
            default,
            help,
            check,
        }
    }

    /// A switch, off if not given.
    pub const fn switch(name: &'static str, help: &'static str) -> Self {
        Self {
            name,
            value: None,
            default: "false",
            help,
            check: any::<bool>,
        }
    }
}

/// Accepts what parses as a `T`.
pub(super) fn any<T: FromStr>(text: &str) -> Result<(), String> {
    text.parse::<T>()
        .map(|_| ())
        .map_err(|_| format!("{text} is no {}", kind::<T>()))
}

/// Accepts whole numbers in a range.
pub(super) fn within(text: &str, range: std::ops::RangeInclusive<u32>) -> Result<(), String> {
    match text.parse() {
        Ok(number) if range.contains(&number) => Ok(()),
        _ => Err(format!(
            "{text} is not a whole number in {}..={}",
            range.start(),
            range.end()
        )),
    }
}

/// Accepts one of some names.
pub(super) fn one_of(text: &str, names: &[&str]) -> Result<(), String> {
    match names.contains(&text) {
        true => Ok(()),
        false => Err(format!("{text} is not one of {}", names.join(", "))),
    }
}

/// What messages call the values of a type.
fn kind<T>() -> &'static str {
    match std::any::type_name::<T>() {
        "f32" | "f64" => "number",
        "bool" => "truth value",
        _ => "whole number",
    }
}

/// Values of options.
#[derive(Clone, Debug, Default)]
pub struct MethodValues(Vec<(&'static MethodOption, String)>);

impl MethodValues {
    /// Sets an option to a value that it has accepted.
    pub(super) fn set(&mut self, option: &'static MethodOption, value: &str) {
        self.0.retain(|(other, _)| other.name != option.name);
        self.0.push((option, value.to_owned()));
    }

    /// What was given, in order.
    pub(super) fn given(&self) -> impl Iterator<Item = (&'static MethodOption, &str)> {
        self.0.iter().map(|(option, value)| (*option, value.as_str()))
    }

    /// The value of an option, or its default; `None` if that is none.
    pub fn get<T: FromStr>(&self, option: &MethodOption) -> Option<T> {
        let given = self.0.iter().find(|(other, _)| other.name == option.name);
        let text = given.map_or(option.default, |(_, value)| value);
        // A value that is there has been accepted.
        text.parse().ok()
    }

    /// Whether an option was given.
    pub fn has(&self, option: &MethodOption) -> bool {
        self.given().any(|(given, _)| given.name == option.name)
    }

    /// Whether a switch is on.
    pub fn is_on(&self, option: &MethodOption) -> bool {
        self.get(option).unwrap_or(false)
    }
}
