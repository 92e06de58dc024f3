//! Light that arrives at paths.

use super::paths::Shadows;
use super::purpose::Purpose;
use lightshed_film::MAX_BATCH;
use lightshed_scene::{Rgb, Scene};

/// Gives what is on its way to paths to those of them that nothing blocks, as paths of `length`
/// edges; then nothing is on its way any more.
#[inline(always)]
pub(super) fn connect(scene: &Scene, shadows: &mut Shadows, length: u32, purpose: &mut impl Purpose) {
    let mut free = !scene.accelerator().occluded_batch(&shadows.rays, shadows.count);
    if shadows.count < MAX_BATCH {
        free &= (1 << shadows.count) - 1;
    }
    while free != 0 {
        let index = free.trailing_zeros() as usize;
        free &= free - 1;
        let [red, green, blue] = &shadows.radiance;
        let radiance = Rgb::new(red.get(index), green.get(index), blue.get(index));
        purpose.connect(shadows.owner.get_word(index) as usize, length, radiance);
    }
    shadows.count = 0;
}
