//! A light tree that learns, region by region, where its lights are hidden.
//!
//! Each region keeps factors for the upper part of one light tree: a cut through it, with all
//! lights below. Where the children `c` of a node have probabilities `p_c(x)`, the second moment of
//! an estimate that gives them `f_c p_c / Σ f p` instead is least over the region's points for
//!
//! `f_c² = A_c / B_c`, `A_c = E_x[m_c(x) / p_c(x)]`, `B_c = E_x[p_c(x)]`,
//!
//! where `m_c = Σ_{l in c} F_l² / p(l | c)` is the second moment below the child and `F_l` is the
//! contribution of light `l`, visibility included (by a Lagrange multiplier, for normalisations
//! that vary little). A sample of light `l` that was selected with probability `q` adds
//! `F² / (q p(l | c) p_c)` to the one and `p_c p(l | c) / q` to the other, whatever technique
//! selected it. A hidden child gets little, but never nothing: every light that the tree reaches
//! stays reachable, so no other technique has to explore.

use super::options::LightTreeCacheOptions;
use super::record::{LightCacheReport, LightRecord};
use super::regions::Regions;
use crate::GuidingError;
use glam::Vec3;
use lightshed_lanes::LANES;
use lightshed_lights::{Bounds, FactorRow, Light, LightBvh, LightChoice, LightSampler, ShadingPoint};
use lightshed_sampling::parallel::for_each_chunk;

/// Selects lights by a light tree whose weights learn visibility, region by region.
///
/// It is unbiased whatever it has learnt, as a [`LightSampler`]: factors are positive. Its
/// additional cost over the tree is a descent of an octree and a cache line a step. It needs no
/// list of visible lights, so it suits scenes where thousands are visible as well as scenes where
/// nearly all are hidden.
///
/// ```
/// use lightshed_guiding::glam::Vec3;
/// use lightshed_guiding::{LightRecord, LightTreeCache, LightTreeCacheOptions};
/// use lightshed_lights::{Bounds, Light, LightSampler, ShadingPoint};
///
/// // A hundred lamps in a row, of which the floor sees one.
/// let lamp = |i: usize| Light {
///     bounds: Bounds::of_point(Vec3::new(i as f32, 2.0, 0.0)),
///     intensity: 1.0,
///     cone: None,
/// };
/// let lights: Vec<Light> = (0..100).map(lamp).collect();
/// let bounds = Bounds::new(Vec3::ZERO, Vec3::splat(100.0));
/// let mut cache = LightTreeCache::new(bounds, &lights, LightTreeCacheOptions::default())?;
/// let at = ShadingPoint::new(Vec3::new(50.0, 0.0, 0.0), Vec3::Y, 1.0);
/// let before = cache.pmf(&at, 47);
/// for round in 0..8u64 {
///     let records: Vec<LightRecord> = (0..500u64)
///         .filter_map(|i| cache.sample(&at, (i << 55) + round))
///         .map(|choice| LightRecord {
///             at,
///             light: choice.light,
///             pmf: choice.pmf,
///             contribution: if choice.light == 47 { 1.0 } else { 0.0 },
///             visible: choice.light == 47,
///         })
///         .collect();
///     cache.update(&records);
/// }
/// assert!(cache.pmf(&at, 47) > 0.5 && before < 0.1);
/// # Ok::<(), lightshed_guiding::GuidingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct LightTreeCache {
    options: LightTreeCacheOptions,
    pub(super) tree: LightBvh,
    pub(super) regions: Regions,
    states: Vec<TreeState>,
    pub(super) rows: Vec<FactorRow>,
    /// Where the rows of each slot begin; and where the last one's end.
    pub(super) starts: Vec<u32>,
}

/// What a region has learnt.
#[derive(Clone, Debug, Default)]
struct TreeState {
    samples: f32,
    rows: Vec<RowState>,
}

/// A region's record of the children of a node.
#[derive(Clone, Copy, Debug)]
struct RowState {
    below: [u32; LANES],
    /// Samples that went through.
    visits: [f32; LANES],
    /// Sums whose ratio is `A_c / B_c`.
    lit: [f64; LANES],
    asked: [f64; LANES],
    /// The ratio of the sums before the update.
    usual: f64,
}

impl RowState {
    const EMPTY: Self = Self {
        below: [FactorRow::NONE; LANES],
        visits: [0.0; LANES],
        lit: [0.0; LANES],
        asked: [0.0; LANES],
        usual: f64::INFINITY,
    };

