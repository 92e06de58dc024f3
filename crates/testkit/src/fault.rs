//! Planted faults: a test that has never been seen to fail says nothing.
//!
//! A property is written over `Option<F>`; `F` enumerates the faults that can be planted in the
//! code under test (drop the Jacobian, divide by M twice, …). [`check_faults`] demands that the
//! property holds with `None` and fails with every `Some`.

use core::any::Any;
use core::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A planted fault, and the message with which the property failed under it.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct CaughtFault<F> {
    /// The fault.
    pub fault: F,
    /// What the property said.
    pub message: String,
}

/// Why a property is not a test of these faults.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultError {
    /// The property fails without any fault.
    FailsWithoutFault(String),
    /// The property holds although the named fault is planted.
    NotCaught(String),
}

impl fmt::Display for FaultError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FailsWithoutFault(message) => write!(f, "fails without a planted fault: {message}"),
            Self::NotCaught(fault) => write!(f, "does not notice the planted fault {fault}"),
        }
    }
}

impl std::error::Error for FaultError {}

/// Runs `property` without a fault (it must hold) and with each of `faults` (it must fail, by `Err`
/// or by a panic).
///
/// ```
/// use lightshed_testkit::check_faults;
///
/// let caught = check_faults(&["off by one"], |fault| {
///     let sum: u32 = (1..=10).sum::<u32>() + u32::from(fault.is_some());
///     if sum == 55 { Ok(()) } else { Err(format!("sum is {sum}")) }
/// })
/// .unwrap();
/// assert!(caught[0].message.contains("sum is 56"));
/// ```
///
/// # Errors
/// [`FaultError::FailsWithoutFault`] and [`FaultError::NotCaught`].
pub fn check_faults<F, T, E>(
    faults: &[F],
    property: impl Fn(Option<F>) -> Result<T, E>,
) -> Result<Vec<CaughtFault<F>>, FaultError>
where
    F: Copy + fmt::Debug,
    E: fmt::Debug,
{
    let run = |fault: Option<F>| -> Result<(), String> {
        match catch_unwind(AssertUnwindSafe(|| property(fault))) {
            Ok(Ok(_)) => Ok(()),
            Ok(Err(error)) => Err(format!("{error:?}")),
            Err(payload) => Err(panic_message(&*payload)),
        }
    };
    run(None).map_err(FaultError::FailsWithoutFault)?;
    faults
        .iter()
        .map(|&fault| match run(Some(fault)) {
            Ok(()) => Err(FaultError::NotCaught(format!("{fault:?}"))),
            Err(message) => Ok(CaughtFault { fault, message }),
        })
        .collect()
}

fn panic_message(payload: &(dyn Any + Send)) -> String {
    if let Some(message) = payload.downcast_ref::<&str>() {
        (*message).to_owned()
    } else if let Some(message) = payload.downcast_ref::<String>() {
        message.clone()
    } else {
        "panic without a message".to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn catches_errors_and_panics() {
        let caught = check_faults(&[1, 2], |fault: Option<i32>| match fault {
            None => Ok(()),
            Some(1) => Err("by error".to_owned()),
            Some(n) => panic!("by panic {n}"),
        })
        .unwrap();
        assert!(caught[0].message.contains("by error"));
        assert!(caught[1].message.contains("by panic 2"));
    }

    #[test]
    fn a_property_that_cannot_fail_is_reported() {
        let result = check_faults(&["dropped Jacobian"], |_| Ok::<_, ()>(()));
        assert_eq!(
            result,
            Err(FaultError::NotCaught("\"dropped Jacobian\"".to_owned()))
        );
    }

    #[test]
    fn a_property_that_always_fails_is_reported() {
        let result = check_faults(&["any"], |_| Err::<(), _>("broken"));
        assert!(matches!(result, Err(FaultError::FailsWithoutFault(_))));
    }
}
