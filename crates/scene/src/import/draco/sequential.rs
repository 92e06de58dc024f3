//! Triangles one after another, by the numbers of their points.

use super::bits::Reader;
use super::{Connectivity, Fault, INVALID, Spend};
use crate::import::limits::LoadResource;

pub(super) fn decode(reader: &mut Reader, spend: &Spend) -> Result<Connectivity, Fault> {
    let (count, point_count) = (reader.variable()?, reader.variable()?);
    let count = count as usize;
    spend(LoadResource::Bytes, 12 * (count as u64 + u64::from(point_count)))?;
    let is_plain = reader.u8()? == 1;
    let mut indices = Vec::new();
    if is_plain {
        // Three bytes a triangle at least.
        if count > reader.left() / 3 {
            return Err(super::CUT_SHORT.into());
        }
        indices.reserve(3 * count);
        for _ in 0..3 * count {
            indices.push(match point_count {
                0..256 => u32::from(reader.u8()?),
                256..0x1_0000 => u32::from(reader.u16()?),
                0x1_0000..0x20_0000 => reader.variable()?,
                _ => reader.i32()? as u32,
            });
        }
    } else {
        let mut last = 0_i64;
        for symbol in reader.symbols(3 * count, 1, spend)? {
            let step = i64::from(symbol >> 1);
            last += if symbol & 1 == 1 { -step } else { step };
            indices.push(u32::try_from(last).map_err(|_| INVALID)?);
        }
    }
    if indices.iter().any(|&index| index >= point_count) {
        return Err(INVALID.into());
    }
    Ok(Connectivity {
        triangles: indices.as_chunks().0.to_vec(),
        point_count: point_count as usize,
        corners: None,
    })
}
