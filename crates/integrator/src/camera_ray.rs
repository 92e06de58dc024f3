//! The first ray of a path.

use lightshed_sampling::CounterRng;
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Camera, Ray};

/// A camera ray through a uniformly chosen point of a pixel's square, and of the lens if there is
/// one.
#[derive(Clone, Copy)]
pub(crate) struct PixelRay {
    pub ray: Ray,
    /// The place in the pixel, [0, 1)².
    pub film: Vec2,
    pub lens: [f32; 2],
}

impl PixelRay {
    /// Through the pixel whose least corner is `corner`: two numbers, and two more for a lens.
    #[inline(always)]
    pub fn draw(camera: &Camera, corner: Vec2, rng: &mut CounterRng) -> Self {
        let [x, y] = rng.next_2d();
        let [u, v] = if camera.has_lens() {
            rng.next_2d()
        } else {
            [0.5; 2]
        };
        Self::through(camera, corner, [x, y, u, v])
    }

    /// Through the pixel whose least corner is `corner`: at a place in it, and on the lens if there
    /// is one.
    #[inline(always)]
    pub fn through(camera: &Camera, corner: Vec2, [x, y, u, v]: [f32; 4]) -> Self {
        let film = Vec2::new(x, y);
        let lens = if camera.has_lens() { [u, v] } else { [0.5; 2] };
        Self {
            ray: camera.ray(corner + film, lens),
            film,
            lens,
        }
    }
}
