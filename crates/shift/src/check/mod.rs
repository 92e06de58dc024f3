//! The laws of a world, checked by sampling it.

mod cone;
mod fault;
mod lighting;
mod scattering;

pub use fault::{WorldFault, WorldFaults, WorldLaw};

use crate::world::{RayKind, World};
use lightshed_sampling::CounterRng;
use lightshed_sampling::glam::Vec3;

/// How much [`check_world`] has tested. A world in which nothing was tested has no fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct WorldTally {
    /// Vertices.
    pub vertices: u32,
    /// Sampled directions that were evaluated again.
    pub directions: u32,
    /// Comparisons of sampled directions with their density.
    pub scattering_densities: u32,
    /// Sampled emitters that were connected to.
    pub connections: u32,
    /// Comparisons of sampled emitters with their density.
    pub emitter_densities: u32,
}

/// Paths that look for vertices.
const PATHS: u32 = 64;
/// Edges of these.
const EDGES: u32 = 3;
/// Vertices at which densities are compared.
const COMPARED: u32 = 10;

/// Tests a world against the laws that shift mappings depend on ([`WorldLaw`]): at `starts`
/// (vertices with unit directions to the viewer), at what `sensors` see, and at vertices of paths
/// from there.
///
/// Densities are compared with samples within cones of directions: the share of samples in a cone
/// against the integral of the density over it. This finds a factor that is wrong by some per cent
/// wherever a few thousand directions can integrate the density. Other densities, such as that of a
/// mirror, are left out; [`WorldTally`] says how much was compared. A correct world fails by chance
/// less than once in a thousand runs, and for the same `seed` always or never.
///
/// The test takes some tenths of a second in a world whose rays take a microsecond. Call it in a
/// test:
///
/// ```ignore
/// check_world(&world, &[(vertex, to_viewer)], &[], 1).unwrap();
/// ```
///
/// # Errors
/// The first fault of every broken law.
pub fn check_world<W: World>(
    world: &W,
    starts: &[(W::Vertex, Vec3)],
    sensors: &[W::Sensor],
    seed: u64,
) -> Result<WorldTally, WorldFaults> {
    let mut check = Check {
        world,
        rng: CounterRng::new(seed, 0, 0),
        tally: WorldTally::default(),
        faults: Vec::new(),
    };
    let count = starts.len() + sensors.len();
    for path in 0..if count == 0 { 0 } else { PATHS } {
        let number = path as usize % count;
        let start = match starts.get(number) {
            Some(start) => Some(start.clone()),
            None => check.see(&sensors[number - starts.len()]),
        };
        if let Some((vertex, wo)) = start {
            check.follow(vertex, wo);
        }
    }
    if check.faults.is_empty() {
        Ok(check.tally)
    } else {
        Err(WorldFaults(check.faults))
    }
}

/// A check under way.
struct Check<'w, W: World> {
    world: &'w W,
    rng: CounterRng,
    tally: WorldTally,
    faults: Vec<WorldFault>,
}

impl<W: World> Check<'_, W> {
    fn fault(&mut self, law: WorldLaw, at: &W::Vertex, expected: f64, found: f64) {
        if self.faults.iter().all(|fault| fault.law != law) {
            self.faults.push(WorldFault {
                law,
                at: self.world.place(at),
                expected,
                found,
            });
        }
    }

    /// Whether `found` equals `expected` up to rounding; otherwise adds a fault.
    fn same(&mut self, law: WorldLaw, at: &W::Vertex, expected: f32, found: f32) {
        let [expected, found] = [expected, found].map(f64::from);
        if !((found - expected).abs() <= 2e-3 * expected.abs().max(found.abs())) {
            self.fault(law, at, expected, found);
        }
    }

    fn same_color(&mut self, law: WorldLaw, at: &W::Vertex, expected: Vec3, found: Vec3) {
        // A dark channel beside a bright one contains only rounding.
        let floor = Vec3::splat(1e-4 * expected.abs().max_element());
        for channel in 0..3 {
            if (expected - found).abs()[channel] > floor[channel] {
                self.same(law, at, expected[channel], found[channel]);
            }
        }
    }

    fn unit(&mut self, at: &W::Vertex, direction: Vec3) {
        let length = f64::from(direction.length());
        if !((length - 1.0).abs() < 1e-3) {
            self.fault(WorldLaw::UnitLength, at, 1.0, length);
        }
    }

    fn sound(&mut self, at: &W::Vertex, value: Vec3, pdf: f32) {
        let least = value.min_element().min(pdf);
        if !(value.is_finite() && pdf.is_finite() && least >= 0.0) {
            self.fault(WorldLaw::Finite, at, 0.0, f64::from(least));
        }
    }

    /// What a sensor sees.
    fn see(&mut self, sensor: &W::Sensor) -> Option<(W::Vertex, Vec3)> {
        let ([a, b], [c, d]) = (self.rng.next_2d(), self.rng.next_2d());
        let (ray, direction) = self.world.sensor_ray(sensor, [a, b, c, d])?;
        let seen = self.world.trace(&ray, RayKind::Sensor)?;
        self.unit(&seen, direction);
        Some((seen, -direction))
    }

    /// Checks the vertices of a path.
    fn follow(&mut self, mut vertex: W::Vertex, mut wo: Vec3) {
        for _ in 0..EDGES {
            self.tally.vertices += 1;
            self.geometry(&vertex);
            self.scattering(&vertex, wo);
            self.lighting(&vertex);
            if self.tally.vertices <= COMPARED {
                self.scattering_density(&vertex, wo);
                self.emitter_density(&vertex);
            }
            let (u_lobe, u) = (self.rng.next_f32(), self.rng.next_2d());
            let Some(sampled) = self.world.sample_lobe(&vertex, wo, u_lobe, u) else {
                return;
            };
            let ray = self.world.ray(&vertex, sampled.wi);
            let Some(next) = self.world.trace(&ray, RayKind::Path) else {
                return;
            };
            self.segment(&vertex, sampled.wi, &next);
            (vertex, wo) = (next, -sampled.wi);
        }
    }

    /// The vertex at a place equals the vertex that has this place.
    fn geometry(&mut self, vertex: &W::Vertex) {
        let again = self.world.vertex(&self.world.place(vertex));
        let at = |vertex: &W::Vertex| (self.world.position(vertex), self.world.geometric_normal(vertex));
        let ((position, normal), (other, other_normal)) = (at(vertex), at(&again));
        let bits = |v: Vec3| v.to_array().map(f32::to_bits);
        if bits(position) != bits(other) || bits(normal) != bits(other_normal) {
            let distance = f64::from(position.distance(other));
            self.fault(WorldLaw::Snapped, vertex, 0.0, distance);
        }
        self.unit(vertex, normal);
    }
}
