//! Light as it leaves the emitters: rays for tracing from the light.
//!
//! The flux through anything is `Φ = Σ ∫∫ L_e(x, ω) |cos θ| dω dA` over the rays that
//! reach it. A ray is drawn with density `p(x, ω)` in the measure `dω dA` (of area, or of the
//! disk across the scene for light from infinity; solid angle alone for points) and carries
//! `L_e |cos θ| / p`. So the sum over the effects of the ray estimates `Σ` without bias.

use super::area::{AreaEmitter, SphereEmitter, TriangleEmitter};
use super::by_power::Selected;
use super::{EmittersByPower, PointEmitter, target_on_surface};
use crate::{Ray, Rgb};
use glam::Vec3;
use lightshed_sampling::{
    ConcentricDisk, CosineHemisphere, Frame, UniformCone, UniformSphere, UniformTriangle,
};
use std::f32::consts::{PI, TAU};

/// A ray that carries light away from an emitter.
#[derive(Clone, Copy, Debug)]
pub struct EmittedRay {
    /// Starts off the emitter's surface, or outside of the scene for light from infinity.
    pub ray: Ray,
    /// Radiant flux it carries, `L_e |cos θ| / p`, selection included.
    pub flux: Rgb,
    /// Index of the emitter.
    pub emitter: u32,
}

/// A sphere around everything that light from infinity can reach.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Surroundings {
    pub center: Vec3,
    pub radius: f32,
}

impl Surroundings {
    /// Around a box, a little wide.
    pub fn of_box([min, max]: [Vec3; 2]) -> Self {
        Self {
            center: min * 0.5 + max * 0.5,
            radius: (max * 0.5 - min * 0.5).length() * 1.001,
        }
    }
}

impl EmittersByPower<'_> {
    /// See [`Scene::sample_emission`](crate::Scene::sample_emission).
    pub(crate) fn sample_emission(
        &self,
        around: Surroundings,
        u_select: u64,
        u_place: [f32; 2],
        u_direction: [f32; 2],
    ) -> Option<EmittedRay> {
        let emitters = self.emitters();
        let emitted = match self.select(u_select) {
            Selected::Finite { index, pmf } => match self.area(index) {
                Some(AreaEmitter::Triangle(triangle)) => triangle.emit(index, u_place, u_direction),
                Some(AreaEmitter::Sphere(sphere)) => sphere.emit(index, u_place, u_direction),
                None => {
                    let point = emitters.points.get(index as usize - emitters.areas.len())?;
                    point.emit(index, pmf * self.group_probability(), u_direction)
                }
            },
            Selected::Infinite(number) => {
                let index = (emitters.finite_count() + number) as u32;
                // Towards the light, and the flux through a unit of area across it.
                let (towards, irradiance) = match emitters.directionals.get(number) {
                    Some(light) => (light.towards, light.irradiance / self.group_probability()),
                    None => {
                        let (towards, radiance, pdf) = emitters.environment()?.sample(u_direction)?;
                        (towards, radiance / (pdf * self.group_probability()).value())
                    }
                };
                let on_disk = ConcentricDisk::sample(u_place) * around.radius;
                let across = Frame::from_normal(towards).to_world(on_disk.extend(0.0));
                EmittedRay {
                    ray: Ray::new(around.center + towards * around.radius + across, -towards),
                    flux: irradiance * (PI * around.radius * around.radius),
                    emitter: index,
                }
            }
        };
        (emitted.flux.is_finite() && emitted.flux != Rgb::ZERO).then_some(emitted)
    }
}

impl TriangleEmitter {
    fn emit(&self, emitter: u32, u_place: [f32; 2], u_direction: [f32; 2]) -> EmittedRay {
        let [v, w, _] = UniformTriangle::sample(u_place);
        let (along, across) = (self.edges[0] * v, self.edges[1] * w);
        let direction = Frame::from_normal(self.normal).to_world(CosineHemisphere::sample(u_direction));
        let magnitude = self.corner.abs() + along.abs() + across.abs();
        let extent = self.edges[0].abs().max(self.edges[1].abs()).max_element();
        let point = self.corner + along + across;
        EmittedRay {
            ray: Ray::new(
                target_on_surface(point, self.normal, magnitude, extent, point + self.normal),
                direction,
            ),
            // The density is p_A cosθ/π.
            flux: self.radiance * (PI / self.pdf_area),
            emitter,
        }
    }
}

