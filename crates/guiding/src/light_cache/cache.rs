//! The light cache: regions, their records, and the data for selections.

use super::block::{LightBlock, Receiver};
use super::bucket_choice::Buckets;
use super::buckets::RegionLights;
use super::entries::{Entry, Visible, collect, merge};
use super::exploration::{ExplorationTable, Explorer};
use super::lists::{Lists, RegionHead};
use super::options::{Exploration, LightCacheOptions};
use super::record::{CacheMoments, LightCacheReport, LightRecord};
use super::regions::Regions;
use super::share::SecondMoments;
use super::tree_cache::LightTreeCache;
use super::units::Units;
use crate::GuidingError;
use glam::Vec3;
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};
use lightshed_lights::{Bounds, Light, LightError, LightSampler, check_lights};
use lightshed_sampling::parallel::for_each_chunk;

/// Selects lights that are visible from the receiver (§5.4).
///
/// Space is divided into regions that follow the samples. A renderer reports which lights it
/// sampled from where, and which were visible ([`LightRecord`]). An update collects the visible
/// lights of each region and of its neighbours. A selection weights those lights for the receiver,
/// so no sample is wasted on lights known to be hidden. Exploration finds lights that nobody has
/// seen yet; its share of the samples is learnt.
///
/// As a [`LightSampler`](lightshed_lights::LightSampler) it is unbiased whatever it has learnt: a
/// light that can contribute has a positive probability, and that is the probability of the actual
/// selection.
///
/// ```
/// use lightshed_guiding::glam::Vec3;
/// use lightshed_guiding::{LightCache, LightCacheOptions, LightRecord};
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
/// let mut cache = LightCache::new(bounds, &lights, LightCacheOptions::default())?;
/// let at = ShadingPoint::new(Vec3::new(50.0, 0.0, 0.0), Vec3::Y, 1.0);
/// for round in 0..4u64 {
///     let records: Vec<LightRecord> = (0..1000u64)
///         .filter_map(|i| cache.sample(&at, (i << 54) + round))
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
/// // It and its neighbour are learnt of together.
/// assert!(cache.pmf(&at, 47) + cache.pmf(&at, 46) + cache.pmf(&at, 48) > 0.9);
/// # Ok::<(), lightshed_guiding::GuidingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct LightCache {
    pub(super) options: LightCacheOptions,
    pub(super) units: Units,
    pub(super) explorer: Explorer,
    pub(super) regions: Regions,
    states: Vec<RegionState>,
    pub(super) lists: Lists,
}

/// What a region has learnt.
#[derive(Clone, Debug, Default)]
struct RegionState {
    entries: Vec<Entry>,
    /// Number of samples, including those left from earlier updates.
    samples: f32,
    moments: SecondMoments,
    buckets: u32,
}

/// Regions that a thread works on at once.
const CHUNK: usize = 16;

impl LightCache {
    /// A cache of `lights` without any record. Regions are in the cube around `bounds`; outside,
    /// all samples explore.
    ///
    /// # Errors
    ///
    /// [`GuidingError::Option`] for options out of range, [`GuidingError::Lights`] for lights that
    /// no sampler accepts, or if no light is on where a table explores, [`GuidingError::Bounds`]
    /// for bounds that are empty or not finite.
    pub fn new(bounds: Bounds, lights: &[Light], options: LightCacheOptions) -> Result<Self, GuidingError> {
        options.check()?;
        check_lights(lights)?;
        if !bounds.is_valid() {
            return Err(GuidingError::Bounds);
        }
        let explorer = match options.exploration {
            Exploration::Tree => Explorer::Tree(Box::new(LightTreeCache::new(bounds, lights, options.tree)?)),
            Exploration::Table => {
                let weights = Default::default();
                Explorer::Table(ExplorationTable::new(lights, None, bounds.center(), weights)?)
            }
        };
        let regions = Regions::new(bounds)?;
        Ok(Self {
            options,
            units: Units::new(lights, &options),
            explorer,
            states: vec![RegionState::default(); regions.slots()],
            lists: Lists::new(options.rule, regions.slots()),
            regions,
        })
    }

