//! Files compressed by gzip (RFC 1952).

use super::error::{ImportError, Location};
use super::limits::LoadResource;
use super::loading::Loading;
use miniz_oxide::inflate::decompress_to_vec_with_limit;
use std::path::Path;

/// The contents of a file: decompressed where it is compressed, else as they are.
pub(super) fn contents(bytes: Vec<u8>, path: &Path, loading: &Loading) -> Result<Vec<u8>, ImportError> {
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(bytes);
    }
    let stream = stream(&bytes)
        .ok_or_else(|| ImportError::malformed(Location::file(path), "the head of gzip is damaged"))?;
    // Deflate makes of a byte 1,032 at most.
    let most = (stream.len() as u64)
        .saturating_mul(1032)
        .min(loading.bytes_left());
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    let found = decompress_to_vec_with_limit(stream, most);
    let found = found.map_err(|error| {
        let message = format!("it cannot be decompressed: {error}");
        ImportError::malformed(Location::file(path), message)
    })?;
    loading.spend(LoadResource::Bytes, found.len() as u64, || Location::file(path))?;
    Ok(found)
}

/// What is behind the head.
fn stream(bytes: &[u8]) -> Option<&[u8]> {
    let [0x1f, 0x8b, 8, flags, rest @ ..] = bytes else {
        return None;
    };
    // Time, level and system.
    let mut rest = rest.get(6..)?;
    if flags & 4 != 0 {
        let (length, after) = rest.split_first_chunk()?;
        rest = after.get(usize::from(u16::from_le_bytes(*length))..)?;
    }
    // Name and comment, each with a zero behind it.
    for text in [8, 16] {
        if flags & text != 0 {
            let end = rest.iter().position(|&byte| byte == 0)?;
            rest = &rest[end + 1..];
        }
    }
    if flags & 2 != 0 { rest.get(2..) } else { Some(rest) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_head_is_passed() {
        let text = b"WorldBegin ".repeat(50);
        let body = miniz_oxide::deflate::compress_to_vec(&text, 6);
        let read = |bytes: Vec<u8>| contents(bytes, Path::new("f.gz"), &Loading::of_file());
        for flags in [0_u8, 4, 8, 16, 2, 4 | 8 | 16 | 2] {
            let mut file = vec![0x1f, 0x8b, 8, flags, 1, 2, 3, 4, 0, 255];
            if flags & 4 != 0 {
                file.extend([2, 0, 7, 7]);
            }
            if flags & 8 != 0 {
                file.extend(b"name\0");
            }
            if flags & 16 != 0 {
                file.extend(b"\0");
            }
            if flags & 2 != 0 {
                file.extend([9, 9]);
            }
            for length in 2..file.len() {
                assert!(read(file[..length].to_vec()).is_err(), "{flags} {length}");
            }
            file.extend(&body);
            assert_eq!(read(file).unwrap(), text, "{flags}");
        }
        assert_eq!(read(b"plain".to_vec()).unwrap(), b"plain");
    }
}
