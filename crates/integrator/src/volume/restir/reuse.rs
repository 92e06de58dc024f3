//! The shift between pixels.

use super::evaluation::Evaluation;
use super::path::VolumePath;
use super::pixel::VolumePixel;
use lightshed_resampling::{Jacobian, Pulled, ShiftMapping, Shifted, Undefined};

/// Directions and distances stay up to the edge that is connected, if any; then places do.
///
/// Where edges are short directions are copied, as Lin 2022 §5.4.2 does all the way: then every vertex moves with the camera ray, and of `F`
/// every `σ_s` and `T` changes. The first edge of a length `|x_{i+1} − x_i|` that is many times what vertices move by is connected instead,
/// `x_{i+1}` kept: what is behind stays, in value as well, and need not be evaluated anew. Its coordinates `(ω_i, z_{i+1})` are others, with
///
/// > `|∂(ω′, z′)/∂(ω, z)| = |x_{i+1} − x_i|² / |x_{i+1} − x′_i|²`,
///
/// since `dV = z² dω dz`. It must be long enough in both pixels; edges before it keep their length, so that they are too short in both.
///
/// Pixels of two frames have targets by what was there in theirs; each is odd or even.
pub(crate) struct PathReuse<'a> {
    pub even: Evaluation<'a>,
    pub odd: Evaluation<'a>,
    /// Whether both frames show the same.
    pub rests: bool,
}

impl PathReuse<'_> {
    /// The image in `to` of a path that `from` holds, and the Jacobian.
    fn shifted(
        &self,
        path: &VolumePath,
        from: &VolumePixel,
        to: &VolumePixel,
    ) -> Result<(VolumePath, Jacobian), Undefined> {
        if self.rests && from.corner == to.corner {
            return Ok((*path, Jacobian::IDENTITY));
        }
        let evaluation = if to.odd_frame { &self.odd } else { &self.even };
        // Otherwise it is of another frame's media.
        let is_known = from.odd_frame == to.odd_frame || std::ptr::eq(self.even.volumes, self.odd.volumes);
        let image = evaluation.settled(to, path, is_known);
        if path.connected_vertex().is_none() || !(image.target > 0.0) {
            return Ok((image, Jacobian::IDENTITY));
        }
        let ratio = f64::from(path.connection.length) / f64::from(image.connection.length);
        Ok((image, Jacobian::new(ratio * ratio)?))
    }
}

impl ShiftMapping<VolumePixel> for PathReuse<'_> {
    fn shift(
        &self,
        x: &VolumePath,
        from: &VolumePixel,
        to: &VolumePixel,
    ) -> Result<Shifted<VolumePath>, Undefined> {
        let (sample, jacobian) = self.shifted(x, from, to)?;
        Ok(Shifted {
            target: f64::from(sample.target),
            sample,
            jacobian,
        })
    }

    fn pull(&self, y: &VolumePath, to: &VolumePixel, from: &VolumePixel) -> Result<Pulled, Undefined> {
        let (image, jacobian) = self.shifted(y, to, from)?;
        Ok(Pulled {
            jacobian,
            proxy: f64::from(image.target),
        })
    }
}
