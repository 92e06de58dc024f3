//! Errors as one line.

use std::error::Error;

/// An error and its sources, separated by colons; a source that its error already quotes is not
/// repeated.
pub fn chain(error: &dyn Error) -> String {
    let mut message = error.to_string();
    let mut source = error.source();
    while let Some(error) = source {
        let cause = error.to_string();
        if !message.ends_with(&cause) {
            message = format!("{message}: {cause}");
        }
        source = error.source();
    }
    message
}
