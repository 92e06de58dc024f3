//! Mitsuba's `.vol` files: grids of numbers.
//!
//! Little-endian: `VOL`, the version 3 as a byte; as `i32` the encoding (1: `f32`), voxels along x,
//! y and z, and channels; six `f32` for the least and greatest corner of a box; then the values,
//! channels fastest, then x, y, z.

use super::error::{ImportError, Location};
use super::loading::Loading;
use glam::Vec3;
use std::path::Path;

/// A grid of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeGrid {
    /// Voxels along each axis, at least one.
    pub resolution: [u32; 3],
    /// Values of a voxel, at least one.
    pub channels: u32,
    /// Least and greatest corner of the box that the file names: finite, of positive extent along
    /// each axis, or else the unit cube.
    pub bounds: [Vec3; 2],
    /// Finite values: channel `c` of voxel `(x, y, z)` at
    /// `((z · ny + y) · nx + x) · channels + c`.
    pub values: Vec<f32>,
}

/// Length of what stands before the values, in bytes.
const HEADER: usize = 48;

/// Reads a `.vol` file.
///
/// # Errors
///
/// The file cannot be read, or as [`parse_vol`].
pub fn read_vol(path: impl AsRef<Path>) -> Result<VolumeGrid, ImportError> {
    parse_vol(&Loading::of_file().read(path.as_ref())?, path)
}

