//! What paths are traced for.

use super::PathState;
use lightshed_film::MAX_BATCH;
use lightshed_lanes::Lanes;
use lightshed_sampling::CounterRng;
use lightshed_scene::{Ray, Rgb, Scene, SurfacePoint};

/// Who wants to know what the paths of a batch find. A path is known by its place among those that the batch began with.
pub(super) trait Purpose {
    /// Four random words of eight paths with these names.
    fn words<L: Lanes>(&self, names: [L::Words; 2], block: u32) -> [L::Words; 4];

    /// A path's ray, its edge number `depth`, has met `point`, or the environment. Nothing need be emitted there.
    fn arrive(
        &mut self,
        scene: &Scene,
        place: usize,
        depth: u32,
        path: &PathState,
        ray: &Ray,
        point: Option<&SurfacePoint>,
    );

    /// A path of `length` edges has reached an emitter by sampling it.
    fn connect(&mut self, place: usize, length: u32, radiance: Rgb);

    /// So many rays were traced to go on, and to emitters.
    fn count(&mut self, path: usize, emitter: usize);
}

/// Radiance that arrives at a camera.
pub(super) struct Pixels {
    pub seed: u64,
    pub radiances: [Rgb; MAX_BATCH],
}

impl Purpose for Pixels {
    #[inline(always)]
    fn words<L: Lanes>(&self, [pixel, sample]: [L::Words; 2], block: u32) -> [L::Words; 4] {
        CounterRng::block_lanes::<L>(self.seed, pixel, sample, block)
    }

    #[inline(always)]
    fn arrive(
        &mut self,
        scene: &Scene,
        place: usize,
        _depth: u32,
        path: &PathState,
        ray: &Ray,
        point: Option<&SurfacePoint>,
    ) {
        self.radiances[place % MAX_BATCH] += path.emission(scene, ray, point);
    }

    #[inline(always)]
    fn connect(&mut self, place: usize, _length: u32, radiance: Rgb) {
        self.radiances[place % MAX_BATCH] += radiance;
    }

    #[inline(always)]
    fn count(&mut self, _path: usize, _emitter: usize) {}
}
