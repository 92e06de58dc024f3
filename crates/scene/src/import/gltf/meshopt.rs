//! Buffer views compressed by `EXT_meshopt_compression` (Khronos' specification of the extension,
//! "Bitstream formats"): vertices, triangles and index sequences, and the filters of vertices.

/// What a compressed view says of itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Compressed<'a> {
    pub(super) mode: &'a str,
    pub(super) filter: &'a str,
    pub(super) count: usize,
    pub(super) stride: usize,
}

/// Largest stride that the format has.
const MOST_STRIDE: usize = 256;

/// The view's bytes, `count · stride`.
pub(super) fn decode(data: &[u8], view: Compressed) -> Result<Vec<u8>, String> {
    let Compressed {
        mode,
        filter,
        count,
        stride,
    } = view;
    let cut_short = || "a compressed buffer view ends in the middle of its data".to_owned();
    let mut bytes = match mode {
        "ATTRIBUTES" if stride.is_multiple_of(4) && (4..=MOST_STRIDE).contains(&stride) => {
            vertices(data, count, stride).ok_or_else(cut_short)?
        }
        "TRIANGLES" | "INDICES" if matches!(stride, 2 | 4) => {
            let indices = match mode {
                "TRIANGLES" => triangles(data, count),
                _ => sequence(data, count),
            };
            let indices = indices.ok_or_else(cut_short)?;
            let word = |index: u32| index.to_le_bytes().into_iter().take(stride);
            indices.into_iter().flat_map(word).collect()
        }
        _ => {
            return Err(format!(
                "a compressed buffer view of mode {mode} and stride {stride}"
            ));
        }
    };
    match filter {
        "OCTAHEDRAL" if stride == 4 => bytes.as_chunks_mut().0.iter_mut().for_each(octahedral8),
        "OCTAHEDRAL" if stride == 8 => bytes.as_chunks_mut().0.iter_mut().for_each(octahedral16),
        "EXPONENTIAL" => bytes.as_chunks_mut().0.iter_mut().for_each(exponential),
        // Rotations belong to animations, which nothing here reads.
        _ => {}
    }
    Ok(bytes)
}

/// Splits off the first bytes.
fn take<'a>(data: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (taken, rest) = data.split_at_checked(count)?;
    *data = rest;
    Some(taken)
}

/// Mode 0: blocks of elements, of which each byte is stored as differences in groups of sixteen.
fn vertices(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let (header, rest) = data.split_first()?;
    if *header != 0xa0 {
        return None;
    }
    let (mut data, tail) = rest.split_at_checked(rest.len().checked_sub(stride.max(32))?)?;
    // A group of no differences takes two bits.
    if count.div_ceil(64).checked_mul(stride)? > 4 * data.len().max(1) + 4 * stride {
        return None;
    }
    let mut last = tail[tail.len() - stride..].to_vec();
    let mut bytes = vec![0; count.checked_mul(stride)?];
    let most = ((8192 / stride) & !15).min(256);
    for block in bytes.chunks_mut(most * stride) {
        let elements = block.len() / stride;
        let groups = elements.div_ceil(16);
        for byte in 0..stride {
            let header = take(&mut data, groups.div_ceil(4))?;
            for group in 0..groups {
                let differences = group_of_16(&mut data, (header[group / 4] >> (group % 4 * 2)) & 3)?;
                let first = 16 * group;
                for (element, difference) in (first..elements).zip(differences) {
                    // Even numbers are positive.
                    let signed = (difference >> 1) ^ (difference & 1).wrapping_neg();
                    last[byte] = last[byte].wrapping_add(signed);
                    block[element * stride + byte] = last[byte];
                }
            }
        }
    }
    Some(bytes)
}

/// Sixteen differences of 0, 2, 4 or 8 bits; the greatest of 2 or 4 bits stands for a byte behind.
fn group_of_16(data: &mut &[u8], kind: u8) -> Option<[u8; 16]> {
    let bits = match kind {
        0 => return Some([0; 16]),
        1 => 2,
        2 => 4,
        _ => return take(data, 16)?.try_into().ok(),
    };
    let packed = take(data, 2 * bits)?;
    let escape = (1 << bits) - 1;
    let mut differences = [0; 16];
    for (i, difference) in differences.iter_mut().enumerate() {
        let shift = 8 - bits - i * bits % 8;
        let value = (packed[i * bits / 8] >> shift) & escape;
        *difference = if value == escape { take(data, 1)?[0] } else { value };
    }
    Some(differences)
}

/// A number of up to five bytes of seven bits.
fn variable(data: &mut &[u8]) -> Option<u32> {
    let mut value = 0_u32;
    for shift in [0, 7, 14, 21, 28] {
        let byte = take(data, 1)?[0];
        value |= u32::from(byte & 127).wrapping_shl(shift);
        if byte < 128 {
            break;
        }
    }
    Some(value)
}

