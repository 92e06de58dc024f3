//! Parameters of directives: `"type name" value`.

use super::tokens::{Token, Word};
use crate::Rgb;
use crate::import::error::{ImportError, Location};
use glam::{DVec2, DVec3};
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// One parameter.
#[derive(Clone, Debug)]
pub(super) struct Parameter {
    pub kind: String,
    pub name: String,
    pub values: Values,
}

/// Its values.
#[derive(Clone, Debug)]
pub(super) enum Values {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
    Flags(Vec<bool>),
}

/// Those of one directive, and which have been asked for.
#[derive(Clone, Debug)]
pub(super) struct Parameters {
    pub path: PathBuf,
    pub line: u32,
    /// What the directive is, for messages.
    pub what: String,
    list: Vec<Parameter>,
    asked: RefCell<Vec<bool>>,
}

impl Parameters {
    /// Of a directive that has none.
    pub fn none(path: &Path, line: u32, what: &str) -> Self {
        Self {
            path: path.to_path_buf(),
            line,
            what: what.to_owned(),
            list: Vec::new(),
            asked: RefCell::default(),
        }
    }

    /// Reads parameters from the front of `tokens`; what is left.
    pub fn read(mut self, mut tokens: &[Token]) -> Result<(Self, &[Token]), ImportError> {
        while let [
            Token {
                word: Word::Quoted(declared),
                line,
            },
            rest @ ..,
        ] = tokens
        {
            let fail = |what: String| ImportError::malformed(Location::line(&self.path, *line), what);
            let mut words = declared.split_ascii_whitespace();
            let (Some(kind), Some(name), None) = (words.next(), words.next(), words.next()) else {
                return Err(fail(format!("`{declared}` is no type and name")));
            };
            let count = match rest {
                [Token { word: Word::Open, .. }, more @ ..] => {
                    let end = more.iter().position(|token| token.word == Word::Close);
                    let end = end.ok_or_else(|| fail("a list without its end".to_owned()))?;
                    tokens = &more[end + 1..];
                    &more[..end]
                }
                [one, more @ ..] => {
                    tokens = more;
                    std::slice::from_ref(one)
                }
                [] => return Err(fail(format!("`{declared}` has no value"))),
            };
            let values = values(count).ok_or_else(|| fail(format!("`{declared}` has values of no type")))?;
            self.list.push(Parameter {
                kind: kind.to_owned(),
                name: name.to_owned(),
                values,
            });
        }
        self.asked = RefCell::new(vec![false; self.list.len()]);
        Ok((self, tokens))
    }

    /// Those of `defaults` that are not there already.
    pub fn with_defaults(mut self, defaults: &[Parameter]) -> Self {
        for default in defaults {
            if !self.list.iter().any(|own| own.name == default.name) {
                self.list.push(default.clone());
                // Attributes may have parameters that this directive does not know.
                self.asked.borrow_mut().push(true);
            }
        }
        self
    }

    pub fn into_list(self) -> Vec<Parameter> {
        self.list
    }

    pub fn location(&self) -> Location {
        Location::line(&self.path, self.line).element(self.what.clone())
    }

    pub fn malformed(&self, message: impl Into<String>) -> ImportError {
        ImportError::malformed(self.location(), message)
    }

    pub fn unsupported(&self, message: impl Into<String>) -> ImportError {
        ImportError::unsupported(self.location(), message)
    }

    /// The parameter of that name, marked as asked for.
    pub fn get(&self, name: &str) -> Option<&Parameter> {
        let index = self.list.iter().position(|parameter| parameter.name == name)?;
        if let Some(asked) = self.asked.borrow_mut().get_mut(index) {
            *asked = true;
        }
        self.list.get(index)
    }

    /// Marks parameters that change nothing here.
    pub fn ignore(&self, names: &[&str]) {
        for name in names {
            self.get(name);
        }
    }

    /// Names that nothing has asked for.
    pub fn left_over(&self) -> Vec<String> {
        let asked = self.asked.borrow();
        let left = self.list.iter().zip(asked.iter()).filter(|(_, asked)| !**asked);
        left.map(|(parameter, _)| parameter.name.clone()).collect()
    }

    fn wrong(&self, name: &str, expected: &str) -> ImportError {
        self.malformed(format!("`{name}` is not {expected}"))
    }

    /// Finite numbers.
    pub fn numbers(&self, name: &str) -> Result<Option<&[f64]>, ImportError> {
        match self.get(name).map(|parameter| &parameter.values) {
            None => Ok(None),
            Some(Values::Numbers(numbers)) => Ok(Some(numbers)),
            Some(_) => Err(self.wrong(name, "a list of numbers")),
        }
    }

