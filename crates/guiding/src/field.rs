//! A field of distributions over space.

use crate::GuidingError;
use crate::model::DirectionalModel;
use crate::options::{FieldOptions, Interpolation};
use crate::partition::Partition;
use crate::passage::{FlightArrival, FlightEnd, Passage, StoredVisit, Visit, learn_passages};
use crate::recorder::Recorder;
use crate::sample::{GuidingSample, TrainingSample};
use crate::share::learn_share;
use glam::Vec3;
use lightshed_sampling::parallel::{fill, for_each_chunk};
use lightshed_sampling::{Density, DirectionDistribution, SolidAngle};
use lightshed_spatial::{AdaptiveOctree, Bounds};

/// Learns, region by region, from which directions light comes, so that a renderer can guide its
/// paths.
///
/// [`record`](Self::record) takes samples from any number of threads while paths are traced.
/// [`update`](Self::update) learns from all samples since the last update. [`at`](Self::at) returns
/// the learnt distribution. The result depends neither on the number of threads nor on the order in
/// which samples were recorded.
///
/// Regions follow the samples (`P`): by default those of an octree. A [`DirectionalModel`] (`M`)
/// defines what they learn.
#[derive(Debug)]
pub struct GuidingField<M: DirectionalModel, P = AdaptiveOctree> {
    pub(crate) partition: P,
    /// The requested box; that of the partition is larger.
    bounds: Bounds,
    model: M,
    options: FieldOptions,
    /// [`DirectionalModel::stride`] for each slot.
    pub(crate) records: Vec<M::Record>,
    pub(crate) regions: Vec<Region>,
    /// [`DirectionalModel::table_words`] for each slot, derived from the records.
    tables: Vec<u32>,
    recorder: Recorder<TrainingSample>,
    visits: Recorder<StoredVisit>,
    /// Ends of flights by [`FlightEnd`].
    arrivals: [Recorder<StoredVisit>; 3],
    /// What is known of the ends of flights in all regions together.
    overall: [Passage; 3],
    /// Kept for their memory.
    samples: Vec<TrainingSample>,
    sorted: Vec<TrainingSample>,
    slots: Vec<u32>,
}

/// Data of a region besides its model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Region {
    /// Share of directions that its guide samples.
    pub share: f32,
    /// Whether it has learnt from any sample, or is a part of a region that has.
    pub has_learnt: bool,
    /// Samples that it has learnt from itself: none of a part before samples reach it.
    pub samples: u32,
    /// What paths find that pass it.
    pub passage: Passage,
    /// What paths find whose flights end in it, by [`FlightEnd`].
    #[cfg_attr(feature = "serde", serde(default))]
    pub arrivals: [Passage; 3],
}

impl Region {
    /// That has learnt nothing.
    fn new(options: &FieldOptions) -> Self {
        Self {
            share: options.first_share,
            ..Self::default()
        }
    }
}

/// The field's knowledge at a position.
#[derive(Clone, Copy, Debug)]
pub struct Guidance<D> {
    /// The directions from which light comes.
    pub directions: D,
    /// The best share of guided directions in the mixture with the BSDF.
    pub share: f32,
}

impl<D: DirectionDistribution> DirectionDistribution for Guidance<D> {
    #[inline(always)]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        self.directions.sample(u)
    }

    #[inline(always)]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        self.directions.pdf(direction)
    }
}

/// What an update did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FieldUpdate {
    /// Number of samples that were learnt from.
    pub samples: usize,
    /// Samples outside the field's box.
    pub outside: usize,
    /// Regions that got samples.
    pub regions: usize,
}

/// Samples that a region must have learnt from to be used by positions outside it.
pub(crate) const LEAST_SAMPLES: u32 = 32;
/// No slot.
const NOWHERE: u32 = u32::MAX;

impl<M: DirectionalModel, P: Partition> GuidingField<M, P> {
    /// A field over a box that has learnt nothing.
    ///
    /// # Errors
    /// [`GuidingError::Bounds`], [`GuidingError::Option`].
    pub fn new(bounds: Bounds, model: M, options: FieldOptions) -> Result<Self, GuidingError> {
        Self::with_partition(P::over(bounds)?, bounds, model, options)
    }

