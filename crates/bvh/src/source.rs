//! Items out of primitives, one by one.

use crate::error::BuildError;
use crate::item::BoxItem;
use crate::primitive::{MAX_PRIMITIVES, Primitive};
use core::ops::Range;
use glam::{BVec4A, Vec4};
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes, resize_in_huge_pages};
use lightshed_sampling::parallel::for_each_chunk;

/// Items that a thread makes at once.
const CHUNK: usize = 1 << 13;

/// Coordinates between which areas times counts neither overflow nor vanish.
const LARGEST: f32 = 1e12;
const SMALLEST: f32 = 1e-9;

/// Primitives that have boxes, and the box around all of them.
pub struct Source<'a, P> {
    primitives: &'a [P],
    /// Boxes are multiplied by this power of two, so that areas neither overflow nor vanish: the
    /// tree is then to be fitted to the primitives.
    factor: f64,
    /// Least and greatest doubled centre.
    pub centers: (Vec4, Vec4),
}

impl<P> Clone for Source<'_, P> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<P> Copy for Source<'_, P> {}

/// What is known of some items.
#[derive(Clone, Copy)]
struct Part {
    bounds: BoxItem,
    centers: (Vec4, Vec4),
    /// The first that has no box.
    wrong: usize,
}

impl Part {
    const NONE: Self = Self {
        bounds: BoxItem::EMPTY,
        centers: (Vec4::INFINITY, Vec4::NEG_INFINITY),
        wrong: usize::MAX,
    };

    #[inline(always)]
    fn union(&self, other: &Self) -> Self {
        Self {
            bounds: self.bounds.union(&other.bounds),
            centers: (
                self.centers.0.min(other.centers.0),
                self.centers.1.max(other.centers.1),
            ),
            wrong: self.wrong.min(other.wrong),
        }
    }
}

impl<'a, P: Primitive> Source<'a, P> {
    /// Checks the primitives.
    pub fn new(primitives: &'a [P]) -> Result<Self, BuildError> {
        if primitives.len() > MAX_PRIMITIVES {
            return Err(BuildError::TooMany(primitives.len()));
        }
        let mut source = Self {
            primitives,
            factor: 1.0,
            centers: (Vec4::ZERO, Vec4::ZERO),
        };
        let Some(all) = source.look() else {
            return Ok(source);
        };
        if all.wrong < usize::MAX {
            return Err(BuildError::Bounds(all.wrong as u32));
        }
        source.factor = factor(&all.bounds);
        source.centers = all.centers;
        if source.is_scaled() {
            source.centers = source.look().map_or(all.centers, |all| all.centers);
        }
        Ok(source)
    }

    fn look(&self) -> Option<Part> {
        let mut parts = vec![Part::NONE; self.primitives.len().div_ceil(CHUNK)];
        for_each_chunk(&mut parts, 1, |chunk, part| {
            let end = ((chunk + 1) * CHUNK).min(self.primitives.len());
            part[0] = self.look_at(chunk * CHUNK..end);
        });
        parts.into_iter().reduce(|a, b| a.union(&b))
    }

    fn look_at(&self, range: Range<usize>) -> Part {
        LaneChoice::best().run(Look(self, range))
    }

    /// Number of primitives.
    pub fn len(&self) -> usize {
        self.primitives.len()
    }

    /// Whether boxes are not those of the primitives.
    pub fn is_scaled(&self) -> bool {
        self.factor != 1.0
    }

    /// The primitive at an index, to be asked for ahead of its turn.
    #[inline(always)]
    pub fn primitive(&self, index: usize) -> &P {
        &self.primitives[index]
    }

    /// The item of this index.
    #[inline(always)]
    pub fn item(&self, index: usize) -> BoxItem {
        self.scaled(self.primitives[index].corners(), index as u32)
    }

    /// The sum of the corners of the item of this index.
    #[inline(always)]
    pub fn doubled_center(&self, index: usize) -> Vec4 {
        let [min, max] = self.scaled_corners(self.primitives[index].corners());
        min + max
    }

    /// All items, in the order of the primitives.
    pub fn collect(&self, items: &mut Vec<BoxItem>) {
        resize_in_huge_pages(items, self.len(), BoxItem::EMPTY);
        for_each_chunk(items, CHUNK, |start, items| {
            for (i, item) in items.iter_mut().enumerate() {
                *item = self.item(start + i);
            }
        });
    }

    #[inline(always)]
    fn scaled(&self, corners: [Vec4; 2], index: u32) -> BoxItem {
        BoxItem::from_corners(self.scaled_corners(corners), index)
    }

    #[inline(always)]
    fn scaled_corners(&self, corners: [Vec4; 2]) -> [Vec4; 2] {
        if self.factor == 1.0 {
            return corners;
        }
        let scale = |value: f32| (f64::from(value) * self.factor) as f32;
        let scale = |corner: Vec4| Vec4::from_array(corner.to_array().map(scale));
        corners.map(scale)
    }
}

/// A power of two by which coordinates are to be multiplied.
fn factor(all: &BoxItem) -> f64 {
    let farthest = f64::from(all.min().abs().max(all.max().abs()).max_element());
    let extent = (all.max().as_dvec3() - all.min().as_dvec3()).max_element();
    let most = exponent(f64::from(LARGEST) / farthest);
    if farthest > f64::from(LARGEST) {
        return power_of_two(most);
    }
    if extent > 0.0 && extent < f64::from(SMALLEST) {
        // Not so much that what is far away overflows.
        return power_of_two(exponent(1.0 / extent).min(most));
    }
    1.0
}

/// Of a positive normal number: the exponent of the greatest power of two that is not greater.
fn exponent(number: f64) -> i64 {
    (number.to_bits() >> 52) as i64 - 1023
}

/// Two to a power of which `f64` has a normal number.
fn power_of_two(exponent: i64) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// What is known of the primitives in a range.
struct Look<'a, P>(&'a Source<'a, P>, Range<usize>);

impl<P: Primitive> LaneKernel for Look<'_, P> {
    type Output = Part;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Part {
        let Self(source, range) = self;
        let mut valid = BVec4A::TRUE;
        let (mut least, mut most) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
        let mut centers = (Vec4::INFINITY, Vec4::NEG_INFINITY);
        for primitive in &source.primitives[range.clone()] {
            let [min, max] = primitive.corners();
            // Of NaN this is false, and what is infinite shows in the box around all.
            valid &= min.cmple(max);
            let [min, max] = source.scaled_corners([min, max]);
            (least, most) = (least.min(min), most.max(max));
            let center = min + max;
            centers = (centers.0.min(center), centers.1.max(center));
        }
        valid &= least.is_finite_mask() & most.is_finite_mask();
        let wrong = if valid.bitmask() & 7 == 7 {
            usize::MAX
        } else {
            let is_wrong = |&i: &usize| !source.primitives[i].bounds().is_valid();
            range.into_iter().find(is_wrong).unwrap_or(usize::MAX)
        };
        Part {
            bounds: BoxItem::from_corners([least, most], 0),
            // Zeros become positive, as those of items are.
            centers: (centers.0 + Vec4::ZERO, centers.1 + Vec4::ZERO),
            wrong,
        }
    }
}