    pub fn number(&self, name: &str) -> Result<Option<f64>, ImportError> {
        match self.numbers(name)? {
            None => Ok(None),
            Some([number]) => Ok(Some(*number)),
            Some(_) => Err(self.wrong(name, "one number")),
        }
    }

    pub fn float(&self, name: &str, default: f32) -> Result<f32, ImportError> {
        let value = self.number(name)?.map_or(default, |value| value as f32);
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.wrong(name, "within the range of numbers"))
        }
    }

    /// At least one.
    pub fn count(&self, name: &str) -> Result<Option<u32>, ImportError> {
        match self.number(name)? {
            None => Ok(None),
            Some(value) if value >= 1.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0 => {
                Ok(Some(value as u32))
            }
            Some(_) => Err(self.wrong(name, "a positive integer")),
        }
    }

    pub fn flag(&self, name: &str, default: bool) -> Result<bool, ImportError> {
        match self.get(name).map(|parameter| &parameter.values) {
            None => Ok(default),
            Some(Values::Flags(flags)) if flags.len() == 1 => Ok(flags[0]),
            // As older files have it.
            Some(Values::Texts(texts)) if texts.len() == 1 => Ok(texts[0] == "true"),
            Some(_) => Err(self.wrong(name, "true or false")),
        }
    }

    pub fn text(&self, name: &str) -> Result<Option<&str>, ImportError> {
        match self.get(name).map(|parameter| &parameter.values) {
            None => Ok(None),
            Some(Values::Texts(texts)) if texts.len() == 1 => Ok(Some(&texts[0])),
            Some(_) => Err(self.wrong(name, "one name")),
        }
    }

    pub fn texts(&self, name: &str) -> Result<Option<&[String]>, ImportError> {
        match self.get(name).map(|parameter| &parameter.values) {
            None => Ok(None),
            Some(Values::Texts(texts)) => Ok(Some(texts)),
            Some(_) => Err(self.wrong(name, "a list of names")),
        }
    }

    pub fn point(&self, name: &str) -> Result<Option<DVec3>, ImportError> {
        match self.numbers(name)? {
            None => Ok(None),
            Some(&[x, y, z]) => Ok(Some(DVec3::new(x, y, z))),
            Some(_) => Err(self.wrong(name, "three numbers")),
        }
    }

    pub fn points(&self, name: &str) -> Result<Vec<DVec3>, ImportError> {
        let numbers = self.numbers(name)?.unwrap_or_default();
        if !numbers.len().is_multiple_of(3) {
            return Err(self.wrong(name, "a list of points"));
        }
        Ok(numbers
            .as_chunks::<3>()
            .0
            .iter()
            .map(|&p| DVec3::from_array(p))
            .collect())
    }

    pub fn pairs(&self, name: &str) -> Result<Vec<DVec2>, ImportError> {
        let numbers = self.numbers(name)?.unwrap_or_default();
        if !numbers.len().is_multiple_of(2) {
            return Err(self.wrong(name, "a list of pairs"));
        }
        Ok(numbers
            .as_chunks::<2>()
            .0
            .iter()
            .map(|&p| DVec2::from_array(p))
            .collect())
    }

    /// Three numbers as a colour, not negative.
    pub fn color_of(&self, name: &str, numbers: &[f64]) -> Result<Rgb, ImportError> {
        let color = match *numbers {
            [r, g, b] => DVec3::new(r, g, b).as_vec3(),
            [grey] => DVec3::splat(grey).as_vec3(),
            _ => return Err(self.wrong(name, "a colour")),
        };
        if color.is_finite() && color.min_element() >= 0.0 {
            Ok(color)
        } else {
            Err(self.wrong(name, "a colour: it has a negative component or one out of range"))
        }
    }
}

/// The values of a parameter, which are all of one type.
fn values(tokens: &[Token]) -> Option<Values> {
    match tokens.first().map(|token| &token.word) {
        Some(Word::Quoted(_)) => {
            let text = |token: &Token| match &token.word {
                Word::Quoted(text) => Some(text.clone()),
                _ => None,
            };
            tokens.iter().map(text).collect::<Option<_>>().map(Values::Texts)
        }
        Some(Word::Bare(word)) if matches!(word.as_str(), "true" | "false") => {
            let flag = |token: &Token| match &token.word {
                Word::Bare(word) => word.parse().ok(),
                _ => None,
            };
            tokens.iter().map(flag).collect::<Option<_>>().map(Values::Flags)
        }
        _ => tokens
            .iter()
            .map(number)
            .collect::<Option<_>>()
            .map(Values::Numbers),
    }
}

/// A finite number.
pub(super) fn number(token: &Token) -> Option<f64> {
    match &token.word {
        Word::Bare(word) => word.parse().ok().filter(|value: &f64| value.is_finite()),
        _ => None,
    }
}
