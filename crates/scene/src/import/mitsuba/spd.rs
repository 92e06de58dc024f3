//! Spectra in `.spd` files: a wavelength in nanometres and a value a line.

use crate::import::error::{ImportError, Location};
use crate::import::loading::Loading;
use crate::import::xml::Node;
use std::path::Path;

/// Puts the values of spectra that stand in files in place of the files' names.
pub(super) fn read_spectra(node: &mut Node, loading: &Loading) -> Result<(), ImportError> {
    let file = node.attribute("filename").filter(|_| node.tag == "spectrum");
    if let Some(path) = file.map(|file| node.resolve(file, loading)) {
        let values = (loading.read(&path)).and_then(|bytes| values(&bytes, &path));
        let values = values.map_err(|source| ImportError::Referenced {
            location: node.location(),
            source: Box::new(source),
        })?;
        let attributes = node.attributes.iter_mut();
        for attribute in attributes.filter(|(name, _)| name == "filename") {
            *attribute = ("value".to_owned(), values.clone());
        }
    }
    let mut children = node.children.iter_mut();
    children.try_for_each(|child| read_spectra(child, loading))
}

/// The contents of a file in the form of the attribute `value`. A `#` begins a comment.
fn values(bytes: &[u8], path: &Path) -> Result<String, ImportError> {
    let text = String::from_utf8_lossy(bytes);
    let mut values = String::new();
    for (line, number) in text.lines().zip(1..) {
        let content = line.split('#').next().unwrap_or_default();
        match content.split_ascii_whitespace().collect::<Vec<_>>()[..] {
            [] => {}
            [wavelength, value] => values += &format!("{wavelength}:{value} "),
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
    fn lines_become_values() {
        let found = values(b"# copper\n400 1.5\n\n  500\t2e0 # green\r\n", Path::new("s.spd"));
        assert_eq!(found.unwrap(), "400:1.5 500:2e0 ");
        let error = |text: &str| {
            values(text.as_bytes(), Path::new("s.spd"))
                .unwrap_err()
                .to_string()
        };
        assert!(error("400 1\n500").contains("s.spd:2"));
        assert!(error("# nothing").contains("without values"));
    }
}
