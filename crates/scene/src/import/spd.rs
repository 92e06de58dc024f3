//! Spectra in `.spd` files: a wavelength in nanometres and a value a line.

use super::error::{ImportError, Location};
use std::path::Path;

/// The values by wavelength, both as they stand in the file. A `#` begins a comment.
pub(super) fn values(bytes: &[u8], path: &Path) -> Result<Vec<[String; 2]>, ImportError> {
    let text = String::from_utf8_lossy(bytes);
    let mut values = Vec::new();
    for (line, number) in text.lines().zip(1..) {
        let content = line.split('#').next().unwrap_or_default();
        match content.split_ascii_whitespace().collect::<Vec<_>>()[..] {
            [] => {}
            [wavelength, value] => values.push([wavelength.to_owned(), value.to_owned()]),
            _ => {
                let message = "expected a wavelength and a value";
                return Err(ImportError::malformed(Location::line(path, number), message));
            }
        }
    }
    if values.is_empty() {
        return Err(ImportError::malformed(
            Location::file(path),
            "a spectrum without values",
        ));
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_values() {
        let found = values(b"# copper\n400 1.5\n\n  500\t2e0 # green\r\n", Path::new("s.spd"));
        assert_eq!(found.unwrap(), [["400", "1.5"], ["500", "2e0"]]);
        let error = |text: &str| {
            values(text.as_bytes(), Path::new("s.spd"))
                .unwrap_err()
                .to_string()
        };
        assert!(error("400 1\n500").contains("s.spd:2"));
        assert!(error("# nothing").contains("without values"));
    }
}
