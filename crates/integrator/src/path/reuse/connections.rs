//! The paths by which the pixels of a tile reach the `x₂` of its trees.

use super::points::{Far, Near, store_all, vector};
use super::tree::{Trees, Vertex};
use crate::path::paths::lanes_within;
use crate::path::scattered_lanes::{is_black, load_rows, load_vectors};
use crate::path::scattering::SurfaceVertex;
use lightshed_film::MAX_BATCH;
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, LaneMask, Lanes, Vec3Lanes};
use lightshed_sampling::power_heuristic_lanes;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{RayBatch, Rgb, Scene};
use std::ops::Range;

/// Pixels of a tile, at most.
pub const TILE_PIXELS: usize = 16;

/// Groups of lanes of a tile's pixels.
const GROUPS: usize = TILE_PIXELS / LANES;

type Row = [f32; LANES];
type Rows = [Row; 3];

/// The paths `x₁ x₂` of eight pixels to the `x₂` of one tree, and how that scatters what the tree
/// found.
#[derive(Clone, Copy)]
struct Connections {
    /// `f(x₁) |cos θ₁| |cos θ₂| / d²`.
    factor: Rows,
    /// Densities with which the pixels' BSDF samples take `x₂`, per solid angle, and the areas that
    /// these are multiplied by for densities per area.
    pdf: Row,
    geometry: Row,
    emitter: Scattering,
    wi: Scattering,
}

/// `f(x₂) |cos θ|` towards the pixels, and the densities of that direction given the pixels.
#[derive(Clone, Copy)]
struct Scattering {
    value: Rows,
    pdf: Row,
}

const BLACK: Scattering = Scattering {
    value: [[0.0; LANES]; 3],
    pdf: [0.0; LANES],
};

const NO_CONNECTIONS: Connections = Connections {
    factor: [[0.0; LANES]; 3],
    pdf: [0.0; LANES],
    geometry: [0.0; LANES],
    emitter: BLACK,
    wi: BLACK,
};

/// A tree that has light to share.
#[derive(Clone, Copy, Default)]
struct Lit {
    /// Its number in the tile and in the batch, and the place of its `x₂`.
    index: usize,
    tree: usize,
    place: usize,
    /// Whether an emitter sampled at `x₂` is seen, and whether there is light along the sampled
    /// direction.
    by_emitter: bool,
    by_wi: bool,
    /// Pixels that reach `x₂`, as bits.
    valid: u32,
}

/// Room for the work on a tile.
pub struct Tile {
    lit: [Lit; TILE_PIXELS],
    count: usize,
    /// By lit tree and group of pixels.
    connections: [[Connections; GROUPS]; TILE_PIXELS],
    /// Rays, batch by batch, with the places of their lit trees and their pixels.
    rays: [RayBatch; BATCHES],
    owners: [[u8; MAX_BATCH]; BATCHES],
    counts: [usize; BATCHES],
    batch: usize,
}

/// A batch may lack a group to be full.
pub const BATCHES: usize = TILE_PIXELS * TILE_PIXELS / (MAX_BATCH - LANES) + 1;

impl Tile {
    pub fn new() -> Self {
        Self {
            lit: [Lit::default(); TILE_PIXELS],
            count: 0,
            connections: [[NO_CONNECTIONS; GROUPS]; TILE_PIXELS],
            rays: [const { RayBatch::NOWHERE }; BATCHES],
            owners: [[0; MAX_BATCH]; BATCHES],
            counts: [0; BATCHES],
            batch: 0,
        }
    }

    /// Connects every pixel of the tile to every tree of it that has light to share, as far as
    /// rays decide nothing.
    pub fn connect(&mut self, scene: &Scene, lanes: LaneChoice, trees: &mut Trees, tile: &Range<usize>) {
        self.find(trees, tile);
        (self.counts, self.batch) = ([0; BATCHES], 0);
        if self.count == 0 {
            return;
        }
        lanes.run(Connect {
            tile: self,
            trees,
            first: tile.start,
            pixels: tile.len().min(TILE_PIXELS),
        });
        self.connect_others(scene, trees, tile);
    }

    /// The rays that must be free, batch by batch.
    pub fn rays(&self) -> impl Iterator<Item = (&RayBatch, usize)> {
        self.rays.iter().zip(self.counts).filter(|(_, count)| *count > 0)
    }

