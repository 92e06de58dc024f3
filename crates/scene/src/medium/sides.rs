//! Media on the two sides of surfaces.

use super::{Medium, MediumDensity};
use crate::Sphere;
use glam::Vec3;
use lightshed_volume::DensityField;

/// In place of a medium's index.
const NONE: u32 = u32::MAX;

/// The media on the two sides of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MediumSides {
    interior: u32,
    exterior: u32,
}

impl MediumSides {
    pub(super) fn new(interior: Option<u32>, exterior: Option<u32>) -> Self {
        Self {
            interior: interior.unwrap_or(NONE),
            exterior: exterior.unwrap_or(NONE),
        }
    }

    /// The medium that a ray enters if it leaves the surface with `cos_theta` to the geometric
    /// normal: the exterior one above, the interior one below. `None` for empty space.
    #[inline(always)]
    pub fn towards(&self, cos_theta: f32) -> Option<u32> {
        let medium = if cos_theta > 0.0 {
            self.exterior
        } else {
            self.interior
        };
        (medium != NONE).then_some(medium)
    }
}

/// The media of a scene and where they meet.
#[derive(Default)]
pub(crate) struct Boundaries {
    pub media: Vec<Medium>,
    /// Index into `sides` by primitive, or [`NONE`]; empty where nothing bounds a medium.
    pub(super) by_primitive: Vec<u32>,
    pub(super) sides: Vec<MediumSides>,
    /// The medium around the camera, if the description names it.
    pub camera_medium: Option<u32>,
    /// Of each medium, whether no surface lies within its grid.
    pub(super) clear: Vec<bool>,
}

impl Boundaries {
    #[inline(always)]
    pub fn of_primitive(&self, primitive: u32) -> Option<MediumSides> {
        let sides = *self.by_primitive.get(primitive as usize)?;
        self.sides.get(sides as usize).copied()
    }

    #[inline(always)]
    pub fn is_clear(&self, medium: u32) -> bool {
        self.clear.get(medium as usize).is_some_and(|&clear| clear)
    }

    /// The middle of each medium's grid in the world, where it has one.
    pub fn grid_middles(&self) -> impl Iterator<Item = Option<Vec3>> + '_ {
        self.media.iter().map(|medium| match medium.density() {
            MediumDensity::Homogeneous => None,
            MediumDensity::Grid(field) => {
                let bounds = field.grid().bounds();
                let middle = (bounds.min() + bounds.max()) * 0.5;
                Some(field.to_field().inverse().transform_point3(middle))
            }
        })
    }

    /// Grids whose middle is not in their own medium, but in that of `around`, are not clear.
    pub fn keep_clear_within(&mut self, around: &[Option<u32>]) {
        for (index, (clear, &around)) in (0..).zip(self.clear.iter_mut().zip(around)) {
            *clear &= around == Some(index);
        }
    }

    /// Looks for surfaces in the media's grids.
    pub fn look_for_surfaces(&mut self, triangles: &[[Vec3; 3]], spheres: &[Sphere]) {
        let is_clear = |medium: &Medium| match medium.density() {
            MediumDensity::Homogeneous => false,
            MediumDensity::Grid(field) => field.is_clear(triangles, spheres),
        };
        self.clear = self.media.iter().map(is_clear).collect();
    }
}
