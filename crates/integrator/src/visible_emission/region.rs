//! Where in a pixel rays go.

use super::mask::{CELLS, CellMask, SIDE, place_of};
use lightshed_scene::glam::Vec2;

/// A part of a pixel that contains all marked cells: their bounding rectangle, in which points keep
/// the stratification that they have in the square, or the cells one by one where the rectangle is
/// much larger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// First column and row, and numbers of columns and rows.
    corner: [u8; 2],
    size: [u8; 2],
    /// Empty for the rectangle.
    cells: CellMask,
}

/// A rectangle is taken up to this many quarters of the marked area.
const ROOM: u32 = 5;

impl Region {
    /// Of cells. `None` without any.
    pub fn new(mask: CellMask) -> Option<Self> {
        let (cells, count) = mask.cells();
        let places = || cells[..count].iter().map(|&cell| place_of(cell));
        let least = places().reduce(|[a, b], [x, y]| [a.min(x), b.min(y)])?;
        let greatest = places().reduce(|[a, b], [x, y]| [a.max(x), b.max(y)])?;
        let size = [0, 1].map(|axis| greatest[axis] - least[axis] + 1);
        let area = u32::from(size[0]) * u32::from(size[1]);
        Some(Self {
            corner: least,
            size,
            cells: match 4 * area <= ROOM * mask.count() {
                true => CellMask::default(),
                false => mask,
            },
        })
    }

    /// Whether it is a rectangle.
    pub fn is_rectangle(&self) -> bool {
        self.cells.is_empty()
    }

    /// Its share of the pixel's area.
    #[inline]
    pub fn share(&self) -> f32 {
        let count = match self.is_rectangle() {
            true => u32::from(self.size[0]) * u32::from(self.size[1]),
            false => self.cells.count(),
        };
        count as f32 / CELLS as f32
    }

    /// Places in it.
    pub fn places(&self) -> Places {
        let whole = |[x, y]: [u8; 2]| Vec2::new(f32::from(x), f32::from(y)) / SIDE as f32;
        Places {
            corner: whole(self.corner),
            size: whole(self.size),
            cells: self.cells.cells(),
        }
    }
}

/// Places in a region of a pixel.
pub struct Places {
    corner: Vec2,
    size: Vec2,
    cells: ([u8; CELLS], usize),
}

impl Places {
    /// A place in the pixel, `[0, 1)²`, uniform over the region for uniform `u`.
    #[inline]
    pub fn at(&self, u: [f32; 2]) -> Vec2 {
        let (cells, count) = &self.cells;
        if *count == 0 {
            return self.corner + self.size * Vec2::from(u);
        }
        let along = u[0] * *count as f32;
        let index = (along as usize).min(count - 1);
        let [x, y] = place_of(cells[index]).map(f32::from);
        Vec2::new(x + (along - index as f32), y + u[1]) / SIDE as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 64 × 64 stratified places, each cell of the region has its share, and no other cell any.
    #[test]
    fn places_are_uniform_over_the_region() {
        let diagonal = (0..SIDE).map(|row| CellMask::of_row(row, row, row));
        let rectangle = (2..5).map(|row| CellMask::of_row(row, 1, 6));
        let corners = [CellMask::of_row(0, 0, 2), CellMask::of_row(1, 0, 1)];
        let union = |masks: &mut dyn Iterator<Item = CellMask>| {
            masks.fold(CellMask::default(), |mut all, mask| {
                all.add(mask);
                all
            })
        };
        let masks = [
            (union(&mut diagonal.into_iter()), 8, false),
            (union(&mut rectangle.into_iter()), 18, true),
            (union(&mut corners.into_iter()), 6, true),
            (CellMask::FULL, 64, true),
        ];
        for (mask, area, is_rectangle) in masks {
            let region = Region::new(mask).unwrap();
            assert_eq!(
                (region.share() * 64.0, region.is_rectangle()),
                (area as f32, is_rectangle)
            );
            let (places, mut found) = (region.places(), [0; CELLS]);
            for index in 0..64 * 64 {
                let u = [index % 64, index / 64].map(|i| (i as f32 + 0.5) / 64.0);
                let [column, row] = places.at(u).to_array().map(|x| (x * SIDE as f32) as usize);
                found[row * SIDE + column] += 1;
            }
            let (expected, all) = (4096 / area, found.iter().filter(|&&count| count > 0));
            assert_eq!(all.clone().count(), area);
            all.for_each(|&count| assert!((count - expected as i32).abs() <= 64 + expected as i32 / 4));
            let covered = (0..SIDE * SIDE).filter(|cell| {
                let place = Vec2::new((cell % SIDE) as f32 + 0.5, (cell / SIDE) as f32 + 0.5) / SIDE as f32;
                mask.contains(place)
            });
            covered.for_each(|cell| assert!(found[cell] > 0, "{mask:?} loses {cell}"));
        }
        assert_eq!(Region::new(CellMask::default()), None);
    }
}
