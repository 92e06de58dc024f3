//! Places on emitters, described independently of the point from which they are seen.
//!
//! A direction towards an emitter has a meaning at one point only. At other points, the place that
//! sends the light is reused: a point on a surface (measured by area), a direction towards the
//! environment (by solid angle), or a light that is a point or a direction itself (counted). With
//! `e` such an endpoint, seen from `x` in the direction `ω(x, e)`,
//!
//! > `L_r = ∫ f(ω_o, ω) L_e(ω) |cos θ| V dω = ∫ f L_e |cos θ| V |dω/de| de`,
//!
//! where `|dω/de| = |cos θ_e| / d²` on surfaces and 1 otherwise. The space of all `e` is the
//! union of the three, and none of it depends on `x`: a sample keeps its contribution weight at
//! another point as it is, with Jacobian 1.

use super::area::{AreaEmitter, SphereEmitter, TriangleEmitter};
use super::{Emitters, SkySampling, ray_towards, shadow_ray, target_on_surface};
use crate::{Ray, Rgb, SurfacePoint};
use glam::Vec3;
use lightshed_sampling::{Density, SolidAngle, UniformTriangle, octahedral_decode, octahedral_encode};

/// A place that emits, `e`, seen from anywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EmitterEndpoint {
    /// A point of an emitting surface.
    Surface {
        /// Index of the emitter, below [`Emitters::area_count`].
        emitter: u32,
        /// In the form of [`Scene::coordinates`](crate::Scene::coordinates).
        coordinates: [f32; 2],
    },
    /// A unit direction towards the environment.
    Environment {
        /// From the scene.
        direction: Vec3,
    },
    /// A light that is a point or a direction.
    Delta {
        /// Index of the emitter.
        emitter: u32,
    },
}

/// An endpoint as seen from a given point, without occlusion.
#[derive(Clone, Copy, Debug)]
pub struct EmitterConnection {
    /// Unit direction towards the endpoint.
    pub direction: Vec3,
    /// Radiance that arrives from there; of lights that are a point or a direction: the irradiance
    /// on a plane facing them.
    pub radiance: Rgb,
    /// Density `P p_ω` of this direction by an emitter sample at the point, where `P` is the
    /// probability with which the emitter (or any of those at infinity) was selected, 1 by default;
    /// zero for emitters that no other technique can hit.
    pub pdf: Density<SolidAngle>,
    /// Whether no other technique can hit the emitter.
    pub is_delta: bool,
    /// `|dω/de|`, solid angle per measure of endpoints: `|cos θ_e| / d²` on surfaces, else 1.
    pub solid_angle_per_endpoint: f32,
    /// Density `P p(e)` of this endpoint by the same, in the measure of endpoints: per area, per
    /// solid angle, or a probability.
    pub pdf_endpoint: f32,
    /// The point aimed at, moved off the emitter's surface; `None` at infinity.
    target: Option<Vec3>,
}

impl EmitterConnection {
    /// The same, had the emitter been chosen with `probability`, where it was given before.
    #[inline(always)]
    #[must_use]
    pub fn chosen_with(self, probability: f32) -> Self {
        Self {
            pdf: self.pdf * probability,
            pdf_endpoint: self.pdf_endpoint * probability,
            ..self
        }
    }

    /// The segment that must be free for the endpoint to be seen from `from`.
    #[inline(always)]
    pub fn shadow_ray(&self, from: &SurfacePoint) -> Ray {
        shadow_ray(from, self.direction, self.target)
    }

    /// The segment that must be free for the endpoint to be seen from a point off all surfaces, in
    /// a medium.
    #[inline(always)]
    pub fn shadow_ray_from(&self, position: Vec3) -> Ray {
        ray_towards(position, self.direction, self.target)
    }
}

impl Emitters {
    /// An endpoint on the finite emitter `emitter`; `None` if a sphere shines the other way, and
    /// for any other index. [`Emitters::connect`] says whether it sends anything to `from`.
    #[inline]
    pub fn endpoint_on(&self, from: Vec3, emitter: u32, u: [f32; 2]) -> Option<EmitterEndpoint> {
        match self.areas.get(emitter as usize) {
            Some(area) => Some(EmitterEndpoint::Surface {
                emitter,
                coordinates: area.sample_coordinates(from, u)?,
            }),
            None => ((emitter as usize) < self.finite_count()).then_some(EmitterEndpoint::Delta { emitter }),
        }
    }

