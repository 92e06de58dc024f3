//! Cells with their reservoirs.

use super::options::WorldReservoirOptions;
use super::report::WorldReport;
use super::visits::WorldVisits;
use crate::error::CachingError;
use lightshed_resampling::{
    Choose, Domain, DomainReservoir, Domains, History, Input, MergeError, MergeRule, Reservoir, ReuseError,
    ShiftMapping, Storage,
};
use lightshed_sampling::{CounterRng, parallel};
use lightshed_spatial::{HashGrid, SpatialIndex, SurfaceSite};
use std::ops::Range;

/// A domain that has a place: what [`WorldReservoirs`] ask of a renderer's domains.
pub trait WorldDomain: Domain + Clone {
    /// Where it is; `None` for one that takes no part, as it has nothing to share.
    fn site(&self) -> Option<SurfaceSite>;

    /// Whether two samples of this domain are one and the same point of it.
    fn is_same(&self, a: &Self::Sample, b: &Self::Sample) -> bool;
}

/// Reservoirs in cells of space, `K` in each; see `docs/caching.md`.
///
/// A frame goes in three steps: [`visit`](Self::visit) says which pixel (or other domain) belongs
/// to which cell, [`update`](Self::update) merges what they bring, [`links`](Self::links) lead them
/// to what they read. As [`Domains`] it has `K` entries for each cell, all of them its site, and
/// [`history`](Self::history) is what [`Reuse::linked`](lightshed_resampling::Reuse::linked) reads.
///
/// The content is the same for any number of threads.
///
/// **Cells outlive frames**: sites keep the surface, view and light of *their* frame. Where the
/// scene changes, their targets are no longer what would be computed now: [`clear`](Self::clear)
/// them, or let their domains keep the old scene.
pub struct WorldReservoirs<D: Domain, R: Storage = f32> {
    options: WorldReservoirOptions,
    pub(super) grid: HashGrid,
    sites: Vec<Option<D>>,
    reservoirs: Vec<DomainReservoir<D, R>>,
    frame: u32,
}

/// Sites whose cells are claimed together.
const CLAIMS: usize = 1024;
/// Cells that go to a thread together.
const TOGETHER: usize = 32;
/// Seed of when sites move.
const RENEWAL_SEED: u64 = 0x776f_726c_6473_6974;

/// A cell as it will be.
struct Renewed<D: Domain, R: Storage> {
    slot: u32,
    /// If it is another than before.
    site: Option<D>,
    reservoirs: Vec<DomainReservoir<D, R>>,
    contributors: usize,
    held: usize,
    distinct: usize,
}

impl<D: Domain, R: Storage> WorldReservoirs<D, R> {
    /// No cells yet.
    ///
    /// # Errors
    /// Options out of range.
    pub fn new(options: WorldReservoirOptions) -> Result<Self, CachingError> {
        options.check()?;
        let grid = HashGrid::new(options.cells, options.slots)?;
        let slots = grid.table.slots();
        let reservoirs = slots * options.reservoirs as usize;
        Ok(Self {
            options,
            grid,
            sites: (0..slots).map(|_| None).collect(),
            reservoirs: (0..reservoirs).map(|_| Reservoir::empty(0.0)).collect(),
            frame: 0,
        })
    }

    /// The options.
    pub fn options(&self) -> &WorldReservoirOptions {
        &self.options
    }

    /// Cells' sites with their reservoirs, `K` for each slot, in one row.
    pub fn history(&self) -> History<'_, Self, R>
    where
        D: Sync,
        D::Sample: Sync,
    {
        History::new(self, &self.reservoirs)
    }

    /// The reservoirs, `K` for each slot; empty, of confidence 0, where there is no cell.
    pub fn reservoirs(&self) -> &[DomainReservoir<D, R>] {
        &self.reservoirs
    }

    /// How many reservoirs a cell has.
    pub(super) fn each(&self) -> usize {
        self.options.reservoirs as usize
    }

