//! Bins along three axes, and the plane between bins at which a division costs least.

use super::BINS;
use crate::item::BoxItem;
use glam::Vec4;
use lightshed_lanes::{LaneMask, Lanes};

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

    /// The first `COUNT` bins of each axis are empty.
    #[inline(always)]
    pub fn empty<const COUNT: usize>() -> Self {
        if COUNT == BINS {
            return Self::EMPTY;
        }
        let mut bins = Self {
            rows: [[[0.0; 8]; BINS]; 3],
            counts: [[0; BINS]; 3],
        };
        for axis in 0..3 {
            for bin in 0..COUNT {
                bins.rows[axis][bin] = [f32::INFINITY; 8];
            }
        }
        bins
    }

    /// Adds items to the first `COUNT` bins of each axis.
    #[inline(always)]
    pub fn add<L: Lanes, const COUNT: usize>(&mut self, binning: &Binning, items: &[BoxItem]) {
        for item in items {
            let words = binning.words(item);
            let row = L::load(item.row());
            for axis in 0..3 {
                let bin = words[axis] as usize % COUNT;
                let of_bin = &mut self.rows[axis][bin];
                *of_bin = L::load(of_bin).min(row).store();
                self.counts[axis][bin] += 1;
            }
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
    pub fn best_plane<L: Lanes, const COUNT: usize>(&self, binning: &Binning) -> Option<Plane> {
        let mut best = None;
        let mut least = f32::INFINITY;
        for axis in 0..3 {
            if !(binning.scale[axis] > 0.0) {
                continue;
            }
            let rows = &self.rows[axis];
            let (mut low, mut high) = ([[0.0; 8]; BINS], [[0.0; 8]; BINS]);
            let (mut counts_low, mut counts_high) = ([0.0; BINS], [0.0; BINS]);
            let mut all = L::splat(f32::INFINITY);
            let mut count = 0;
            for bin in 0..COUNT - 1 {
                all = all.min(L::load(&rows[bin]));
                low[bin] = all.store();
                count += self.counts[axis][bin];
                counts_low[bin] = count as f32;
            }
            let total = count + self.counts[axis][COUNT - 1];
            let mut all = L::splat(f32::INFINITY);
            let mut count = total;
            for bin in 1..COUNT {
                let bin = COUNT - bin;
                all = all.min(L::load(&rows[bin]));
                high[bin - 1] = all.store();
            }
            for bin in 0..COUNT - 1 {
                count -= self.counts[axis][bin];
                counts_high[bin] = count as f32;
            }
            for block in 0..COUNT / 8 {
                let cost = areas::<L>(&low, block) * values::<L>(&counts_low, block)
                    + areas::<L>(&high, block) * values::<L>(&counts_high, block);
                // There is no plane behind the last bin.
                let planes = if block + 1 == COUNT / 8 { 0x7f } else { 0xff };
                let value = cost.least_of(planes);
                if value.first() < least {
                    least = value.first();
                    let lane = (cost.equal(value).bits() & planes).trailing_zeros();
                    best = Some((axis, block as u32 * 8 + lane));
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

/// Half areas of eight boxes.
#[inline(always)]
fn areas<L: Lanes>(rows: &[[f32; 8]; BINS], block: usize) -> L {
    let at = block * 8;
    let [x, y, z, _, u, v, w, _] = L::load_transposed([
        &rows[at],
        &rows[at + 1],
        &rows[at + 2],
        &rows[at + 3],
        &rows[at + 4],
        &rows[at + 5],
        &rows[at + 6],
        &rows[at + 7],
    ]);
    let (x, y, z) = (x + u, y + v, z + w);
    x * y + y * z + z * x
}

#[inline(always)]
fn values<L: Lanes>(values: &[f32; BINS], block: usize) -> L {
    let mut eight = [0.0; 8];
    for i in 0..8 {
        eight[i] = values[block * 8 + i];
    }
    L::load(&eight)
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