    /// The options.
    pub fn options(&self) -> &LightCacheOptions {
        &self.options
    }

    /// Explores by this table from now on, if the options select tables.
    pub fn set_exploration(&mut self, table: ExplorationTable) {
        if self.options.exploration == Exploration::Table {
            self.explorer = Explorer::Table(table);
        }
    }

    /// Updates the same lights to their present state. Regions keep what they have learnt; a light
    /// that has become invisible is forgotten gradually.
    ///
    /// # Errors
    ///
    /// [`GuidingError::Lights`] for lights that no sampler accepts, or another number of them.
    pub fn set_lights(&mut self, lights: &[Light]) -> Result<(), GuidingError> {
        check_lights(lights)?;
        if lights.len() != self.units.light_count() {
            return Err(GuidingError::Lights(LightError::TooMany(lights.len())));
        }
        if let Explorer::Tree(tree) = &mut self.explorer {
            tree.set_lights(lights)?;
        }
        self.units = self.units.moved(lights);
        self.rebuild(&[], &[]);
        Ok(())
    }

    /// Learns from the records since the last update. Invalid records are ignored. The same records
    /// in the same order give the same cache, for any number of threads.
    pub fn update(&mut self, records: &[LightRecord]) -> LightCacheReport {
        let lights = self.units.light_count();
        let sound = records
            .iter()
            .filter(|record| record.is_sound() && (record.light as usize) < lights);
        let records: Vec<LightRecord> = sound.copied().collect();
        if let Explorer::Tree(tree) = &mut self.explorer {
            tree.update(&records);
        }
        let positions: Vec<Vec3> = records.iter().map(|record| record.at.position).collect();
        let persistence = self.options.persistence;
        let left = |state: &RegionState| state.samples * persistence;
        let samples: Vec<f32> = self.states.iter().map(left).collect();
        let adapted = self.regions.adapt(&positions, &samples, &self.options.regions());
        let mut descendants = vec![0u32; self.states.len()];
        adapted
            .from
            .iter()
            .flatten()
            .for_each(|&from| descendants[from as usize] += 1);
        let old = std::mem::take(&mut self.states);
        let inherit = |(&from, &left): (&Option<u32>, &f32)| {
            let Some(from) = from else {
                return RegionState::default();
            };
            let old = &old[from as usize];
            let factor = left / (old.samples * persistence).max(f32::MIN_POSITIVE);
            RegionState {
                entries: match descendants[from as usize] {
                    1 => old.entries.clone(),
                    _ => old.entries.iter().map(|entry| entry.inherited()).collect(),
                },
                samples: left,
                moments: old
                    .moments
                    .scaled(f64::from(factor.min(1.0)) * f64::from(persistence)),
                buckets: old.buckets,
            }
        };
        self.states = adapted.from.iter().zip(&adapted.samples).map(inherit).collect();

        // Records by region and unit, those of a unit in their order.
        let (units, slot_of) = (&self.units, &adapted.slot_of);
        let mut order: Vec<u32> = (0..records.len() as u32).collect();
        order.retain(|&i| slot_of[i as usize].is_some());
        order.sort_unstable_by_key(|&i| (slot_of[i as usize], units.of(records[i as usize].light), i));
        let mut inside = vec![0..0usize; self.states.len()];
        let mut start = 0;
        for group in order.chunk_by(|&a, &b| slot_of[a as usize] == slot_of[b as usize]) {
            if let Some(slot) = slot_of[group[0] as usize] {
                inside[slot as usize] = start..start + group.len();
            }
            start += group.len();
        }
        let mut found = vec![0; self.states.len()];
        let (options, order, records) = (self.options, &order[..], &records[..]);
        let mut work: Vec<_> = self.states.iter_mut().zip(&mut found).collect();
        for_each_chunk(&mut work, CHUNK, |start, part| {
            for (region, (state, found)) in (start..).zip(part) {
                let inside = &order[inside[region].clone()];
                state.samples += inside.len() as f32;
                **found = collect(
                    &mut state.entries,
                    records,
                    inside,
                    |light| units.of(light),
                    &options,
                );
            }
        });
        let ordered: Vec<&[u32]> = inside.iter().map(|range| &order[range.clone()]).collect();
        let share = self.rebuild(records, &ordered);
        LightCacheReport {
            regions: self.regions.count(),
            lights: self
                .lists
                .blocks
                .iter()
                .flat_map(|block| block.lights)
                .filter(|&n| n != LightBlock::NONE)
                .count(),
            buckets: self.lists.heads.iter().map(|head| head.buckets as usize).sum(),
            found: found.iter().sum(),
            share,
        }
    }

