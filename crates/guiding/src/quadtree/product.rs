//! The product of a tree with what a receiver reflects.
//!
//! A tree gives all of its `L` leaves the same probability. The product gives leaf `i` the
//! probability `h_i / Σ h`, where `h_i` is the mean over the leaf of what the receiver reflects per
//! unit of irradiance, its cosine included ([`ReflectionLobe`]). A direction in leaf `i` has the
//! density `p_tree · L h_i / Σ h`. All leaves of a small tree are looked at, so this is the exact
//! density of what is sampled; the thesis draws a few leaves and leaves the density open (§5.8).

use super::bits::MAX_QUADTREE_DEPTH;
use super::counts::{count_of, step_to};
use super::parallax::SeenQuadtree;
use crate::lobe::{ReflectionLobe, cosine_over};
use crate::square::{code_of, direction_of, square_of};
use glam::{Vec2, Vec3};
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, LaneWords, Lanes, Vec3Lanes};
use lightshed_lights::{Facing, ShadingPoint};
use lightshed_sampling::{
    Density, DirectionDistribution, ONE_MINUS_EPSILON, SolidAngle, octahedral_to_solid_angle,
};
use std::f32::consts::FRAC_1_PI;

/// Most bits of a tree whose products are sampled.
pub const MAX_PRODUCT_BITS: u32 = 128;
/// Its leaves, in whole blocks of lanes.
const MOST_LEAVES: usize = (3 * MAX_PRODUCT_BITS as usize / 4 + 1).next_multiple_of(LANES);
/// Least weight of a leaf, where a perpendicular diffuse surface has 1.
const LEAST_WEIGHT: f32 = 1.0 / 1024.0;
/// Least ratio that [`QuadtreeProduct::ratio`] reports.
const LEAST_RATIO: f32 = 1.0 / 64.0;

/// Words of the leaves of a tree of so many words.
pub(super) const fn leaf_words(tree_words: usize) -> usize {
    (24 * tree_words + 1).next_multiple_of(LANES)
}

/// Writes the leaves of a tree, depth first, by its counts: the depth in the four low bits, then 14
/// bits each of the corner along u and along v. Words behind the last leaf are zero.
pub(super) fn write_leaves(counts: &[u32], leaves: &mut [u32]) {
    leaves.fill(0);
    let mut stack = [(0usize, [0u32; 2], 0u32); MAX_QUADTREE_DEPTH as usize];
    let (mut depth, mut next) = (0usize, 0);
    loop {
        let (node, place, quarter) = stack[depth];
        if quarter == 4 {
            if depth == 0 {
                return;
            }
            depth -= 1;
            continue;
        }
        stack[depth].2 += 1;
        let corner = [2 * place[0] + (quarter & 1), 2 * place[1] + (quarter >> 1)];
        let below = depth as u32 + 1;
        if count_of(counts[node], quarter) == 0 || below == MAX_QUADTREE_DEPTH {
            let [x, y] = corner.map(|corner| corner << (MAX_QUADTREE_DEPTH - below));
            if let Some(leaf) = leaves.get_mut(next) {
                *leaf = below | x << 4 | y << 18;
            }
            next += 1;
        } else {
            depth += 1;
            stack[depth] = (node + step_to(counts[node], quarter), corner, 0);
        }
    }
}

/// The number of the leaf that has a point of the square by its code, and its depth.
#[inline(always)]
fn leaf_at(counts: &[u32], code: u32) -> (usize, u32) {
    let (mut inner, mut depth, mut code, mut leaf) = (0, 0, code, 0);
    loop {
        let (node, quarter) = (counts[inner], code >> 30);
        let step = step_to(node, quarter);
        // A subtree of m inner nodes has 1 + 3 m leaves; `step − 1` nodes are in those before.
        leaf += quarter as usize + 3 * (step - 1);
        depth += 1;
        if count_of(node, quarter) == 0 || depth == MAX_QUADTREE_DEPTH {
            return (leaf, depth);
        }
        inner += step;
        code <<= 2;
    }
}

/// Weights of all leaves for a receiver: their running sums.
struct Weigh<'a> {
    leaves: &'a [u32],
    offset: Vec3,
    normal: Vec3,
    lobe: Option<ReflectionLobe>,
    ends: &'a mut [f32; MOST_LEAVES],
}

