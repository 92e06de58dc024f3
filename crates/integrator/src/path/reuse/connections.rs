//! The paths by which pixels reach the `x₂` of others' trees.

mod gain;
mod weights;

use super::points::{Far, Near, store_all, vector};
use super::reach::Reach;
use super::squares::MOST_PIXELS;
use super::tree::{Trees, Vertex};
use crate::path::paths::lanes_within;
use crate::path::scattered_lanes::{is_black, load_rows, load_vectors};
use crate::path::scattering::SurfaceVertex;
use gain::Gain;
use lightshed_film::MAX_BATCH;
use lightshed_lanes::{Column, LANES, LaneChoice, LaneKernel, LaneMask, Lanes, Vec3Lanes};
use lightshed_sampling::power_heuristic_lanes;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{RayBatch, Rgb, Scene};
use std::ops::Range;
use weights::weights;

/// Blocks of connections that are worked on together: one block is a lit tree and [`LANES`] pixels.
/// All pixels of a square and one lit tree fill them.
const BLOCKS: usize = MOST_PIXELS / LANES;

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
    /// Its batch, its number there, and the place of its `x₂`.
    batch: usize,
    tree: usize,
    place: usize,
    /// The groups that share what an emitter sample at `x₂` found, and those that share what was
    /// found along the sampled direction; none if there is no light.
    by_emitter: Groups,
    by_wi: Groups,
    /// Both.
    all: Groups,
    /// Number of its first block.
    block: usize,
}

/// Some groups that follow each other.
#[derive(Clone, Copy, Default)]
struct Groups {
    first: usize,
    end: usize,
}

impl Groups {
    /// The groups of the `pixels` places, a power of two, around a place of a square with `count`
    /// groups.
    fn around(place: usize, pixels: usize, count: usize) -> Self {
        let wide = (pixels / LANES).max(1);
        let first = place / LANES / wide * wide;
        let end = (first + wide).min(count);
        Self { first, end }
    }

    #[inline(always)]
    fn contains(self, group: usize) -> bool {
        (self.first..self.end).contains(&group)
    }

    #[inline(always)]
    fn len(self) -> usize {
        self.end - self.first
    }
}

impl Lit {
    /// The number of the block with a group.
    #[inline(always)]
    fn block(&self, group: usize) -> usize {
        (self.block + group - self.all.first) % BLOCKS
    }

    /// The lane of its own pixel, if that is one of a group.
    #[inline(always)]
    fn own_lane(&self, group: &Group) -> Option<usize> {
        let lane = self.tree.wrapping_sub(group.place);
        (self.batch == group.batch && lane < LANES && group.lanes >> lane & 1 == 1).then_some(lane)
    }
}

/// Eight pixels of a square: their batch, the place of the first, and which of them there are.
#[derive(Clone, Copy, Default)]
struct Group {
    batch: usize,
    place: usize,
    lanes: u32,
}

impl Group {
    /// The part of a set of a batch's places that is in this group.
    #[inline(always)]
    fn part(&self, set: u64) -> u32 {
        (set >> self.place) as u32 & self.lanes
    }
}

/// The connections of eight pixels to one lit tree.
#[derive(Clone, Copy)]
struct Block {
    rows: Connections,
    /// Pixels that reach `x₂`, as bits.
    valid: u32,
}

/// Room for the work on a square.
pub struct Sharing {
    groups: Vec<Group>,
    lit: Vec<Lit>,
    /// The lit trees that are worked on, and their blocks: all groups of the first one, all of the
    /// second …
    work: Range<usize>,
    blocks: [Block; BLOCKS],
    /// Rays, batch by batch, with the places of their blocks and their lanes.
    rays: [RayBatch; BATCHES],
    owners: [[u8; MAX_BATCH]; BATCHES],
    counts: [usize; BATCHES],
    batch: usize,
    /// Connections so far that are evaluated one by one whatever lanes there are.
    pub alone: u64,
}

const _: () = assert!(BLOCKS * LANES <= 1 << u8::BITS);

