//! A cache of outgoing radiance.

use super::error::CachingError;
use super::grid::CacheGrid;
use super::moments::VertexMoments;
use super::options::{MAX_UPDATE_SAMPLES, RadianceCacheOptions};
use super::published::CachedRadiance;
use super::record::Record;
use super::report::CacheReport;
use super::sampler::{CacheSample, VertexSampler, VertexVisit};
use super::surroundings::Surroundings;
use super::view::CacheView;
use glam::DVec3;
use lightshed_sampling::{CounterRng, f32_from_u32, parallel};
use lightshed_spatial::SurfaceSite;

/// Outgoing radiance of surfaces by position, level and side, in a hash grid of bounded size, with
/// its local variance and its bias.
///
/// `rc = E_P[E[g^suf | x_0, x_1]]` (eq. 4.121): the mean radiance that the vertices of a cell
/// scatter, over the vertices and outgoing directions that paths have found. It is updated in
/// separate passes (§7.4). In each pass, a vertex of every record is sampled independently several
/// times. A sample is direct light plus the cache's value, of the previous pass, at the end of the
/// next edge. So radiance propagates by one edge a pass, and records learn the variance of a path's
/// next step.
///
/// Vertices come from [`offer`](Self::offer), and from the samples, which explore. A pass has the
/// same result for any number of threads: records are updated one by one from their own samples,
/// and vertices are kept in the order of the records that found them.
///
/// With a [`Refinement`](crate::Refinement), cells whose bias dominates are split after a pass. The
/// smaller ones begin with the vertices of the larger, which answers for them until they do, and is
/// itself sampled in one of eight passes only.
pub struct RadianceCache<V> {
    options: RadianceCacheOptions,
    grid: CacheGrid,
    records: Vec<Record<V>>,
    /// Whether a record has a vertex: most slots are empty, and records are large.
    in_use: Vec<bool>,
    surroundings: Surroundings,
    published: Vec<CachedRadiance>,
    /// Vertices that wait for the next pass.
    offered: Vec<(SurfaceSite, V)>,
    pass: u32,
}

/// Slots that go to a thread together.
const TOGETHER: usize = 128;
/// A record whose cell is split is sampled in one of so many passes.
const SPLIT_PASSES: u32 = 8;
/// Offered vertices whose cells are claimed together.
const CLAIMS: usize = 1024;
/// Seeds of the random selection of kept vertices, and of their places.
const KEEP_SEED: u64 = 0x6361_6368_655f_6b65;
const PLACE_SEED: u64 = 0x6361_6368_655f_706c;
const MOVE_SEED: u64 = 0x6361_6368_655f_6d76;

/// Results of a part of the records in a pass.
struct Part<V> {
    visited: usize,
    found: Vec<(SurfaceSite, V)>,
}

impl<V: Copy + Send + Sync> RadianceCache<V> {
    /// A cache without records.
    ///
    /// # Errors
    /// Options out of range.
    pub fn new(options: RadianceCacheOptions) -> Result<Self, CachingError> {
        options.check()?;
        let grid = CacheGrid::new(&options)?;
        let slots = grid.table.slots();
        Ok(Self {
            options,
            grid,
            records: vec![Record::new(); slots],
            in_use: vec![false; slots],
            surroundings: Surroundings::new(options.cells)?,
            published: vec![CachedRadiance::default(); slots],
            offered: Vec::new(),
            pass: 0,
        })
    }

    /// The options.
    pub fn options(&self) -> &RadianceCacheOptions {
        &self.options
    }

