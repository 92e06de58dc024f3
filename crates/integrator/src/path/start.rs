//! The first rays of a batch.

use super::numbers::PathWords;
use super::paths::Paths;
use lightshed_film::{MAX_BATCH, SampleId};
use lightshed_lanes::{LANES, LaneKernel, LaneWords, Lanes};
use lightshed_sampling::f32_from_u32_lanes;
use lightshed_scene::Camera;

/// The name of a sample's pixel for random numbers.
#[inline(always)]
pub(super) fn pixel_name(id: &SampleId) -> u32 {
    id.y << 16 | id.x
}

/// Sets `paths` to the beginnings of those that `ids` names, of which no more than [`MAX_BATCH`]
/// are looked at.
pub(super) struct Start<'a, K> {
    pub camera: &'a Camera,
    pub ids: &'a [SampleId],
    pub words: PathWords,
    pub paths: &'a mut Paths<K>,
}

impl<K> LaneKernel for Start<'_, K> {
    const HOT: bool = true;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self {
            camera,
            ids,
            words,
            paths,
        } = self;
        let count = ids.len().min(MAX_BATCH);
        for (index, id) in ids.iter().enumerate().take(count) {
            paths.name[0].set_word(index, pixel_name(id));
            paths.name[1].set_word(index, id.index);
            paths.owner.set_word(index, index as u32);
        }
        let mut place = 0;
        while place < count {
            let pixel = paths.name[0].load_words::<L>(place);
            let words = words.camera_lanes::<L>(pixel, paths.name[1].load_words::<L>(place));
            let (x, y) = (pixel & L::Words::splat(0xffff), pixel.shift_right::<16>());
            let film = [
                L::from_integers(x) + f32_from_u32_lanes::<L>(words[0]),
                L::from_integers(y) + f32_from_u32_lanes::<L>(words[1]),
            ];
            let u_lens = [
                f32_from_u32_lanes::<L>(words[2]),
                f32_from_u32_lanes::<L>(words[3]),
            ];
            let (origin, direction, t_max) = camera.ray_lanes(film, u_lens);
            paths.rays.store(place, origin, direction, t_max);
            let one = L::splat(1.0);
            paths.throughput[0].store(place, one);
            paths.throughput[1].store(place, one);
            paths.throughput[2].store(place, one);
            paths.eta_squared.store(place, one);
            place += LANES;
        }
    }
}
