//! What integration tests share: the folders of external data, and reading NumPy archives of
//! reference moments.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The folder that an environment variable names, or `None` after saying that the test is skipped.
pub fn data_folder(variable: &str) -> Option<PathBuf> {
    let folder = std::env::var_os(variable).map(PathBuf::from);
    if folder.is_none() {
        println!("SKIPPED: {variable} is not set");
    }
    folder
}

/// A reference image with the variance of its pixels' means, from an `.npz` archive with the arrays
/// `mean`, `var_of_mean` (height × width × 3) and `spp`.
pub struct ReferenceMoments {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Means, rows after each other from the top, channels interleaved.
    pub mean: Vec<f64>,
    /// Variance of each of the means.
    pub variance_of_mean: Vec<f64>,
    /// Samples in each pixel.
    pub samples_per_pixel: u64,
}

impl ReferenceMoments {
    /// Reads the archive. A test that has data must not pass without it, so anything unexpected
    /// panics.
    pub fn read(path: &Path) -> Self {
        let file = File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut archive = zip::ZipArchive::new(file).unwrap();
        let mut array = |name: &str| {
            let mut bytes = Vec::new();
            archive.by_name(name).unwrap().read_to_end(&mut bytes).unwrap();
            parse_npy(&bytes).unwrap_or_else(|| panic!("{}: {name} cannot be read", path.display()))
        };
        let (shape, mean) = array("mean.npy");
        let (variance_shape, variance_of_mean) = array("var_of_mean.npy");
        let (_, spp) = array("spp.npy");
        assert_eq!((shape.len(), shape[2], &shape), (3, 3, &variance_shape));
        let samples_per_pixel = spp[0] as u64;
        Self {
            width: shape[1],
            height: shape[0],
            mean,
            variance_of_mean,
            samples_per_pixel,
        }
    }
}

/// Shape and values of a little-endian, row-major array in NumPy's format: ten bytes, a header, the
/// values.
fn parse_npy(bytes: &[u8]) -> Option<(Vec<usize>, Vec<f64>)> {
    let rest = bytes.strip_prefix(b"\x93NUMPY\x01\x00")?;
    let (length, rest) = rest.split_first_chunk::<2>()?;
    let (header, values) = rest.split_at_checked(usize::from(u16::from_le_bytes(*length)))?;
    let header = std::str::from_utf8(header).ok()?;
    let between = |before: &str, after: &str| Some(header.split_once(before)?.1.split_once(after)?.0);
    if between("'fortran_order': ", ",")? != "False" {
        return None;
    }
    let shape = between("'shape': (", ")")?
        .split(',')
        .map(str::trim)
        .filter(|size| !size.is_empty());
    let shape: Vec<usize> = shape.map(|size| size.parse().ok()).collect::<Option<_>>()?;
    let values: Vec<f64> = match between("'descr': '", "'")? {
        "<f4" => values
            .as_chunks()
            .0
            .iter()
            .map(|&v| f64::from(f32::from_le_bytes(v)))
            .collect(),
        "<f8" => values
            .as_chunks()
            .0
            .iter()
            .map(|&v| f64::from_le_bytes(v))
            .collect(),
        "<i8" => values
            .as_chunks()
            .0
            .iter()
            .map(|&v| i64::from_le_bytes(v) as f64)
            .collect(),
        _ => return None,
    };
    (values.len() == shape.iter().product::<usize>()).then_some((shape, values))
}
