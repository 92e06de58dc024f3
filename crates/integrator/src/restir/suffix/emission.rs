//! Emission that camera rays meet.

use crate::emitter_sampler::EmitterSampler;
use crate::visible_emission::VisibleEmission;
use crate::{SceneVertex, SceneWorld};
use lightshed_scene::Rgb;
use lightshed_scene::glam::Vec3;

/// What the camera rays of a frame add to their pixels.
pub(super) struct Emission<'b, 'a, E: EmitterSampler> {
    pub world: &'a SceneWorld<'a, E>,
    /// What separate rays see.
    pub visible: Option<&'b VisibleEmission>,
    /// The weight of a ray: zero if another estimator sees all emission.
    pub share: f32,
}

impl<E: EmitterSampler> Emission<'_, '_, E> {
    /// The weighted emission that a ray of a pixel meets, at `vertex` if it hits one.
    #[inline]
    pub fn seen(&self, pixel: usize, vertex: Option<&SceneVertex>, direction: Vec3) -> Rgb {
        let scene = self.world.scene();
        let radiance = match vertex {
            _ if self.share == 0.0 => return Rgb::ZERO,
            Some(_) if self.visible.is_some_and(|visible| visible.takes(pixel)) => Rgb::ZERO,
            Some(vertex) => scene.emitters().radiance(vertex.point(), direction),
            None => scene
                .emitters()
                .environment()
                .map_or(Rgb::ZERO, |environment| environment.radiance(direction)),
        };
        radiance * self.share
    }
}
