//! Where to divide a group of lights.

use crate::block::Node;
use crate::normals::NormalBall;
use crate::{Bounds, Light};
use glam::{Vec3, Vec3A};

/// A light as the build sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub min: Vec3A,
    pub max: Vec3A,
    /// Centre of the ball around the light's normals.
    pub normals: Vec3A,
    /// Its radius.
    pub spread: f32,
    /// Both, packed.
    pub packed: u32,
    pub intensity: f32,
    pub light: u32,
}

impl Item {
    /// `None` for a light that is off.
    pub fn new(light: &Light, index: usize) -> Option<Self> {
        let node = Node::leaf(light);
        let ball = NormalBall::unpack(node.normals);
        (node.intensity > 0.0).then(|| Self {
            min: node.bounds.min.into(),
            max: node.bounds.max.into(),
            normals: ball.center.into(),
            spread: ball.radius,
            packed: node.normals,
            intensity: node.intensity,
            light: index as u32,
        })
    }

    fn doubled_center(&self) -> Vec3A {
        self.min + self.max
    }
}

/// Extent of a group: boxes of places and of normals. Least and greatest values alone, so that it is the same in any order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    min: Vec3A,
    max: Vec3A,
    normals_min: Vec3A,
    normals_max: Vec3A,
    intensity: f64,
}

impl Extent {
    pub const EMPTY: Self = Self {
        min: Vec3A::INFINITY,
        max: Vec3A::NEG_INFINITY,
        normals_min: Vec3A::INFINITY,
        normals_max: Vec3A::NEG_INFINITY,
        intensity: 0.0,
    };

    #[inline(always)]
    pub fn add(&mut self, item: &Item) {
        self.min = self.min.min(item.min);
        self.max = self.max.max(item.max);
        self.normals_min = self.normals_min.min(item.normals - item.spread);
        self.normals_max = self.normals_max.max(item.normals + item.spread);
        self.intensity += f64::from(item.intensity);
    }

    #[inline(always)]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            normals_min: self.normals_min.min(other.normals_min),
            normals_max: self.normals_max.max(other.normals_max),
            intensity: self.intensity + other.intensity,
        }
    }

    pub fn of(items: &[Item]) -> Self {
        let mut all = Self::EMPTY;
        items.iter().for_each(|item| all.add(item));
        all
    }

    /// `I · M_A · M_Ω`: with the squared diagonal for the area, which does not vanish on a line, and from 1 to 4 for normals from
    /// one direction to all, as the measure of the cone does (Conty Estevez and Kulla 2018, eq. 1).
    #[inline(always)]
    pub fn cost(&self) -> f64 {
        if !(self.intensity > 0.0) {
            return 0.0;
        }
        let half = (self.normals_max - self.normals_min) * 0.5;
        let spread = half.length().min(1.0);
        let area = f64::from((self.max - self.min).length_squared());
        self.intensity * area * f64::from(1.0 + 3.0 * spread)
    }

    pub fn bounds(&self) -> Bounds {
        Bounds::new(self.min.into(), self.max.into())
    }

    /// A ball around the box of normals.
    pub fn ball(&self) -> NormalBall {
        let half = (self.normals_max - self.normals_min) * 0.5;
        let radius = half.length();
        if radius >= 1.0 {
            return NormalBall::ALL;
        }
        NormalBall {
            center: Vec3::from(self.normals_min + half),
            radius,
        }
    }

    pub fn intensity(&self) -> f32 {
        self.intensity.min(f64::from(f32::MAX)) as f32
    }
}

/// Bins of a large group, …
const BINS: usize = 16;
/// … and of one of fewer lights than [`FEW`]: going through bins costs more there than going through lights.
const BINS_OF_FEW: usize = 8;
const FEW: usize = 48;

/// Divides a group of at least two in place; both parts have items. The rest of the arithmetic is of least and greatest
/// values and of sums in the order of the items.
pub(super) fn split(items: &mut [Item], by_half: bool) -> usize {
    let (mut low, mut high) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    for item in items.iter() {
        let center = item.doubled_center();
        low = low.min(center);
        high = high.max(center);
    }
    let extent = high - low;
    let bins = if items.len() < FEW { BINS_OF_FEW } else { BINS };
    let place = match bins {
        _ if by_half => None,
        BINS_OF_FEW => best_place::<BINS_OF_FEW>(items, low, extent),
        _ => best_place::<BINS>(items, low, extent),
    };
    if let Some((axis, bin)) = place {
        let (low, scale) = (low[axis], bins as f32 / extent[axis]);
        let last = (bins - 1) as f32;
        let middle = partition(items, |item| {
            let center = item.doubled_center()[axis];
            ((center - low) * scale).min(last) as usize <= bin
        });
        if middle > 0 && middle < items.len() {
            return middle;
        }
    }
    // No place is better than another: the middle of the longest axis, ties by index.
    let axis = (0..3).fold(
        0,
        |best, axis| if extent[axis] > extent[best] { axis } else { best },
    );
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        let key = |item: &Item| item.doubled_center()[axis];
        key(a).total_cmp(&key(b)).then(a.light.cmp(&b.light))
    });
    middle
}

/// Bin along each axis and the place in it; NaN on an axis without extent.
#[inline(always)]
fn bin_of<const BINS: usize>(item: &Item, low: Vec3A, scale: Vec3A) -> Vec3A {
    ((item.doubled_center() - low) * scale).min(Vec3A::splat((BINS - 1) as f32))
}

/// Axis and last bin of the first part, for the least cost; `None` where no axis has extent.
fn best_place<const BINS: usize>(items: &[Item], low: Vec3A, extent: Vec3A) -> Option<(usize, usize)> {
    let mut bins = [[Extent::EMPTY; BINS]; 3];
    let scale = BINS as f32 / extent;
    for item in items {
        let bin = bin_of::<BINS>(item, low, scale).to_array();
        for axis in 0..3 {
            // NaN is bin 0.
            bins[axis][bin[axis] as usize % BINS].add(item);
        }
    }
    let longest = extent.max_element();
    let mut best = None;
    let mut least = f64::INFINITY;
    for axis in 0..3 {
        if !(extent[axis] > 0.0 && scale[axis].is_finite()) {
            continue;
        }
        let mut costs = [0.0; BINS];
        let mut all = Extent::EMPTY;
        for bin in (1..BINS).rev() {
            all = all.union(&bins[axis][bin]);
            costs[bin - 1] = all.cost();
        }
        let mut all = Extent::EMPTY;
        // Thin boxes are penalised: division across the long axis is better than cost alone tells.
        let regular = f64::from(longest / extent[axis]);
        for bin in 0..BINS - 1 {
            all = all.union(&bins[axis][bin]);
            let cost = regular * (all.cost() + costs[bin]);
            if cost < least && all.intensity > 0.0 {
                least = cost;
                best = Some((axis, bin));
            }
        }
    }
    best
}

/// Moves items for which `first` holds to the front and tells how many they are.
fn partition(items: &mut [Item], first: impl Fn(&Item) -> bool) -> usize {
    let mut count = 0;
    for i in 0..items.len() {
        if first(&items[i]) {
            items.swap(i, count);
            count += 1;
        }
    }
    count
}