/// A batch may lack a group to be full.
pub const BATCHES: usize = BLOCKS * LANES / (MAX_BATCH - LANES) + 1;

impl Sharing {
    pub fn new() -> Self {
        let nothing = Block {
            rows: NO_CONNECTIONS,
            valid: 0,
        };
        Self {
            groups: Vec::with_capacity(BLOCKS),
            lit: Vec::with_capacity(MOST_PIXELS),
            work: 0..0,
            blocks: [nothing; BLOCKS],
            rays: [const { RayBatch::NOWHERE }; BATCHES],
            owners: [[0; MAX_BATCH]; BATCHES],
            counts: [0; BATCHES],
            batch: 0,
            alone: 0,
        }
    }

    /// Begins the work on the trees of a square's pixels, `pixels` in all. Each shares its light as
    /// far as `reach` says, which then learns from them.
    pub fn begin(&mut self, batches: &[Trees], pixels: usize, reach: &mut Reach) {
        self.groups.clear();
        self.lit.clear();
        self.work = 0..0;
        for batch in 0..batches.len() {
            let end = MAX_BATCH.min(pixels - batch * MAX_BATCH);
            for place in (0..end).step_by(LANES) {
                let lanes = lanes_within(place, end);
                self.groups.push(Group { batch, place, lanes });
            }
        }
        let (others, count) = (*reach, self.groups.len());
        reach.fade(pixels);
        for ([batch, tree, place], brightness) in Trees::all_bright(batches, pixels) {
            reach.learn(brightness);
            let around = |brightness: f32| match brightness > 0.0 {
                true => Groups::around(batch * MAX_BATCH + tree, others.pixels(brightness), count),
                false => Groups::default(),
            };
            let [by_emitter, by_wi] = brightness.map(around);
            let all = if by_emitter.len() > by_wi.len() {
                by_emitter
            } else {
                by_wi
            };
            if all.len() > 0 {
                self.lit.push(Lit {
                    batch,
                    tree,
                    place,
                    by_emitter,
                    by_wi,
                    all,
                    block: 0,
                });
            }
        }
    }

    /// Connects the next trees that have light to share to the pixels that share it, as far as
    /// rays decide nothing; false if none is left.
    pub fn connect(&mut self, scene: &Scene, lanes: LaneChoice, batches: &mut [Trees]) -> bool {
        let start = self.work.end;
        let mut blocks = 0;
        for lit in &mut self.lit[start..] {
            if blocks + lit.all.len() > BLOCKS {
                break;
            }
            lit.block = blocks;
            blocks += lit.all.len();
            self.work.end += 1;
        }
        self.work.start = start;
        (self.counts, self.batch) = ([0; BATCHES], 0);
        if self.work.is_empty() {
            return false;
        }
        for block in &mut self.blocks[..blocks] {
            block.valid = 0;
        }
        lanes.run(Connect {
            sharing: self,
            batches,
        });
        self.connect_others(scene, batches);
        true
    }

    /// The rays that must be free, batch by batch.
    pub fn rays(&self) -> impl Iterator<Item = (&RayBatch, usize)> {
        self.rays.iter().zip(self.counts).filter(|(_, count)| *count > 0)
    }

    /// Takes away the connections whose rays are blocked, bit by bit of a batch.
    fn block(&mut self, batch: usize, mut blocked: u64) {
        let (Some(owners), Some(&count)) = (self.owners.get(batch), self.counts.get(batch)) else {
            return;
        };
        if count < MAX_BATCH {
            blocked &= (1 << count) - 1;
        }
        while blocked != 0 {
            let owner = usize::from(owners[blocked.trailing_zeros() as usize % MAX_BATCH]);
            blocked &= blocked - 1;
            self.blocks[owner / LANES].valid &= !(1 << (owner % LANES));
        }
    }

    /// Adds what the connections whose rays are not `blocked` bring to the pixels' own light.
    pub fn add(&mut self, lanes: LaneChoice, blocked: [u64; BATCHES], batches: &mut [Trees]) {
        for (batch, blocked) in blocked.into_iter().enumerate() {
            self.block(batch, blocked);
        }
        lanes.run(Add {
            sharing: self,
            batches,
        });
    }

