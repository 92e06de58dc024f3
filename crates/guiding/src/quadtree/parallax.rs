//! Trees that are seen from other places than the one that they were learnt for.
//!
//! A region's light is taken to come from a sphere of radius `t` around its pivot. The point
//! `x = pivot + t o`, `|o| < 1`, sees the place of direction `ω′` from the pivot in the direction
//! `ω = (ω′ − o)/s`, where `s = ‖ω′ − o‖`. That is one to one, and with `r = ω·ω′`
//! `dω′/dω = s²/r`, so `p(ω) = p_tree(ω′) s²/r` is a density for every `t`.

use super::view::CompressedQuadtree;
use crate::sample::TrainingSample;
use crate::square::direction_of;
use glam::Vec3;
use lightshed_sampling::{Density, DirectionDistribution, SolidAngle};
use lightshed_spatial::Bounds;

/// Words behind those of a tree: the pivot, and `1/t`.
pub(super) const PARALLAX_WORDS: usize = 4;
/// Largest `|o|`: places further away see what those do.
const LARGEST_OFFSET: f32 = 0.5;

/// The light of a region as seen from a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Parallax {
    /// `o`.
    offset: Vec3,
}

impl Parallax {
    /// From a region's words, at a position; none if there are no words.
    #[inline(always)]
    pub fn new(words: &[u32], position: Vec3) -> Self {
        let &[x, y, z, inverse] = words else {
            return Self::default();
        };
        let pivot = Vec3::from([x, y, z].map(f32::from_bits));
        let offset = (position - pivot) * f32::from_bits(inverse);
        let length = offset.length();
        let offset = match length {
            // NaN and infinity fail the comparisons.
            _ if length <= LARGEST_OFFSET => offset,
            _ if length < f32::INFINITY => offset * (LARGEST_OFFSET / length),
            _ => Vec3::ZERO,
        };
        Self { offset }
    }

    /// `ω′` of a direction, and `dω′/dω`.
    #[inline(always)]
    pub fn at_pivot(self, direction: Vec3) -> (Vec3, f32) {
        let along = self.offset.dot(direction);
        let r = (along * along + (1.0 - self.offset.length_squared())).sqrt();
        let s = r - along;
        ((self.offset + s * direction).normalize(), s * s / r)
    }

    /// The direction of which `ω′` is seen.
    #[inline(always)]
    pub fn seen(self, from_pivot: Vec3) -> Vec3 {
        (from_pivot - self.offset).normalize()
    }
}

/// The words of a region: its middle is the pivot, and `1/t` the mean over samples, each with its
/// weight. Samples are nearer than the extent of the region at most by rounding.
pub(super) fn learn_parallax(samples: &[TrainingSample], region: &Bounds) -> [u32; PARALLAX_WORDS] {
    /// Bits after the binary point of sums that do not depend on the order of their terms.
    const SCALE: f64 = (1u64 << 32) as f64;
    let pivot = 0.5 * (region.min + region.max);
    let side = f64::from((region.max - region.min).max_element());
    let largest = samples.iter().map(TrainingSample::weight).fold(0.0, f32::max);
    let (mut sum, mut total) = (0u64, 0u64);
    for sample in samples {
        let weight = f64::from(sample.weight() / largest);
        let nearness = (side / f64::from(sample.distance())).min(1.0);
        total += (weight * SCALE) as u64;
        sum += (weight * nearness * SCALE) as u64;
    }
    let inverse = if total > 0 {
        sum as f64 / (total as f64 * side)
    } else {
        0.0
    };
    let inverse = if inverse.is_finite() { inverse as f32 } else { 0.0 };
    [pivot.x, pivot.y, pivot.z, inverse].map(f32::to_bits)
}

/// Whether words are those of a region.
pub(super) fn is_parallax(words: &[u32]) -> bool {
    let is_sound = |&word: &u32| f32::from_bits(word).is_finite();
    words.iter().all(is_sound) && words.last().is_none_or(|&inverse| f32::from_bits(inverse) >= 0.0)
}

/// A [`CompressedQuadtree`] as it is seen from a place.
#[derive(Clone, Copy, Debug)]
pub struct SeenQuadtree<'a> {
    tree: CompressedQuadtree<'a>,
    parallax: Parallax,
}

impl<'a> SeenQuadtree<'a> {
    pub(super) fn new(tree: CompressedQuadtree<'a>, parallax: Parallax) -> Self {
        Self { tree, parallax }
    }

    #[inline(always)]
    pub(super) fn offset(&self) -> Vec3 {
        self.parallax.offset
    }

    #[inline(always)]
    pub(super) fn at_pivot(&self, direction: Vec3) -> (Vec3, f32) {
        match self.parallax.offset == Vec3::ZERO {
            true => (direction, 1.0),
            false => self.parallax.at_pivot(direction),
        }
    }

    #[inline(always)]
    pub(super) fn seen_from_pivot(&self, from_pivot: Vec3) -> Vec3 {
        match self.parallax.offset == Vec3::ZERO {
            true => from_pivot,
            false => self.parallax.seen(from_pivot),
        }
    }

    /// The tree as its pivot sees it.
    pub fn tree(&self) -> &CompressedQuadtree<'a> {
        &self.tree
    }
}

impl DirectionDistribution for SeenQuadtree<'_> {
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        if self.parallax.offset == Vec3::ZERO {
            return self.tree.sample(u);
        }
        let chosen = self.tree.choose(u);
        let direction = self.parallax.seen(direction_of(chosen.square));
        let (from_pivot, factor) = self.parallax.at_pivot(direction);
        let density = self.tree.density_near(&chosen, from_pivot) * factor;
        density.is_positive().then_some((direction, density))
    }

    #[inline(always)]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        if self.parallax.offset == Vec3::ZERO {
            return self.tree.pdf(direction);
        }
        let (from_pivot, factor) = self.parallax.at_pivot(direction);
        self.tree.pdf(from_pivot) * factor
    }
}
