//! Virtual point lights: where light paths meet diffuse surfaces.

use lightshed_lights::PointLight;
use lightshed_sampling::{SobolSampler, parallel};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Rgb, Scene};
use std::fmt;

/// Most light paths of a set.
pub const MAX_LIGHT_PATHS: u32 = 1 << 24;

/// Most diffuse bounces of a light path.
pub const MAX_VPL_BOUNCES: u32 = 16;

/// Greatest number of mirrors and panes on a light path between two diffuse bounces.
const MAX_DELTA_BOUNCES: u32 = 8;

/// How virtual point lights are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VplOptions {
    /// Light paths traced from the emitters.
    pub paths: u32,
    /// Diffuse bounces after which a path ends, each leaving a light. With `b` of them all paths of
    /// up to `b + 2` edges are covered.
    pub bounces: u32,
}

impl Default for VplOptions {
    /// 10,000 paths of three bounces (Lin 2022 §3.4).
    fn default() -> Self {
        Self {
            paths: 10_000,
            bounces: 3,
        }
    }
}

/// Why virtual point lights cannot be made as asked.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum VplError {
    /// The number of paths is not in 1..=[`MAX_LIGHT_PATHS`].
    Paths(u32),
    /// The number of bounces is not in 1..=[`MAX_VPL_BOUNCES`].
    Bounces(u32),
    /// The distance at which the singularity is cut off is negative or not finite.
    MinDistance(f32),
    /// α is out of range.
    Grid(lightshed_lights::GridError),
    /// The number of shadow samples is out of range.
    ShadowSamples(u32),
    /// The side of the blocks of interleaved sampling is not 1, 2 or 4.
    Interleaving(u32),
    /// More iterations of the filter than the image is large.
    FilterIterations(u32),
}

impl fmt::Display for VplError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Paths(paths) => write!(f, "{paths} light paths are not between 1 and {MAX_LIGHT_PATHS}"),
            Self::Bounces(bounces) => write!(f, "{bounces} bounces are not between 1 and {MAX_VPL_BOUNCES}"),
            Self::MinDistance(distance) => {
                write!(
                    f,
                    "the least distance {distance} is not a finite number from 0 up"
                )
            }
            Self::Grid(error) => write!(f, "{error}"),
            Self::ShadowSamples(samples) => write!(f, "{samples} shadow samples are out of range"),
            Self::Interleaving(side) => write!(f, "blocks of {side} pixels are not of 1, 2 or 4"),
            Self::FilterIterations(count) => write!(f, "{count} iterations of the filter are too many"),
        }
    }
}

impl std::error::Error for VplError {}

impl VplOptions {
    /// Tells what cannot be done.
    pub(super) fn check(&self) -> Result<(), VplError> {
        if !(1..=MAX_LIGHT_PATHS).contains(&self.paths) {
            return Err(VplError::Paths(self.paths));
        }
        if !(1..=MAX_VPL_BOUNCES).contains(&self.bounces) {
            return Err(VplError::Bounces(self.bounces));
        }
        Ok(())
    }
}

/// Random numbers of a bounce: lobe and direction, survival, and one to keep pairs together.
const DIMENSIONS_PER_BOUNCE: u32 = 4;
/// Random numbers of the emission: emitter (two), place, direction.
const DIMENSIONS_OF_EMISSION: u32 = 6;

/// Virtual point lights of a scene, and the memory that the next set uses again.
#[derive(Clone, Debug, Default)]
pub struct VplSet {
    /// `bounces` places for each path, unused ones of no intensity.
    places: Vec<PointLight>,
    lights: Vec<PointLight>,
    rays: u64,
}

impl VplSet {
    /// The lights of the last trace.
    pub fn lights(&self) -> &[PointLight] {
        &self.lights
    }

    /// Rays that the last trace took.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// The seed of a frame's lights, in images of `seed`.
    pub fn seed_of_frame(seed: u64, frame: u32) -> u64 {
        let frame = u64::from(frame).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (seed ^ 0x5650_4c73_0000_0000).wrapping_add(frame)
    }

