//! Densities and emission as trackers read them.

use crate::{Ray, Rgb, Sphere};
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

/// Edge of the super-voxels that bound a grid's density, in voxels: 8, as in Lin 2022 §5.6, but no
/// more than an eighth of the grid's shortest edge.
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

    /// Their bounds on super-voxels: of 8 voxels, or an eighth of the shortest edge of a small
    /// grid.
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

impl GridField {
    /// Whether no surface reaches into the grid's box: collisions in it then come before all
    /// surfaces that a ray meets. Surfaces on the box's faces, as far as rounding tells, do not
    /// count; slanted ones are taken for the boxes around them.
    pub(super) fn is_clear(&self, triangles: &[[Vec3; 3]], spheres: &[Sphere]) -> bool {
        let (least, greatest) = (self.grid.bounds().min(), self.grid.bounds().max());
        let reaches_in = |corners: &mut dyn Iterator<Item = Vec3>| {
            let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            let mut terms = greatest - least;
            for corner in corners {
                let place = self.to_field.transform_point3(corner);
                (min, max) = (min.min(place), max.max(place));
                terms = terms.max(self.terms_of(corner));
            }
            let slack = terms * (16.0 * f32::EPSILON);
            min.cmplt(greatest - slack).all() && max.cmpgt(least + slack).all()
        };
        let corners_of = |sphere: &Sphere| {
            let Sphere { center, radius } = *sphere;
            let sign = move |bit: u32| if bit == 0 { -radius } else { radius };
            (0..8u32).map(move |i| center + Vec3::new(sign(i & 1), sign(i & 2), sign(i & 4)))
        };
        !triangles
            .iter()
            .any(|corners| reaches_in(&mut corners.iter().copied()))
            && !spheres.iter().any(|sphere| reaches_in(&mut corners_of(sphere)))
    }

    /// Sums of the magnitudes that a point's coordinates in the grid's space are summed from.
    fn terms_of(&self, point: Vec3) -> Vec3 {
        let (matrix, point) = (&self.to_field.matrix3, point.abs());
        let sum =
            matrix.x_axis.abs() * point.x + matrix.y_axis.abs() * point.y + matrix.z_axis.abs() * point.z;
        Vec3::from(sum + self.to_field.translation.abs())
    }
}

/// What the albedo of a medium is multiplied by.
pub(super) struct AlbedoGrid {
    /// One for all channels, or one each.
    pub grids: Vec<DenseGrid>,
    pub to_field: Affine3A,
}

impl AlbedoGrid {
    /// The factor at a world position, at most one; beyond the grid that of its edge.
    pub fn at(&self, position: Vec3) -> Rgb {
        let place = self.to_field.transform_point3(position);
        let value = |grid: &DenseGrid| {
            let bounds = grid.bounds();
            grid.density(place.clamp(bounds.min(), bounds.max()))
                .clamp(0.0, 1.0)
        };
        match &self.grids[..] {
            [red, green, blue] => Rgb::new(value(red), value(green), value(blue)),
            [one, ..] => Rgb::splat(value(one)),
            [] => Rgb::ONE,
        }
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