    /// Where a cell's are.
    fn range(&self, slot: u32) -> Range<usize> {
        let first = slot as usize * self.each();
        first..first + self.each()
    }

    /// Whether a cell has something to read.
    pub(super) fn serves(&self, slot: u32) -> bool {
        self.sites[slot as usize].is_some()
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.grid.table.evict(0, |_| ());
        self.sites.iter_mut().for_each(|site| *site = None);
        self.reservoirs.fill_with(|| Reservoir::empty(0.0));
    }
}

impl<D: Domain + Sync, R: Storage> Domains for WorldReservoirs<D, R>
where
    D::Sample: Sync,
{
    type Domain = D;

    fn count(&self) -> usize {
        self.reservoirs.len()
    }

    #[inline]
    fn domain(&self, index: usize) -> Option<&D> {
        self.sites.get(index / self.each())?.as_ref()
    }
}

impl<D, R> WorldReservoirs<D, R>
where
    D: WorldDomain + Send + Sync,
    D::Sample: Send + Sync,
    R: Storage,
{
    /// A frame begins: cells of `domains` are opened or stay in use, those that nobody has visited
    /// for too long go. `rank` gives each domain a random number of this frame: those of the
    /// lowest ranks in a cell bring something, and one of them is the site where one is wanted. It
    /// must not depend on samples.
    pub fn visit(
        &mut self,
        domains: &(impl Domains<Domain = D> + ?Sized),
        rank: impl Fn(usize) -> u32 + Sync,
    ) -> WorldVisits {
        self.frame = self.frame.wrapping_add(1);
        let numbers: Vec<usize> = (0..domains.count()).collect();
        let sited = |index: usize| domains.domain(index)?.site();
        let grid = &self.grid;
        parallel::for_each(numbers.chunks(CLAIMS), |_, numbers| {
            for site in numbers.iter().filter_map(|&index| sited(index)) {
                grid.claim(&site);
            }
        });
        let (each, sites, reservoirs) = (self.each(), &mut self.sites, &mut self.reservoirs);
        let mut begin = |slot: u32| {
            let slot = slot as usize;
            sites[slot] = None;
            reservoirs[slot * each..(slot + 1) * each].fill_with(|| Reservoir::empty(0.0));
        };
        self.grid.table.settle(&mut begin);
        self.grid.table.evict(self.options.max_age, &mut begin);
        let grid = &self.grid;
        let parts = parallel::map(numbers.chunks(CLAIMS), |_, numbers| {
            let visitor = |&index: &usize| {
                let slot = grid.locate(&sited(index)?)?;
                Some((slot, rank(index), index as u32))
            };
            numbers.iter().filter_map(visitor).collect::<Vec<_>>()
        });
        WorldVisits::new(parts.concat(), self.options.contributors as usize)
    }

    /// Each visited cell merges what it held with the fresh reservoirs of those that bring
    /// something, in the domain of its site, by `rule`; its cap of confidence is that of cells, in
    /// fresh reservoirs. `fresh` has one reservoir for each of `domains`; those of confidence 0
    /// count as not brought. `choose` makes each cell's source of decisions, by slot.
    ///
    /// What a cell held before is canonical there, as it lives in the site's domain: its `K`
    /// reservoirs share the cell's confidence. Where the site moves, it is shifted as the rest, and
    /// the fresh reservoir of the new site is canonical.
    ///
    /// # Errors
    /// [`ReuseError::Length`], or the error of some cell's merge.
    pub fn update<T, C>(
        &mut self,
        visits: &WorldVisits,
        domains: &(impl Domains<Domain = D> + ?Sized),
        fresh: &[DomainReservoir<D, R>],
        rule: &MergeRule<T>,
        choose: impl Fn(u32) -> C + Sync,
    ) -> Result<WorldReport, ReuseError>
    where
        T: ShiftMapping<D> + Sync,
        C: Choose,
    {
        if domains.count() != fresh.len() {
            return Err(ReuseError::Length);
        }
        let parts = parallel::map(visits.cells().chunks(TOGETHER), |_, cells| {
            let renewed = |(slot, visitors): &(u32, Range<usize>)| {
                let bringing = visits.bringing(visitors);
                let brought: Vec<(&D, &DomainReservoir<D, R>)> = bringing
                    .filter_map(|index| Some((domains.domain(index)?, &fresh[index])))
                    .filter(|(_, reservoir)| reservoir.confidence() > 0.0)
                    .collect();
                self.renewed(*slot, &brought, rule, &mut choose(*slot))
            };
            cells.iter().map(renewed).collect::<Result<Vec<_>, _>>()
        });
        let mut report = WorldReport {
            visited: visits.cells().len(),
            occupancy: self.grid.table.occupancy(),
            ..WorldReport::default()
        };
        for part in parts {
            for cell in part.map_err(ReuseError::Merge)?.into_iter().flatten() {
                report.contributors += cell.contributors;
                report.held += cell.held;
                report.distinct += cell.distinct;
                report.moved += usize::from(cell.site.is_some());
                self.keep(cell);
            }
        }
        Ok(report)
    }

    /// A cell after a merge of what it held and what is brought, the new site first if there is to
    /// be one; `None` if nothing is.
    fn renewed<T: ShiftMapping<D>>(
        &self,
        slot: u32,
        brought: &[(&D, &DomainReservoir<D, R>)],
        rule: &MergeRule<T>,
        choose: &mut impl Choose,
    ) -> Result<Option<Renewed<D, R>>, MergeError> {
        let Some(&(first, _)) = brought.first() else {
            return Ok(None);
        };
        let held = &self.reservoirs[self.range(slot)];
        let share = held[0].confidence() / self.each() as f32;
        let held: Vec<_> = held
            .iter()
            .map(|held| held.clone().with_confidence_cap(share))
            .collect();
        let before = self.sites[slot as usize].as_ref();
        let moves = CounterRng::at(RENEWAL_SEED, slot, self.frame, 0).is_multiple_of(self.options.renewal);
        let (to, moved) = match before {
            Some(site) if !moves => (site, false),
            _ => (first, true),
        };
        let mut inputs: Vec<Input<'_, D, R>> = Vec::with_capacity(brought.len() + held.len());
        for (number, (domain, reservoir)) in brought.iter().enumerate() {
            inputs.push(match moved && number == 0 {
                true => Input::canonical(domain, reservoir),
                false => Input::neighbour(domain, reservoir),
            });
        }
        if let Some(site) = before {
            inputs.extend(held.iter().map(|held| match moved {
                true => Input::neighbour(site, held),
                false => Input::canonical(site, held),
            }));
        }
        let mut reservoirs = vec![Reservoir::empty(0.0); self.each()];
        let same = |a: &D::Sample, b: &D::Sample| to.is_same(a, b);
        rule.merge_several(to, &inputs, same, &mut reservoirs, choose)?;
        let samples: Vec<_> = reservoirs.iter().filter_map(Reservoir::sample).collect();
        let is_first = |&(number, sample): &(usize, &&D::Sample)| {
            !samples[..number].iter().any(|other| same(sample, other))
        };
        Ok(Some(Renewed {
            slot,
            contributors: brought.len(),
            held: samples.len(),
            distinct: samples.iter().enumerate().filter(is_first).count(),
            site: moved.then(|| first.clone()),
            reservoirs,
        }))
    }

    fn keep(&mut self, cell: Renewed<D, R>) {
        let range = self.range(cell.slot);
        for (place, reservoir) in self.reservoirs[range].iter_mut().zip(cell.reservoirs) {
            *place = reservoir;
        }
        if let Some(site) = cell.site {
            self.sites[cell.slot as usize] = Some(site);
        }
    }
}