    /// What the cache answers.
    #[inline]
    pub fn view(&self) -> CacheView<'_> {
        CacheView {
            grid: &self.grid,
            published: &self.published,
        }
    }

    /// [`CacheView::query`].
    #[inline]
    pub fn query(&self, site: &SurfaceSite) -> Option<&CachedRadiance> {
        self.view().query(site)
    }

    /// Offers vertices of paths for the next pass: their cells get records, or stay in use. Their
    /// order counts.
    pub fn offer(&mut self, vertices: impl IntoIterator<Item = (SurfaceSite, V)>) {
        self.offered.extend(vertices);
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.offered.clear();
        let mut closed = Vec::new();
        self.grid.table.evict(0, |slot| closed.push(slot));
        closed
            .into_iter()
            .for_each(|slot| self.grid.set_split(slot, false));
        self.records.fill(Record::new());
        self.in_use.fill(false);
        self.published.fill(CachedRadiance::default());
    }

    /// A pass: samples a vertex of every record, and opens records for the vertices that were found
    /// and offered.
    pub fn update(&mut self, sampler: &impl VertexSampler<V>) -> CacheReport {
        self.pass += 1;
        let parts = self.sample(sampler);
        let visited = parts.iter().map(|part| part.visited).sum();
        self.publish();
        let mut offered = std::mem::take(&mut self.offered);
        parts.into_iter().for_each(|part| offered.extend(part.found));
        self.split(&mut offered);
        self.open(&offered);
        let report = CacheReport {
            passes: self.pass,
            answering: self.published.iter().filter(|record| record.passes > 0.0).count(),
            visited,
            samples: visited as u64 * u64::from(self.options.samples),
            offered: offered.len(),
            split: self.split_cells(),
            occupancy: self.grid.table.occupancy(),
        };
        // The memory is kept for the next pass.
        offered.clear();
        self.offered = offered;
        report
    }

    /// Samples a vertex of every record, which learns from the samples.
    fn sample(&mut self, sampler: &impl VertexSampler<V>) -> Vec<Part<V>> {
        let Self {
            options,
            grid,
            records,
            in_use,
            published,
            pass,
            ..
        } = self;
        let (grid, pass, count) = (&*grid, *pass, options.samples as usize);
        let view = CacheView { grid, published };
        parallel::map(records.chunks_mut(TOGETHER), |part, records| {
            let first = part * TOGETHER;
            let visits: Vec<VertexVisit<V>> = (first..)
                .zip(records.iter())
                .filter(|(slot, _)| in_use[*slot])
                .filter_map(|(slot, record)| {
                    let slot = slot as u32;
                    if grid.is_split(slot) && !(pass.wrapping_add(slot)).is_multiple_of(SPLIT_PASSES) {
                        return None;
                    }
                    let &(site, vertex) = record.vertex(slot, pass)?;
                    Some(VertexVisit {
                        vertex,
                        site,
                        slot,
                        pass,
                    })
                })
                .collect();
            let mut found = Vec::new();
            let mut samples = [CacheSample::default(); MAX_UPDATE_SAMPLES as usize];
            for visits in visits.chunks(MAX_UPDATE_SAMPLES as usize / count) {
                let samples = &mut samples[..visits.len() * count];
                samples.fill(CacheSample::default());
                sampler.sample(&view, visits, samples);
                for (visit, samples) in visits.iter().zip(samples.chunks(count)) {
                    let record = &mut records[visit.slot as usize - first];
                    learn(record, samples, moved_variance(&view, visit), options);
                    let next = (0u32..)
                        .zip(samples)
                        .filter_map(|(number, sample)| Some((number, sample.next?)));
                    found.extend(next.filter_map(|(number, (site, vertex))| {
                        let word = CounterRng::at(KEEP_SEED, visit.slot, pass, number);
                        let wanted = word.is_multiple_of(options.keep_one_in) || grid.locate(&site).is_none();
                        wanted.then_some((site, vertex))
                    }));
                }
            }
            let visited = visits.len();
            Part { visited, found }
        })
    }

    /// Publishes the records' learnt values.
    fn publish(&mut self) {
        let (records, in_use, least) = (&self.records, &self.in_use, self.options.min_passes);
        parallel::for_each_chunk(&mut self.published, CLAIMS, |first, published| {
            for (slot, shown) in (first..).zip(published) {
                if in_use[slot] {
                    *shown = records[slot].publish(least);
                }
            }
        });
        self.surroundings.raise(&mut self.published, |slot| {
            let first = records[slot].first_site().filter(|_| in_use[slot])?;
            Some(*first)
        });
    }

    /// How many cells are split.
    fn split_cells(&self) -> usize {
        let slots = 0..self.grid.table.slots() as u32;
        match self.options.refinement {
            Some(_) => slots.filter(|&slot| self.grid.is_split(slot)).count(),
            None => 0,
        }
    }

    /// Splits the cells whose bias dominates; their vertices are `offered` to the smaller ones.
    fn split(&mut self, offered: &mut Vec<(SurfaceSite, V)>) {
        let Some(refinement) = self.options.refinement else {
            return;
        };
        if self.grid.table.occupancy().load() > refinement.most_load {
            return;
        }
        for slot in (0..self.records.len()).filter(|&slot| self.in_use[slot]) {
            let record = &self.records[slot];
            let leaf = record.first_site().and_then(|site| self.grid.leaf(site, |_| ()));
            let is_leaf = leaf.is_some_and(|leaf| leaf.left > 0 && leaf.slot == Some(slot as u32));
            if is_leaf && record.is_biased(refinement.least_bias) {
                offered.extend(record.vertices().copied());
                self.grid.set_split(slot as u32, true);
            }
        }
    }

    /// Opens records for the cells of vertices, keeps the vertices there, and closes records for
    /// which none was found.
    fn open(&mut self, offered: &[(SurfaceSite, V)]) {
        let grid = &self.grid;
        parallel::for_each(offered.chunks(CLAIMS), |_, part| {
            part.iter().for_each(|(site, _)| {
                grid.claim(site);
            });
        });
        let Self {
            grid,
            records,
            in_use,
            published,
            ..
        } = self;
        let mut begun = Vec::new();
        grid.table.settle(|slot| begun.push(slot));
        grid.table.evict(self.options.max_age, |slot| begun.push(slot));
        for slot in begun {
            records[slot as usize] = Record::new();
            in_use[slot as usize] = false;
            published[slot as usize] = CachedRadiance::default();
            grid.set_split(slot, false);
        }
        for (number, vertex) in (0u32..).zip(offered) {
            if let Some(slot) = grid.locate(&vertex.0) {
                let place = CounterRng::at(PLACE_SEED, slot, self.pass, number);
                records[slot as usize].keep(*vertex, place);
                in_use[slot as usize] = true;
            }
        }
    }
}

/// An unbiased estimate of the variance of the radiance over moved look-ups at a vertex: half the
/// squared difference of two.
fn moved_variance<V>(view: &CacheView<'_>, visit: &VertexVisit<V>) -> DVec3 {
    let words =
        |first| [first, first + 1].map(|word| CounterRng::at(MOVE_SEED, visit.slot, visit.pass, word));
    let answers = [0, 2].map(|first| view.query_jittered(&visit.site, words(first).map(f32_from_u32)));
    match answers {
        [Some(a), Some(b)] => {
            let apart = (a.radiance - b.radiance).as_dvec3();
            0.5 * apart * apart
        }
        _ => DVec3::ZERO,
    }
}

/// Lets a record learn from samples of one vertex.
fn learn<V: Copy>(
    record: &mut Record<V>,
    samples: &[CacheSample<V>],
    moved: DVec3,
    options: &RadianceCacheOptions,
) {
    let moments = VertexMoments::of(samples.iter().map(|sample| sample.radiance));
    let deferred = samples
        .iter()
        .map(|sample| sample.deferred_bias_squared.as_dvec3());
    let deferred = deferred.sum::<DVec3>() / samples.len().max(1) as f64;
    record.learn(&moments, [deferred, moved], options.history);
}