    /// Before an update: what is left of earlier samples.
    fn age(&mut self, factor: f32) {
        let (lit, asked): (f64, f64) = (self.lit.iter().sum(), self.asked.iter().sum());
        self.usual = if lit > 0.0 { lit / asked } else { f64::INFINITY };
        self.visits.iter_mut().for_each(|x| *x *= factor);
        self.lit.iter_mut().for_each(|x| *x *= f64::from(factor));
        self.asked.iter_mut().for_each(|x| *x *= f64::from(factor));
    }

    fn factors(&self, options: &LightTreeCacheOptions) -> FactorRow {
        let mut row = FactorRow {
            below: self.below,
            ..FactorRow::ONE
        };
        let (lit, asked): (f64, f64) = (self.lit.iter().sum(), self.asked.iter().sum());
        let visits: f32 = self.visits.iter().sum();
        // NaN fails the comparison.
        if !(lit > 0.0 && asked > 0.0 && (lit / asked).is_finite()) {
            return row;
        }
        // Without samples, a child is assumed to equal the mean of its siblings.
        let prior = f64::from(options.prior_count) * asked / f64::from(visits);
        let usual = lit / asked;
        let ratios: [f64; LANES] =
            std::array::from_fn(|c| (self.lit[c] + prior * usual) / (self.asked[c] + prior));
        let largest = ratios.iter().copied().fold(0.0, f64::max);
        for (factor, ratio) in row.factors.iter_mut().zip(ratios) {
            *factor = ((ratio / largest).sqrt() as f32).max(options.least_factor);
        }
        row
    }
}

/// A sample whose ratio is more than this many times the mean counts as that much: one firefly must
/// not take all of a node's samples.
const MOST_UNUSUAL: f64 = 32.0;

/// Regions that a thread works on at once.
const CHUNK: usize = 16;

impl LightTreeCache {
    /// A cache of `lights` without any record: its selections are those of the tree. Regions are in
    /// the cube around `bounds`.
    ///
    /// # Errors
    ///
    /// [`GuidingError`], for options out of range, lights that no sampler accepts, or bounds that
    /// are not finite.
    pub fn new(
        bounds: Bounds,
        lights: &[Light],
        options: LightTreeCacheOptions,
    ) -> Result<Self, GuidingError> {
        options.check()?;
        let regions = Regions::new(bounds)?;
        Ok(Self {
            options,
            tree: LightBvh::new(lights)?,
            states: vec![TreeState::default(); regions.slots()],
            rows: Vec::new(),
            starts: vec![0; regions.slots() + 1],
            regions,
        })
    }

    /// Replaces the lights. Nothing is known about the new ones.
    ///
    /// # Errors
    ///
    /// Lights that no sampler accepts; the cache is then unchanged.
    pub fn set_lights(&mut self, lights: &[Light]) -> Result<(), GuidingError> {
        self.tree.rebuild(lights)?;
        self.states.iter_mut().for_each(|state| state.rows.clear());
        self.rows.clear();
        self.starts.fill(0);
        Ok(())
    }

    /// The tree without learnt factors.
    pub fn into_plain(self) -> LightBvh {
        self.tree
    }

    /// Probability of a light by the tree without learnt factors.
    pub fn plain_pmf(&self, at: &ShadingPoint, light: u32) -> f32 {
        self.tree.pmf(at, light)
    }

    /// The factors at a position.
    #[inline(always)]
    fn rows(&self, position: Vec3) -> &[FactorRow] {
        match self.regions.slot(position) {
            Some(slot) => self.rows_of(slot),
            None => &[],
        }
    }

    #[inline(always)]
    fn rows_of(&self, slot: u32) -> &[FactorRow] {
        let slot = slot as usize;
        &self.rows[self.starts[slot] as usize..self.starts[slot + 1] as usize]
    }

