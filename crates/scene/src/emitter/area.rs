//! Emitting triangles and spheres.

use super::{EmitterSample, luminance_f64, target_on_surface};
use crate::{FlatEmitter, Rgb, Sphere, SurfacePoint};
use glam::Vec3;
use lightshed_sampling::{Area, Density, Frame, SolidAngle, UniformCone, UniformSphere, UniformTriangle};
use std::f32::consts::{PI, TAU};

/// A surface that emits. Its densities are those of sampling it, times the probability of its
/// selection, which is 1 unless set by [`AreaEmitter::chosen_with`].
#[derive(Clone, Debug)]
pub enum AreaEmitter {
    Triangle(TriangleEmitter),
    Sphere(SphereEmitter),
}

/// Triangles are sampled uniformly by area.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub struct TriangleEmitter {
    pub(super) corner: Vec3,
    pub(super) edges: [Vec3; 2],
    pub(super) normal: Vec3,
    pub(super) radiance: Rgb,
    /// `P / area`, with `P` the probability of having chosen it.
    pub(super) pdf_area: f32,
}

/// Spheres are sampled uniformly by the solid angle they subtend; from inside, by area.
#[derive(Clone, Debug)]
pub struct SphereEmitter {
    pub(super) sphere: Sphere,
    pub(super) orientation: f32,
    pub(super) radiance: Rgb,
    /// Of having chosen it.
    pub(super) probability: f32,
}

impl AreaEmitter {
    /// A triangle that emits to the side of its unit `normal`.
    pub fn triangle([a, b, c]: [Vec3; 3], normal: Vec3, radiance: Rgb) -> Self {
        let mut triangle = TriangleEmitter {
            corner: a,
            edges: [b - a, c - a],
            normal,
            radiance,
            pdf_area: 0.0,
        };
        triangle.pdf_area = (1.0 / triangle.area()) as f32;
        Self::Triangle(triangle)
    }

    /// A sphere that emits outwards or inwards.
    pub fn sphere(sphere: Sphere, inwards: bool, radiance: Rgb) -> Self {
        Self::Sphere(SphereEmitter {
            sphere,
            orientation: if inwards { -1.0 } else { 1.0 },
            radiance,
            probability: 1.0,
        })
    }

    /// Luminous flux `π A L`.
    pub fn power(&self) -> f64 {
        let area = match self {
            Self::Triangle(triangle) => triangle.area(),
            Self::Sphere(SphereEmitter { sphere, .. }) => {
                2.0 * f64::from(TAU) * f64::from(sphere.radius).powi(2)
            }
        };
        f64::from(PI) * area * luminance_f64(self.radiance())
    }

    /// The same, selected with `probability`.
    pub fn chosen_with(mut self, probability: f32) -> Self {
        match &mut self {
            Self::Triangle(triangle) => triangle.pdf_area = (f64::from(probability) / triangle.area()) as f32,
            Self::Sphere(sphere) => sphere.probability = probability,
        }
        self
    }

    #[inline(always)]
    pub fn radiance(&self) -> Rgb {
        match self {
            Self::Triangle(triangle) => triangle.radiance,
            Self::Sphere(sphere) => sphere.radiance,
        }
    }

    #[inline(always)]
    pub fn sample(&self, from: Vec3, index: u32, u: [f32; 2]) -> Option<EmitterSample> {
        match self {
            Self::Triangle(triangle) => triangle.sample(from, index, u),
            Self::Sphere(sphere) => sphere.sample(from, index, u),
        }
    }

    /// Density of sampling `point` from `from`.
    #[inline(always)]
    pub fn pdf(&self, from: Vec3, point: &SurfacePoint) -> Density<SolidAngle> {
        match self {
            Self::Triangle(triangle) => {
                let d = point.position - from;
                let distance_squared = d.length_squared();
                let cos_theta = triangle.normal.dot(d) / distance_squared.sqrt();
                Density::<Area>::new(triangle.pdf_area).to_solid_angle(distance_squared, cos_theta)
            }
            Self::Sphere(sphere) => sphere.pdf_at(from, point.position, point.geometric_normal),
        }
    }
}

impl TriangleEmitter {
    /// In place of an emitter.
    pub const NONE: Self = Self {
        corner: Vec3::ZERO,
        edges: [Vec3::X, Vec3::Y],
        normal: Vec3::Z,
        radiance: Rgb::ZERO,
        pdf_area: 0.0,
    };

    /// The record as two rows of lanes.
    #[inline(always)]
    pub fn halves(&self) -> &[[f32; 8]; 2] {
        bytemuck::cast_ref(self)
    }