    /// Makes buckets from the regions' records, and learns shares from `records`, of which `inside`
    /// are those of each region. Returns the mean share over the records.
    fn rebuild(&mut self, records: &[LightRecord], inside: &[&[u32]]) -> f32 {
        let mut made: Vec<(RegionLights, Vec<Visible>)> = vec![Default::default(); self.states.len()];
        let (states, regions, options) = (&self.states, &self.regions, &self.options);
        let lights = &self.units.lights[..];
        for_each_chunk(&mut made, CHUNK, |start, part| {
            for (region, (made, visible)) in (start..).zip(part) {
                let around = match options.merge_neighbours {
                    true => regions.neighbours(region as u32),
                    false => &[],
                };
                let neighbours = around.iter().map(|&other| &states[other as usize].entries[..]);
                merge(&states[region].entries, neighbours, visible);
                *made = RegionLights::new(visible, lights, states[region].buckets, options);
            }
        });
        self.lists.clear();
        for ((made, _), state) in made.iter().zip(&mut self.states) {
            state.buckets = made.buckets();
            self.lists.push(made);
        }
        if self.options.learn_share && !inside.is_empty() {
            self.learn_shares(records, inside, &made);
        }
        let (mut sum, mut count) = (0.0, 0.0f64);
        for (region, (state, head)) in self.states.iter().zip(&mut self.lists.heads).enumerate() {
            let share = match (head.buckets, self.options.learn_share) {
                (0, _) => 1.0,
                (_, false) => self.options.share,
                (_, true) => state.moments.share(self.options.share),
            };
            head.explore_below = if share < 1.0 {
                (f64::from(share) * 18_446_744_073_709_551_616.0) as u64
            } else {
                u64::MAX
            };
            let inside = inside.get(region).map_or(0, |inside| inside.len()) as f64;
            sum += f64::from(share) * inside;
            count += inside;
        }
        if count > 0.0 { (sum / count) as f32 } else { 0.0 }
    }

    fn learn_shares(
        &mut self,
        records: &[LightRecord],
        inside: &[&[u32]],
        made: &[(RegionLights, Vec<Visible>)],
    ) {
        let mut moments = vec![SecondMoments::default(); self.states.len()];
        let cache = &*self;
        for_each_chunk(&mut moments, CHUNK, |start, part| {
            LaneChoice::best().run(Moments {
                cache,
                records,
                inside: &inside[start..start + part.len()],
                made: &made[start..start + part.len()],
                heads: &cache.lists.heads[start..start + part.len()],
                moments: part,
            });
        });
        for (state, new) in self.states.iter_mut().zip(&moments) {
            state.moments.known += new.known;
            state.moments.unknown += new.unknown;
            state.moments.explored += new.explored;
            state.moments.count += new.count;
        }
    }