    /// Adds what the pixels gain by the connections that were added last to `gains`, batch by
    /// batch: how much more their second moments would be without the other pixels.
    pub fn add_gains(&self, lanes: LaneChoice, batches: &[Trees], gains: &mut [Column]) {
        lanes.run(Gain {
            sharing: self,
            batches,
            gains,
        });
    }

    /// The connections of a tree at work, and the groups of pixels that they lead to.
    #[inline(always)]
    fn reached_by(&self, lit: &Lit) -> (&[Block], &[Group]) {
        let blocks = &self.blocks[lit.block..lit.block + lit.all.len()];
        (blocks, &self.groups[lit.all.first..lit.all.end])
    }

    /// All groups that some tree at work shares its light with.
    #[inline(always)]
    fn groups_at_work(&self) -> Groups {
        let at_work = &self.lit[self.work.clone()];
        Groups {
            first: at_work.iter().map(|lit| lit.all.first).min().unwrap_or(0),
            end: at_work.iter().map(|lit| lit.all.end).max().unwrap_or(0),
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
    fn connect_others(&mut self, scene: &Scene, batches: &mut [Trees]) {
        let there = |vertex: &Vertex| vertex.alone | vertex.points.there;
        for number in self.work.clone() {
            let lit = self.lit[number];
            let is_alone = batches[lit.batch].second.alone >> lit.place & 1 == 1;
            for index in lit.all.first..lit.all.end {
                let group = self.groups[index];
                let first = &batches[group.batch].first;
                let mut pixels = match is_alone {
                    true => group.part(there(first)),
                    false => group.part(first.alone),
                };
                if pixels != 0 {
                    batches[lit.batch].second.know(scene, lit.place);
                }
                while pixels != 0 {
                    let lane = pixels.trailing_zeros() as usize;
                    pixels &= pixels - 1;
                    batches[group.batch].first.know(scene, group.place + lane);
                    let lighted = &batches[lit.batch];
                    let ends = [
                        (&batches[group.batch].first, group.place + lane),
                        (&lighted.second, lit.place),
                    ];
                    // Where lanes are arrays all are made here; what is counted is the same.
                    let for_lanes = |(vertex, place): (&Vertex, usize)| {
                        scene.is_for_lanes(vertex.hits.primitive.get_word(place))
                    };
                    self.alone += u64::from(!ends.into_iter().all(for_lanes));
                    if let (Some(first), Some(second)) = (
                        &batches[group.batch].first.known[group.place + lane],
                        &lighted.second.known[lit.place],
                    ) {
                        self.connect_alone(number, (index, lane), [first, second], lighted);
                    }
                }
            }
        }
    }

    fn connect_alone(
        &mut self,
        number: usize,
        (index, lane): (usize, usize),
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
        let emitter = scattering(
            lit.by_emitter.contains(index),
            vector(&trees.behind.light, lit.place),
        );
        let wi = scattering(lit.by_wi.contains(index), vector(&trees.behind.wi, lit.place));
        if emitter.value == Rgb::ZERO && wi.value == Rgb::ZERO {
            return;
        }
        let place = lit.block(index);
        let block = &mut self.blocks[place];
        block.valid |= 1 << lane;
        let connections = &mut block.rows;
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
        // A tree's own pixel has seen its x₂.
        if lit.own_lane(&self.groups[index]) != Some(lane) {
            let batch = self.room();
            let ray = self.counts[batch];
            self.rays[batch].set(ray, &first.point.segment_to(&second.point));
            self.owners[batch][ray % MAX_BATCH] = (place * LANES + lane) as u8;
            self.counts[batch] += 1;
        }
    }
}

/// Connections between vertices in lanes.
struct Connect<'a> {
    sharing: &'a mut Sharing,
    batches: &'a [Trees],
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
        let groups = self.sharing.groups_at_work();
        for index in groups.first..groups.end {
            let group = self.sharing.groups[index];
            let points = &self.batches[group.batch].first.points;
            let near = Near::<L>::load(points, group.place, group.lanes);
            if near.seen == 0 {
                continue;
            }
            for number in self.sharing.work.clone() {
                self.eight(&near, number, index);
            }
        }
    }
}