impl SphereEmitter {
    fn emit(&self, emitter: u32, u_place: [f32; 2], u_direction: [f32; 2]) -> EmittedRay {
        let (center, radius) = (self.sphere.center, self.sphere.radius);
        let outward = UniformSphere::sample(u_place);
        let normal = outward * self.orientation;
        let direction = Frame::from_normal(normal).to_world(CosineHemisphere::sample(u_direction));
        let (point, magnitude) = (center + outward * radius, center.abs() + Vec3::splat(radius));
        EmittedRay {
            ray: Ray::new(
                target_on_surface(point, normal, magnitude, radius, point + normal),
                direction,
            ),
            flux: self.radiance * (PI * 2.0 * TAU * radius * radius / self.probability),
            emitter,
        }
    }
}

impl PointEmitter {
    fn emit(&self, emitter: u32, probability: f32, u_direction: [f32; 2]) -> EmittedRay {
        let (position, direction, intensity, solid_angle) = match self {
            Self::Point(point) => (
                point.position,
                UniformSphere::sample(u_direction),
                point.intensity,
                2.0 * TAU,
            ),
            Self::Spot(spot) => {
                let (axis, angle) = spot.cone();
                let half = (0.5 * angle).sin();
                let cone = UniformCone::from_one_minus_cos(2.0 * half * half);
                let direction = Frame::from_normal(axis).to_world(cone.sample(u_direction));
                let intensity = spot.intensity_towards(spot.position + direction);
                (spot.position, direction, intensity, cone.solid_angle())
            }
        };
        EmittedRay {
            ray: Ray::new(position, direction),
            flux: intensity * (solid_angle / probability),
            emitter,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{scene, sphere, triangle};
    use crate::{EmitterDescription, EnvironmentMap, Geometry, Image, Rgb, Scene};
    use glam::{Affine3A, Vec3};
    use lightshed_sampling::{CounterRng, UniformTriangle};
    use lightshed_testkit::{MeanTest, check_faults};
    use std::sync::Arc;

    /// The flux through a triangle, by rays from the emitters and by the irradiance at its points
    /// as `EmittersByPower::sample` sees it.
    fn fluxes(scene: &Scene, corners: [Vec3; 3], count: u32, fault: f64) -> (MeanTest, MeanTest) {
        let (mut from_light, mut at_surface) = (MeanTest::new(), MeanTest::new());
        let [a, b, c] = corners;
        let cross = (b - a).cross(c - a);
        let (normal, area) = (cross.normalize(), 0.5 * f64::from(cross.length()));
        for i in 0..count {
            let mut rng = CounterRng::new(71, i, 0);
            let (u_select, u_place, u_direction) = (rng.next_u64(), rng.next_2d(), rng.next_2d());
            let emitted = scene.sample_emission(u_select, u_place, u_direction);
            let arrived = emitted.filter(|emitted| {
                emitted.ray.direction.dot(normal) < 0.0
                    && crate::intersect_triangle(&emitted.ray, &corners, 0, f32::INFINITY).is_some()
            });
            from_light.push(fault * arrived.map_or(0.0, |emitted| f64::from(emitted.flux.x)));
            let [v, w, _] = UniformTriangle::sample(rng.next_2d());
            let point = a + (b - a) * v + (c - a) * w;
            let sample = scene
                .emitters_by_power()
                .sample(point, rng.next_u64(), rng.next_2d());
            let irradiance = sample.map_or(0.0, |s| f64::from(s.weight.x * s.direction.dot(normal).max(0.0)));
            at_surface.push(irradiance * area);
        }
        (from_light, at_surface)
    }

    /// Every kind of emitter alone, and all of them together, z-test at 1e-6 each. A twentieth of
    /// the flux missing is noticed.
    #[test]
    fn flux_from_the_light_is_flux_at_the_surface() {
        let lit = triangle([
            Vec3::new(-0.4, 1.5, 0.0),
            Vec3::new(0.5, 1.4, 0.1),
            Vec3::new(0.0, 1.6, 0.7),
        ]);
        let floor = [
            Vec3::new(-1.0, 0.0, 1.0),
            Vec3::new(1.2, 0.0, 0.8),
            Vec3::new(0.0, 0.1, -1.0),
        ];
        // Light from infinity goes where there is something.
        let lamp = || vec![(lit.clone(), 3.0), (triangle(floor), 0.0)];
        let dark = || vec![(triangle(floor), 0.0)];
        let point = EmitterDescription::Point {
            position: Vec3::new(0.3, 1.0, -0.2),
            intensity: Rgb::splat(2.0),
        };
        let spot = EmitterDescription::Spot {
            position: Vec3::new(-0.3, 1.3, 0.2),
            direction: Vec3::new(0.2, -1.0, 0.0).normalize(),
            intensity: Rgb::splat(4.0),
            beam_width: 0.2,
            cutoff_angle: 0.7,
        };
        let directional = EmitterDescription::Directional {
            direction: Vec3::new(0.3, -1.0, 0.2).normalize(),
            irradiance: Rgb::splat(1.5),
        };
        let constant = EmitterDescription::Constant {
            radiance: Rgb::splat(0.4),
        };
        let texels = (0..32).map(|i| [if i == 9 { 9.0 } else { 0.2 }; 3]).collect();
        let environment = EmitterDescription::Environment(EnvironmentMap {
            image: Arc::new(Image::from_linear(8, 4, texels).unwrap()),
            scale: 1.0,
            to_world: Affine3A::IDENTITY,
        });
        let ball = |flip| vec![(sphere(Vec3::new(0.1, 1.2, 0.0), 0.3, flip), 2.0)];
        let room: Vec<(Geometry, f32)> = vec![(sphere(Vec3::ZERO, 2.0, true), 1.0)];
        let everything = vec![
            point.clone(),
            spot.clone(),
            directional.clone(),
            environment.clone(),
        ];
        let scenes = [
            ("triangle", scene(lamp(), vec![])),
            ("sphere", scene(ball(false), vec![])),
            ("sphere from inside", scene(room, vec![])),
            ("point", scene(dark(), vec![point])),
            ("spot", scene(dark(), vec![spot])),
            ("directional", scene(dark(), vec![directional])),
            ("constant", scene(dark(), vec![constant])),
            ("environment", scene(dark(), vec![environment])),
            (
                "everything",
                scene(lamp().into_iter().chain(ball(false)).collect(), everything),
            ),
        ];
        check_faults(&[0.95, 1.05], |fault: Option<f64>| {
            for (name, scene) in &scenes {
                let (from_light, at_surface) = fluxes(scene, floor, 60_000, fault.unwrap_or(1.0));
                assert!(at_surface.mean() > 0.01, "{name} is dark");
                from_light
                    .test_equal(&at_surface, 1e-6)
                    .map_err(|error| format!("{name}: {error}"))?;
            }
            Ok::<_, String>(())
        })
        .unwrap();
    }

    /// The whole flux of lamps in closed form: `π A L` and `4π I`. Emission of a lamp does not
    /// meet the lamp itself.
    #[test]
    fn rays_carry_the_whole_flux_away() {
        let corners = [Vec3::ZERO, Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 3.0, 0.0)];
        let point = EmitterDescription::Point {
            position: Vec3::Z,
            intensity: Rgb::ONE,
        };
        let scene = scene(vec![(triangle(corners), 2.0)], vec![point]);
        let mut flux = MeanTest::new();
        for i in 0..20_000 {
            let mut rng = CounterRng::new(72, i, 0);
            let emitted = scene
                .sample_emission(rng.next_u64(), rng.next_2d(), rng.next_2d())
                .unwrap();
            flux.push(f64::from(emitted.flux.y));
            if emitted.emitter == 0 {
                assert!(!scene.occluded(&emitted.ray));
            }
        }
        let expected = std::f64::consts::PI * (3.0 * 2.0 + 4.0);
        // Emitters are chosen by power, so that each ray carries the same.
        assert!((flux.mean() / expected - 1.0).abs() < 1e-6 && flux.standard_error() < 1e-6 * expected);
    }

    #[test]
    fn where_nothing_emits_no_ray_leaves() {
        let dark = scene(vec![(triangle([Vec3::ZERO, Vec3::X, Vec3::Y]), 0.0)], vec![]);
        assert!(dark.sample_emission(0, [0.5; 2], [0.5; 2]).is_none());
    }
}