/// A number as a difference from another.
fn from_last(data: &mut &[u8], last: u32) -> Option<u32> {
    let value = variable(data)?;
    Some(last.wrapping_add((value >> 1) ^ (value & 1).wrapping_neg()))
}

/// The last sixteen of something.
struct Recent<T> {
    items: [T; 16],
    next: usize,
}

impl<T: Copy + Default> Recent<T> {
    fn new() -> Self {
        Self {
            items: [T::default(); 16],
            next: 0,
        }
    }

    fn push(&mut self, item: T) {
        self.items[self.next & 15] = item;
        self.next += 1;
    }

    /// The item `back` before the next.
    fn back(&self, back: usize) -> T {
        self.items[self.next.wrapping_sub(back) & 15]
    }
}

/// Mode 1: triangles by edges and vertices that came before.
fn triangles(data: &[u8], count: usize) -> Option<Vec<u32>> {
    let (header, rest) = data.split_first()?;
    if *header != 0xe1 || !count.is_multiple_of(3) {
        return None;
    }
    let (codes, rest) = rest.split_at_checked(count / 3)?;
    let (mut data, table) = rest.split_at_checked(rest.len().checked_sub(16)?)?;
    let (mut edges, mut vertices) = (Recent::<[u32; 2]>::new(), Recent::<u32>::new());
    let (mut next, mut last) = (0_u32, 0_u32);
    let mut indices = Vec::with_capacity(count);
    for &code in codes {
        let fresh = |next: &mut u32| {
            let index = *next;
            *next = next.wrapping_add(1);
            index
        };
        let low = usize::from(code & 15);
        let [a, b, c] = if code < 0xf0 {
            let [a, b] = edges.back(1 + usize::from(code >> 4));
            let c = match low {
                0 => fresh(&mut next),
                1..13 => vertices.back(1 + low),
                13 => last.wrapping_sub(1),
                14 => last.wrapping_add(1),
                _ => from_last(&mut data, last)?,
            };
            if low >= 13 {
                last = c;
            }
            if low == 0 || low >= 13 {
                vertices.push(c);
            }
            edges.push([c, b]);
            edges.push([a, c]);
            indices.extend([a, b, c]);
            continue;
        } else if code < 0xfe {
            let kinds = table[low];
            let kinds = [0, kinds >> 4, kinds & 15].map(usize::from);
            let a = fresh(&mut next);
            // As the vertices are before any of this triangle.
            let [b, c] = [kinds[1], kinds[2]].map(|kind| match kind {
                0 => fresh(&mut next),
                _ => vertices.back(kind),
            });
            for (kind, index) in kinds.into_iter().zip([a, b, c]) {
                if kind == 0 {
                    vertices.push(index);
                }
            }
            [a, b, c]
        } else {
            let kinds = take(&mut data, 1)?[0];
            if kinds == 0 {
                next = 0;
            }
            let kinds = [if code == 0xfe { 0 } else { 15 }, kinds >> 4, kinds & 15].map(usize::from);
            let mut triangle = kinds.map(|kind| match kind {
                0 => fresh(&mut next),
                15 => 0,
                _ => vertices.back(kind),
            });
            for (kind, index) in kinds.into_iter().zip(&mut triangle) {
                if kind == 15 {
                    last = from_last(&mut data, last)?;
                    *index = last;
                }
            }
            for (kind, index) in kinds.into_iter().zip(triangle) {
                if kind == 0 || kind == 15 {
                    vertices.push(index);
                }
            }
            triangle
        };
        edges.push([b, a]);
        edges.push([c, b]);
        edges.push([a, c]);
        indices.extend([a, b, c]);
    }
    Some(indices)
}

/// Mode 2: indices by differences from one of two.
fn sequence(data: &[u8], count: usize) -> Option<Vec<u32>> {
    let (header, rest) = data.split_first()?;
    if *header != 0xd1 || count > rest.len() {
        return None;
    }
    let mut data = rest;
    let mut last = [0_u32; 2];
    let mut one = || {
        let value = variable(&mut data)?;
        let (which, value) = ((value & 1) as usize, value >> 1);
        last[which] = last[which].wrapping_add((value >> 1) ^ (value & 1).wrapping_neg());
        Some(last[which])
    };
    (0..count).map(|_| one()).collect()
}

/// A direction from the octahedron `|x| + |y| + |z| = z_stored` to the sphere of radius `most`.
fn direction([x, y, z]: [f32; 3], most: f32) -> [f32; 3] {
    let z = z - x.abs() - y.abs();
    let fold = z.min(0.0);
    let folded = |x: f32| if x >= 0.0 { x + fold } else { x - fold };
    let (x, y) = (folded(x), folded(y));
    let length = (x * x + y * y + z * z).sqrt();
    let scale = if length > 0.0 { most / length } else { 0.0 };
    [x, y, z].map(|x| (x * scale).round())
}

fn octahedral8(bytes: &mut [u8; 4]) {
    let [x, y, z, _] = bytes.map(|byte| f32::from(byte as i8));
    for (byte, value) in bytes.iter_mut().zip(direction([x, y, z], 127.0)) {
        *byte = value as i8 as u8;
    }
}