impl Connect<'_> {
    /// The pixels `near`, group number `index`, to one lit tree.
    #[inline(always)]
    fn eight<L: Lanes>(&mut self, near: &Near<L>, number: usize, index: usize) {
        let lit = self.sharing.lit[number];
        if !lit.all.contains(index) {
            return;
        }
        let seconds = &self.batches[lit.batch].second;
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
        let behind = &self.batches[lit.batch].behind;
        // One after the other through the same code, which is long.
        let sides = [(lit.by_emitter, &behind.light), (lit.by_wi, &behind.wi)];
        for side in 0..2 {
            let (groups, wi) = sides[side];
            if groups.contains(index) {
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
        let sharing = &mut *self.sharing;
        let [emitter, wi] = scatterings;
        let block = lit.block(index);
        sharing.blocks[block] = Block {
            rows: Connections {
                factor: factor.store(),
                pdf: pdf.store(),
                geometry: geometry.store(),
                emitter,
                wi,
            },
            valid,
        };
        // A tree's own pixel has seen its x₂.
        let own = lit.own_lane(&sharing.groups[index]).map_or(0, |lane| 1 << lane);
        let mut traced = valid & !own;
        let batch = sharing.room();
        let mut ray = sharing.counts[batch];
        let origin = near.origins_towards(between);
        let target = far.origins_towards(-between);
        let one = L::splat(1.0);
        sharing.rays[batch].store_compressed(ray, origin, target - origin, one, traced);
        while traced != 0 {
            let lane = traced.trailing_zeros() as usize;
            traced &= traced - 1;
            sharing.owners[batch][ray % MAX_BATCH] = (block * LANES + lane) as u8;
            ray += 1;
        }
        sharing.counts[batch] = ray;
    }
}

/// Adds the light of connections.
struct Add<'a> {
    sharing: &'a Sharing,
    batches: &'a mut [Trees],
}

impl LaneKernel for Add<'_> {
    const HOT: bool = true;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let sharing = self.sharing;
        for lit in &sharing.lit[sharing.work.clone()] {
            let (blocks, groups) = sharing.reached_by(lit);
            let weights = weights::<L>(blocks, groups, lit);
            let light = Light::<L>::of(&self.batches[lit.batch], lit, weights);
            for (block, group) in blocks.iter().zip(groups) {
                if block.valid != 0 {
                    let own = &mut self.batches[group.batch].own;
                    let before = load_vectors::<L>(own, group.place);
                    let more = light.through(&block.rows);
                    let size = more.abs();
                    let infinity = L::splat(f32::INFINITY);
                    let finite = size.x.less(infinity) & size.y.less(infinity) & size.z.less(infinity);
                    let added = finite & L::Mask::from_bits(block.valid);
                    store_all(own, group.place, (before + more).select(added, before));
                }
            }
        }
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
            emitter: splat(match lit.by_emitter.len() {
                0 => Rgb::ZERO,
                _ => vector(&behind.light_weight, lit.place),
            }),
            emitter_pdf: L::splat(behind.light_pdf.get(lit.place)),
            is_delta: behind.light_is_delta >> lit.place & 1 == 1,
            met: splat(met),
            met_pdf: L::splat(met_pdf),
            beyond: splat(behind.beyond[tree]),
            weights: weights.map(L::splat),
        }
    }

    /// What reaches the pixels' film.
    #[inline(always)]
    fn through(&self, connections: &Connections) -> Vec3Lanes<L> {
        let [emitter, wi] = self.scattered(connections);
        load_rows::<L>(&connections.factor) * (emitter + wi)
    }

    /// What `x₂` scatters towards the pixels, of what was found in each of the two ways. Emitters
    /// are found in both; the power heuristic combines them for each pixel separately.
    #[inline(always)]
    fn scattered(&self, connections: &Connections) -> [Vec3Lanes<L>; 2] {
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
        [emitter, wi]
    }
}
