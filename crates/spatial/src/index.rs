//! Which cell a surface point belongs to.

use glam::Vec3;
use std::fmt::Debug;
use std::hash::Hash;

/// A point on a surface, as a spatial index sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSite {
    /// Position.
    pub position: Vec3,
    /// Unit *geometric* normal; zero in a medium, which has none. Shading normals differ from point
    /// to point of one triangle and would scatter its points over several cells.
    pub normal: Vec3,
    /// Length of the path from the eye to this point. An index whose cells grow with distance takes
    /// its level of detail from it; 0 requests the finest cells. Use the whole path, not its last
    /// edge: a mirror is no reason for finer cells.
    pub eye_distance: f32,
    /// The direction that is asked about, by a number of the user's own from 1 on: what leaves a
    /// glossy surface differs from direction to direction. 0 for all directions together. Only
    /// indices that say so look at it.
    pub facet: u16,
}

impl SurfaceSite {
    /// A site on a surface, as seen from distance 0.
    pub fn new(position: Vec3, normal: Vec3) -> Self {
        Self {
            position,
            normal,
            eye_distance: 0.0,
            facet: 0,
        }
    }

    /// The same site, reached from the eye by a path of this length.
    pub fn with_eye_distance(self, eye_distance: f32) -> Self {
        Self { eye_distance, ..self }
    }

    /// The same site, in the direction of this number.
    pub fn with_facet(self, facet: u16) -> Self {
        Self { facet, ..self }
    }
}

/// A partition of surface sites into cells. Methods that learn over space (guides, caches,
/// world-space reservoirs) store one record a cell, and are generic over this trait.
///
/// An implementation must satisfy these laws. Property tests of this crate check them for its own
/// implementations.
///
/// - [`locate`](Self::locate) is a pure function: the same site has the same cell until the index
///   is changed through `&mut self`. An estimator may therefore locate a site twice, once to read
///   and once to write.
/// - `None` means that no record is kept for the site: it lies outside, is not finite, or nothing
///   was stored there. A method must then return a defined value, and stay unbiased unless its name
///   says otherwise.
/// - An implementation may ignore parts of the site. A grid of positions ignores the normal.
///
/// ```
/// use lightshed_spatial::glam::{DVec3, Vec3};
/// use lightshed_spatial::{CubicGrid, SpatialIndex, SurfaceSite};
///
/// /// The number of samples in the cell of each site.
/// fn count<I: SpatialIndex>(index: &I, sites: &[SurfaceSite]) -> std::collections::HashMap<I::Cell, u32> {
///     let mut counts = std::collections::HashMap::new();
///     for cell in sites.iter().filter_map(|site| index.locate(site)) {
///         *counts.entry(cell).or_default() += 1;
///     }
///     counts
/// }
///
/// let grid = CubicGrid::new(DVec3::ZERO, 0.5);
/// let sites = [0.1, 0.2, 0.7].map(|x| SurfaceSite::new(Vec3::new(x, 0.0, 0.0), Vec3::Y));
/// assert_eq!(count(&grid, &sites)[&[0, 0, 0]], 2);
/// ```
pub trait SpatialIndex {
    /// Names a cell.
    type Cell: Copy + Eq + Hash + Debug;

    /// The cell of `site`, if a record is kept for it.
    fn locate(&self, site: &SurfaceSite) -> Option<Self::Cell>;
}

impl<I: SpatialIndex + ?Sized> SpatialIndex for &I {
    type Cell = I::Cell;

    #[inline(always)]
    fn locate(&self, site: &SurfaceSite) -> Option<Self::Cell> {
        (**self).locate(site)
    }
}
