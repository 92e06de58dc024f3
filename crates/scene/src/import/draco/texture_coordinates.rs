//! Texture coordinates predicted by the shape of the triangle: as far along an edge and as far from
//! it as the corner is in space.

use super::bits::Reader;
use super::corners::{next, previous};
use super::layout::{Layout, Positions};
use super::undo::Undo;
use super::{Fault, INVALID};

/// Coordinates from differences to what is predicted; a bit each says on which side of the edge the
/// corner lies.
pub(super) fn restore(
    values: &mut [i32],
    layout: &Layout,
    positions: &Positions,
    reader: &mut Reader,
    kind: u8,
) -> Result<(), Fault> {
    let count = usize::try_from(reader.i32()?).map_err(|_| INVALID)?;
    if count > values.len() {
        return Err(INVALID.into());
    }
    let mut changes = reader.coded_bits()?;
    let mut side = true;
    // Used from the last one.
    let mut sides: Vec<bool> = (0..count)
        .map(|_| {
            side ^= !changes.next();
            side
        })
        .collect();
    let undo = Undo::read(reader, kind)?;
    for (value, &corner) in layout.order.corners.iter().enumerate() {
        let (known, rest) = values.as_chunks_mut::<2>().0.split_at_mut(value);
        let [a, b] = [next(corner), previous(corner)];
        let [of_a, of_b] = [a, b].map(|corner| known.get(layout.value(corner)).copied());
        let by_shape = match (of_a, of_b) {
            (Some(of_a), Some(of_b)) if of_a == of_b => Some(of_a),
            (Some(of_a), Some(of_b)) => {
                let corners = [corner, a, b].map(|corner| positions.at(corner));
                predicted(corners, [of_a, of_b], &mut sides)?
            }
            _ => None,
        };
        // The next corner, else the value before. The corner before is passed over by all encoders.
        let predicted = by_shape.or(of_a).or(known.last().copied()).unwrap_or_default();
        undo.apply(&predicted, &mut rest[0]);
    }
    Ok(())
}

/// Of a corner's position and two others' with their coordinates; none if these share a position.
/// Numbers wrap around as those of the encoder do.
fn predicted(
    [tip, a, b]: [[i64; 3]; 3],
    known: [[i32; 2]; 2],
    sides: &mut Vec<bool>,
) -> Result<Option<[i32; 2]>, Fault> {
    let minus = |a: [i64; 3], b: [i64; 3]| -> [i64; 3] { std::array::from_fn(|i| a[i].wrapping_sub(b[i])) };
    let dot = |a: [i64; 3], b: [i64; 3]| -> i64 {
        (0..3).fold(0, |sum, i| sum.wrapping_add(a[i].wrapping_mul(b[i])))
    };
    let edge = minus(b, a);
    let length = dot(edge, edge);
    if length == 0 {
        return Ok(None);
    }
    let along = dot(edge, minus(tip, a));
    let foot: [i64; 3] =
        std::array::from_fn(|i| a[i].wrapping_add(edge[i].wrapping_mul(along).wrapping_div(length)));
    let away = minus(tip, foot);
    let product = (dot(away, away) as u64).wrapping_mul(length as u64);
    let height = product.isqrt() as i64;
    let [of_a, of_b] = known.map(|point| point.map(i64::from));
    let of_edge = [of_b[0] - of_a[0], of_b[1] - of_a[1]];
    let turned = [of_edge[1], -of_edge[0]];
    let side = sides.pop().ok_or(INVALID)?;
    Ok(Some(std::array::from_fn(|i| {
        let base = of_a[i]
            .wrapping_mul(length)
            .wrapping_add(of_edge[i].wrapping_mul(along));
        let offset = turned[i].wrapping_mul(height);
        let sum = if side {
            base.wrapping_add(offset)
        } else {
            base.wrapping_sub(offset)
        };
        sum.wrapping_div(length) as i32
    })))
}
