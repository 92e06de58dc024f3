//! The shift between pixels.

use super::follow::FollowPaths;
use super::path::{PathCoordinates, VolumePath};
use super::world::VolumeWorld;
use lightshed_resampling::{Domain, Jacobian, Pulled, ShiftMapping, Shifted, Undefined};

/// A pixel of one frame as a domain of paths through volumes. It belongs to the renderer, which
/// stores in it the data of its candidates.
///
/// **Target.** Samples carry the target that they have in their pixel.
pub trait VolumePathDomain: Domain<Sample = VolumePath<Self::Endpoint>, Space = PathCoordinates> {
    /// The end of a path on an emitter.
    type Endpoint: Copy;

    /// Whether the pixel is one of an odd frame: reuse sees two frames, of which one is odd.
    fn is_odd(&self) -> bool;
    /// Whether both are the same pixel, of the same frame or of two.
    fn is_same_pixel(&self, other: &Self) -> bool;
}

/// Directions and distances are kept up to the connected edge, if any; places are kept after it.
///
/// Where edges are short, directions are copied, as Lin 2022 §5.4.2 does for the whole path: then
/// every vertex moves with the camera ray, and every `σ_s` and `T` of `F` changes. The first edge
/// with a length `|x_{i+1} − x_i|` that is many times the movement of the vertices is connected
/// instead, with `x_{i+1}` kept: everything behind it stays, in value as well, and need not be
/// evaluated again. Its coordinates `(ω_i, z_{i+1})` change, with
///
/// > `|∂(ω′, z′)/∂(ω, z)| = |x_{i+1} − x_i|² / |x_{i+1} − x′_i|²`,
///
/// because `dV = z² dω dz`. The edge must be long enough in both pixels. Edges before it keep
/// their length, so they are too short in both.
///
/// Targets of pixels of two frames use the media and surfaces of their own frame; each frame is odd
/// or even.
#[derive(Clone, Copy, Debug)]
pub struct VolumePathShift<W> {
    /// What is there in even frames.
    pub even: W,
    /// The same in odd ones.
    pub odd: W,
    /// Whether both frames show the same, to the same camera.
    pub rests: bool,
    /// Whether both frames have the same media and surfaces: then the values behind a connected
    /// edge are known.
    pub is_same_scene: bool,
}

impl<W: VolumeWorld<Pixel: VolumePathDomain<Endpoint = W::Endpoint>>> VolumePathShift<W> {
    /// The image in `to` of a path that `from` holds, and the Jacobian.
    fn shifted(
        &self,
        path: &VolumePath<W::Endpoint>,
        from: &W::Pixel,
        to: &W::Pixel,
    ) -> Result<(VolumePath<W::Endpoint>, Jacobian), Undefined> {
        if self.rests && from.is_same_pixel(to) {
            return Ok((*path, Jacobian::IDENTITY));
        }
        let world = if to.is_odd() { &self.odd } else { &self.even };
        // Otherwise it is of another frame's media.
        let is_known = self.is_same_scene || from.is_odd() == to.is_odd();
        let image = world.settled(to, path, is_known);
        if path.connected_vertex().is_none() || !(image.target > 0.0) {
            return Ok((image, Jacobian::IDENTITY));
        }
        let ratio = f64::from(path.connection.length) / f64::from(image.connection.length);
        Ok((image, Jacobian::new(ratio * ratio)?))
    }
}

impl<P, W> ShiftMapping<P> for VolumePathShift<W>
where
    P: VolumePathDomain,
    W: VolumeWorld<Pixel = P, Endpoint = P::Endpoint>,
{
    fn shift(
        &self,
        x: &VolumePath<P::Endpoint>,
        from: &P,
        to: &P,
    ) -> Result<Shifted<VolumePath<P::Endpoint>>, Undefined> {
        let (sample, jacobian) = self.shifted(x, from, to)?;
        Ok(Shifted {
            target: f64::from(sample.target),
            sample,
            jacobian,
        })
    }

    fn pull(&self, y: &VolumePath<P::Endpoint>, to: &P, from: &P) -> Result<Pulled, Undefined> {
        let (image, jacobian) = self.shifted(y, to, from)?;
        Ok(Pulled {
            jacobian,
            proxy: f64::from(image.target),
        })
    }
}
