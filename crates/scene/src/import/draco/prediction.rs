//! Predictions by the value before and by parallelograms (Touma and Gotsman 1998).

use super::bits::Reader;
use super::layout::Layout;
use super::undo::Undo;
use super::{Fault, INVALID};

/// Undoes the difference of a value from another one before it.
fn undo_from(values: &mut [i32], width: usize, from: Option<usize>, to: usize, undo: Undo) {
    let (before, rest) = values.split_at_mut(to * width);
    let zero = [0; 16];
    let predicted = from.map_or(&zero[..width], |from| &before[from * width..(from + 1) * width]);
    undo.apply(predicted, &mut rest[..width]);
}

/// Each value is predicted by the one before.
pub(super) fn differences(values: &mut [i32], width: usize, undo: Undo) {
    for value in 0..values.len() / width {
        undo_from(values, width, value.checked_sub(1), value, undo);
    }
}

/// The corner that completes the parallelogram over the edge opposite to `corner`, if the values of
/// the triangle across are known.
fn parallelogram(
    values: &[i32],
    width: usize,
    layout: &Layout,
    corner: u32,
    known: usize,
    predicted: &mut [i32],
) -> bool {
    use super::corners::{next, previous};
    let Some(across) = layout.corners.across(corner) else {
        return false;
    };
    let [tip, a, b] = [across, next(across), previous(across)].map(|corner| layout.value(corner));
    if tip.max(a).max(b) >= known {
        return false;
    }
    for (i, predicted) in predicted.iter_mut().enumerate() {
        let [tip, a, b] = [tip, a, b].map(|value| values[value * width + i]);
        *predicted = a.wrapping_add(b).wrapping_sub(tip);
    }
    true
}

/// Each value is predicted by the parallelogram over the edge across from it.
pub(super) fn parallelograms(values: &mut [i32], width: usize, layout: &Layout, undo: Undo) {
    let mut buffer = [0; 16];
    let predicted = &mut buffer[..width];
    for (value, &corner) in layout.order.corners.iter().enumerate() {
        if value > 0 && parallelogram(values, width, layout, corner, value, predicted) {
            undo.apply(predicted, &mut values[value * width..(value + 1) * width]);
        } else {
            undo_from(values, width, value.checked_sub(1), value, undo);
        }
    }
}

/// Each value is predicted by the mean of up to four parallelograms around its vertex; a bit each
/// says whether it counts.
pub(super) fn chosen_parallelograms(
    values: &mut [i32],
    width: usize,
    layout: &Layout,
    reader: &mut Reader,
    kind: u8,
) -> Result<(), Fault> {
    // By the number of parallelograms: bits, and how many of them there are.
    let mut is_left_out = Vec::new();
    for _ in 0..4 {
        let count = reader.variable()?;
        is_left_out.push(match count {
            0 => None,
            _ => Some((reader.coded_bits()?, count)),
        });
    }
    let undo = Undo::read(reader, kind)?;
    let mut predicted = [[0; 16]; 4];
    for (value, &start) in layout.order.corners.iter().enumerate() {
        let mut found = 0;
        if value > 0 {
            for corner in layout.corners.around(start) {
                if parallelogram(
                    values,
                    width,
                    layout,
                    corner,
                    value,
                    &mut predicted[found][..width],
                ) {
                    found += 1;
                    if found == predicted.len() {
                        break;
                    }
                }
            }
        }
        let (mut sum, mut used) = ([0_i32; 16], 0);
        for predicted in &predicted[..found] {
            let (bits, left) = is_left_out[found - 1].as_mut().ok_or(INVALID)?;
            *left = left.checked_sub(1).ok_or(INVALID)?;
            if !bits.next() {
                used += 1;
                for (sum, predicted) in sum.iter_mut().zip(predicted) {
                    *sum = sum.wrapping_add(*predicted);
                }
            }
        }
        if used == 0 {
            undo_from(values, width, value.checked_sub(1), value, undo);
        } else {
            let mean = sum.map(|sum| sum / used);
            undo.apply(&mean[..width], &mut values[value * width..(value + 1) * width]);
        }
    }
    Ok(())
}
