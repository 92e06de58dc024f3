//! A tree as a distribution of directions.

use super::bits::{MAX_QUADTREE_DEPTH, bit, inner_count, is_tree, leaf_count, rank, select};
use super::counts;
use super::sample::{Chosen, descend, descend_counts};
use crate::GuidingError;
use crate::square::{code_of, direction_of, square_of};
use glam::Vec3;
use lightshed_sampling::{Density, DirectionDistribution, SolidAngle, octahedral_to_solid_angle};

/// A distribution of directions in 32, 64, … 1,024 bits: a quadtree over the octahedral square
/// whose leaves all have the same probability (§5.5).
///
/// With `L` leaves and `A` the area of the leaf that contains a direction `ω`,
/// `p(ω) = 1/(A L) · ‖q‖₂³/4`, `q = ω/‖ω‖₁` (eq. 5.1): directions are frequent
/// where the tree is fine. Samples come from two numbers by one warp from the root down, which
/// keeps the stratification of the numbers: neighbouring numbers give neighbouring directions.
///
/// The layout of the bits is that of the words in little-endian order: the root's four children are
/// the low bits of the first.
#[derive(Clone, Copy, Debug)]
pub struct CompressedQuadtree<'a> {
    words: &'a [u32],
    /// The first 64 bits.
    first: u64,
    /// Its [`counts`](super::counts), from which the same is read faster; empty if nobody counted.
    counts: &'a [u32],
    /// Its leaves, if products are sampled; otherwise empty.
    leaves: &'a [u32],
}

/// A square of the octahedral map: `[place, place + 1) · 2^−depth` along u and v.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QuadtreeCell {
    /// Depth in the tree, from 1.
    pub depth: u32,
    /// Whole numbers from 0 to `2^depth − 1`.
    pub place: [u32; 2],
}

impl QuadtreeCell {
    /// Its area on the unit square.
    pub fn area(&self) -> f32 {
        0.25f32.powi(self.depth as i32)
    }
}

impl<'a> CompressedQuadtree<'a> {
    /// The tree with these bits, 1 to 32 words.
    ///
    /// # Errors
    /// [`GuidingError::Damaged`] if they are not those of a tree of depth at most 14.
    pub fn new(words: &'a [u32]) -> Result<Self, GuidingError> {
        match is_tree(words) {
            true => Ok(Self::of_tree(words)),
            false => Err(GuidingError::Damaged("the bits are not those of a quadtree")),
        }
    }

    /// The same for bits that are known to form a tree.
    #[inline(always)]
    pub(super) fn of_tree(words: &'a [u32]) -> Self {
        let word = |index| words.get(index).map_or(0, |&word: &u32| u64::from(word));
        Self {
            words,
            first: word(0) | word(1) << 32,
            counts: &[],
            leaves: &[],
        }
    }

    /// The same tree with its counts.
    #[inline(always)]
    pub(super) fn with_counts(self, counts: &'a [u32]) -> Self {
        Self { counts, ..self }
    }

    /// The same tree with its leaves in a row.
    #[inline(always)]
    pub(super) fn with_leaves(self, leaves: &'a [u32]) -> Self {
        Self { leaves, ..self }
    }

    #[inline(always)]
    pub(super) fn counts(&self) -> &'a [u32] {
        self.counts
    }

    #[inline(always)]
    pub(super) fn leaves(&self) -> &'a [u32] {
        self.leaves
    }

    /// Leaves.
    pub fn leaf_count(&self) -> u32 {
        leaf_count(self.words)
    }

    /// The square of leaf number `number` in breadth-first order, reconstructed through its
    /// parents; `None` if there are fewer leaves.
    pub fn leaf(&self, number: u32) -> Option<QuadtreeCell> {
        let mut place = select(self.words, number, u32::MAX)?;
        let (mut depth, mut cell) = (0, [0; 2]);
        loop {
            cell[0] |= (place & 1) << depth;
            cell[1] |= (place >> 1 & 1) << depth;
            depth += 1;
            // Children of inner node k are bits 4 k to 4 k + 3; k is the inner node with k − 1
            // others before it.
            match place / 4 {
                0 => return Some(QuadtreeCell { depth, place: cell }),
                inner => place = select(self.words, inner - 1, 0)?,
            }
        }
    }

    /// Ones before a bit of the tree.
    #[inline(always)]
    fn rank(&self, place: u32) -> u32 {
        if place < 64 {
            (self.first & ((1 << place) - 1)).count_ones()
        } else {
            rank(self.words, place)
        }
    }

    #[inline(always)]
    fn bit(&self, place: u32) -> bool {
        if place < 64 {
            self.first >> place & 1 != 0
        } else {
            bit(self.words, place)
        }
    }

    /// Depth of the leaf that has a point of the square by its code.
    #[inline(always)]
    fn depth_at(&self, code: u32) -> u32 {
        // The bits of a small tree are at hand.
        if self.words.len() > 2 && !self.counts.is_empty() {
            return counts::depth_at(self.counts, code);
        }
        let (mut inner, mut depth, mut code) = (0, 0, code);
        loop {
            let place = 4 * inner + (code >> 30);
            depth += 1;
            if !self.bit(place) || depth == MAX_QUADTREE_DEPTH {
                return depth;
            }
            inner = self.rank(place) + 1;
            code <<= 2;
        }
    }

    /// Density on the unit square where leaves have this depth.
    #[inline(always)]
    fn square_density(&self, depth: u32) -> f32 {
        // 4^depth.
        f32::from_bits((127 + 2 * depth) << 23) / self.leaf_count() as f32
    }
}

impl CompressedQuadtree<'_> {
    /// The leaf and the place in it that `u` selects.
    #[inline(always)]
    pub(super) fn choose(&self, u: [f32; 2]) -> Chosen {
        if !self.counts.is_empty() {
            return descend_counts(self.counts, u);
        }
        match inner_count(self.words) {
            0..=16 => descend::<32>(self.words, u),
            17..=63 => descend::<64>(self.words, u),
            _ => descend::<512>(self.words, u),
        }
    }

    /// Density of a direction that should be in a leaf: rounding may have moved it into another.
    #[inline(always)]
    pub(super) fn density_near(&self, chosen: &Chosen, direction: Vec3) -> Density<SolidAngle> {
        let code = code_of(square_of(direction));
        let depth = match (code ^ chosen.code) >> (32 - 2 * chosen.depth) {
            0 => chosen.depth,
            _ => self.depth_at(code),
        };
        octahedral_to_solid_angle(Density::new(self.square_density(depth)), direction)
    }
}

impl DirectionDistribution for CompressedQuadtree<'_> {
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let chosen = self.choose(u);
        let direction = direction_of(chosen.square);
        let density = self.density_near(&chosen, direction);
        Some((direction, density))
    }

    #[inline(always)]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        let depth = self.depth_at(code_of(square_of(direction)));
        octahedral_to_solid_angle(Density::new(self.square_density(depth)), direction)
    }
}