    /// Learns from the records since the last update. Invalid records are ignored. The same records
    /// in the same order give the same cache, for any number of threads.
    pub fn update(&mut self, records: &[LightRecord]) -> LightCacheReport {
        let lights = LightSampler::<ShadingPoint>::light_count(&self.tree);
        let sound = |record: &&LightRecord| record.is_sound() && (record.light as usize) < lights;
        let records: Vec<LightRecord> = records.iter().filter(sound).copied().collect();
        let positions: Vec<Vec3> = records.iter().map(|record| record.at.position).collect();
        let options = self.options;
        let before: Vec<Option<u32>> = positions
            .iter()
            .map(|&position| self.regions.slot(position))
            .collect();
        let left: Vec<f32> = self
            .states
            .iter()
            .map(|state| state.samples * options.persistence)
            .collect();
        let adapted = self.regions.adapt(&positions, &left, &options.regions());
        let old = std::mem::take(&mut self.states);
        let inherit = |(&from, &samples): (&Option<u32>, &f32)| TreeState {
            samples,
            rows: from.map_or(Vec::new(), |from| old[from as usize].rows.clone()),
        };
        let mut states: Vec<TreeState> = adapted.from.iter().zip(&adapted.samples).map(inherit).collect();
        let inside = adapted.records_by_slot();
        let (cache, records) = (&*self, &records[..]);
        for_each_chunk(&mut states, CHUNK, |start, part| {
            for (slot, state) in (start..).zip(part) {
                let rows = |i: u32| before[i as usize].map_or(&[][..], |slot| cache.rows_of(slot));
                cache.learn(state, records, inside.of(slot), rows);
            }
        });
        self.states = states;
        self.rows.clear();
        self.starts.clear();
        self.starts.push(0);
        for state in &self.states {
            self.rows
                .extend(state.rows.iter().map(|row| row.factors(&options)));
            self.starts.push(self.rows.len() as u32);
        }
        LightCacheReport {
            regions: self.regions.count(),
            lights: 0,
            buckets: self.rows.len(),
            found: 0,
            share: 0.0,
        }
    }

    /// Adds the records `inside` a region, which were chosen by the factors in `rows`.
    fn learn<'a>(
        &self,
        state: &mut TreeState,
        records: &[LightRecord],
        inside: &[u32],
        rows: impl Fn(u32) -> &'a [FactorRow],
    ) {
        if inside.is_empty() {
            // Without samples, what was learnt stays.
            return;
        }
        state
            .rows
            .iter_mut()
            .for_each(|row| row.age(self.options.persistence));
        state.samples += inside.len() as f32;
        if state.rows.is_empty() {
            state.rows.push(RowState::EMPTY);
        }
        // Rows below `first` have these records already.
        let mut first = 0;
        let mut trail = Vec::new();
        loop {
            let known = state.rows.len();
            for &i in inside {
                let record = &records[i as usize];
                trail.clear();
                self.tree
                    .steps_factored(&record.at, record.light, rows(i), |step| trail.push(step));
                self.learn_one(state, record, &trail, first);
            }
            if state.rows.len() == known {
                return;
            }
            first = known;
        }
    }

    fn learn_one(
        &self,
        state: &mut TreeState,
        record: &LightRecord,
        trail: &[lightshed_lights::FactoredStep],
        first: usize,
    ) {
        let by_tree: f64 = trail.iter().map(|step| step.chosen).product();
        if !(by_tree > 0.0) {
            return;
        }
        // Whatever selected the light, its sample counts with one over the probability of that
        // selection.
        let weight = 1.0 / f64::from(record.pmf);
        let squared = f64::from(record.contribution).powi(2);
        let (mut row, mut reached, known) = (0usize, 1.0, state.rows.len());
        for step in trail {
            reached *= step.chosen;
            // p(l | c), from the light's probability and that of coming here.
            let below = by_tree / reached;
            let here = &mut state.rows[row];
            if row >= first {
                let asked = weight * below * step.plain;
                let ratio = squared / (below * step.plain).powi(2);
                here.visits[step.lane] += 1.0;
                here.asked[step.lane] += asked;
                here.lit[step.lane] += asked * ratio.min(MOST_UNUSUAL * here.usual);
            }
            if here.below[step.lane] == FactorRow::NONE {
                let wanted =
                    step.is_inner && row >= first && here.visits[step.lane] >= self.options.split_row;
                if wanted && known < self.options.max_rows as usize {
                    here.below[step.lane] = known as u32;
                    state.rows.push(RowState::EMPTY);
                }
                return;
            }
            row = here.below[step.lane] as usize;
        }
    }

    /// The region of a position; `None` outside.
    pub fn region_at(&self, position: Vec3) -> Option<u32> {
        self.regions.slot(position)
    }
}

impl LightSampler for LightTreeCache {
    fn light_count(&self) -> usize {
        LightSampler::<ShadingPoint>::light_count(&self.tree)
    }

    #[inline]
    fn sample(&self, at: &ShadingPoint, u: u64) -> Option<LightChoice> {
        self.tree.sample_factored(at, u, self.rows(at.position))
    }

    #[inline]
    fn pmf(&self, at: &ShadingPoint, light: u32) -> f32 {
        self.tree.pmf_factored(at, light, self.rows(at.position))
    }
    fn sample_each(&self, at: &[ShadingPoint], u: &[u64], choices: &mut [Option<LightChoice>]) {
        self.tree
            .sample_each_factored(at, u, |at| self.rows(at.position), choices);
    }
}