fn octahedral16(bytes: &mut [u8; 8]) {
    let half = |i: usize| f32::from(i16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]));
    let found = direction([half(0), half(1), half(2)], 32767.0);
    for (i, value) in found.into_iter().enumerate() {
        [bytes[2 * i], bytes[2 * i + 1]] = (value as i16).to_le_bytes();
    }
}

/// A mantissa of 24 bits and an exponent of 8 to a float.
fn exponential(bytes: &mut [u8; 4]) {
    let word = i32::from_le_bytes(*bytes);
    let (exponent, mantissa) = (word >> 24, (word << 8) >> 8);
    let value = f64::from(mantissa) * f64::from(exponent).exp2();
    *bytes = (value as f32).to_le_bytes();
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four elements of four bytes: the first byte by raw groups, the second by two bits with an
    /// escape, the third by four bits, the fourth without differences.
    #[test]
    fn vertices_are_sums_of_differences() {
        let mut data = vec![0xa0];
        let raw: Vec<u8> = [2, 2, 1, 4].into_iter().chain([0; 12]).collect();
        data.push(3);
        data.extend(&raw);
        // 2, then an escape for 9, 0, 1.
        data.extend([1, 0b1011_0001, 0, 0, 0, 9]);
        // 15 escapes to 200: 3, 0, 200, 1.
        data.extend([2, 0x30, 0xf1, 0, 0, 0, 0, 0, 0, 200]);
        data.push(0);
        let mut tail = vec![0; 28];
        tail.extend([10, 20, 30, 40]);
        data.extend(tail);
        let view = Compressed {
            mode: "ATTRIBUTES",
            filter: "NONE",
            count: 4,
            stride: 4,
        };
        let bytes = decode(&data, view).unwrap();
        let column = |byte: usize| -> Vec<u8> { bytes.iter().skip(byte).step_by(4).copied().collect() };
        assert_eq!(column(0), [11, 12, 11, 13]);
        assert_eq!(column(1), [21, 16, 16, 15]);
        assert_eq!(column(2), [28, 28, 128, 127]);
        assert_eq!(column(3), [40; 4]);
    }

    /// A triangle of three new vertices, and one beside it over its last edge.
    #[test]
    fn triangles_share_edges() {
        let mut data = vec![0xe1, 0xf0, 0x00];
        data.extend([0; 16]);
        let view = Compressed {
            mode: "TRIANGLES",
            filter: "NONE",
            count: 6,
            stride: 2,
        };
        let bytes = decode(&data, view).unwrap();
        let indices: Vec<u8> = bytes.iter().step_by(2).copied().collect();
        assert_eq!(indices, [0, 1, 2, 0, 2, 3]);
    }

    #[test]
    fn sequences_follow_two_bases() {
        // 5 from the first, 7 from the second, 4 from the first, by zigzag and base bit.
        let data = [0xd1, 20, 29, 2, 0, 0, 0, 0];
        let view = Compressed {
            mode: "INDICES",
            filter: "NONE",
            count: 3,
            stride: 4,
        };
        let bytes = decode(&data, view).unwrap();
        let words: Vec<u32> = bytes
            .as_chunks()
            .0
            .iter()
            .map(|w| u32::from_le_bytes(*w))
            .collect();
        assert_eq!(words, [5, 7, 4]);
    }

    #[test]
    fn filters_give_unit_directions_and_floats() {
        let mut up = [0, 0, 127, 0];
        octahedral8(&mut up);
        assert_eq!(up, [0, 0, 127, 0]);
        // 127 · 64 / √(64² + 63²) = 90.5.
        let mut slanted = [64, 0, 127, 5];
        octahedral8(&mut slanted);
        assert_eq!(slanted.map(|b| b as i8), [91, 0, 89, 5]);
        let mut number = (3 | (-1_i32 << 24)).to_le_bytes();
        exponential(&mut number);
        assert_eq!(f32::from_le_bytes(number), 1.5);
    }

    #[test]
    fn damaged_views_never_panic() {
        for mode in ["ATTRIBUTES", "TRIANGLES", "INDICES", "OTHER"] {
            for seed in 0..2_000_u32 {
                let byte = |i: u32| (seed.wrapping_mul(2_654_435_761).wrapping_add(i * 40_503) >> 7) as u8;
                let mut data: Vec<u8> = (0..seed % 90).map(byte).collect();
                if let Some(first) = data.first_mut() {
                    *first = [0xa0, 0xe1, 0xd1, 0][(seed % 4) as usize];
                }
                let stride = [2, 4, 8, 12][(seed / 4 % 4) as usize];
                let count = (seed / 16 % 50) as usize;
                let view = Compressed {
                    mode,
                    filter: "EXPONENTIAL",
                    count,
                    stride,
                };
                if let Ok(bytes) = decode(&data, view) {
                    assert_eq!(bytes.len(), count * stride);
                }
            }
        }
    }
}
