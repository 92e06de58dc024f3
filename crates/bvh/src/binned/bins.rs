//! Bins along three axes, and the plane between bins at which a division costs least.

use super::BINS;
use crate::item::{BoxItem, half_areas};
use glam::Vec4;
use lightshed_lanes::{LANES, LaneMask, Lanes};

/// `1.5 · 2²³`: added to a small number, leaves its nearest integer in the low bits of the sum.
const ROUND: f32 = 12_582_912.0;

/// What a division starts from: the box of all items, and that of their doubled centres.
#[derive(Clone, Copy, Debug)]
pub struct Summary {
    pub bounds: BoxItem,
    pub center_min: Vec4,
    pub center_max: Vec4,
}

impl Summary {
    /// Of no items.
    pub const NONE: Self = Self {
        bounds: BoxItem::EMPTY,
        center_min: Vec4::INFINITY,
        center_max: Vec4::NEG_INFINITY,
    };

    #[inline(always)]
    pub fn of<L: Lanes>(items: &[BoxItem]) -> Self {
        let mut bounds = L::splat(f32::INFINITY);
        let (mut center_min, mut center_max) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
        for item in items {
            bounds = bounds.min(L::load(item.row()));
            let center = item.doubled_center();
            center_min = center_min.min(center);
            center_max = center_max.max(center);
        }
        Self {
            bounds: BoxItem::from_row(bounds.store()),
            center_min,
            center_max,
        }
    }

    #[inline(always)]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            bounds: self.bounds.union(&other.bounds),
            center_min: self.center_min.min(other.center_min),
            center_max: self.center_max.max(other.center_max),
        }
    }

    /// The axis along which centres lie farthest apart.
    pub fn longest_axis(&self) -> usize {
        let extent = (self.center_max - self.center_min).to_array();
        let longer = |best, axis| if extent[axis] > extent[best] { axis } else { best };
        (0..3).fold(0, longer)
    }
}

/// From doubled centres to bins.
#[derive(Clone, Copy, Debug)]
pub struct Binning {
    base: Vec4,
    /// Zero along an axis on which all centres are equal.
    scale: Vec4,
}

impl Binning {
    #[inline(always)]
    pub fn new(summary: &Summary, bins: usize) -> Self {
        let extent = summary.center_max - summary.center_min;
        // A little less than all bins, so that the last one holds the end.
        let scale = Vec4::splat(bins as f32 - 0.01) / extent;
        let mut scale = scale.to_array();
        for axis in 0..3 {
            // Not finite where the extent is nothing, or nearly.
            let usable = scale[axis] < f32::MAX;
            scale[axis] = if usable { scale[axis] } else { 0.0 };
        }
        scale[3] = 0.0;
        Self {
            base: summary.center_min,
            scale: Vec4::from_array(scale),
        }
    }

    /// Words whose low bits are the bins along the axes.
    #[inline(always)]
    fn words(&self, item: &BoxItem) -> [u32; 4] {
        let place = (item.doubled_center() - self.base) * self.scale - 0.5 + ROUND;
        bytemuck::cast(place)
    }
}

