//! The contribution of one virtual point light at a receiver, and its visibility.

use super::camera::Receiver;
use crate::path::scattering::Vertex;
use lightshed_film::RayCounts;
use lightshed_lights::PointLight;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Ray, Rgb, Scene};

/// Where shadow rays end, as a share of the way, as those to emitters do.
const SEGMENT_END: f32 = 1.0 - 16.0 * f32::EPSILON;

impl Receiver {
    /// `f(ω_o, ω) |cos θ| T` for light from the unit `direction`: the factor from irradiance on
    /// a facing plane to the pixel.
    #[inline(always)]
    pub fn response(&self, direction: Vec3) -> Rgb {
        self.throughput * self.vertex.evaluate(direction).value
    }

    /// The contribution of `light` if it is visible: `T f |cos θ| I(−ω) / max(d², d_min²)`.
    #[inline]
    pub fn unshadowed(&self, light: &PointLight, min_distance_squared: f32) -> Rgb {
        let to_light = light.position - self.vertex.point.position;
        let distance_squared = to_light.length_squared();
        let in_range = (f32::MIN_POSITIVE..f32::INFINITY).contains(&distance_squared);
        if !in_range {
            return Rgb::ZERO;
        }
        let direction = to_light / distance_squared.sqrt();
        let emission = light.emission(-direction);
        if emission == 0.0 {
            return Rgb::ZERO;
        }
        let falloff = emission / distance_squared.max(min_distance_squared);
        self.response(direction) * light.intensity * falloff
    }

    /// Whether nothing lies between the receiver and `target`, which is off its own surface.
    #[inline]
    pub fn sees(&self, scene: &Scene, target: Vec3, rays: &mut RayCounts) -> bool {
        rays.emitter += 1;
        let origin = self
            .vertex
            .point
            .origin_towards(target - self.vertex.point.position);
        !scene.occluded(&Ray::segment(origin, target - origin, SEGMENT_END))
    }
}