    /// Density with which [`endpoint_on`](Self::endpoint_on) at `from` chooses `point` on its
    /// emitter, per solid angle there; zero if it lies on none.
    #[inline]
    pub fn endpoint_pdf_on(&self, from: Vec3, point: &SurfacePoint) -> Density<SolidAngle> {
        match self.areas.get(point.emitter as usize) {
            Some(area) => area.pdf(from, point),
            None => Density::ZERO,
        }
    }

    /// An endpoint of one of the emitters at infinity, which are chosen by `u_select` uniformly;
    /// `None` where there are none.
    #[inline]
    pub fn endpoint_at_infinity(
        &self,
        sky: SkySampling,
        u_select: u64,
        u: [f32; 2],
    ) -> Option<EmitterEndpoint> {
        let count = self.infinite_count();
        let which = ((u128::from(u_select) * count as u128) >> 64) as usize;
        (count > 0)
            .then(|| self.endpoint_of_infinite(sky, which, u))
            .flatten()
    }

    pub(super) fn endpoint_of_infinite(
        &self,
        sky: SkySampling,
        index: usize,
        u: [f32; 2],
    ) -> Option<EmitterEndpoint> {
        if index < self.directionals.len() {
            return Some(EmitterEndpoint::Delta {
                emitter: (self.finite_count() + index) as u32,
            });
        }
        let (direction, _, _) = self.environment()?.sample_by(sky, u)?;
        Some(EmitterEndpoint::Environment { direction })
    }

    /// The finite emitter that an endpoint lies on; `None` of those at infinity.
    #[inline]
    pub fn finite_emitter(&self, endpoint: &EmitterEndpoint) -> Option<u32> {
        match *endpoint {
            EmitterEndpoint::Surface { emitter, .. } => Some(emitter),
            EmitterEndpoint::Delta { emitter } => {
                ((emitter as usize) < self.finite_count()).then_some(emitter)
            }
            EmitterEndpoint::Environment { .. } => None,
        }
    }

    /// The contribution of `endpoint` at `from`, and the densities with which endpoints on its
    /// emitter ([`endpoint_on`](Self::endpoint_on)), or on those at infinity
    /// ([`endpoint_at_infinity`](Self::endpoint_at_infinity)), are that one. `None` if there is
    /// none: from behind, outside of a spot's cone, or if `from` is so near that no `f32` holds the
    /// values.
    #[inline]
    pub fn connect(&self, from: Vec3, endpoint: &EmitterEndpoint) -> Option<EmitterConnection> {
        self.connect_by(SkySampling::Luminance, from, endpoint)
    }

    /// [`connect`](Self::connect), where the environment is sampled in this way. The densities are
    /// zero in directions that it leaves out, and the connection is there.
    #[inline]
    pub fn connect_by(
        &self,
        sky: SkySampling,
        from: Vec3,
        endpoint: &EmitterEndpoint,
    ) -> Option<EmitterConnection> {
        let at_infinity = (1.0 / self.infinite_count() as f32, sky);
        self.connect_among(&self.areas, |_| 1.0, at_infinity, from, endpoint)
    }

    /// [`connect`](Self::connect), where surfaces have been chosen as these say, points and spots
    /// with the probability `point`, and each emitter at infinity with the other, a direction of
    /// the environment among them as `SkySampling` says.
    #[inline(always)]
    pub(super) fn connect_among(
        &self,
        areas: &[AreaEmitter],
        point: impl FnOnce(u32) -> f32,
        (at_infinity, sky): (f32, SkySampling),
        from: Vec3,
        endpoint: &EmitterEndpoint,
    ) -> Option<EmitterConnection> {
        match *endpoint {
            EmitterEndpoint::Surface { emitter, coordinates } => match areas.get(emitter as usize)? {
                AreaEmitter::Triangle(triangle) => triangle.connect(from, coordinates),
                AreaEmitter::Sphere(sphere) => sphere.connect(from, coordinates),
            },
            EmitterEndpoint::Environment { direction } => {
                let environment = self.environment()?;
                let pdf = environment.pdf_by(sky, direction) * at_infinity;
                let is_left_out =
                    || sky != SkySampling::Luminance && environment.pdf(direction).is_positive();
                (pdf.is_positive() || is_left_out()).then(|| EmitterConnection {
                    direction,
                    radiance: environment.radiance(direction),
                    pdf,
                    is_delta: false,
                    solid_angle_per_endpoint: 1.0,
                    pdf_endpoint: pdf.value(),
                    target: None,
                })
            }
            EmitterEndpoint::Delta { emitter } => self.connect_delta(from, emitter, point, at_infinity),
        }
    }

