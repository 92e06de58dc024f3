//! Light that rays find around the scene, eight at a time.

use super::paths::Paths;
use super::scattered_lanes::load_vectors;
use crate::emitter_sampler::EmitterSampler;
use lightshed_lanes::{LANES, Lanes};
use lightshed_sampling::power_heuristic_lanes;
use lightshed_scene::Scene;
use lightshed_scene::glam::Vec3;

/// What eight paths bring with them from around the scene, throughput and MIS weight included:
/// [`PathState::met_beside`](super::transport::PathState::met_beside) of rays that meet nothing,
/// bit for bit.
pub(super) struct Escaped([[f32; LANES]; 3]);

impl Escaped {
    /// Of the paths from `place` on in the lanes `missed`, of which there is at least one; the rays
    /// are edges number `depth`, and this number of emitter samples was taken at the vertices that
    /// they left. `None` if the sampler's density differs from point to point, or if nothing
    /// surrounds the scene.
    #[inline(always)]
    pub fn of<L: Lanes, S: EmitterSampler>(
        (scene, sampler): (&Scene, &S),
        paths: &Paths<S::Site>,
        place: usize,
        (depth, samples): (u32, u32),
        missed: u32,
    ) -> Option<Self> {
        let (environment, choice) = (scene.emitters().environment()?, sampler.environment_choice()?);
        let direction = load_vectors::<L>(&paths.rays.direction, place);
        // Nothing is weighed against what the camera sees.
        let sky = (depth > 1).then_some(choice.sky());
        let light = environment.light_lanes(sky, direction, missed);
        let mut met = light.radiance;
        if depth > 1 {
            let by_emitters = choice.pdf_lanes(light.pdf_solid_angle) * L::splat(samples as f32);
            // Delta lobes have an infinite density here, and the weight 1.
            met = met * power_heuristic_lanes(paths.pdf.load::<L>(place), by_emitters);
        }
        Some(Self((load_vectors::<L>(&paths.throughput, place) * met).store()))
    }

    /// That of one path.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3 {
        let lane = lane % LANES;
        Vec3::new(self.0[0][lane], self.0[1][lane], self.0[2][lane])
    }
}