    /// Takes away the connections whose rays are blocked, bit by bit of a batch.
    pub fn block(&mut self, batch: usize, mut blocked: u64) {
        let (Some(owners), Some(&count)) = (self.owners.get(batch), self.counts.get(batch)) else {
            return;
        };
        if count < MAX_BATCH {
            blocked &= (1 << count) - 1;
        }
        while blocked != 0 {
            let owner = owners[blocked.trailing_zeros() as usize % MAX_BATCH];
            blocked &= blocked - 1;
            let (lit, pixel) = (usize::from(owner) / TILE_PIXELS, usize::from(owner) % TILE_PIXELS);
            self.lit[lit].valid &= !(1 << pixel);
        }
    }

    /// Adds what the connections bring to the pixels' own light.
    pub fn add(&self, lanes: LaneChoice, trees: &mut Trees, first: usize) {
        if self.count > 0 {
            lanes.run(Add {
                tile: self,
                trees,
                first,
            });
        }
    }

    /// The trees that have light to share.
    fn find(&mut self, trees: &Trees, tile: &Range<usize>) {
        self.count = 0;
        for (index, tree) in tile.clone().take(TILE_PIXELS).enumerate() {
            let Some(place) = trees.second(tree) else {
                continue;
            };
            let by_emitter = trees.behind.lit >> place & 1 == 1;
            let by_wi = trees.is_bright(tree, place);
            if by_emitter || by_wi {
                self.lit[self.count] = Lit {
                    index,
                    tree,
                    place,
                    by_emitter,
                    by_wi,
                    valid: 0,
                };
                self.count += 1;
            }
        }
    }

    /// A batch with room for the rays of a group: its number.
    #[inline(always)]
    fn room(&mut self) -> usize {
        if self.counts[self.batch] > MAX_BATCH - LANES && self.batch + 1 < BATCHES {
            self.batch += 1;
        }
        self.batch
    }

    /// Connections of which one end or the other is not shaded in lanes.
    fn connect_others(&mut self, scene: &Scene, trees: &mut Trees, tile: &Range<usize>) {
        let there = |vertex: &Vertex| vertex.alone | vertex.points.there;
        let of_tile = |set: u64| set >> tile.start & ((1 << tile.len().min(TILE_PIXELS)) - 1);
        let others = of_tile(trees.first.alone);
        let is_alone = |place: usize, trees: &Trees| trees.second.alone >> place & 1 == 1;
        for number in 0..self.count {
            let lit = self.lit[number];
            let mut pixels = match is_alone(lit.place, trees) {
                true => of_tile(there(&trees.first)),
                false => others,
            };
            if pixels != 0 {
                trees.second.know(scene, lit.place);
            }
            while pixels != 0 {
                let pixel = pixels.trailing_zeros() as usize;
                pixels &= pixels - 1;
                trees.first.know(scene, tile.start + pixel);
                if let (Some(first), Some(second)) = (
                    &trees.first.known[tile.start + pixel],
                    &trees.second.known[lit.place],
                ) {
                    self.connect_alone(number, pixel, [first, second], trees);
                }
            }
        }
    }

    fn connect_alone(
        &mut self,
        number: usize,
        pixel: usize,
        [first, second]: [&SurfaceVertex; 2],
        trees: &Trees,
    ) {
        let lit = self.lit[number];
        let between = second.point.position - first.point.position;
        let distance_squared = between.length_squared();
        let direction = between / distance_squared.sqrt();
        let scattered = first
            .bsdf
            .evaluate(first.wo, first.point.shading.to_local(direction));
        let geometry = second.point.geometric_normal.dot(direction).abs() / distance_squared;
        let factor = scattered.value * geometry;
        let pdf = scattered.pdf.value();
        if factor == Rgb::ZERO || !factor.is_finite() || !(pdf > 0.0 && geometry > 0.0) {
            return;
        }
        let wo = second.point.shading.to_local(-direction);
        let scattering = |is_used: bool, wi: Vec3| match is_used {
            true => second.bsdf.evaluate(wo, wi),
            false => Default::default(),
        };
        let emitter = scattering(lit.by_emitter, vector(&trees.behind.light, lit.place));
        let wi = scattering(lit.by_wi, vector(&trees.behind.wi, lit.place));
        if emitter.value == Rgb::ZERO && wi.value == Rgb::ZERO {
            return;
        }
        let (group, lane) = (pixel / LANES % GROUPS, pixel % LANES);
        let connections = &mut self.connections[number][group];
        let set = |rows: &mut Rows, value: Rgb| {
            for axis in 0..3 {
                rows[axis][lane] = value[axis];
            }
        };
        set(&mut connections.factor, factor);
        set(&mut connections.emitter.value, emitter.value);
        set(&mut connections.wi.value, wi.value);
        (connections.pdf[lane], connections.geometry[lane]) = (pdf, geometry);
        connections.emitter.pdf[lane] = emitter.pdf.value();
        connections.wi.pdf[lane] = wi.pdf.value();
        self.lit[number].valid |= 1 << pixel;
        // A tree's own pixel has seen its x₂.
        if pixel != lit.index {
            let batch = self.room();
            let place = self.counts[batch];
            self.rays[batch].set(place, &first.point.segment_to(&second.point));
            self.owners[batch][place % MAX_BATCH] = (number * TILE_PIXELS + pixel) as u8;
            self.counts[batch] += 1;
        }
    }
}

