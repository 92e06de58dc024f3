//! Maps that turn shading normals: of normals, and of heights.

use crate::{ColorTexture, FloatTexture, Place};
use glam::{Vec2, Vec3};
use lightshed_sampling::Frame;

/// What turns the shading normals of a material.
///
/// With `n` the interpolated normal, `s` the direction of growing `u` made orthogonal to it and
/// `t = n × s`, a map of normals with colour `c` gives `n′ ∝ m_x s + m_y t + m_z n`,
/// `m = 2c − 1`. A map of heights `h` moves the surface by `h n`:
/// `n′ ∝ ∂p′/∂u × ∂p′/∂v`,
/// `∂p′/∂u = ∂p/∂u + n (∂h/∂u − n · ∂p/∂u)` and likewise for `v` (Blinn 1978,
/// *Simulation of Wrinkled Surfaces*).
#[derive(Clone, Debug)]
pub enum Relief {
    /// Normals in the tangent space of the surface, as colours.
    Normals {
        /// `(m + 1)/2`, not encoded.
        texture: ColorTexture,
        /// Multiplies `m_x` and `m_y`.
        scale: f32,
        /// Whether `t` turns to the other side where the texture lies mirrored on the surface, as
        /// in glTF; in Mitsuba it does not.
        follows_mirroring: bool,
    },
    /// Heights.
    Heights {
        /// `h`, in units of the world's length.
        texture: FloatTexture,
        /// Multiplies `h`.
        scale: f32,
    },
}

/// Derivatives of a position by its texture coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Along {
    pub u: Vec3,
    pub v: Vec3,
}

impl Relief {
    /// The turned normal at a place whose shading frame is `frame`, with its tangent along `u`.
    /// The frame's own where the map says nothing of use.
    pub(crate) fn normal(&self, frame: &Frame, along: Along, place: Place) -> Vec3 {
        let turned = match self {
            Self::Normals {
                texture,
                scale,
                follows_mirroring,
            } => {
                let m = 2.0 * texture.at(place) - Vec3::ONE;
                let is_mirrored = along.u.cross(along.v).dot(frame.normal) < 0.0;
                let side = if *follows_mirroring && is_mirrored {
                    -1.0
                } else {
                    1.0
                };
                if !(m.z > 0.0) {
                    return frame.normal;
                }
                frame.tangent * (m.x * scale) + frame.bitangent * (m.y * scale * side) + frame.normal * m.z
            }
            Self::Heights { texture, scale } => {
                let [by_u, by_v] = gradient(texture, place).map(|slope| slope * scale);
                let n = frame.normal;
                let moved = |along: Vec3, slope: f32| along + n * (slope - n.dot(along));
                let turned = moved(along.u, by_u).cross(moved(along.v, by_v));
                if turned.dot(n) < 0.0 { -turned } else { turned }
            }
        };
        turned.try_normalize().unwrap_or(frame.normal)
    }
}

/// `∂h/∂u` and `∂h/∂v`, by differences over one texel.
fn gradient(texture: &FloatTexture, place: Place) -> [f32; 2] {
    let FloatTexture::Image(image, _) = texture else {
        return [0.0; 2];
    };
    let size = Vec2::new(image.image.width() as f32, image.image.height() as f32);
    let map = image.to_uv.matrix2;
    // How far one texel is in mesh coordinates, along the axis of each.
    let steps = [map.x_axis, map.y_axis].map(|axis| 1.0 / (axis * size).abs().max_element().max(1e-6));
    std::array::from_fn(|axis| {
        let half = Vec2::AXES[axis] * (0.5 * steps[axis]);
        let height = |uv: Vec2| texture.at(Place { uv, ..place });
        (height(place.uv + half) - height(place.uv - half)) / steps[axis]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, Filter, Image, ImageTexture, Rgb, Wrap};
    use glam::Affine2;
    use std::sync::Arc;

    const ALONG: Along = Along {
        u: Vec3::X,
        v: Vec3::Y,
    };

    fn frame() -> Frame {
        Frame::from_normal_and_tangent(Vec3::Z, Vec3::X)
    }

    fn normals(follows_mirroring: bool) -> Relief {
        Relief::Normals {
            texture: ColorTexture::Constant(Rgb::new(0.8, 0.7, 0.9)),
            scale: 0.5,
            follows_mirroring,
        }
    }

    /// `m = (0.6, 0.4, 0.8)`, the first two halved.
    #[test]
    fn colours_are_normals_of_the_tangent_space() {
        let place = Place::from(Vec2::ZERO);
        let expected = Vec3::new(0.3, 0.2, 0.8).normalize();
        let found = normals(true).normal(&frame(), ALONG, place);
        assert!(found.abs_diff_eq(expected, 1e-6), "{found}");
        let mirrored = Along { v: -Vec3::Y, ..ALONG };
        let found = normals(true).normal(&frame(), mirrored, place);
        assert!(
            found.abs_diff_eq(expected * Vec3::new(1.0, -1.0, 1.0), 1e-6),
            "{found}"
        );
        let found = normals(false).normal(&frame(), mirrored, place);
        assert!(found.abs_diff_eq(expected, 1e-6), "{found}");
    }

    /// A ramp `h = 0.3 u` over `p = (2u, v, 0)` has the slope 0.15 along x, wherever its image is
    /// looked at but at the seam; up to the bump's sign and the scale.
    #[test]
    fn heights_tilt_the_surface() {
        let ramp = (0..64).map(|x| [0.3 * (x as f32 + 0.5) / 64.0; 3]).collect();
        let texture = ImageTexture {
            image: Arc::new(Image::from_linear(64, 1, ramp).unwrap()),
            to_uv: Affine2::IDENTITY,
            filter: Filter::Bilinear,
            wrap: Wrap::Repeat,
            scale: Rgb::ONE,
        };
        for (scale, slope) in [(1.0, 0.15), (-2.0, -0.3)] {
            let texture = FloatTexture::Image(texture.clone(), Channel::Red);
            let relief = Relief::Heights { texture, scale };
            let along = Along {
                u: 2.0 * Vec3::X,
                v: Vec3::Y,
            };
            let found = relief.normal(&frame(), along, Place::from(Vec2::new(0.4, 0.5)));
            let expected = Vec3::new(-slope, 0.0, 1.0).normalize();
            assert!(found.abs_diff_eq(expected, 1e-4), "{scale}: {found}");
        }
    }

    #[test]
    fn what_points_into_the_surface_is_left_out() {
        let relief = Relief::Normals {
            texture: ColorTexture::Constant(Rgb::new(0.9, 0.5, 0.2)),
            scale: 1.0,
            follows_mirroring: true,
        };
        assert_eq!(relief.normal(&frame(), ALONG, Place::from(Vec2::ZERO)), Vec3::Z);
    }
}