    /// A field over a box with this partition of it, in which nothing was learnt.
    ///
    /// # Errors
    /// [`GuidingError::Option`].
    pub fn with_partition(
        partition: P,
        bounds: Bounds,
        model: M,
        options: FieldOptions,
    ) -> Result<Self, GuidingError> {
        options.check()?;
        let slots = partition.slot_count();
        let mut records = vec![M::Record::default(); slots * model.stride()];
        records
            .chunks_mut(model.stride())
            .for_each(|records| model.reset(records));
        let region = Region::new(&options);
        Ok(Self {
            partition,
            bounds,
            model,
            options,
            records,
            regions: vec![region; slots],
            tables: Vec::new(),
            recorder: Recorder::default(),
            visits: Recorder::default(),
            arrivals: Default::default(),
            overall: [Passage::default(); 3],
            samples: Vec::new(),
            sorted: Vec::new(),
            slots: Vec::new(),
        })
    }

    /// Bytes that a region takes in a field of this model, without those of the partition and of
    /// samples that wait for an update.
    pub fn region_bytes(model: &M) -> usize {
        model.stride() * size_of::<M::Record>() + size_of::<Region>() + 4 * model.table_words()
    }

    /// What is learnt.
    pub fn model(&self) -> &M {
        &self.model
    }

    /// How it is learnt.
    pub fn options(&self) -> &FieldOptions {
        &self.options
    }

    /// The box that was asked for.
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// The partition of space.
    pub fn partition(&self) -> &P {
        &self.partition
    }

    /// Number of regions that have learnt from any sample.
    pub fn learnt_regions(&self) -> usize {
        self.regions.iter().filter(|region| region.has_learnt).count()
    }

    /// Mean share of the guides of regions that have learnt.
    pub fn mean_share(&self) -> f32 {
        let shares = self.regions.iter().filter(|region| region.has_learnt);
        let sum: f64 = shares.map(|region| f64::from(region.share)).sum();
        (sum / (self.learnt_regions() as f64).max(1.0)) as f32
    }

    /// A copy that guides as this field does, without the samples that wait for an update.
    #[must_use]
    pub fn learnt(&self) -> Self
    where
        M: Clone,
    {
        Self {
            partition: self.partition.clone(),
            bounds: self.bounds,
            model: self.model.clone(),
            options: self.options,
            records: self.records.clone(),
            regions: self.regions.clone(),
            tables: self.tables.clone(),
            recorder: Recorder::default(),
            visits: Recorder::default(),
            arrivals: Default::default(),
            overall: self.overall,
            samples: Vec::new(),
            sorted: Vec::new(),
            slots: Vec::new(),
        }
    }

    /// Number of samples that wait for the next update.
    pub fn recorded(&self) -> usize {
        self.recorder.count()
    }

    /// Records samples, usually those of a path at once; from any thread. Samples without
    /// information are left out.
    #[inline]
    pub fn record(&self, samples: &[GuidingSample]) {
        self.recorder
            .record(samples.iter().filter_map(TrainingSample::new));
    }

    /// Records vertices of paths, also of those that found nothing: what [`worth`](Self::worth) is
    /// learnt from. A share of all paths is enough. Any thread may call it.
    #[inline]
    pub fn visit(&self, visits: &[Visit]) {
        self.visits.record(visits.iter().filter_map(StoredVisit::new));
    }

    /// `√E[w²]` of the paths that pass the region of a position, with `w` what a path finds behind
    /// its vertex over the throughput with which it arrives ([`Visit`]): what roulette has to know.
    /// `None` where too few came. A pure function until the next update.
    #[inline(always)]
    pub fn worth(&self, position: Vec3) -> Option<f32> {
        let slot = self.partition.slot(position)?;
        self.regions[slot as usize].passage.worth()
    }

    /// Records ends of flights through media, also of those that found nothing: what
    /// [`arrival_worth`](Self::arrival_worth) is learnt from. Any thread may call it.
    #[inline]
    pub fn arrive(&self, arrivals: &[FlightArrival]) {
        for end in FlightEnd::ALL {
            let own = arrivals.iter().filter(|arrival| arrival.end == end);
            self.arrivals[end as usize].record(own.filter_map(|own| StoredVisit::new(&own.visit())));
        }
    }

    /// `√E[w²]` of what paths found whose flights ended at such a place in the region of a position
    /// ([`FlightArrival`]): the worth by which a flight is guided. Where too few came, that of all
    /// regions; `None` where that is not known either. A pure function until the next update.
    #[inline(always)]
    pub fn arrival_worth(&self, position: Vec3, end: FlightEnd) -> Option<f32> {
        let own = self.partition.slot(position);
        let own = own.and_then(|slot| self.regions[slot as usize].arrivals[end as usize].worth());
        own.or_else(|| self.overall[end as usize].worth())
    }

