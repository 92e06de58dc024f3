//! Densities and emission as trackers read them.

use crate::{Ray, Rgb};
use glam::{Affine3A, Vec3};
use lightshed_volume::{DenseGrid, DensityField, FieldRay, Interval, MajorantGrid};

/// The density of a medium.
pub enum MediumDensity {
    /// 1 everywhere within the boundary.
    Homogeneous,
    /// A grid.
    Grid(Box<GridField>),
}

/// A grid of densities in the world.
pub struct GridField {
    pub(super) grid: DenseGrid,
    pub(super) majorants: MajorantGrid,
    pub(super) to_field: Affine3A,
}

/// Edge of the super-voxels that bound a grid's density, in voxels: 8, as in Lin 2022 §5.6, but no more than an eighth of the grid's
/// shortest edge.
pub(super) fn super_voxel(resolution: [u32; 3]) -> f32 {
    let shortest = resolution.into_iter().min().unwrap_or(1);
    (shortest / 8).clamp(2, 8) as f32
}

impl GridField {
    /// The densities, in a space that counts voxels.
    #[inline(always)]
    pub fn grid(&self) -> &DenseGrid {
        &self.grid
    }

    /// Their bounds on super-voxels: of 8 voxels, or an eighth of the shortest edge of a small grid.
    #[inline(always)]
    pub fn majorants(&self) -> &MajorantGrid {
        &self.majorants
    }

    /// From the world to the grid's space.
    #[inline(always)]
    pub fn to_field(&self) -> &Affine3A {
        &self.to_field
    }

    /// The ray in the grid's space, with the same parameter `t`.
    #[inline(always)]
    pub fn field_ray(&self, ray: &Ray) -> FieldRay {
        FieldRay::new(
            self.to_field.transform_point3(ray.origin),
            self.to_field.transform_vector3(ray.direction),
        )
    }

    /// The part of `interval` of a ray in the grid's space that lies in the grid.
    #[inline(always)]
    pub fn clip(&self, ray: &FieldRay, interval: Interval) -> Option<Interval> {
        self.grid.bounds().clip(ray, interval)
    }
}

/// What a medium emits.
pub struct MediumEmission {
    pub(super) radiance: Rgb,
    pub(super) grid: Option<(DenseGrid, Affine3A)>,
}

impl MediumEmission {
    /// `L_e(x)` at a world position.
    #[inline]
    pub fn radiance(&self, position: Vec3) -> Rgb {
        let Some((grid, to_field)) = &self.grid else {
            return self.radiance;
        };
        let place = to_field.transform_point3(position);
        let bounds = grid.bounds();
        if place.cmpge(bounds.min()).all() && place.cmple(bounds.max()).all() {
            self.radiance * grid.density(place)
        } else {
            Rgb::ZERO
        }
    }
}
