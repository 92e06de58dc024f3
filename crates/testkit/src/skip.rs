//! Tests that need something which not every machine has.

use std::fmt::Display;

/// What was found. If nothing was found, prints that the test is skipped and returns `None`; fails
/// if the environment variable `required` is 1.
///
/// # Panics
/// Where it is required and not found.
pub fn found_or_skipped<T, E: Display>(found: Result<T, E>, required: &str) -> Option<T> {
    match found {
        Ok(found) => Some(found),
        Err(error) => {
            let is_required = std::env::var(required).is_ok_and(|value| value == "1");
            assert!(!is_required, "{required}=1, but {error}");
            println!("SKIPPED: {error}");
            None
        }
    }
}
