//! The renderer's own scene: diffuse balls, two of which glow, on a ball so large that it is a
//! floor.

use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Area, Density};
use lightshed_shift::Place;
use std::f32::consts::TAU;

pub struct Sphere {
    pub center: Vec3,
    pub radius: f32,
    pub albedo: f32,
    pub emission: f32,
}

/// A point of a ball, made of its place alone.
#[derive(Clone)]
pub struct Vertex {
    pub place: Place,
    pub position: Vec3,
    pub normal: Vec3,
}

/// A ray up to a distance.
#[derive(Clone, Copy)]
pub struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
    pub far: f32,
}

pub struct Scene {
    pub spheres: Vec<Sphere>,
}

/// Those that glow come first.
const GLOWING: u32 = 2;

impl Scene {
    pub fn new() -> Self {
        let sphere = |center: [f32; 3], radius, albedo, emission| Sphere {
            center: center.into(),
            radius,
            albedo,
            emission,
        };
        Self {
            spheres: vec![
                sphere([1.2, 1.8, 0.2], 0.3, 0.0, 12.0),
                sphere([-1.3, 0.4, 0.9], 0.15, 0.0, 20.0),
                sphere([0.0, -20.0, 0.0], 20.0, 0.6, 0.0),
                sphere([-0.6, 0.5, -0.3], 0.5, 0.7, 0.0),
                sphere([0.5, 0.35, 0.4], 0.35, 0.8, 0.0),
                sphere([0.0, 0.0, -22.0], 20.0, 0.5, 0.0),
            ],
        }
    }

    pub fn sphere(&self, vertex: &Vertex) -> &Sphere {
        &self.spheres[vertex.place.primitive as usize]
    }

    /// The point at a place: height and azimuth, each from 0 to 1.
    pub fn locate(&self, place: &Place) -> Vertex {
        let sphere = &self.spheres[place.primitive as usize];
        let [u, v] = place.coordinates;
        let z = 1.0 - 2.0 * u;
        let (sin, cos) = (TAU * v).sin_cos();
        let s = (1.0 - z * z).max(0.0).sqrt();
        let normal = Vec3::new(s * cos, s * sin, z);
        Vertex {
            place: *place,
            position: sphere.center + normal * sphere.radius,
            normal,
        }
    }

    /// The first point along a ray.
    pub fn hit(&self, ray: &Ray) -> Option<Vertex> {
        let (mut far, mut found) = (ray.far, None);
        for (primitive, sphere) in (0..).zip(&self.spheres) {
            let o = ray.origin - sphere.center;
            let b = o.dot(ray.direction);
            let nearest = o - b * ray.direction;
            let square = sphere.radius * sphere.radius - nearest.length_squared();
            if square < 0.0 {
                continue;
            }
            let half = square.sqrt();
            if let Some(t) = [-b - half, -b + half].into_iter().find(|&t| t > 0.0 && t < far) {
                let n = ((o + ray.direction * t) / sphere.radius).normalize();
                let v = (n.y.atan2(n.x) / TAU).rem_euclid(1.0);
                let coordinates = [(0.5 * (1.0 - n.z)).clamp(0.0, 1.0), v];
                far = t;
                found = Some(Place { primitive, coordinates });
            }
        }
        found.map(|place| self.locate(&place))
    }

    /// A ray that leaves a point.
    pub fn leave(&self, from: &Vertex, direction: Vec3, far: f32) -> Ray {
        let side = from.normal.dot(direction).signum();
        Ray {
            origin: from.position + from.normal * (side * 1e-3),
            direction,
            far,
        }
    }

    /// What lies between two points.
    pub fn between(&self, from: &Vertex, to: &Vertex) -> Ray {
        let d = to.position - from.position;
        self.leave(from, d.normalize(), d.length() - 3e-3)
    }

    /// Radiance of a point towards a direction.
    pub fn glow(&self, vertex: &Vertex, direction: Vec3) -> f32 {
        if vertex.normal.dot(direction) > 0.0 {
            self.sphere(vertex).emission
        } else {
            0.0
        }
    }

    /// A place on one of the balls that glow.
    pub fn light_place(&self, u_select: u64, u: [f32; 2]) -> Place {
        Place {
            primitive: (u_select % u64::from(GLOWING)) as u32,
            coordinates: u,
        }
    }

    /// Density of that place.
    pub fn light_density(&self, vertex: &Vertex) -> Density<Area> {
        let area = 2.0 * TAU * self.sphere(vertex).radius.powi(2);
        Density::new(1.0 / (GLOWING as f32 * area))
    }

    /// What a pixel shows, and the direction back to the viewer.
    pub fn seen(&self, pixel: usize, width: usize) -> (Option<Vertex>, Vec3) {
        let ray = self.camera(pixel, width);
        (self.hit(&ray), -ray.direction)
    }

    /// The camera's ray through the middle of a pixel of a `width × width` image.
    pub fn camera(&self, pixel: usize, width: usize) -> Ray {
        let at = |k: usize| (k as f32 + 0.5) / width as f32 - 0.5;
        let direction = Vec3::new(at(pixel % width), -at(pixel / width) - 0.1, -1.2).normalize();
        Ray {
            origin: Vec3::new(0.0, 0.9, 3.5),
            direction,
            far: f32::INFINITY,
        }
    }
}
