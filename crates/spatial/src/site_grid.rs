//! The nearest surface sites by a grid of cells.

use crate::{
    Bounds, Nearest, NearestSites, PointGrid, PointGridError, SiteMetric, SurfaceSite, ensure_capacity,
};
use glam::Vec3;

/// Surface sites sorted into cubic cells: a search visits balls of growing radius until they hold
/// enough sites.
///
/// Building it is a radix sort, linear in the number of sites. If their density varies strongly, as
/// among surface points that a camera sees near and far, [`SiteTree`](crate::SiteTree) searches
/// faster.
///
/// ```
/// use lightshed_spatial::glam::Vec3;
/// use lightshed_spatial::{Nearest, NearestSites, SiteGrid, SiteMetric, SurfaceSite};
///
/// let sites: Vec<SurfaceSite> =
///     (0..100).map(|i| SurfaceSite::new(Vec3::new(i as f32, 0.0, 0.0), Vec3::Y)).collect();
/// let grid = SiteGrid::new(&sites)?;
/// let mut found = Nearest::new(2, f32::INFINITY);
/// let site = SurfaceSite::new(Vec3::new(41.6, 3.0, 0.0), Vec3::Y);
/// grid.nearest(&site, SiteMetric::POSITION, &mut found);
/// assert_eq!(found.found().iter().map(|site| site.index).collect::<Vec<_>>(), [42, 41]);
/// # Ok::<(), lightshed_spatial::PointGridError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct SiteGrid {
    points: PointGrid,
    sites: Vec<SurfaceSite>,
    positions: Vec<Vec3>,
    bounds: Bounds,
}

/// Sites that a cell would hold if they were spread evenly over their box.
const IN_CELL: f32 = 4.0;

impl SiteGrid {
    /// Sorts `sites`.
    ///
    /// # Errors
    /// [`PointGridError`] for positions that are not finite, or too many.
    pub fn new(sites: &[SurfaceSite]) -> Result<Self, PointGridError> {
        let mut grid = Self::default();
        grid.rebuild(sites)?;
        Ok(grid)
    }

    /// As [`SiteGrid::new`], reusing this grid's memory.
    ///
    /// # Errors
    /// As [`SiteGrid::new`]; on error the grid must not be searched.
    pub fn rebuild(&mut self, sites: &[SurfaceSite]) -> Result<(), PointGridError> {
        self.positions.clear();
        ensure_capacity(&mut self.positions, sites.len());
        self.positions.extend(sites.iter().map(|site| site.position));
        self.bounds = Bounds::of_points(self.positions.iter().copied());
        // Surfaces fill an area, not a volume.
        let area = self.bounds.half_area() * 2.0;
        let cell = (area / sites.len().max(1) as f32 * IN_CELL).sqrt();
        let length = self.bounds.diagonal().max_element() / sites.len().max(1) as f32;
        let cell = cell.max(length).clamp(f32::MIN_POSITIVE, f32::MAX);
        self.points.rebuild(&self.positions, cell)?;
        self.sites.clear();
        self.sites.extend_from_slice(sites);
        Ok(())
    }
}

impl NearestSites for SiteGrid {
    fn nearest(&self, site: &SurfaceSite, metric: SiteMetric, found: &mut Nearest) {
        let center = site.position;
        // Beyond this radius there are no sites; NaN finds none either.
        let farthest = f64::from(self.bounds.distance_squared_max(center)).sqrt() * (1.0 + 1e-6);
        let nearest = f64::from(self.bounds.distance_squared_min(center)).sqrt();
        let mut radius = nearest + 0.5 * self.points.cell_side();
        if self.sites.is_empty() || !farthest.is_finite() {
            // Coordinates whose squares overflow are too rare to sort for.
            return self.sites[..].nearest(site, metric, found);
        }
        loop {
            found.clear();
            // Rounded outwards: the ball must contain everything within its radius.
            let rounded = (radius * (1.0 + 1e-6)).min(f64::from(f32::MAX)) as f32;
            self.points.for_each_within(center, rounded, |index, _| {
                let distance_squared = metric.distance_squared(site, &self.sites[index as usize]);
                found.offer(index, distance_squared);
            });
            let reach = found.reach_squared().max(0.0).sqrt();
            if reach <= radius || radius >= farthest {
                return;
            }
            radius = match found.is_full() {
                true => reach,
                false => (2.0 * radius).min(reach),
            };
        }
    }
}