    /// Traces light paths from the emitters of `scene` and leaves a light at each diffuse bounce
    /// (Keller 1997; Lin 2022 §3.4).
    ///
    /// Path `i` of `n` starts with the flux `Φ/n` of an emitted ray. At a vertex with incident
    /// direction ω_i the sampled scattering changes the flux, `Φ ← Φ f |cos| / p`, and a light
    /// of radiant intensity `(Φ/π) max(0, n·ω)` is left on the side of the new direction. For
    /// diffuse surfaces that is exactly `Φ_i f (n·ω)`. For others it has the right power with a
    /// diffuse shape, the *diffuse approximation*, which is biased. Mirrors and smooth dielectrics
    /// leave no light and are followed. Then the path continues in the sampled direction, surviving
    /// with probability `min(1, max Φ/max Φ_before)`, so that lights are about equally bright.
    /// The shape is that of the geometric normal. If shading normals differ, the flux carries the
    /// factor of the adjoint (Veach 1997 §5.3.2), so that lights agree with paths from the camera.
    ///
    /// With `seed` and options the set is the same for any number of threads; the numbers are
    /// Owen-scrambled Sobol points, one for each path. An empty set where nothing arrives.
    ///
    /// # Errors
    ///
    /// Numbers of paths or bounces out of range.
    pub fn trace(&mut self, scene: &Scene, options: &VplOptions, seed: u64) -> Result<(), VplError> {
        options.check()?;
        let bounces = options.bounces as usize;
        self.places.clear();
        self.places
            .resize(options.paths as usize * bounces, PointLight::default());
        let per_path = 1.0 / options.paths as f32;
        let groups = self.places.chunks_mut(bounces * PATHS_IN_GROUP);
        let rays = parallel::map(groups, |group, places| -> u64 {
            let paths = (group * PATHS_IN_GROUP..).zip(places.chunks_mut(bounces));
            paths
                .map(|(path, places)| trace_path(scene, places, per_path, seed, path as u32))
                .sum()
        });
        self.rays = rays.iter().sum();
        self.lights.clear();
        self.lights
            .extend(self.places.iter().filter(|light| light.intensity != Vec3::ZERO));
        Ok(())
    }
}

/// Paths that one thread takes at a time.
const PATHS_IN_GROUP: usize = 64;

/// Fills `places` from the first one on; returns how many rays that took.
fn trace_path(scene: &Scene, places: &mut [PointLight], per_path: f32, seed: u64, path: u32) -> u64 {
    let mut sobol = SobolSampler::new(seed, 0, path);
    let u_select = sobol.next_u64();
    let (u_place, u_direction) = (sobol.next_2d(), sobol.next_2d());
    let Some(emitted) = scene.sample_emission(u_select, u_place, u_direction) else {
        return 0;
    };
    let (mut ray, mut flux) = (emitted.ray, emitted.flux * per_path);
    let (mut left, mut deltas, mut rays) = (0, 0, 0);
    while left < places.len() && deltas <= MAX_DELTA_BOUNCES {
        rays += 1;
        let Some(point) = scene.intersect(&ray) else {
            break;
        };
        let bounce = (left as u32) + deltas;
        sobol.set_dimension(DIMENSIONS_OF_EMISSION + bounce * DIMENSIONS_PER_BOUNCE);
        let (u, u_lobe, u_survival) = (sobol.next_2d(), sobol.next_f32(), sobol.next_f32());
        let wo = point.shading.to_local(-ray.direction);
        let Some(sample) = scene.bsdf(&point).sample(wo, u_lobe, u.into()) else {
            break;
        };
        let outgoing = point.shading.to_world(sample.wi);
        let Some(adjoint) = adjoint_factor(
            [wo.z, sample.wi.z],
            [
                -ray.direction.dot(point.geometric_normal),
                outgoing.dot(point.geometric_normal),
            ],
        ) else {
            break;
        };
        // Refraction does not compress flux as it compresses radiance.
        let scattered: Rgb = flux * sample.weight * (adjoint * sample.eta * sample.eta);
        if !(scattered.is_finite() && scattered.max_element() > 0.0) {
            break;
        }
        if sample.is_delta {
            deltas += 1;
        } else {
            let normal = point.geometric_normal * outgoing.dot(point.geometric_normal).signum();
            places[left] = PointLight::lambertian(
                point.origin_towards(normal),
                normal,
                scattered * std::f32::consts::FRAC_1_PI,
            );
            left += 1;
        }
        let survival = (scattered.max_element() / flux.max_element()).min(1.0);
        if u_survival >= survival {
            break;
        }
        flux = scattered / survival;
        ray = point.spawn(outgoing);
    }
    rays
}

