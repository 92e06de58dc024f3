//! Candidates: random walks through coarse densities. Each vertex ends a path at an emitter and, if
//! media emit, another path.

use super::evaluation::{Evaluation, Lit};
use super::pixel::{First, VolumePath, VolumePixel, VolumeReservoir};
use super::through::{Landing, Met, transmitted};
use super::vertex::{Vertex, emission, surface_vertex};
use lightshed_film::RayKind;
use lightshed_resampling::{ContributionWeight, MixtureRis};
use lightshed_sampling::{CounterRng, f32_from_u32, f64_from_u64};
use lightshed_scene::EmitterEndpoint;
use lightshed_scene::glam::{DVec3, Vec2, Vec3};
use lightshed_scene::volume::PhaseFunction;
use lightshed_shift::{
    EdgeEnd, MAX_SCATTERINGS, PathCoordinates, SensorPlace, Step, Transmittance, path_target,
};

/// Scattering vertices from which on roulette may end a walk (Lin 2022 §5.6.1).
const ROULETTE_VERTICES: u32 = 3;

/// A walk on its way.
struct Walk<'a> {
    path: VolumePath,
    /// `F` so far, with the proposals' transmittances.
    value: DVec3,
    /// Density of the walk so far, in the measure of coordinates.
    pdf: f64,
    vertex: Vertex<'a>,
}

/// How a walk goes on.
struct Onward {
    /// The emitter that it has hit.
    found: Option<Found>,
    /// Whether it is at another vertex, or ended.
    arrived: bool,
}

impl Onward {
    const ENDED: Self = Self {
        found: None,
        arrived: false,
    };
}

/// A path as a walk found it.
struct Found {
    path: VolumePath,
    value: DVec3,
    pdf: f64,
    /// Its share under MIS with emitter samples.
    part: f64,
}

/// Points that fill the unit cube evenly, each of them uniform by a random shift: the additive
/// recurrence of the powers of `1/g`, `g⁴ = g + 1` (Roberts 2018).
#[derive(Clone, Copy)]
pub(crate) struct Sequence {
    /// In 2⁻⁶⁴.
    place: [u64; 3],
}

impl Sequence {
    /// From point number `index` on, of those shifted by `shift`.
    pub fn new(shift: [u64; 3], index: u64) -> Self {
        Self {
            place: core::array::from_fn(|axis| {
                shift[axis].wrapping_add(Self::STEP[axis].wrapping_mul(index))
            }),
        }
    }

    /// `2⁶⁴ g⁻¹`, `2⁶⁴ g⁻²`, `2⁶⁴ g⁻³`.
    const STEP: [u64; 3] = [
        0xd1b5_4a32_d192_ed03,
        0xabc9_8388_fb8f_ac03,
        0x8cb9_2ba7_2f3d_8dd7,
    ];

    /// The next point.
    pub fn next(&mut self) -> [u64; 3] {
        let point = self.place;
        for (place, step) in self.place.iter_mut().zip(Self::STEP) {
            *place = place.wrapping_add(step);
        }
        point
    }
}