impl LaneKernel for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (words, _) = self.leaves.as_chunks::<LANES>();
        let (rows, _) = self.ends.as_chunks_mut::<LANES>();
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let splat = |vector: Vec3| Vec3Lanes::<L>::splat(vector.to_array());
        let (normal, offset) = (splat(self.normal), splat(self.offset));
        let word = |word: u32| <L::Words as LaneWords>::splat(word);
        let cell = L::splat(1.0 / (1 << MAX_QUADTREE_DEPTH) as f32);
        let mut before = zero;
        for (words, row) in words.iter().zip(rows) {
            let words = L::Words::load(words);
            let depth = words & word(15);
            // 2^−depth by its exponent.
            let side = L::from_bits(word(127 << 23) + depth * word((1u32 << 23).wrapping_neg()));
            let half = side * L::splat(0.5);
            let x = L::from_integers(words.shift_right::<4>() & word(0x3fff)) * cell + half;
            let y = L::from_integers(words.shift_right::<18>()) * cell + half;
            // The middle on the octahedron, whose corners have the sum of coordinates 1.
            let (x, y) = (x + x - one, y + y - one);
            let z = one - x.abs() - y.abs();
            let fold = (-z).max(zero);
            let q = Vec3Lanes::new(x - fold.copysign(x), y - fold.copysign(y), z);
            let inverse = one / q.dot(q).sqrt();
            let from_pivot = Vec3Lanes::new(q.x * inverse, q.y * inverse, q.z * inverse);
            // Its solid angle over π is the squared sine of a cone as large; at the position, of
            // one that is seen from there.
            let spread = side * side * L::splat(4.0 * FRAC_1_PI) * inverse * inverse * inverse;
            let d = from_pivot - offset;
            let squared = d.dot(d).max(L::splat(1e-12));
            let distance = squared.sqrt();
            let spread = (spread * d.dot(from_pivot).max(zero) / (squared * distance)).min(one);
            let cosine = cosine_over(normal.dot(d) / distance, spread);
            let weight = match &self.lobe {
                None => cosine,
                Some(lobe) => lobe.weights(d, squared, spread, cosine),
            };
            let weight = weight.max(L::splat(LEAST_WEIGHT));
            // Behind the last leaf there is none.
            let weight = weight.select(zero.less(L::from_integers(depth)), zero);
            let ends = weight.running_sums() + before;
            *row = ends.store();
            before = L::splat(row[LANES - 1]);
        }
    }
}

/// A [`SeenQuadtree`] times what a receiver reflects. It is made by
/// [`SeenQuadtree::times`].
#[derive(Clone, Copy, Debug)]
pub struct QuadtreeProduct<'a> {
    seen: SeenQuadtree<'a>,
    ends: [f32; MOST_LEAVES],
    count: usize,
}

impl<'a> SeenQuadtree<'a> {
    /// The product with what a receiver reflects towards its viewer. `None` if the model does not
    /// keep leaves for it ([`QuadtreeOptions::product`](super::QuadtreeOptions::product)), if the
    /// receiver takes light from both sides, or if no leaf has a weight.
    #[inline]
    pub fn times(&self, at: &ShadingPoint) -> Option<QuadtreeProduct<'a>> {
        let leaves = self.tree().leaves();
        if leaves.is_empty() || leaves.len() > MOST_LEAVES || at.facing != Facing::Front {
            return None;
        }
        let mut product = QuadtreeProduct {
            seen: *self,
            ends: [0.0; MOST_LEAVES],
            count: leaves.len(),
        };
        LaneChoice::best().run(Weigh {
            leaves,
            offset: self.offset(),
            normal: at.normal,
            lobe: ReflectionLobe::of(at),
            ends: &mut product.ends,
        });
        let total = product.total();
        (total > 0.0 && total < f32::INFINITY).then_some(product)
    }
}

impl<'a> QuadtreeProduct<'a> {
    /// The tree alone.
    pub fn seen(&self) -> &SeenQuadtree<'a> {
        &self.seen
    }

    #[inline(always)]
    fn total(&self) -> f32 {
        self.ends[self.count - 1]
    }

    /// Probability of a leaf: exactly that with which it is chosen.
    #[inline(always)]
    fn probability(&self, leaf: usize) -> f32 {
        let before = if leaf > 0 { self.ends[leaf - 1] } else { 0.0 };
        (self.ends[leaf] - before) / self.total()
    }

    /// The density of the product in a direction over that of the tree alone, at least 1/64. In the
    /// measure `dω / ratio` the tree is what the product is in `dω`: samples whose densities
    /// are divided by the ratio teach the tree what its product needs.
    pub fn ratio(&self, direction: Vec3) -> f32 {
        let (from_pivot, _) = self.seen.at_pivot(direction);
        let (leaf, _) = leaf_at(self.seen.tree().counts(), code_of(square_of(from_pivot)));
        let ratio = self.probability(leaf) * self.seen.tree().leaf_count() as f32;
        ratio.max(LEAST_RATIO)
    }
}

impl DirectionDistribution for QuadtreeProduct<'_> {
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let bound = f64::from(u[1]) * f64::from(self.total());
        let (rows, _) = self.ends[..self.count].as_chunks::<LANES>();
        let below = |row: &[f32; LANES]| row.iter().filter(|&&end| f64::from(end) <= bound).count();
        let chosen = rows.iter().map(below).sum::<usize>().min(self.count - 1);
        let before = if chosen > 0 {
            f64::from(self.ends[chosen - 1])
        } else {
            0.0
        };
        let rest = (bound - before) / (f64::from(self.ends[chosen]) - before);
        let rest = (rest as f32).clamp(0.0, ONE_MINUS_EPSILON);
        let leaf = self.seen.tree().leaves()[chosen];
        let side = f32::from_bits((127 - (leaf & 15)) << 23);
        let corner = Vec2::new((leaf >> 4 & 0x3fff) as f32, (leaf >> 18) as f32);
        let square = corner * (1.0 / (1 << MAX_QUADTREE_DEPTH) as f32) + Vec2::new(u[0], rest) * side;
        let direction = self.seen.seen_from_pivot(direction_of(square));
        // Rounding may have moved it into another leaf.
        let density = self.pdf(direction);
        density.is_positive().then_some((direction, density))
    }

    #[inline]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        let (from_pivot, factor) = self.seen.at_pivot(direction);
        let (leaf, depth) = leaf_at(self.seen.tree().counts(), code_of(square_of(from_pivot)));
        // 4^depth.
        let density = self.probability(leaf) * f32::from_bits((127 + 2 * depth) << 23);
        octahedral_to_solid_angle(Density::new(density), from_pivot) * factor
    }
}