/// `|cos_g,o cos_s,i| / |cos_s,o cos_g,i|`, with the cosines `[in, out]` to the shading and to the
/// geometric normal. `None` if the two normals disagree about the side of a direction.
#[inline]
fn adjoint_factor(shading: [f32; 2], geometric: [f32; 2]) -> Option<f32> {
    let agree = shading[0] * geometric[0] > 0.0 && shading[1] * geometric[1] > 0.0;
    let factor = geometric[1] / shading[1] * (shading[0] / geometric[0]);
    // Grazing incidence may send it to infinity; a bound loses the light of a few such paths.
    agree.then_some(factor.min(MAX_ADJOINT_FACTOR))
}

/// Bound on the adjoint's factor.
const MAX_ADJOINT_FACTOR: f32 = 16.0;

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_scene::{Geometry, Material, builtin};
    use lightshed_testkit::{MeanTest, check_faults};

    fn traced(scene: &Scene, paths: u32, bounces: u32, seed: u64) -> VplSet {
        let mut set = VplSet::default();
        set.trace(scene, &VplOptions { paths, bounces }, seed).unwrap();
        set
    }

    /// All paths in one pool and in another give the same lights; another seed gives others.
    #[test]
    fn threads_do_not_change_the_lights() {
        let scene = Scene::new(&builtin::cornell()).unwrap();
        let in_pool = |threads, seed| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| traced(&scene, 1000, 3, seed)).lights
        };
        let lights = in_pool(1, 5);
        assert!(lights.len() > 1500 && lights == in_pool(3, 5) && lights != in_pool(1, 6));
    }

    /// Inside a sphere of reflectance ρ that emits `Φ`, the lights of the k-th bounce have the
    /// flux `ρ^k Φ`, `π I` each. MeanTest at 1e-6; paths that end a bounce early, and survivors
    /// that are not made up for, are noticed.
    #[test]
    fn lights_have_the_flux_of_the_reflected_light() {
        let mut description = builtin::furnace();
        let shape = &mut description.shapes[0];
        let Geometry::Sphere(sphere) = &mut shape.geometry else {
            panic!("the furnace has a sphere");
        };
        sphere.flip_normals = true;
        shape.emission = Some(Rgb::new(1.0, 2.0, 0.5));
        let reflectance = Rgb::splat(0.6);
        description.materials = vec![Material::Diffuse {
            reflectance: reflectance.into(),
        }];
        description.emitters.clear();
        let scene = Scene::new(&description).unwrap();
        let emitted = 4.0 * std::f64::consts::PI.powi(2) * 2.0;
        let expected = emitted * (0.6 + 0.36 + 0.216);
        check_faults(&["early", "not divided"], |fault| {
            let mut flux = MeanTest::new();
            for seed in 0..60 {
                let set = traced(&scene, 256, if fault == Some("early") { 2 } else { 3 }, seed);
                let lights = set.lights.iter().map(|light| f64::from(light.intensity.y));
                // Every light has the flux of the first bounce if survival is divided by.
                let undivided = |i: f64| if fault == Some("not divided") { 0.8 * i } else { i };
                flux.push(lights.map(|i| undivided(i) * std::f64::consts::PI).sum());
            }
            flux.test_against(expected, 1e-6)
        })
        .unwrap();
    }

    #[test]
    fn impossible_numbers_are_refused() {
        let scene = Scene::new(&builtin::furnace()).unwrap();
        let mut set = VplSet::default();
        for (paths, bounces) in [(0, 3), (MAX_LIGHT_PATHS + 1, 3), (1, 0), (1, MAX_VPL_BOUNCES + 1)] {
            assert!(set.trace(&scene, &VplOptions { paths, bounces }, 0).is_err());
        }
    }
}
