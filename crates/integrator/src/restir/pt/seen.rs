//! The paths behind what a pixel sees, with their place.

use crate::SceneWorld;
use crate::emitter_sampler::EmitterSampler;
use lightshed_caching::WorldDomain;
use lightshed_resampling::{Domain, Pulled, ShiftMapping, Shifted, Undefined};
use lightshed_sampling::PrimarySample;
use lightshed_shift::{PathDomain, PathSample};
use lightshed_spatial::SurfaceSite;

/// The domain of a pixel. What pixels share is [`PathDomain`]; cells of space ask for its place,
/// too.
pub(super) struct SeenPaths<'a, E: EmitterSampler> {
    pub paths: PathDomain<'a, SceneWorld<'a, E>>,
    /// From the camera to where they start; 0 for paths that start at the sensor.
    pub distance: f32,
}

// Not derived: a derive would ask for `E: Clone`.
impl<E: EmitterSampler> Clone for SeenPaths<'_, E> {
    fn clone(&self) -> Self {
        Self {
            paths: self.paths.clone(),
            distance: self.distance,
        }
    }
}

impl<E: EmitterSampler> Domain for SeenPaths<'_, E> {
    type Sample = PathSample;
    type Space = PrimarySample;

    #[inline(always)]
    fn target(&self, x: &PathSample) -> f64 {
        x.target()
    }
}

impl<E: EmitterSampler> WorldDomain for SeenPaths<'_, E> {
    /// On the side that is seen. Paths that start at the sensor have no place.
    fn site(&self) -> Option<SurfaceSite> {
        let (first, wo) = self.paths.first()?;
        let point = first.point();
        let outward = point.geometric_normal.dot(wo) >= 0.0;
        let normal = match outward {
            true => point.geometric_normal,
            false => -point.geometric_normal,
        };
        Some(SurfaceSite::new(point.position, normal).with_eye_distance(self.distance))
    }

    fn is_same(&self, a: &PathSample, b: &PathSample) -> bool {
        a.is_same_path(b)
    }
}

/// A shift of paths among pixels.
pub(super) struct ShiftSeen<'s, S>(pub &'s S);

impl<S> Clone for ShiftSeen<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S> Copy for ShiftSeen<'_, S> {}

impl<'a, E: EmitterSampler, S> ShiftMapping<SeenPaths<'a, E>> for ShiftSeen<'_, S>
where
    S: ShiftMapping<PathDomain<'a, SceneWorld<'a, E>>>,
{
    #[inline(always)]
    fn shift(
        &self,
        x: &PathSample,
        from: &SeenPaths<'a, E>,
        to: &SeenPaths<'a, E>,
    ) -> Result<Shifted<PathSample>, Undefined> {
        self.0.shift(x, &from.paths, &to.paths)
    }

    #[inline(always)]
    fn pull(
        &self,
        y: &PathSample,
        to: &SeenPaths<'a, E>,
        from: &SeenPaths<'a, E>,
    ) -> Result<Pulled, Undefined> {
        self.0.pull(y, &to.paths, &from.paths)
    }
}