    fn connect_delta(
        &self,
        from: Vec3,
        emitter: u32,
        point_probability: impl FnOnce(u32) -> f32,
        at_infinity: f32,
    ) -> Option<EmitterConnection> {
        let delta = |direction, radiance, probability, target| EmitterConnection {
            direction,
            radiance,
            pdf: Density::ZERO,
            is_delta: true,
            solid_angle_per_endpoint: 1.0,
            pdf_endpoint: probability,
            target,
        };
        let number = (emitter as usize).checked_sub(self.areas.len())?;
        let Some(point) = self.points.get(number) else {
            let light = self.directionals.get(number - self.points.len())?;
            return Some(delta(light.towards, light.irradiance, at_infinity, None));
        };
        let probability = point_probability(emitter);
        let (position, intensity) = point.towards(from);
        let to_emitter = position - from;
        let distance_squared = to_emitter.length_squared();
        let irradiance = intensity / distance_squared;
        let lit = probability > 0.0 && intensity != Rgb::ZERO && irradiance.is_finite();
        lit.then(|| {
            delta(
                to_emitter / distance_squared.sqrt(),
                irradiance,
                probability,
                Some(position),
            )
        })
    }
}

impl AreaEmitter {
    /// Coordinates of the point that [`AreaEmitter::sample`] aims at.
    #[inline]
    fn sample_coordinates(&self, from: Vec3, u: [f32; 2]) -> Option<[f32; 2]> {
        match self {
            Self::Triangle(_) => {
                let [v, w, _] = UniformTriangle::sample(u);
                Some([v, w])
            }
            Self::Sphere(sphere) => Some(octahedral_encode(sphere.place(from, u)?.0).into()),
        }
    }
}

impl TriangleEmitter {
    #[inline]
    fn connect(&self, from: Vec3, [v, w]: [f32; 2]) -> Option<EmitterConnection> {
        let (along, across) = (self.edges[0] * v, self.edges[1] * w);
        let point = self.corner + along + across;
        let d = point - from;
        let distance_squared = d.length_squared();
        let distance = distance_squared.sqrt();
        let cos_theta = -self.normal.dot(d) / distance;
        let pdf = Density::new(self.pdf_area).to_solid_angle(distance_squared, cos_theta);
        let magnitude = self.corner.abs() + along.abs() + across.abs();
        let extent = self.edges[0].abs().max(self.edges[1].abs()).max_element();
        let connection = EmitterConnection {
            direction: d / distance,
            radiance: self.radiance,
            pdf,
            is_delta: false,
            solid_angle_per_endpoint: cos_theta / distance_squared,
            pdf_endpoint: self.pdf_area,
            target: Some(target_on_surface(point, self.normal, magnitude, extent, from)),
        };
        (cos_theta > 0.0).then_some(connection).filter(is_usable)
    }
}

impl SphereEmitter {
    #[inline]
    fn connect(&self, from: Vec3, coordinates: [f32; 2]) -> Option<EmitterConnection> {
        let (center, radius) = (self.sphere.center, self.sphere.radius);
        let outward = octahedral_decode(coordinates.into());
        let point = center + outward * radius;
        let d = point - from;
        let distance_squared = d.length_squared();
        let distance = distance_squared.sqrt();
        let cos_theta = -outward.dot(d) / distance * self.orientation;
        // A sphere that shines inwards hides its far side from who stands outside.
        let outside = from.distance_squared(center) > radius * radius;
        if !(cos_theta > 0.0) || (outside && self.orientation < 0.0) {
            return None;
        }
        let pdf = self.pdf_at(from, point, outward);
        let magnitude = center.abs() + Vec3::splat(radius);
        Some(EmitterConnection {
            direction: d / distance,
            radiance: self.radiance,
            pdf,
            is_delta: false,
            solid_angle_per_endpoint: cos_theta / distance_squared,
            pdf_endpoint: pdf.to_area(distance_squared, cos_theta).value(),
            target: Some(target_on_surface(point, outward, magnitude, radius, from)),
        })
        .filter(is_usable)
    }
}