/// Parses a `.vol` file in memory; `path` is for messages.
///
/// # Errors
///
/// Another format, version or encoding, a grid without voxels or too large to count, values that
/// are missing, too many, or not finite.
pub fn parse_vol(bytes: &[u8], path: impl AsRef<Path>) -> Result<VolumeGrid, ImportError> {
    let path = path.as_ref();
    let at = |byte: usize| Location::byte(path, byte as u64);
    let malformed = |byte, message: String| ImportError::malformed(at(byte), message);
    if !bytes.starts_with(b"VOL") {
        return Err(malformed(
            0,
            "no volume: the file does not start with `VOL`".to_owned(),
        ));
    }
    let Some((header, data)) = bytes.split_at_checked(HEADER) else {
        return Err(malformed(
            bytes.len(),
            "the file ends within its header".to_owned(),
        ));
    };
    if header[3] != 3 {
        let message = format!("version {} is not supported, only 3", header[3]);
        return Err(ImportError::unsupported(at(3), message));
    }
    let word = |index: usize| {
        let from = 4 + 4 * index;
        [header[from], header[from + 1], header[from + 2], header[from + 3]]
    };
    let encoding = i32::from_le_bytes(word(0));
    if encoding != 1 {
        let message = format!("encoding {encoding} is not supported, only 1 (32-bit floats)");
        return Err(ImportError::unsupported(at(4), message));
    }
    let mut counts = [0u32; 4];
    let mut expected = Some(4u64);
    for (index, (count, name)) in counts.iter_mut().zip(["x", "y", "z", "channels"]).enumerate() {
        let found = i32::from_le_bytes(word(1 + index));
        *count = u32::try_from(found).unwrap_or(0);
        if *count == 0 {
            let message = format!("{found} along {name}, where at least one is needed");
            return Err(malformed(8 + 4 * index, message));
        }
        expected = expected.and_then(|bytes| bytes.checked_mul(u64::from(*count)));
    }
    let [x, y, z, channels] = counts;
    // Compared before anything is allocated.
    if expected != Some(data.len() as u64) {
        let message = format!(
            "{x} × {y} × {z} voxels of {channels} values need {} bytes of data, the file has {}",
            expected.map_or("more than 2^64".to_owned(), |bytes| bytes.to_string()),
            data.len()
        );
        return Err(malformed(HEADER, message));
    }
    let number = |index| f32::from_le_bytes(word(index));
    let corner = |first| Vec3::new(number(first), number(first + 1), number(first + 2));
    let mut bounds = [corner(5), corner(8)];
    let extent = bounds[1] - bounds[0];
    if !(bounds.iter().all(|b| b.is_finite()) && extent.is_finite() && extent.min_element() > 0.0) {
        bounds = [Vec3::ZERO, Vec3::ONE];
    }
    let mut values = Vec::with_capacity(data.len() / 4);
    for (index, &bytes) in data.as_chunks::<4>().0.iter().enumerate() {
        let value = f32::from_le_bytes(bytes);
        if !value.is_finite() {
            return Err(malformed(HEADER + 4 * index, format!("the value {value}")));
        }
        values.push(value);
    }
    Ok(VolumeGrid {
        resolution: [x, y, z],
        channels,
        bounds,
        values,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of 2 × 1 × 2 voxels with the values 0, 1, 2, 3.
    fn sound() -> Vec<u8> {
        let mut bytes = b"VOL\x03".to_vec();
        for word in [1i32, 2, 1, 2, 1] {
            bytes.extend(word.to_le_bytes());
        }
        for number in [-1.0f32, -1.0, -1.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0] {
            bytes.extend(number.to_le_bytes());
        }
        bytes
    }

    #[test]
    fn a_sound_file_is_read() {
        let grid = parse_vol(&sound(), "a.vol").unwrap();
        assert_eq!((grid.resolution, grid.channels), ([2, 1, 2], 1));
        assert_eq!(grid.values, [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(grid.bounds, [Vec3::NEG_ONE, Vec3::new(1.0, 2.0, 3.0)]);
    }

    #[test]
    fn hostile_files_are_refused_with_the_place() {
        let with = |at: usize, word: [u8; 4]| {
            let mut bytes = sound();
            bytes[at..at + 4].copy_from_slice(&word);
            bytes
        };
        let cases: [(Vec<u8>, &str); 13] = [
            (Vec::new(), "byte 0: no volume"),
            (b"VOL".to_vec(), "byte 3: the file ends within its header"),
            (sound()[..40].to_vec(), "byte 40: the file ends within its header"),
            (with(0, *b"VOL\x02"), "byte 3: version 2 is not supported"),
            (with(4, 3i32.to_le_bytes()), "byte 4: encoding 3 is not supported"),
            (with(8, 0i32.to_le_bytes()), "byte 8: 0 along x"),
            (with(12, (-5i32).to_le_bytes()), "byte 12: -5 along y"),
            (
                with(20, i32::MIN.to_le_bytes()),
                "byte 20: -2147483648 along channels",
            ),
            (
                with(16, i32::MAX.to_le_bytes()),
                "byte 48: 2 × 1 × 2147483647 voxels of 1 values need 17179869176 bytes",
            ),
            (sound()[..60].to_vec(), "need 16 bytes of data, the file has 12"),
            (
                [sound(), vec![0]].concat(),
                "need 16 bytes of data, the file has 17",
            ),
            (with(52, f32::NAN.to_le_bytes()), "byte 52: the value NaN"),
            (with(60, f32::INFINITY.to_le_bytes()), "byte 60: the value inf"),
        ];
        for (bytes, expected) in cases {
            let message = parse_vol(&bytes, "a.vol").unwrap_err().to_string();
            assert!(message.contains(expected), "{message}\ninstead of {expected}");
        }
        // Counts whose product overflows 64 bits are no reason to allocate.
        let mut bytes = sound();
        bytes[8..24].copy_from_slice(&[0x7f; 16]);
        assert!(
            parse_vol(&bytes, "a.vol")
                .unwrap_err()
                .to_string()
                .contains("more than 2^64")
        );
    }

    #[test]
    fn a_box_that_is_none_is_the_unit_cube() {
        let mut bytes = sound();
        bytes[24..28].copy_from_slice(&f32::NAN.to_le_bytes());
        assert_eq!(
            parse_vol(&bytes, "a.vol").unwrap().bounds,
            [Vec3::ZERO, Vec3::ONE]
        );
    }
}