    /// Second moments of the records' contributions: with the cache, with its tree alone, and with
    /// the tree in its initial state. Computed from records that the cache has not learnt from yet,
    /// they show which part of it is worth its cost. All are equal if a table explores.
    pub fn moments(&self, records: &[LightRecord]) -> CacheMoments {
        let mut moments = CacheMoments::default();
        for record in records
            .iter()
            .filter(|record| record.is_sound() && record.contribution > 0.0)
        {
            let (at, light) = (&record.at, record.light);
            let squared = f64::from(record.contribution).powi(2) / f64::from(record.pmf);
            // The tree reaches everything that the others reach.
            let over = |pmf: f32| if pmf > 0.0 { squared / f64::from(pmf) } else { 0.0 };
            let all = over(self.pmf(at, light));
            let (plain, tree) = match &self.explorer {
                Explorer::Tree(tree) => (over(tree.plain_pmf(at, light)), over(tree.pmf(at, light))),
                Explorer::Table(_) => (all, all),
            };
            moments.plain += plain;
            moments.tree += tree;
            moments.lists += all;
        }
        moments
    }

    /// The exploring tree, with its learnt factors; `None` if a table explores.
    pub fn into_tree(self) -> Option<LightTreeCache> {
        match self.explorer {
            Explorer::Tree(tree) => Some(*tree),
            Explorer::Table(_) => None,
        }
    }

    /// The head of the region of a position.
    #[inline(always)]
    pub(super) fn head(&self, position: Vec3) -> &RegionHead {
        match self.regions.slot(position) {
            Some(slot) => &self.lists.heads[slot as usize],
            None => &RegionHead::UNKNOWN,
        }
    }

    /// The lights in the lists of the region of `position`, in ascending order. Tests compare them
    /// with the visible lights.
    pub fn lights_at(&self, position: Vec3) -> Vec<u32> {
        let head = self.head(position);
        let blocks = (0..head.buckets as usize).flat_map(|bucket| self.lists.blocks(head, bucket));
        let units = blocks
            .flat_map(|block| block.lights)
            .filter(|&unit| unit != LightBlock::NONE);
        let mut lights: Vec<u32> = units.flat_map(|unit| self.units.lights_of(unit)).collect();
        lights.sort_unstable();
        lights
    }

    /// Number of buckets of the region of `position`.
    pub fn buckets_at(&self, position: Vec3) -> u32 {
        self.head(position).buckets
    }

    /// Share of the samples at `position` that explore.
    pub fn share_at(&self, position: Vec3) -> f32 {
        let head = self.head(position);
        if head.explores_always() { 1.0 } else { head.share() }
    }

    /// The region of a position; `None` outside.
    pub fn region_at(&self, position: Vec3) -> Option<u32> {
        self.regions.slot(position)
    }
}

/// Second moments of the new samples of some regions.
struct Moments<'a> {
    cache: &'a LightCache,
    records: &'a [LightRecord],
    inside: &'a [&'a [u32]],
    made: &'a [(RegionLights, Vec<Visible>)],
    heads: &'a [RegionHead],
    moments: &'a mut [SecondMoments],
}

impl LaneKernel for Moments<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (i, moments) in self.moments.iter_mut().enumerate() {
            let visible = &self.made[i].1;
            for &record in self.inside[i] {
                let LightRecord {
                    at,
                    light,
                    pmf,
                    contribution,
                    ..
                } = self.records[record as usize];
                if contribution == 0.0 {
                    continue;
                }
                let squared = f64::from(contribution) * f64::from(contribution) / f64::from(pmf);
                let explored = self.cache.explorer.pmf(&at, light);
                if !(explored > 0.0) {
                    continue;
                }
                let by_exploration = squared / f64::from(explored);
                moments.count += 1.0;
                moments.explored += by_exploration;
                let unit = self.cache.units.of(light);
                let seen = visible.binary_search_by_key(&unit, |seen| seen.unit);
                let is_known = seen.is_ok_and(|place| visible[place].seen_count > 1.0);
                let cached = if is_known && self.heads[i].buckets > 0 {
                    let to = &Receiver::new(&at, self.cache.options.lobes);
                    Buckets::new::<L>(&self.cache.lists, &self.cache.units, &self.heads[i], to)
                        .cached::<L>(to, light)
                        .0
                } else {
                    0.0
                };
                if cached > 0.0 {
                    moments.known += squared / f64::from(cached);
                } else {
                    moments.unknown += by_exploration;
                }
            }
        }
    }
}