/// Whether all figures are positive and finite.
#[inline(always)]
fn is_usable(connection: &EmitterConnection) -> bool {
    let figures = [
        connection.pdf.value(),
        connection.pdf_endpoint,
        connection.solid_angle_per_endpoint,
    ];
    figures
        .iter()
        .all(|&figure| figure > 0.0 && figure < f32::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emitter::tests::{scene, sphere, triangle};
    use crate::{EmitterDescription, EnvironmentMap, Image, Scene};
    use glam::Affine3A;
    use lightshed_sampling::CounterRng;
    use lightshed_testkit::check_faults;
    use std::sync::Arc;

    /// Emitters of every kind around the origin.
    fn every_kind() -> Scene {
        let corners = [
            Vec3::new(-1.0, -1.0, 2.0),
            Vec3::new(0.0, 1.5, 2.5),
            Vec3::new(1.0, -1.0, 2.0),
        ];
        let texels = (0..32).map(|i| [0.2, 0.1, 0.01 * i as f32]).collect();
        let map = EnvironmentMap {
            image: Arc::new(Image::from_linear(8, 4, texels).unwrap()),
            scale: 1.0,
            to_world: Affine3A::from_rotation_y(0.4),
        };
        scene(
            vec![
                (triangle(corners), 100.0),
                (sphere(Vec3::new(3.0, 0.0, 0.0), 1.0, false), 20.0),
                (sphere(Vec3::ZERO, 20.0, true), 0.1),
            ],
            vec![
                EmitterDescription::Point {
                    position: Vec3::new(0.0, 4.0, 0.0),
                    intensity: Rgb::splat(90.0),
                },
                EmitterDescription::Spot {
                    position: Vec3::new(0.0, -4.0, 0.0),
                    direction: Vec3::Y,
                    intensity: Rgb::splat(7000.0),
                    beam_width: 0.05,
                    cutoff_angle: 0.2,
                },
                EmitterDescription::Directional {
                    direction: Vec3::new(1.0, 2.0, -1.0),
                    irradiance: Rgb::splat(0.25),
                },
                EmitterDescription::Environment(map),
            ],
        )
    }

    /// What a broken connection would give.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Fault {
        OtherCoordinates,
        Direction,
        Radiance,
        Density,
    }

    fn agree(name: &str, found: f32, expected: f32, tolerance: f32) -> Result<(), String> {
        if (found - expected).abs() <= tolerance * expected.abs() {
            Ok(())
        } else {
            Err(format!("{name}: {found} for {expected}"))
        }
    }

    /// Seen from the point that it was sampled from, an endpoint is the sample of the same random
    /// numbers.
    #[test]
    fn connecting_from_where_it_was_sampled_gives_the_sample() {
        let scene = every_kind();
        let emitters = scene.emitters_by_power();
        let faults = [
            Fault::OtherCoordinates,
            Fault::Direction,
            Fault::Radiance,
            Fault::Density,
        ];
        check_faults(&faults, |fault| {
            let mut rng = CounterRng::new(8, 0, 0);
            let mut seen = [0; 7];
            for _ in 0..10_000 {
                let from = Vec3::from_array(std::array::from_fn(|_| rng.next_f32() - 0.5));
                let (u_select, u) = (rng.next_u64(), rng.next_2d());
                let sample = emitters.sample(from, u_select, u);
                let mut endpoint = emitters.sample_endpoint(from, u_select, u);
                if let (Some(Fault::OtherCoordinates), Some(EmitterEndpoint::Surface { coordinates, .. })) =
                    (fault, &mut endpoint)
                {
                    coordinates.swap(0, 1);
                }
                let connection = endpoint.and_then(|endpoint| emitters.connect(from, &endpoint));
                let (sample, mut connection) = match (sample, connection) {
                    (Some(sample), Some(connection)) => (sample, connection),
                    (None, None) => continue,
                    (sample, connection) => return Err(format!("{sample:?} but {connection:?}")),
                };
                match fault {
                    Some(Fault::Direction) => connection.direction = -connection.direction,
                    Some(Fault::Radiance) => connection.radiance *= 1.01,
                    Some(Fault::Density) => connection.pdf_endpoint *= 1.01,
                    _ => (),
                }
                seen[sample.emitter as usize] += 1;
                agree("cosine", connection.direction.dot(sample.direction), 1.0, 1e-5)?;
                if connection.is_delta != sample.is_delta {
                    return Err("kind".to_owned());
                }
                agree("density", connection.pdf.value(), sample.pdf.value(), 1e-4)?;
                // What both estimate, by either density.
                let by_endpoint = connection.radiance * connection.solid_angle_per_endpoint;
                let weight = by_endpoint / connection.pdf_endpoint;
                agree("weight", weight.x, sample.weight.x, 1e-3)?;
                let rays = {
                    let mut point = scene.locate(0, [0.3; 2]);
                    point.position = from;
                    [connection.shadow_ray(&point), sample.shadow_ray(&point)]
                };
                let ends = rays.map(|ray| {
                    if ray.t_max < 2.0 {
                        ray.direction.length()
                    } else {
                        1.0
                    }
                });
                agree("distance", ends[0], ends[1], 1e-4)?;
            }
            if seen.iter().all(|&count| count > 100) {
                Ok(())
            } else {
                Err(format!("{seen:?}"))
            }
        })
        .unwrap();
    }

    /// From any other point: densities are those of [`EmittersByPower::pdf`], and the place is the
    /// same place.
    #[test]
    fn connecting_from_elsewhere_aims_at_the_same_place() {
        let scene = every_kind();
        let emitters = scene.emitters_by_power();
        let mut rng = CounterRng::new(9, 0, 0);
        let mut seen = 0;
        for _ in 0..20_000 {
            let from = Vec3::from_array(std::array::from_fn(|_| rng.next_f32() - 0.5));
            let ray = Ray::new(
                from,
                Vec3::from_array(std::array::from_fn(|_| rng.next_f32() - 0.5)).normalize(),
            );
            let hit = scene.accelerator().intersect(&ray).unwrap();
            let coordinates = scene.coordinates(&ray, &hit);
            let place = scene.locate(hit.primitive, coordinates);
            let endpoint = EmitterEndpoint::Surface {
                emitter: place.emitter,
                coordinates,
            };
            let elsewhere = Vec3::from_array(std::array::from_fn(|_| 3.0 * rng.next_f32() - 1.5));
            let Some(connection) = emitters.connect(elsewhere, &endpoint) else {
                let towards = place.position - elsewhere;
                let outside_in = place.emitter == 2 && elsewhere.length() > 20.0;
                assert!(scene.emitters().radiance(&place, towards) == Rgb::ZERO || outside_in);
                continue;
            };
            seen += 1;
            let towards = (place.position - elsewhere).normalize();
            assert!(connection.direction.dot(towards) > 1.0 - 1e-6);
            assert_eq!(connection.radiance, scene.emitters().radiance(&place, towards));
            agree(
                "density",
                connection.pdf.value(),
                emitters.pdf(elsewhere, &place).value(),
                1e-4,
            )
            .unwrap();
            let cos_theta = place.geometric_normal.dot(towards).abs();
            let per_area = cos_theta / elsewhere.distance_squared(place.position);
            agree("dω/de", connection.solid_angle_per_endpoint, per_area, 1e-3).unwrap();
            agree(
                "density by endpoint",
                connection.pdf_endpoint,
                connection.pdf.value() * connection.solid_angle_per_endpoint,
                1e-5,
            )
            .unwrap();
        }
        assert!(seen > 10_000, "{seen}");
    }

    #[test]
    fn what_does_not_exist_sends_nothing() {
        let scene = every_kind();
        let emitters = scene.emitters_by_power();
        let none = |endpoint| assert!(emitters.connect(Vec3::ZERO, &endpoint).is_none(), "{endpoint:?}");
        none(EmitterEndpoint::Surface {
            emitter: 3,
            coordinates: [0.2; 2],
        });
        for emitter in [0, 6, 7, u32::MAX] {
            none(EmitterEndpoint::Delta { emitter });
        }
        let on_light = Vec3::new(0.0, 4.0, 0.0);
        assert!(
            emitters
                .connect(on_light, &EmitterEndpoint::Delta { emitter: 3 })
                .is_none(),
            "at the light"
        );
    }
}
