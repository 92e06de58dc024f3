//! Which of a cell's reservoirs are read.

use super::reservoirs::{WorldDomain, WorldReservoirs};
use crate::error::{CachingError, check_option};
use lightshed_resampling::{Domains, Storage, Topology};
use lightshed_sampling::CounterRng;
use lightshed_spatial::{SpatialIndex, SurfaceSite};

/// Most reservoirs that one domain reads.
pub const MAX_READS: u32 = 16;

/// What a domain reads of the cells around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorldReads {
    count: u32,
    jittered: bool,
}

impl WorldReads {
    /// `count` reservoirs, 1 to 16, each of a random place in the cell of a site that is moved at
    /// random by up to half a cell: borders of cells do not show.
    ///
    /// # Errors
    /// [`CachingError::Option`].
    pub fn new(count: u32) -> Result<Self, CachingError> {
        let fits = (1..=MAX_READS).contains(&count);
        check_option(fits, "reads", f64::from(count), "from 1 to 16")?;
        Ok(Self {
            count,
            jittered: true,
        })
    }

    /// Of the site's own cell alone.
    #[must_use]
    pub fn within_cells(self) -> Self {
        Self {
            jittered: false,
            ..self
        }
    }
}

/// Leads each of a row of domains to the reservoirs that it reads: a [`Topology`] whose neighbours
/// are indices of [`WorldReservoirs::history`].
///
/// The place within a cell is random and says nothing of what is held there; a cell that is not
/// there is replaced by that of the site itself. None is visited twice.
pub struct WorldLinks<'a, D: WorldDomain, Ds: ?Sized, F, R: Storage = f32> {
    world: &'a WorldReservoirs<D, R>,
    domains: &'a Ds,
    reads: WorldReads,
    random: F,
}

impl<D: WorldDomain, R: Storage> WorldReservoirs<D, R> {
    /// What each of `domains` reads, by random numbers that `random` makes for its index.
    pub fn links<'a, Ds, F>(
        &'a self,
        domains: &'a Ds,
        reads: WorldReads,
        random: F,
    ) -> WorldLinks<'a, D, Ds, F, R>
    where
        Ds: Domains<Domain = D> + ?Sized,
        F: Fn(usize) -> CounterRng + Sync,
    {
        WorldLinks {
            world: self,
            domains,
            reads,
            random,
        }
    }
}

impl<D, Ds, F, R> Topology for WorldLinks<'_, D, Ds, F, R>
where
    D: WorldDomain + Send + Sync,
    D::Sample: Send + Sync,
    Ds: Domains<Domain = D> + ?Sized,
    F: Fn(usize) -> CounterRng + Sync,
    R: Storage,
{
    fn max_neighbours(&self) -> usize {
        self.reads.count as usize
    }

    fn for_each(&self, index: usize, mut visit: impl FnMut(usize)) {
        let Some(site) = self.domains.domain(index).and_then(WorldDomain::site) else {
            return;
        };
        let mut rng = (self.random)(index);
        let grid = &self.world.grid;
        let serving = |site: &SurfaceSite| grid.locate(site).filter(|&slot| self.world.serves(slot));
        let mut visited = [usize::MAX; MAX_READS as usize];
        for number in 0..self.reads.count as usize {
            let u = rng.next_2d();
            let number_in_cell = rng.next_u32() % self.world.options().reservoirs;
            let moved = self.reads.jittered.then(|| grid.cells.jittered(&site, u));
            let slot = moved.and_then(|moved| serving(&moved)).or_else(|| serving(&site));
            let Some(slot) = slot else { continue };
            let place = slot as usize * self.world.each() + number_in_cell as usize;
            if !visited[..number].contains(&place) {
                visited[number] = place;
                visit(place);
            }
        }
    }
}