/// Connections between vertices in lanes.
struct Connect<'a> {
    tile: &'a mut Tile,
    trees: &'a Trees,
    /// The first of the tile's trees, and how many pixels it has.
    first: usize,
    pixels: usize,
}

impl LaneKernel for Connect<'_> {
    const HOT: bool = true;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        // There are no points if lanes are arrays.
        if !L::IN_REGISTERS {
            return;
        }
        for group in 0..GROUPS {
            let start = group * LANES;
            if start >= self.pixels {
                return;
            }
            let lanes = lanes_within(start, self.pixels);
            let near = Near::<L>::load(&self.trees.first.points, self.first + start, lanes);
            if near.seen == 0 {
                continue;
            }
            for number in 0..self.tile.count {
                self.eight(&near, number, group);
            }
        }
    }
}

impl Connect<'_> {
    /// The pixels `near` to one lit tree.
    #[inline(always)]
    fn eight<L: Lanes>(&mut self, near: &Near<L>, number: usize, group: usize) {
        let lit = self.tile.lit[number];
        let seconds = &self.trees.second;
        if seconds.points.there >> lit.place & 1 == 0 {
            return;
        }
        let far = Far::<L>::load(&seconds.points, lit.place);
        let (zero, infinity) = (L::splat(0.0), L::splat(f32::INFINITY));
        let between = far.position - near.position;
        let distance_squared = between.dot(between);
        let distance = distance_squared.sqrt();
        let direction = Vec3Lanes::new(between.x / distance, between.y / distance, between.z / distance);
        let (value, pdf) = near.evaluate(direction);
        let geometry = far.geometric_normal.dot(direction).abs() / distance_squared;
        let factor = value * geometry;
        let size = factor.abs();
        let finite = size.x.less(infinity) & size.y.less(infinity) & size.z.less(infinity);
        let reached = finite & !is_black(factor) & zero.less(pdf) & zero.less(geometry);
        let reached = reached & L::Mask::from_bits(near.seen);
        if reached.bits() == 0 {
            return;
        }
        let seen = far.seen_from(-direction);
        let mut scatterings = [BLACK; 2];
        let mut lights = L::Mask::from_bits(0);
        let behind = &self.trees.behind;
        // One after the other through the same code, which is long.
        let sides = [(lit.by_emitter, &behind.light), (lit.by_wi, &behind.wi)];
        for side in 0..2 {
            let (is_used, wi) = sides[side];
            if is_used {
                let (value, pdf) = far.evaluate(&seen, vector(wi, lit.place));
                lights = lights | !is_black(value);
                scatterings[side] = Scattering {
                    value: value.store(),
                    pdf: pdf.store(),
                };
            }
        }
        let valid = (reached & lights).bits();
        if valid == 0 {
            return;
        }
        let tile = &mut *self.tile;
        let [emitter, wi] = scatterings;
        tile.connections[number][group] = Connections {
            factor: factor.store(),
            pdf: pdf.store(),
            geometry: geometry.store(),
            emitter,
            wi,
        };
        let start = group * LANES;
        tile.lit[number].valid |= valid << start;
        // A tree's own pixel has seen its x₂.
        let mut traced = valid & !((1u32 << lit.index) >> start);
        let batch = tile.room();
        let mut place = tile.counts[batch];
        let origin = near.origins_towards(between);
        let target = far.origins_towards(-between);
        let one = L::splat(1.0);
        tile.rays[batch].store_compressed(place, origin, target - origin, one, traced);
        while traced != 0 {
            let pixel = start + traced.trailing_zeros() as usize;
            traced &= traced - 1;
            tile.owners[batch][place % MAX_BATCH] = (number * TILE_PIXELS + pixel) as u8;
            place += 1;
        }
        tile.counts[batch] = place;
    }
}

/// Adds the light of connections.
struct Add<'a> {
    tile: &'a Tile,
    trees: &'a mut Trees,
    /// The first of the tile's trees.
    first: usize,
}

