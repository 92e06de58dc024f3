//! Lines for a reader who may have gone: a closed stream is no reason to panic.

use std::fmt::Display;
use std::io::{ErrorKind, Result, Write, stderr, stdout};

/// Writes a line on the standard output. That nobody reads it is no error, a full disk is.
pub fn say(text: impl Display) -> Result<()> {
    let mut out = stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        outcome => outcome,
    }
}

/// Writes a line on the standard error stream, if it can be written to.
pub fn complain(text: impl Display) {
    writeln!(stderr().lock(), "{text}").ok();
}
