//! Shadow rays that wait for a full batch.

use lightshed_film::MAX_BATCH;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Ray, Rgb, Scene};

/// Shadow rays with their owners and contributions, traced in batches of the best size.
pub(crate) struct ShadowBatch {
    rays: [Ray; MAX_BATCH],
    brings: [(u8, Rgb); MAX_BATCH],
    count: usize,
}

impl ShadowBatch {
    pub fn new() -> Self {
        Self {
            rays: [Ray::segment(Vec3::ZERO, Vec3::Z, 0.0); MAX_BATCH],
            brings: [(0, Rgb::ZERO); MAX_BATCH],
            count: 0,
        }
    }

    /// One more ray, for `values[owner]`.
    #[inline(always)]
    pub fn push(&mut self, scene: &Scene, ray: Ray, owner: usize, radiance: Rgb, values: &mut [Rgb]) {
        if self.count == MAX_BATCH {
            self.flush(scene, values);
        }
        self.rays[self.count] = ray;
        self.brings[self.count] = (owner as u8, radiance);
        self.count += 1;
    }

    /// Traces them, and adds the contributions that arrive: for each owner in the order of arrival.
    pub fn flush(&mut self, scene: &Scene, values: &mut [Rgb]) {
        let mut occluded = [false; MAX_BATCH];
        let count = std::mem::take(&mut self.count);
        scene
            .accelerator()
            .occluded_many(&self.rays[..count], &mut occluded[..count]);
        for ((owner, radiance), occluded) in self.brings[..count].iter().zip(occluded) {
            if !occluded {
                values[*owner as usize] += *radiance;
            }
        }
    }
}
