//! A method by name, or the demand to choose one.

use super::candidates::restricted;
use crate::registry::{Method, MethodError};
use std::fmt;
use std::str::FromStr;

/// The demand to choose a method, with options that restrict the choice to methods that take them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Auto {
    given: Vec<(String, String)>,
}

impl Auto {
    /// The name by which it is asked for.
    pub const NAME: &'static str = "auto";

    /// Sets an option of the method that will be chosen: it is one that takes it, with this value.
    ///
    /// # Errors
    /// [`MethodError::Option`] if no candidate takes it with those that were set before.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), MethodError> {
        let mut given = self.given.clone();
        given.retain(|(other, _)| other != name);
        given.push((name.to_owned(), value.to_owned()));
        if restricted(&given).is_empty() {
            return Err(MethodError::Option {
                method: Self::NAME,
                given: name.to_owned(),
                reason: "no method that may be chosen takes it".to_owned(),
            });
        }
        self.given = given;
        Ok(())
    }

    /// What was set, in order.
    pub fn given(&self) -> &[(String, String)] {
        &self.given
    }
}

impl fmt::Display for Auto {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(Self::NAME)?;
        let mut given = self.given.iter();
        given.try_for_each(|(name, value)| write!(f, ":{name}={value}"))
    }
}

/// A method by name, or `auto`.
///
/// ```
/// use lightshed_integrator::MethodRequest;
/// let request: MethodRequest = "auto:lights=bvh".parse()?;
/// assert!(matches!(request, MethodRequest::Auto(_)));
/// assert_eq!(request.to_string(), "auto:lights=bvh");
/// assert!(matches!("path:bvh".parse()?, MethodRequest::Method(_)));
/// assert!("auto:smis=spatial".parse::<MethodRequest>().is_err());
/// # Ok::<(), lightshed_integrator::MethodError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MethodRequest {
    /// Whichever is best.
    Auto(Auto),
    /// This one.
    Method(Method),
}

impl MethodRequest {
    /// The name that was given.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Auto(_) => Auto::NAME,
            Self::Method(method) => method.name(),
        }
    }

    /// Sets an option, see [`Auto::set`] and [`Method::set`].
    ///
    /// # Errors
    /// Theirs.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), MethodError> {
        match self {
            Self::Auto(auto) => auto.set(name, value),
            Self::Method(method) => method.set(name, value),
        }
    }
}

impl fmt::Display for MethodRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto(auto) => auto.fmt(f),
            Self::Method(method) => method.fmt(f),
        }
    }
}

impl FromStr for MethodRequest {
    type Err = MethodError;

    /// `auto[:option=value]…`, or the text of a [`Method`].
    fn from_str(text: &str) -> Result<Self, MethodError> {
        let mut parts = text.split(':');
        if parts.next() != Some(Auto::NAME) {
            return text.parse().map(Self::Method);
        }
        let mut auto = Auto::default();
        for part in parts {
            // A switch's name alone turns it on.
            let (name, value) = part.split_once('=').unwrap_or((part, "true"));
            auto.set(name, value)?;
        }
        Ok(Self::Auto(auto))
    }
}