    pub(super) fn flat(&self) -> FlatEmitter {
        FlatEmitter {
            corner: self.corner,
            edge0: self.edges[0],
            edge1: self.edges[1],
            normal: self.normal,
            pdf_area: self.pdf_area,
            radiance_r: self.radiance.x,
            radiance_g: self.radiance.y,
            radiance_b: self.radiance.z,
        }
    }

    pub(super) fn area(&self) -> f64 {
        let [a, b] = self.edges.map(Vec3::as_dvec3);
        0.5 * a.cross(b).length()
    }

    #[inline(always)]
    fn sample(&self, from: Vec3, index: u32, u: [f32; 2]) -> Option<EmitterSample> {
        let [v, w, _] = UniformTriangle::sample(u);
        let (along, across) = (self.edges[0] * v, self.edges[1] * w);
        let point = self.corner + along + across;
        let d = point - from;
        let distance_squared = d.length_squared();
        let facing = -self.normal.dot(d);
        if !(facing > 0.0) {
            return None;
        }
        let distance = distance_squared.sqrt();
        let pdf = Density::<Area>::new(self.pdf_area).to_solid_angle(distance_squared, facing / distance);
        if !pdf.is_positive() {
            return None;
        }
        let magnitude = self.corner.abs() + along.abs() + across.abs();
        let extent = self.edges[0].abs().max(self.edges[1].abs()).max_element();
        Some(EmitterSample {
            emitter: index,
            direction: d / distance,
            weight: self.radiance / pdf.value(),
            pdf,
            is_delta: false,
            target: Some(target_on_surface(point, self.normal, magnitude, extent, from)),
        })
    }
}

impl SphereEmitter {
    /// The cone that the sphere fills as seen from `from`, its unit axis and the distance of the
    /// centre; `None` from inside.
    #[inline(always)]
    fn cone(&self, from: Vec3) -> Option<(UniformCone, Vec3, f32)> {
        let to_center = self.sphere.center - from;
        let distance_squared = to_center.length_squared();
        let cone = UniformCone::of_sphere(self.sphere.radius * self.sphere.radius, distance_squared)?;
        let distance = distance_squared.sqrt();
        Some((cone, to_center / distance, distance))
    }

    fn pdf_area(&self) -> Density<Area> {
        Density::new(self.probability / (2.0 * TAU * self.sphere.radius * self.sphere.radius))
    }

    /// A direction from the centre to the place on the sphere that `u` maps to as seen from `from`,
    /// and the density; `None` where the sphere shines the other way.
    #[inline]
    pub(super) fn place(&self, from: Vec3, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let Sphere { center, radius } = self.sphere;
        match self.cone(from) {
            Some((cone, axis, distance)) => {
                if self.orientation < 0.0 {
                    return None;
                }
                let local = cone.sample(u);
                // The nearer point of the sphere in that direction, as a direction from the centre.
                let sin_squared = local.x * local.x + local.y * local.y;
                let half_chord = (radius * radius - distance * distance * sin_squared)
                    .max(0.0)
                    .sqrt();
                let along = distance * local.z - half_chord;
                let direction = Frame::from_normal(axis).to_world(local);
                let outward = (direction * along - axis * distance).normalize_or(-axis);
                Some((outward, Density::new(self.probability / cone.solid_angle())))
            }
            None => {
                let outward = UniformSphere::sample(u);
                Some((outward, self.pdf_at(from, center + outward * radius, outward)))
            }
        }
    }

    /// Density of the point `position` on the sphere, of unit normal `normal`, as seen from `from`.
    #[inline]
    pub(super) fn pdf_at(&self, from: Vec3, position: Vec3, normal: Vec3) -> Density<SolidAngle> {
        match self.cone(from) {
            Some((cone, _, _)) => Density::new(self.probability / cone.solid_angle()),
            None => {
                let d = position - from;
                let distance_squared = d.length_squared();
                let cos_theta = normal.dot(d) / distance_squared.sqrt();
                self.pdf_area().to_solid_angle(distance_squared, cos_theta)
            }
        }
    }

    #[inline]
    fn sample(&self, from: Vec3, index: u32, u: [f32; 2]) -> Option<EmitterSample> {
        let Sphere { center, radius } = self.sphere;
        let (outward, pdf) = self.place(from, u)?;
        let point = center + outward * radius;
        let d = point - from;
        let emits = d.dot(outward) * self.orientation < 0.0;
        if !emits || !pdf.is_positive() {
            return None;
        }
        let magnitude = center.abs() + Vec3::splat(radius);
        Some(EmitterSample {
            emitter: index,
            direction: d.normalize(),
            weight: self.radiance / pdf.value(),
            pdf,
            is_delta: false,
            target: Some(target_on_surface(point, outward, magnitude, radius, from)),
        })
    }
}