/// What lies in each bin.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub struct Bins {
    rows: [[[f32; 8]; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl Bins {
    pub const EMPTY: Self = Self {
        rows: [[[f32::INFINITY; 8]; BINS]; 3],
        counts: [[0; BINS]; 3],
    };

    /// Empties the first `COUNT` bins of each axis.
    #[inline(always)]
    pub fn clear<const COUNT: usize>(&mut self) {
        for axis in 0..3 {
            for bin in 0..COUNT {
                self.rows[axis][bin] = [f32::INFINITY; 8];
                self.counts[axis][bin] = 0;
            }
        }
    }

    /// Adds items to the first `COUNT` bins of each axis.
    #[inline(always)]
    pub fn add<L: Lanes, const COUNT: usize>(&mut self, binning: &Binning, items: &[BoxItem]) {
        // Neighbours are often in one bin, and the second has to wait for the first. So four items
        // are taken in turn that lie far apart.
        let quarter = items.len() / 4;
        let (a, rest) = items.split_at(quarter);
        let (b, rest) = rest.split_at(quarter);
        let (c, rest) = rest.split_at(quarter);
        let (d, rest) = rest.split_at(quarter);
        for (((a, b), c), d) in a.iter().zip(b).zip(c).zip(d) {
            self.add_one::<L, COUNT>(binning, a);
            self.add_one::<L, COUNT>(binning, b);
            self.add_one::<L, COUNT>(binning, c);
            self.add_one::<L, COUNT>(binning, d);
        }
        for item in rest {
            self.add_one::<L, COUNT>(binning, item);
        }
    }

    #[inline(always)]
    fn add_one<L: Lanes, const COUNT: usize>(&mut self, binning: &Binning, item: &BoxItem) {
        let words = binning.words(item);
        let row = L::load(item.row());
        for axis in 0..3 {
            let bin = words[axis] as usize % COUNT;
            let of_bin = &mut self.rows[axis][bin];
            *of_bin = L::load(of_bin).min(row).store();
            self.counts[axis][bin] += 1;
        }
    }

    pub fn merge(&mut self, other: &Self) {
        for axis in 0..3 {
            for bin in 0..BINS {
                let (own, other) = (&mut self.rows[axis][bin], &other.rows[axis][bin]);
                *own = *BoxItem::from_row(*own).union(&BoxItem::from_row(*other)).row();
            }
            for (own, other) in self.counts[axis].iter_mut().zip(&other.counts[axis]) {
                *own += other;
            }
        }
    }

    /// How many items lie before a plane.
    pub fn count_before(&self, plane: &Plane) -> usize {
        let counts = &self.counts[plane.axis][..=plane.bin as usize];
        counts.iter().map(|&count| count as usize).sum()
    }

    /// The plane of least cost `A(low) · |low| + A(high) · |high|`; `None` where no axis has
    /// extent.
    #[inline(always)]
    pub fn best_plane<L: Lanes, const COUNT: usize>(
        &self,
        binning: &Binning,
        sides: &mut Sides,
    ) -> Option<Plane> {
        let Sides { low, high, counts } = sides;
        let mut best = None;
        let mut least = f32::INFINITY;
        for axis in 0..3 {
            if !(binning.scale[axis] > 0.0) {
                continue;
            }
            let rows = &self.rows[axis];
            let mut all = L::splat(f32::INFINITY);
            let mut count = 0;
            for bin in 0..COUNT - 1 {
                all = all.min(L::load(&rows[bin]));
                low[bin] = all.store();
                count += self.counts[axis][bin];
                counts[bin] = count as f32;
            }
            let total = L::splat((count + self.counts[axis][COUNT - 1]) as f32);
            let mut all = L::splat(f32::INFINITY);
            for bin in 1..COUNT {
                let bin = COUNT - bin;
                all = all.min(L::load(&rows[bin]));
                high[bin - 1] = all.store();
            }
            for block in 0..COUNT / LANES {
                let at = block * LANES;
                let before = match counts[at..].first_chunk() {
                    Some(eight) => L::load(eight),
                    None => break,
                };
                let cost = half_areas::<L>(low, at) * before + half_areas::<L>(high, at) * (total - before);
                // There is no plane behind the last bin.
                let planes = if block + 1 == COUNT / LANES { 0x7f } else { 0xff };
                let value = cost.least_of(planes);
                if value.first() < least {
                    least = value.first();
                    let lane = (cost.equal(value).bits() & planes).trailing_zeros();
                    best = Some((axis, at as u32 + lane));
                }
            }
        }
        let (axis, bin) = best?;
        Some(Plane {
            axis,
            bin,
            mask: COUNT as u32 - 1,
            base: binning.base[axis],
            scale: binning.scale[axis],
        })
    }
}

/// What lies before and behind the planes across one axis, while the best plane is looked for.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub struct Sides {
    low: [[f32; 8]; BINS],
    high: [[f32; 8]; BINS],
    /// Items before each plane.
    counts: [f32; BINS],
}

impl Sides {
    pub const NONE: Self = Self {
        low: [[0.0; 8]; BINS],
        high: [[0.0; 8]; BINS],
        counts: [0.0; BINS],
    };
}

/// A plane between two bins.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    axis: usize,
    /// Last bin before it.
    bin: u32,
    mask: u32,
    base: f32,
    scale: f32,
}

impl Plane {
    /// Whether an item lies before the plane: by the arithmetic that found its bin.
    #[inline(always)]
    pub fn is_low(&self, item: &BoxItem) -> bool {
        let row = item.row();
        let center = row[self.axis & 3] - row[4 + (self.axis & 3)];
        let place = (center - self.base) * self.scale - 0.5 + ROUND;
        place.to_bits() & self.mask <= self.bin
    }
}
