//! Normals predicted by the areas of the triangles around their vertex.

use super::Fault;
use super::bits::Reader;
use super::corners::{next, previous};
use super::layout::{Layout, Positions};
use super::octahedron::Octahedron;

/// The sum of the triangles' normals around a corner's vertex, longer ones by their area.
fn predicted(corner: u32, layout: &Layout, positions: &Positions) -> [i64; 3] {
    let center = positions.at(corner);
    let mut normal = [0_i64; 3];
    for corner in layout.corners.around(corner) {
        let [a, b] = [next(corner), previous(corner)].map(|corner| {
            let position = positions.at(corner);
            std::array::from_fn::<i64, 3, _>(|i| position[i].wrapping_sub(center[i]))
        });
        for (i, normal) in normal.iter_mut().enumerate() {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let cross = a[j].wrapping_mul(b[k]).wrapping_sub(a[k].wrapping_mul(b[j]));
            *normal = normal.wrapping_add(cross);
        }
    }
    // So that products with the center keep within 64 bits.
    const MOST: i64 = 1 << 29;
    let sum = normal
        .iter()
        .fold(0_i64, |sum, v| sum.saturating_add(v.saturating_abs()));
    if sum > MOST {
        let quotient = sum / MOST;
        normal = normal.map(|v| v / quotient);
    }
    normal
}

/// Points of normals from corrections of what is predicted; a bit each says whether the normal
/// points to the other side.
pub(super) fn restore(
    values: &mut [i32],
    layout: &Layout,
    positions: &Positions,
    reader: &mut Reader,
) -> Result<(), Fault> {
    let octahedron = Octahedron::read(reader)?;
    let mut is_flipped = reader.coded_bits()?;
    for (value, &corner) in values.as_chunks_mut().0.iter_mut().zip(&layout.order.corners) {
        let mut vector = octahedron.onto(predicted(corner, layout, positions));
        if is_flipped.next() {
            vector = vector.map(|v| -v);
        }
        *value = octahedron.corrected(octahedron.point(vector), *value);
    }
    Ok(())
}
