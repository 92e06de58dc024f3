//! Trees for lights that move a little: the order is kept as long as it is good.

use super::build::{self, PART_LIGHTS};
use super::drift::{Cost, Drift};
use super::tree::PerfectTree;
use crate::block::{LightNode, WIDTH};
use crate::light::check_lights;
use crate::{Bounds, Light, LightError};
use lightshed_spatial::CurveCube;

/// The work that [`PerfectTree::update`] did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TreeUpdate {
    /// The order was kept.
    Refitted,
    /// This number of parts of 4,096 lights were sorted again, each by itself.
    PartlySorted(usize),
    /// All lights were sorted anew.
    Rebuilt,
}

impl PerfectTree {
    /// Follows lights that have moved, or changed otherwise, since the last build. It keeps their
    /// order and recomputes all nodes. Then it sorts those parts of 4,096 lights again, each by
    /// itself, whose drift exceeds `limit`, and all lights if that does not help or their number
    /// has changed. Allocates only in the first call and for more lights than ever before.
    ///
    /// The result is a valid tree for any limit. A limit of `1` sorts everything that got worse, an
    /// infinite one nothing.
    ///
    /// # Errors
    ///
    /// See [`LightError`]; the tree is then unchanged.
    pub fn update(&mut self, lights: &[Light], limit: f32) -> Result<TreeUpdate, LightError> {
        if lights.len() != self.leaf_of.len() {
            self.rebuild(lights)?;
            return Ok(TreeUpdate::Rebuilt);
        }
        check_lights(lights)?;
        self.refit(lights);
        let limit = f64::from(limit);
        let mut sorted = 0;
        for part in 0..self.drift.costs.len() {
            if self.cost(part).growth(&self.drift.costs[part]) > limit {
                self.sort_part(lights, part);
                sorted += 1;
            }
        }
        if sorted == 0 {
            return Ok(TreeUpdate::Refitted);
        }
        self.refit(lights);
        if self.drift() > limit {
            self.rebuild(lights)?;
            return Ok(TreeUpdate::Rebuilt);
        }
        Ok(TreeUpdate::PartlySorted(sorted))
    }

    /// How many times larger the nodes are than when their lights were last sorted, in the part
    /// where that is worst: by `Σ I |diagonal|²` of the nodes of eight lights, or of the part's
    /// root. 1 after a build.
    pub fn drift(&self) -> f64 {
        let growths = (0..)
            .zip(&self.drift.costs)
            .map(|(part, before)| self.cost(part).growth(before));
        growths.fold(0.0, f64::max)
    }

    /// Takes the current size of the nodes as the reference.
    pub(super) fn note_costs(&mut self) {
        let mut costs = std::mem::take(&mut self.drift.costs);
        costs.clear();
        costs.extend((0..self.leaf_of.len().div_ceil(PART_LIGHTS)).map(|part| self.cost(part)));
        self.drift.costs = costs;
    }

    /// Recomputes all nodes in the present order.
    fn refit(&mut self, lights: &[Light]) {
        build::build_levels(&mut self.blocks, &self.levels, &mut self.light_at, lights, None);
    }

    fn cost(&self, part: usize) -> Cost {
        let size =
            |node: LightNode| f64::from(node.intensity) * f64::from(node.bounds.diagonal().length_squared());
        // `down` levels above the leaves, if there are as many.
        let level = |down: u32| (self.depth().saturating_sub(down), down.min(self.depth()));
        let (small, down) = level(WIDTH.trailing_zeros());
        let first = (part * PART_LIGHTS) >> down;
        let end = self
            .leaf_of
            .len()
            .min((part + 1) * PART_LIGHTS)
            .div_ceil(1 << down);
        let node = |level: u32, node: usize| self.block(level, node as u32).node(node % WIDTH);
        let (root, down) = level(PART_LIGHTS.trailing_zeros());
        Cost {
            small: (first..end).map(|i| size(node(small, i))).sum(),
            root: size(node(root, (part * PART_LIGHTS) >> down)),
        }
    }

    /// Sorts the lights of a part along the curve through their own box.
    fn sort_part(&mut self, lights: &[Light], part: usize) {
        let first = part * PART_LIGHTS;
        let end = self.light_at.len().min(first + PART_LIGHTS);
        let own = &mut self.light_at[first..end];
        let bounds = |&light: &u32| lights[light as usize].bounds;
        let cube = CurveCube::around(&Bounds::of_points(own.iter().map(|light| bounds(light).center())));
        let Drift { codes, keys, .. } = &mut self.drift;
        codes.resize(own.len(), 0);
        self.options.curve.encode(&cube, own, bounds, codes);
        keys.clear();
        keys.extend(codes.iter().copied().zip(own.iter().copied()));
        keys.sort_unstable();
        for ((leaf, slot), &(_, light)) in (first as u32..).zip(own).zip(keys.iter()) {
            *slot = light;
            self.leaf_of[light as usize] = leaf;
        }
    }
}