    /// The field's knowledge at a position: `None` outside the box, where nothing was learnt, and
    /// where a guide is useless. A pure function until the next update.
    #[inline(always)]
    pub fn at(&self, position: Vec3) -> Option<Guidance<M::Distribution<'_>>> {
        let slot = match self.options.interpolation {
            Interpolation::None => self.partition.slot(position)?,
            Interpolation::Jitter => match self.partition.slot_moved(position, offset(position))? {
                // Half of the regions around a surface are empty. What those know is what a larger
                // region knew before it was divided.
                (_, Some(other)) if self.regions[other as usize].samples >= LEAST_SAMPLES => other,
                (slot, _) => slot,
            },
        };
        let Region {
            share, has_learnt, ..
        } = self.regions[slot as usize];
        if !has_learnt || share < self.options.min_share {
            return None;
        }
        let (words, records) = (self.model.table_words(), self.records_of(slot));
        let table = &self.tables[slot as usize * words..][..words];
        let directions = self.model.directions_by_table(records, table, position);
        let share = share.min(self.options.max_share);
        Some(Guidance { directions, share })
    }

    #[inline(always)]
    fn records_of(&self, slot: u32) -> &[M::Record] {
        let stride = self.model.stride();
        &self.records[slot as usize * stride..][..stride]
    }

    /// Forgets all samples that wait for an update.
    pub fn forget_samples(&mut self) {
        self.recorder.take(&mut self.samples);
        self.samples.clear();
        self.visits = Recorder::default();
        self.arrivals = Default::default();
    }

    /// Learns from all samples since the last update: divides space again, then lets each region
    /// learn its share and its directions from its own samples. A region without samples keeps its
    /// state.
    ///
    /// With the feature `parallel` it runs on the current rayon pool.
    ///
    /// # Errors
    /// [`GuidingError::TooManyRegions`]: the field learns nothing then, and the samples are gone.
    pub fn update(&mut self) -> Result<FieldUpdate, GuidingError> {
        self.samples.clear();
        self.recorder.take(&mut self.samples);
        self.locate();
        for _ in 0..self.options.levels {
            let counts = self.counts();
            let FieldOptions {
                split_above,
                collapse_below,
                max_regions,
                ..
            } = self.options;
            let positions = self.samples.iter().map(TrainingSample::position);
            self.partition.claim(positions, &counts, split_above);
            let adapted = self
                .partition
                .adapt(&counts, split_above, collapse_below, max_regions);
            // Levels that were changed before stay.
            let changed = adapted.inspect_err(|_| self.tabulate())?;
            if !changed {
                break;
            }
            self.populate();
            self.locate();
        }
        let passages = self.regions.iter_mut().map(|region| &mut region.passage);
        learn_passages(
            &mut self.visits,
            |position| self.partition.slot(position),
            passages,
        );
        for end in FlightEnd::ALL {
            let (arrivals, partition) = (&mut self.arrivals[end as usize], &self.partition);
            let passages = self
                .regions
                .iter_mut()
                .map(|region| &mut region.arrivals[end as usize]);
            learn_passages(arrivals, |position| partition.slot(position), passages);
        }
        self.join_arrivals();
        Ok(self.learn())
    }

    /// Sums up what all regions know of the ends of flights.
    pub(crate) fn join_arrivals(&mut self) {
        let regions = self.regions.iter().map(|region| region.arrivals);
        self.overall = regions.fold([Passage::default(); 3], |sum, own| {
            std::array::from_fn(|end| sum[end].joined(own[end]))
        });
    }

    /// Finds the slot of each sample.
    fn locate(&mut self) {
        let (partition, samples) = (&self.partition, &self.samples);
        self.slots.resize(samples.len(), NOWHERE);
        fill(&mut self.slots, |i| {
            partition.slot(samples[i].position()).unwrap_or(NOWHERE)
        });
    }

    /// Samples of each slot.
    fn counts(&self) -> Vec<u32> {
        let mut counts = vec![0u32; self.partition.slot_count()];
        for &slot in &self.slots {
            if let Some(count) = counts.get_mut(slot as usize) {
                *count += 1;
            }
        }
        counts
    }

    /// Moves records and regions to the slots of the changed partition.
    fn populate(&mut self) {
        let stride = self.model.stride();
        let slots = self.partition.slot_count();
        let mut records = vec![M::Record::default(); slots * stride];
        let mut regions = vec![Region::new(&self.options); slots];
        let mut parts = vec![0u32; self.regions.len()];
        for origin in (0..slots).filter_map(|slot| self.partition.origin(slot as u32)) {
            parts[origin as usize] += 1;
        }
        for slot in 0..slots {
            let own = &mut records[slot * stride..][..stride];
            match self.partition.origin(slot as u32) {
                Some(origin) => {
                    own.clone_from_slice(&self.records[origin as usize * stride..][..stride]);
                    regions[slot] = self.regions[origin as usize];
                    if parts[origin as usize] > 1 {
                        regions[slot].samples = 0;
                        regions[slot].passage = regions[slot].passage.of_part();
                        regions[slot].arrivals = regions[slot].arrivals.map(Passage::of_part);
                    }
                }
                None => self.model.reset(own),
            }
        }
        (self.records, self.regions) = (records, regions);
    }

    fn learn(&mut self) -> FieldUpdate {
        let counts = self.counts();
        let mut places = Vec::with_capacity(counts.len());
        let mut end = 0;
        for count in &counts {
            places.push(end as usize);
            end += count;
        }
        let found = end as usize;
        self.sorted.clear();
        self.sorted.resize(found, bytemuck::Zeroable::zeroed());
        for (sample, &slot) in self.samples.iter().zip(&self.slots) {
            if let Some(place) = places.get_mut(slot as usize) {
                self.sorted[*place] = *sample;
                *place += 1;
            }
        }
        let stride = self.model.stride();
        let mut tasks = Vec::new();
        let mut rest = self.sorted.as_mut_slice();
        let kept = self.records.chunks_mut(stride).zip(&mut self.regions);
        for ((slot, count), (records, region)) in (0u32..).zip(&counts).zip(kept) {
            let (samples, after) = rest.split_at_mut(*count as usize);
            rest = after;
            if *count > 0 {
                tasks.push(Task {
                    slot,
                    samples,
                    records,
                    region,
                });
            }
        }
        let update = FieldUpdate {
            samples: found,
            outside: self.samples.len() - found,
            regions: tasks.len(),
        };
        let (model, partition, options) = (&self.model, &self.partition, &self.options);
        for_each_chunk(&mut tasks, 16, |_, tasks| {
            let mut table = vec![0; model.table_words()];
            for task in tasks {
                if M::ORDERED {
                    task.samples.sort_unstable_by(TrainingSample::order);
                }
                let bounds = partition.bounds(task.slot);
                if task.region.has_learnt {
                    let records = &*task.records;
                    model.tabulate(records, &mut table);
                    let share = learn_share(
                        task.samples,
                        |position| model.directions_by_table(records, &table, position),
                        task.region.share,
                        options.share_prior,
                        options.share_by_variance,
                    );
                    task.region.share = share;
                }
                model.learn(task.records, task.samples, &bounds);
                task.region.has_learnt = true;
                let count = u32::try_from(task.samples.len()).unwrap_or(u32::MAX);
                task.region.samples = task.region.samples.saturating_add(count);
            }
        });
        let (partition, regions) = (&self.partition, &self.regions);
        self.model.exchange(&mut self.records, |slot| {
            let is_region = regions[slot as usize].has_learnt && partition.origin(slot).is_some();
            let bounds = is_region.then(|| partition.bounds(slot))?;
            Some(0.5 * (bounds.min + bounds.max))
        });
        self.tabulate();
        update
    }

    /// Derives the tables of all regions from their records.
    pub(crate) fn tabulate(&mut self) {
        let (words, stride) = (self.model.table_words(), self.model.stride());
        if words == 0 {
            return;
        }
        self.tables.resize(self.regions.len() * words, 0);
        let (model, records) = (&self.model, &self.records);
        for_each_chunk(&mut self.tables, 64 * words, |start, tables| {
            let records = records[start / words * stride..].chunks(stride);
            for (records, table) in records.zip(tables.chunks_mut(words)) {
                model.tabulate(records, table);
            }
        });
    }
}

/// What one region learns from.
struct Task<'a, R> {
    slot: u32,
    samples: &'a mut [TrainingSample],
    records: &'a mut [R],
    region: &'a mut Region,
}

/// Three numbers in [−½, ½) determined by the bits of a position.
#[inline(always)]
fn offset(position: Vec3) -> Vec3 {
    let [x, y, z] = position.to_array().map(f32::to_bits);
    // Rounds of the finaliser of MurmurHash3.
    let mix = |hash: u32| {
        let hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
        let hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
        hash ^ hash >> 16
    };
    let first = mix(x ^ mix(y ^ mix(z)));
    let (second, third) = (mix(first ^ 0x9e37_79b9), mix(first ^ 0x3c6e_f372));
    let unit = |bits: u32| lightshed_sampling::f32_from_u32(bits) - 0.5;
    Vec3::new(unit(first), unit(second), unit(third))
}
