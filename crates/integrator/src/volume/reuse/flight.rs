//! Flights that remember their null collisions, and their densities from elsewhere.

use lightshed_sampling::{CounterRng, f32_from_u32};
use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::{
    DensityAccessor, DensityField, Interval, TentativeCollisions, unbiased_ray_marching,
    unbiased_ray_marching_lookups,
};
use lightshed_scene::{Medium, MediumDensity, Ray};

/// Null collisions that a flight may have and be shared.
pub const MOST_NULLS: usize = 16;

/// The null collisions of a flight, in order: as shares of its length if it collides, as distances
/// if it passes.
#[derive(Clone, Copy, Debug)]
pub struct Nulls {
    places: [f32; MOST_NULLS],
    count: usize,
}

impl Nulls {
    pub const NONE: Self = Self {
        places: [0.0; MOST_NULLS],
        count: 0,
    };

    pub fn places(&self) -> &[f32] {
        &self.places[..self.count]
    }
}

/// A flight through a grey medium.
pub struct Flight {
    /// Where it collides, if it does.
    pub distance: Option<f32>,
    /// `None` if they are too many.
    pub nulls: Option<Nulls>,
}

/// Delta tracking along `ray`, whose direction is a unit vector, up to `t_max`.
pub fn fly(medium: &Medium, ray: &Ray, t_max: f32, rng: &mut CounterRng) -> Flight {
    let k = medium.extinction().x;
    let mut nulls = Nulls::NONE;
    let field = match medium.density() {
        MediumDensity::Homogeneous => {
            let t = -(-f32_from_u32(rng.next_u32())).ln_1p() / k;
            return Flight {
                distance: (t < t_max).then_some(t),
                nulls: Some(nulls),
            };
        }
        MediumDensity::Grid(field) => field,
    };
    let field_ray = field.field_ray(ray);
    let interval = Interval { t0: 0.0, t1: t_max };
    let mut density = field.grid().accessor();
    let mut collisions = TentativeCollisions::new(field.majorants().segments(&field_ray, interval), k);
    let mut count = 0;
    let distance = loop {
        let Some(collision) = collisions.next(rng) else {
            break None;
        };
        let real = density.density(field_ray.at(collision.t));
        if f32_from_u32(rng.next_u32()) * collision.majorant < real {
            break Some(collision.t);
        }
        if let Some(place) = nulls.places.get_mut(count) {
            *place = collision.t;
        }
        count += 1;
    };
    nulls.count = count.min(MOST_NULLS);
    if let Some(distance) = distance {
        for place in &mut nulls.places[..nulls.count] {
            *place /= distance;
        }
    }
    Flight {
        distance,
        nulls: (count <= MOST_NULLS).then_some(nulls),
    }
}

/// A place in the space of a medium's grid; in a homogeneous medium there is none.
pub fn place(medium: &Medium, position: Vec3) -> Vec3 {
    match medium.density() {
        MediumDensity::Grid(field) => field.to_field().transform_point3(position),
        MediumDensity::Homogeneous => position,
    }
}

/// The same of a direction.
pub fn movement(medium: &Medium, direction: Vec3) -> Vec3 {
    match medium.density() {
        MediumDensity::Grid(field) => field.to_field().transform_vector3(direction),
        MediumDensity::Homogeneous => direction,
    }
}

/// The transmittance of `ray` through a grey medium, by unbiased ray marching.
pub fn march(medium: &Medium, ray: &Ray, rng: &mut CounterRng) -> f32 {
    let k = medium.extinction().x * ray.direction.length();
    let MediumDensity::Grid(field) = medium.density() else {
        return (-k * ray.t_max).exp();
    };
    let field_ray = field.field_ray(ray);
    let interval = Interval {
        t0: 0.0,
        t1: ray.t_max,
    };
    let segments = field.majorants().segments(&field_ray, interval);
    let residual = segments.clone().filter(|segment| segment.majorant > 0.0);
    let depth: f32 = residual
        .map(|segment| (segment.t1 - segment.t0) * (segment.majorant - segment.minorant))
        .sum();
    let lookups = unbiased_ray_marching_lookups(depth * k);
    let mut density = field.grid().accessor();
    unbiased_ray_marching(&mut density, &field_ray, segments, k, lookups, rng).value
}
