//! Errors as one line.

use crate::error_chain::chain;
use std::error::Error;
use std::fmt;

/// A message for the user, on one line.
#[derive(Debug)]
pub struct Failure(String);

impl Failure {
    /// A message that stands for itself.
    pub fn new(message: impl fmt::Display) -> Self {
        Self(one_line(&message.to_string()))
    }

    /// `what`, then the error and everything behind it.
    pub fn because(what: impl fmt::Display, error: &dyn Error) -> Self {
        Self::new(format_args!("{what}: {}", chain(error)))
    }
}

impl<E: Error> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::new(chain(&error))
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The text with line breaks and runs of blanks turned into single blanks.
pub fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