impl Evaluation<'_> {
    /// One path of the pixel from `walks` random walks of at most `scatterings` scattering
    /// vertices, by RIS with this evaluation's target (Lin 2022 eqs. 5.17, 5.18, A.1). After their
    /// first vertex, walks go through densities of this evaluation's level, and of cubes of
    /// `cubes`.
    ///
    /// The path has the walk's own target, of the proposals' transmittances.
    ///
    /// `start` has the numbers of first distances and first emitter samples; each set is uniform,
    /// and all together are more even than random ones.
    ///
    /// The paths of a walk differ in length or kind, except paths to the environment and to lamps,
    /// which end by an emitter sample or where the walk hits the emitter. The balance heuristic
    /// combines these two techniques by their densities of endpoints as seen from the last vertex.
    /// All others have a single technique, and all walks have equal shares.
    pub fn resample_walks(
        &self,
        pixel: &VolumePixel,
        walks: u32,
        scatterings: u32,
        cubes: u32,
        mut start: Sequence,
        rng: &mut CounterRng,
    ) -> VolumeReservoir {
        if pixel.is_empty() {
            return VolumeReservoir::empty(1.0);
        }
        // Behind the last vertex that scatters, only emission and the environment remain.
        let emits_behind = self
            .volumes
            .scene
            .media()
            .iter()
            .any(|medium| medium.emission().is_some());
        let mut ris = MixtureRis::new();
        let share = 1.0 / f64::from(walks);
        for _ in 0..walks {
            let [u_first, u_light @ ..] = start.next();
            let Some(mut walk) = self.begin(pixel, f64_from_u64(u_first)) else {
                continue;
            };
            let mut scattered = 0;
            loop {
                let mut offer =
                    |path: VolumePath, value: DVec3, pdf: f64, part: f64, rng: &mut CounterRng| {
                        let target = path_target(value);
                        let path = path.held(path.connection, target);
                        if target > 0.0
                            && let Ok(weight) = ContributionWeight::<PathCoordinates, f64>::new(pdf.recip())
                        {
                            ris.candidate(path, f64::from(target), share * part, weight, rng);
                        }
                    };
                let emitters = self.volumes.scene.emitters();
                match &walk.vertex {
                    Vertex::Medium { medium, position, .. } if medium.emission().is_some() => {
                        let value = walk.value * emission(medium, *position);
                        offer(walk.path, value, walk.pdf, 1.0, rng);
                    }
                    // No emitter sample finds what a mirror shows.
                    Vertex::Surface { .. } if walk.path.lobe_to(walk.path.vertices() - 1).is_some() => {
                        let value = walk.value * walk.vertex.emitted(emitters);
                        offer(walk.path, value, walk.pdf, 1.0, rng);
                    }
                    _ => (),
                }
                if scattered == scatterings.min(MAX_SCATTERINGS) {
                    break;
                }
                let u = if scattered == 0 {
                    u_light.map(|u| f32_from_u32((u >> 32) as u32))
                } else {
                    rng.next_2d()
                };
                let by_power = self.volumes.emitters();
                let endpoint = by_power.sample_endpoint(walk.vertex.position(), rng.next_u64(), u);
                let is_last = scattered + 1 == scatterings && !emits_behind;
                let looks = self.looks_for_emitters(&walk.vertex, is_last);
                if let Some(endpoint) = endpoint
                    && let Some(lit) = self.light_from(&walk.vertex, &endpoint, &mut Transmittance::Target)
                {
                    let path = walk.path.with_endpoint(endpoint, lit.radiance);
                    let part = if looks {
                        self.share_of_sample(&walk.vertex, &endpoint, &lit)
                    } else {
                        1.0
                    };
                    offer(path, walk.value * lit.value, walk.pdf * lit.pdf, part, rng);
                }
                scattered += 1;
                let onward = self.walk_on(&mut walk, scattered, [is_last, looks], cubes, rng);
                if let Some(found) = onward.found {
                    offer(found.path, found.value, found.pdf, found.part, rng);
                }
                if !onward.arrived {
                    break;
                }
            }
        }
        ris.finish(1.0)
    }

    /// Whether a walk continues from a vertex, in a direction that has a width, to hit emitters:
    /// not from the last vertex, where it would seldom hit one.
    fn looks_for_emitters(&self, vertex: &Vertex<'_>, is_last: bool) -> bool {
        let has_environment = self.volumes.scene.emitters().environment().is_some();
        if !(has_environment || self.volumes.shows_lamps) {
            return false;
        }
        match vertex {
            Vertex::Medium { index, .. } => {
                !is_last || has_environment || self.volumes.has_lobe[*index as usize]
            }
            Vertex::Surface { bsdf, .. } => !is_last || has_environment || !bsdf.is_diffuse(),
        }
    }

    /// Share of an emitter sample under balance MIS with directions from its vertex, which can hit
    /// the emitter, too: `p_e/(p_e + p_ω |dω/de|)`.
    fn share_of_sample(&self, vertex: &Vertex<'_>, endpoint: &EmitterEndpoint, lit: &Lit) -> f64 {
        let is_met = match endpoint {
            EmitterEndpoint::Surface { .. } => self.volumes.shows_lamps,
            EmitterEndpoint::Environment { .. } => true,
            EmitterEndpoint::Delta { .. } => false,
        };
        if is_met {
            lit.pdf / (lit.pdf + vertex.pdf_towards(lit.direction) * lit.per_endpoint)
        } else {
            1.0
        }
    }

    /// A walk's hit, with its value and density up to there: an emitter, in a direction of density
    /// `pdf_direction`; `None` by a lobe without width.
    fn found(&self, walk: &Walk<'_>, endpoint: EmitterEndpoint, pdf_direction: Option<f64>) -> Option<Found> {
        let seen = self
            .volumes
            .emitters()
            .connect(walk.vertex.position(), &endpoint)?;
        let per_endpoint = f64::from(seen.solid_angle_per_endpoint);
        let part = pdf_direction.map_or(1.0, |pdf| {
            let pdf_endpoint = pdf * per_endpoint;
            pdf_endpoint / (pdf_endpoint + f64::from(seen.pdf_endpoint))
        });
        Some(Found {
            path: walk.path.with_endpoint(endpoint, seen.radiance),
            value: walk.value * (seen.radiance.as_dvec3() * per_endpoint),
            pdf: walk.pdf * per_endpoint,
            part,
        })
    }

    /// The first vertex of a walk.
    fn begin(&self, pixel: &VolumePixel, u: f64) -> Option<Walk<'_>> {
        let mut path = VolumePath::seen(SensorPlace {
            film: pixel.film,
            lens: pixel.lens,
        });
        let first = |end| Step {
            direction: Vec3::ZERO,
            end,
        };
        let (vertex, depth, pdf) = match pixel.fly(u) {
            First::Medium { distance, pdf } => {
                path.push(first(EdgeEnd::Medium(distance)));
                let (index, depth) = pixel.depth_at(distance)?;
                let vertex = Vertex::Medium {
                    medium: &self.volumes.scene.media()[index as usize],
                    index,
                    position: pixel.ray.origin + pixel.ray.direction * distance,
                    incoming: pixel.ray.direction,
                };
                (vertex, depth, pdf)
            }
            First::Surface { pdf } => {
                path.push(first(EdgeEnd::Surface));
                (pixel.surface_vertex()?, pixel.depth_of_surface(), pdf)
            }
            First::Nowhere => return None,
        };
        Some(Walk {
            path,
            value: transmitted(depth),
            pdf,
            vertex,
        })
    }

    /// Scatters and flies on.
    fn walk_on<'s>(
        &'s self,
        walk: &mut Walk<'s>,
        scattered: u32,
        [is_last, looks]: [bool; 2],
        cubes: u32,
        rng: &mut CounterRng,
    ) -> Onward {
        let volumes = self.volumes;
        if is_last && !looks && walk.vertex.is_wide() {
            return Onward::ENDED;
        }
        let (u_lobe, u) = (rng.next_f32(), rng.next_2d());
        let (mut lobe, mut eta) = (None, 1.0);
        let (direction, pdf, towards) = match &walk.vertex {
            Vertex::Medium { medium, incoming, .. } => {
                let sample = medium.phase().sample(*incoming, u);
                let pdf = f64::from(sample.pdf.value());
                (sample.direction, pdf, walk.vertex.scattered(sample.direction))
            }
            Vertex::Surface { point, bsdf, wo, .. } => match bsdf.sample(*wo, u_lobe, Vec2::from(u)) {
                Some(sample) if sample.is_delta => {
                    let Some(reflected) = walk.vertex.reflected(sample.lobe) else {
                        return Onward::ENDED;
                    };
                    (lobe, eta) = (Some(sample.lobe), reflected.eta);
                    (reflected.direction, reflected.probability, reflected.share)
                }
                Some(sample) if looks || !is_last => {
                    let direction = point.shading.to_world(sample.wi);
                    let pdf = f64::from(sample.pdf.value());
                    (direction, pdf, walk.vertex.scattered(direction))
                }
                _ => return Onward::ENDED,
            },
        };
        if !(pdf > 0.0 && towards.max_element() > 0.0) {
            return Onward::ENDED;
        }
        if let Some(lobe) = lobe {
            walk.path.scatter_by(lobe);
        }
        // The albedo that was met, as far as it is one.
        let throughput = (towards * (eta * eta) / pdf).max_element();
        walk.value *= towards;
        walk.pdf *= pdf;
        if scattered >= ROULETTE_VERTICES {
            let survival = match &walk.vertex {
                Vertex::Medium { medium, .. } => f64::from(medium.albedo().max_element()),
                Vertex::Surface { .. } => throughput.min(0.95),
            };
            if !(f64_from_u64(rng.next_u64()) < survival) {
                return Onward::ENDED;
            }
            walk.pdf *= survival;
        }
        let (ray, medium) = walk.vertex.leave(volumes, direction);
        self.tally.add(RayKind::Path, 1);
        let flight = volumes.fly(&ray, medium, [self.level, cubes], || f64_from_u64(rng.next_u64()));
        walk.value *= transmitted(flight.depth);
        walk.pdf *= flight.pdf;
        let pdf_direction = lobe.is_none().then_some(pdf);
        let (mut connection, mut found) = (None, None);
        let end = match flight.landing {
            Landing::Collision { distance, medium } => {
                let distance = distance as f32;
                let (before, position) = (walk.vertex.position(), ray.origin + ray.direction * distance);
                walk.vertex = Vertex::Medium {
                    medium: &volumes.scene.media()[medium as usize],
                    index: medium,
                    position,
                    incoming: direction,
                };
                let length = position.distance(before);
                // Where the direction is not free, no place can be kept.
                if lobe.is_none()
                    && walk.path.connected_vertex().is_none()
                    && length >= self.reach.least_length(walk.path.end(0))
                {
                    connection = Some((position, length));
                }
                EdgeEnd::Medium(distance)
            }
            Landing::Surface(Met { point, endpoint }) => {
                // Behind a lobe without width the lamp itself is a vertex.
                if let Some(endpoint) = endpoint
                    && looks
                    && volumes.shows_lamps
                    && lobe.is_none()
                {
                    found = self.found(walk, endpoint, pdf_direction);
                }
                walk.vertex = surface_vertex(volumes, point, &ray, flight.medium);
                EdgeEnd::Surface
            }
            Landing::Away => {
                let sky = EmitterEndpoint::Environment { direction };
                return Onward {
                    found: (looks || lobe.is_some())
                        .then(|| self.found(walk, sky, pdf_direction))
                        .flatten(),
                    arrived: false,
                };
            }
        };
        walk.path.push(Step { direction, end });
        if let Some((place, length)) = connection {
            walk.path.connect(place, length);
        }
        Onward { found, arrived: true }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::restir::unscattered;
    use crate::{CameraMotion, RestirVolume, RestirVolumeOptions, VolumePathTracer};
    use lightshed_sampling::UniformSphere;
    use lightshed_scene::{PhaseDescription, Ray, Scene, builtin};
    use lightshed_shift::FollowPaths;
    use lightshed_testkit::{MeanTest, check_faults};

    /// Smoke that scatters forward among boxes and walls of rough metal.
    fn lobes() -> Scene {
        let mut description = builtin::smoke_in_cornell();
        description.materials[0] = builtin::cornell_glossy().materials[3].clone();
        description.media[0].phase = PhaseDescription::HenyeyGreenstein { g: 0.8 };
        (description.settings.width, description.settings.height) = (24, 24);
        Scene::new(&description).unwrap()
    }

    fn method(scene: &Scene, scatterings: u32) -> RestirVolume<'_> {
        RestirVolume::new(scene, RestirVolumeOptions::new(scatterings), CameraMotion::STILL).unwrap()
    }

    /// A path to a lamp is the same by an emitter sample and by coming upon it: the value is, but
    /// for what is in between, and the shares add up to one. A ray in its direction comes upon the
    /// place that was sampled.
    #[test]
    fn lamps_are_shared() {
        let scene = lobes();
        let method = method(&scene, 2);
        let evaluation = method.evaluation(0);
        let volumes = evaluation.volumes;
        check_faults(&[1.01], |fault: Option<f64>| {
            let (mut rng, mut seen) = (CounterRng::new(7, 0, 0), [0; 2]);
            for _ in 0..4000 {
                let position = (Vec3::from_array([(); 3].map(|()| rng.next_f32())) - Vec3::splat(0.5)) * 1.4;
                let incoming = UniformSphere::sample(rng.next_2d());
                let inside = Vertex::Medium {
                    medium: &scene.media()[0],
                    index: 0,
                    position,
                    incoming,
                };
                let vertex = if rng.next_f32() < 0.5 {
                    inside
                } else {
                    let ray = Ray::new(position, incoming);
                    match volumes.parts(&ray, Some(0), |_| true) {
                        (Some(met), medium) => surface_vertex(volumes, met.point, &ray, medium),
                        _ => inside,
                    }
                };
                let at = vertex.position();
                let endpoint = scene
                    .emitters_by_power()
                    .sample_endpoint(at, rng.next_u64(), rng.next_2d());
                let endpoint = endpoint.expect("there is a lamp");
                let Some(lit) = evaluation.light_from(&vertex, &endpoint, &mut Transmittance::Target) else {
                    continue;
                };
                let pdf = vertex.pdf_towards(lit.direction);
                let share = evaluation.share_of_sample(&vertex, &endpoint, &lit);
                let (ray, medium) = vertex.leave(volumes, lit.direction);
                let met = volumes.parts(&ray, medium, |_| true).0.expect("a lamp");
                let place = met.endpoint.ok_or("a wall in place of a lamp")?;
                let there = scene.emitters().connect(at, &place).ok_or("the lamp's back")?;
                if there.direction.distance(lit.direction) > 1e-4 {
                    return Err("another place".to_owned());
                }
                seen[usize::from(matches!(vertex, Vertex::Surface { .. }))] += 1;
                let walk = Walk {
                    path: VolumePath::seen(SensorPlace {
                        film: Vec2::ZERO,
                        lens: [0.5; 2],
                    }),
                    value: vertex.scattered(lit.direction),
                    pdf,
                    vertex,
                };
                let pdf_direction = Some(pdf * fault.unwrap_or(1.0));
                let found = evaluation
                    .found(&walk, endpoint, pdf_direction)
                    .ok_or("nothing")?;
                let whole = found.value * lit.arriving / (lit.radiance.as_dvec3() * lit.per_endpoint);
                if !whole.abs_diff_eq(lit.value, 1e-6 * lit.value.max_element()) {
                    return Err(format!("{whole} is not {}", lit.value));
                }
                // Where one technique alone finds lamps, its fault is not to be told.
                if (share + found.part - 1.0).abs() > 1e-6 {
                    return Err(format!("{share} and {}", found.part));
                }
            }
            assert!(seen.iter().all(|&count| count > 500), "{seen:?}");
            Ok(())
        })
        .unwrap();
    }

    /// By RIS of walks among lobes light has the mean of path tracing, seen through smoke and on
    /// metal; z-tests at 1e-6. (Seen to fail where emitter samples, or what walks come upon, take
    /// the whole of a path, and where the latter is left out.)
    #[test]
    fn walks_among_lobes_estimate_what_path_tracing_does() {
        let scene = lobes();
        for (place, scatterings) in [
            ([11.0, 6.0], 1),
            ([11.0, 6.0], 3),
            ([18.0, 15.0], 2),
            ([20.0, 5.0], 2),
        ] {
            let method = method(&scene, scatterings);
            let evaluation = method.evaluation(0);
            let mut pixel = VolumePixel::default();
            (pixel.corner, pixel.film) = (Vec2::from(place), Vec2::splat(0.5));
            let ray = scene.camera().ray(pixel.corner + pixel.film, pixel.lens);
            pixel.look(evaluation.volumes, ray, scene.camera_medium(scene.camera()), 1);
            let tracer = VolumePathTracer::new(&scene, scene.emitters_by_power())
                .with_depths(Some(scatterings + 1), u32::MAX);
            let mut traced = MeanTest::new();
            for sample in 0..60_000 {
                let mut rng = CounterRng::new(2, 0, sample);
                traced.push(f64::from(tracer.radiance(pixel.ray, pixel.medium, &mut rng).y));
            }
            let mut walked = MeanTest::new();
            for sample in 0..30_000 {
                let mut rng = CounterRng::new(1, 0, sample);
                let start = Sequence::new([(); 3].map(|()| rng.next_u64()), 0);
                let reservoir = evaluation.resample_walks(&pixel, 4, scatterings, 2, start, &mut rng);
                let light = reservoir.weighted_sample().map_or(0.0, |(path, weight)| {
                    evaluation.estimate(&pixel, path, &mut rng).y * weight.value()
                });
                walked.push(light + f64::from(unscattered(evaluation.volumes, &pixel, &mut rng).y));
            }
            let test = walked.test_equal(&traced, 1e-6);
            println!(
                "{place:?}, K = {scatterings}: {} ± {} against {} ± {}: {test:?}",
                walked.mean(),
                walked.standard_error(),
                traced.mean(),
                traced.standard_error()
            );
            test.unwrap();
        }
    }
}
