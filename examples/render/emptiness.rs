//! Images with nothing in them, and why.

use lightshed::scene::Scene;
use lightshed::scene::glam::Vec2;

/// Rays along each side of the image that look for something.
const RAYS: u32 = 24;

/// Says so if the camera seems to see no surface.
pub fn empty(scene: &Scene) -> Option<&'static str> {
    let settings = scene.settings();
    let size = Vec2::new(settings.width as f32, settings.height as f32);
    let seen = |i: u32| {
        let place = Vec2::new((i % RAYS) as f32 + 0.5, (i / RAYS) as f32 + 0.5) / RAYS as f32;
        scene
            .intersect(&scene.camera().ray(place * size, [0.5; 2]))
            .is_some()
    };
    let is_empty = !(0..RAYS * RAYS).any(seen);
    is_empty
        .then_some("no surface is seen by the camera: check its place, its direction and its clipping planes")
}

/// Says so if an image of this mean is black, and what the scene has of lights.
pub fn black(scene: &Scene, mean: [f64; 3]) -> Option<String> {
    if mean.iter().any(|&mean| mean != 0.0) {
        return None;
    }
    Some(match scene.emitters().len() {
        0 => "the image is black: the scene has no light".to_owned(),
        count => format!(
            "the image is black, though the scene has {count} emitters: they may face away, be hidden, or need longer paths"
        ),
    })
}