impl LaneKernel for Add<'_> {
    const HOT: bool = true;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for number in 0..self.tile.count {
            let lit = self.tile.lit[number];
            let connections = &self.tile.connections[number];
            let weights = weights(connections, &lit);
            let light = Light::<L>::of(self.trees, &lit, weights);
            for (group, connections) in connections.iter().enumerate() {
                let valid = lit.valid >> (group * LANES) & ((1 << LANES) - 1);
                if valid != 0 {
                    let place = self.first + group * LANES;
                    let own = load_vectors::<L>(&self.trees.own, place);
                    let more = light.through(connections);
                    let size = more.abs();
                    let infinity = L::splat(f32::INFINITY);
                    let finite = size.x.less(infinity) & size.y.less(infinity) & size.z.less(infinity);
                    let added = finite & L::Mask::from_bits(valid);
                    store_all(&mut self.trees.own, place, (own + more).select(added, own));
                }
            }
        }
    }
}

/// `m_i / p_i = 1 / Σ_j p_j` for the two continuations from `x₂`, by an emitter sample there and by
/// the sampled direction, without the density of the emitter sample, which is the same for all
/// pixels; 0 if the tree's own pixel cannot have made it.
fn weights(connections: &[Connections; GROUPS], lit: &Lit) -> [f32; 2] {
    let (mut totals, mut own) = ([0.0f64; 2], [0.0f64; 2]);
    let mut left = lit.valid;
    while left != 0 {
        let pixel = left.trailing_zeros() as usize;
        left &= left - 1;
        let (connections, lane) = (&connections[pixel / LANES % GROUPS], pixel % LANES);
        let second = f64::from(connections.pdf[lane]) * f64::from(connections.geometry[lane]);
        let is_black = |scattering: &Scattering| scattering.value.iter().all(|row| row[lane] == 0.0);
        // A pixel that would not use a continuation does not make it.
        let densities = [
            match is_black(&connections.emitter) {
                true => 0.0,
                false => second,
            },
            match is_black(&connections.wi) {
                true => 0.0,
                false => second * f64::from(connections.wi.pdf[lane]),
            },
        ];
        for (total, density) in totals.iter_mut().zip(densities) {
            *total += if density.is_finite() {
                density.max(0.0)
            } else {
                0.0
            };
        }
        if pixel == lit.index {
            own = densities;
        }
    }
    std::array::from_fn(|way| {
        let share = (sound(own[way]) / totals[way].min(f64::MAX)).min(1.0);
        let weight = share / own[way];
        if weight.is_finite() { weight as f32 } else { 0.0 }
    })
}

/// A density, or 0 for what is none.
fn sound(density: f64) -> f64 {
    match density > 0.0 {
        true => density.min(f64::MAX),
        false => 0.0,
    }
}

/// What a tree found behind `x₂`, in all lanes.
struct Light<L: Lanes> {
    emitter: Vec3Lanes<L>,
    emitter_pdf: L,
    is_delta: bool,
    met: Vec3Lanes<L>,
    met_pdf: L,
    beyond: Vec3Lanes<L>,
    weights: [L; 2],
}

impl<L: Lanes> Light<L> {
    #[inline(always)]
    fn of(trees: &Trees, lit: &Lit, weights: [f32; 2]) -> Self {
        let (behind, tree) = (&trees.behind, lit.tree % MAX_BATCH);
        let splat = |v: Rgb| Vec3Lanes::splat(v.to_array());
        let (met, met_pdf) = behind.met[tree].unwrap_or((Rgb::ZERO, 0.0));
        Self {
            emitter: splat(match lit.by_emitter {
                true => vector(&behind.light_weight, lit.place),
                false => Rgb::ZERO,
            }),
            emitter_pdf: L::splat(behind.light_pdf.get(lit.place)),
            is_delta: behind.light_is_delta >> lit.place & 1 == 1,
            met: splat(met),
            met_pdf: L::splat(met_pdf),
            beyond: splat(behind.beyond[tree]),
            weights: weights.map(L::splat),
        }
    }

    /// What reaches the pixels' film. Emitters are found in two ways from `x₂`; the power heuristic
    /// combines them for each pixel separately.
    #[inline(always)]
    fn through(&self, connections: &Connections) -> Vec3Lanes<L> {
        let [by_emitter, by_wi] = self.weights;
        let pdf = L::load(&connections.emitter.pdf);
        let mis = match self.is_delta {
            true => L::splat(1.0),
            false => power_heuristic_lanes(self.emitter_pdf, pdf),
        };
        let emitter = load_rows::<L>(&connections.emitter.value) * self.emitter * mis * by_emitter;
        let pdf = L::load(&connections.wi.pdf);
        let met = self.met * power_heuristic_lanes(pdf, self.met_pdf);
        let wi = load_rows::<L>(&connections.wi.value) * (met + self.beyond) * by_wi;
        load_rows::<L>(&connections.factor) * (emitter + wi)
    }
}
