//! Values of attributes: integers that predictions were subtracted from, then what they stand for.

use super::bits::{Reader, signed};
use super::layout::{Layout, Positions};
use super::octahedron::Octahedron;
use super::order;
use super::undo::Undo;
use super::{
    Attribute, Connectivity, Fault, INVALID, Kind, Mesh, Spend, normals, prediction, texture_coordinates,
};
use crate::import::limits::LoadResource;

/// What a file says of an attribute.
struct Header {
    /// 0 is a position.
    meaning: u8,
    kind: Kind,
    width: usize,
    id: u32,
    storage: Storage,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Storage {
    Bytes,
    Integers,
    Quantized,
    Normals,
}

/// Where a group of attributes is stored: number of the attribute data, −1 for positions; whether
/// by corners; and the order.
struct Place {
    data: i8,
    is_by_corner: bool,
    order: u8,
}

pub(super) fn decode(reader: &mut Reader, connectivity: Connectivity, spend: &Spend) -> Result<Mesh, Fault> {
    let Connectivity {
        triangles,
        point_count,
        corners,
    } = connectivity;
    let group_count = reader.u8()?;
    let mut places = Vec::new();
    if corners.is_some() {
        for _ in 0..group_count {
            places.push(Place {
                data: reader.u8()? as i8,
                is_by_corner: reader.u8()? != 0,
                order: reader.u8()?,
            });
        }
    }
    let mut groups = Vec::new();
    for _ in 0..group_count {
        groups.push(headers(reader)?);
    }
    let mut attributes = Vec::new();
    let mut positions = None;
    for (group, headers) in groups.iter().enumerate() {
        let layout = match &corners {
            Some(corners) => {
                let place = &places[group];
                let data = usize::try_from(place.data).ok();
                let used = match (place.is_by_corner, data) {
                    (false, None) => &corners.base,
                    (false, Some(data)) if data < corners.cut.len() => &corners.base,
                    (true, Some(data)) => corners.cut.get(data).ok_or(INVALID)?,
                    _ => return Err(INVALID.into()),
                };
                Some(Layout {
                    corners: used,
                    order: match (place.order, place.is_by_corner) {
                        (0, _) => order::depth_first(used),
                        (1, false) => order::by_degree(used),
                        _ => return Err(INVALID.into()),
                    },
                })
            }
            None => None,
        };
        let count = layout
            .as_ref()
            .map_or(point_count, |layout| layout.order.corners.len());
        let mut integers = Vec::with_capacity(headers.len());
        for header in headers {
            let size = (count as u64).saturating_mul(header.width as u64 * 12);
            spend(LoadResource::Bytes, size)?;
            let values = portable(reader, header, count, layout.as_ref(), positions.as_ref(), spend)?;
            if header.meaning == 0
                && header.width == 3
                && positions.is_none()
                && let (Portable::Integers(values, _), Some(layout)) = (&values, &layout)
            {
                positions = Some(Positions::new(layout, values.clone()));
            }
            integers.push(values);
        }
        for (header, values) in headers.iter().zip(integers) {
            let bytes = restore(reader, header, values)?;
            let size = header.width * header.kind.size();
            // A value for each of the points.
            let bytes = match (&layout, &corners) {
                (Some(layout), Some(corners)) => {
                    let mut of_points = Vec::with_capacity(point_count * size);
                    for &corner in &corners.corner_of_point {
                        let first = layout.value(corner) * size;
                        of_points.extend_from_slice(&bytes[first..first + size]);
                    }
                    of_points
                }
                _ => bytes,
            };
            attributes.push(Attribute {
                id: header.id,
                kind: header.kind,
                width: header.width,
                bytes,
            });
        }
    }
    Ok(Mesh {
        triangles,
        point_count,
        attributes,
    })
}

fn headers(reader: &mut Reader) -> Result<Vec<Header>, Fault> {
    let count = reader.variable()? as usize;
    if count > reader.left() / 5 {
        return Err(super::CUT_SHORT.into());
    }
    let mut headers = Vec::with_capacity(count);
    for _ in 0..count {
        let meaning = reader.u8()?;
        let kind = Kind::of(reader.u8()?).ok_or("an attribute of numbers of 64 bits")?;
        let width = usize::from(reader.u8()?);
        let _normalized = reader.u8()?;
        if !(1..=16).contains(&width) {
            return Err("an attribute of more than 16 components".into());
        }
        headers.push(Header {
            meaning,
            kind,
            width,
            id: reader.variable()?,
            storage: Storage::Bytes,
        });
    }
    for header in &mut headers {
        header.storage = match reader.u8()? {
            0 => Storage::Bytes,
            1 => Storage::Integers,
            2 if header.kind == Kind::F32 => Storage::Quantized,
            3 if header.kind == Kind::F32 && header.width == 3 => Storage::Normals,
            _ => return Err(INVALID.into()),
        };
    }
    Ok(headers)
}

/// Values before they are restored.
enum Portable {
    Bytes(Vec<u8>),
    /// With the components of a value.
    Integers(Vec<i32>, usize),
}

fn portable(
    reader: &mut Reader,
    header: &Header,
    count: usize,
    layout: Option<&Layout>,
    positions: Option<&Positions>,
    spend: &Spend,
) -> Result<Portable, Fault> {
    if header.storage == Storage::Bytes {
        let bytes = reader.take(count * header.width * header.kind.size())?;
        return Ok(Portable::Bytes(bytes.to_vec()));
    }
    let width = match header.storage {
        Storage::Normals => 2,
        _ => header.width,
    };
    let method = reader.u8()? as i8;
    let undo = if method == -2 { None } else { Some(reader.u8()?) };
    let is_normal = header.storage == Storage::Normals;
    if undo.is_some_and(|undo| (undo == 3) != is_normal) {
        return Err(INVALID.into());
    }
    let mut values = stored(reader, count, width, undo == Some(3), spend)?;
    let Some(undo) = undo else {
        return Ok(Portable::Integers(values, width));
    };
    match (method, layout) {
        // What needs triangles is a difference without them.
        (0, _) | (1 | 4..=6, None) => {
            let undo = Undo::read(reader, undo)?;
            prediction::differences(&mut values, width, undo);
        }
        (1, Some(layout)) => {
            let undo = Undo::read(reader, undo)?;
            prediction::parallelograms(&mut values, width, layout, undo);
        }
        (4, Some(layout)) => prediction::chosen_parallelograms(&mut values, width, layout, reader, undo)?,
        (5, Some(layout)) if width == 2 => {
            let positions = positions.ok_or(INVALID)?;
            texture_coordinates::restore(&mut values, layout, positions, reader, undo)?;
        }
        (6, Some(layout)) if is_normal => {
            let positions = positions.ok_or(INVALID)?;
            normals::restore(&mut values, layout, positions, reader)?;
        }
        _ => return Err("an unknown prediction of attributes".into()),
    }
    Ok(Portable::Integers(values, width))
}

/// Numbers as they stand in the file.
fn stored(
    reader: &mut Reader,
    count: usize,
    width: usize,
    is_positive: bool,
    spend: &Spend,
) -> Result<Vec<i32>, Fault> {
    let raw = if reader.u8()? > 0 {
        reader.symbols(count * width, width, spend)?
    } else {
        let size = usize::from(reader.u8()?);
        if !(1..=4).contains(&size) {
            return Err(INVALID.into());
        }
        let bytes = reader.take(count * width * size)?;
        let number = |bytes: &[u8]| {
            bytes
                .iter()
                .rev()
                .fold(0, |value, &byte| value << 8 | u32::from(byte))
        };
        bytes.chunks_exact(size).map(number).collect()
    };
    let restore = |value: u32| if is_positive { value as i32 } else { signed(value) };
    Ok(raw.into_iter().map(restore).collect())
}

/// Values as the attribute has them, in the order of the file.
fn restore(reader: &mut Reader, header: &Header, values: Portable) -> Result<Vec<u8>, Fault> {
    let (values, width) = match values {
        Portable::Bytes(bytes) => return Ok(bytes),
        Portable::Integers(values, width) => (values, width),
    };
    let mut bytes = Vec::with_capacity(values.len() / width * header.width * header.kind.size());
    match header.storage {
        Storage::Bytes => {}
        Storage::Integers => {
            if header.kind == Kind::F32 {
                return Err(INVALID.into());
            }
            for value in values {
                bytes.extend_from_slice(&value.to_le_bytes()[..header.kind.size()]);
            }
        }
        Storage::Quantized => {
            let mut least = Vec::with_capacity(width);
            for _ in 0..width {
                least.push(reader.f32()?);
            }
            let range = reader.f32()?;
            let bits = reader.u8()?;
            if !(1..=31).contains(&bits) {
                return Err(INVALID.into());
            }
            let step = range / ((1_u32 << bits) - 1) as f32;
            for value in values.chunks_exact(width) {
                for (&value, least) in value.iter().zip(&least) {
                    bytes.extend_from_slice(&(value as f32 * step + least).to_le_bytes());
                }
            }
        }
        Storage::Normals => {
            let octahedron = Octahedron::of_bits(reader.u8()?)?;
            for value in values.as_chunks().0 {
                for number in octahedron.direction(*value) {
                    bytes.extend_from_slice(&number.to_le_bytes());
                }
            }
        }
    }
    Ok(bytes)
}
