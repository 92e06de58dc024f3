//! Cameras and emitters as rows of numbers, for shaders.

use crate::Rgb;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// An emitting triangle: a corner, the edges from there, unit normal, radiance, and `p_sel / area`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FlatEmitter {
    /// A corner.
    pub corner: Vec3,
    /// `p_sel / area`, per unit area.
    pub pdf_area: f32,
    /// From the corner to the second, …
    pub edge0: Vec3,
    /// Red radiance.
    pub radiance_r: f32,
    /// … and to the third.
    pub edge1: Vec3,
    /// Green radiance.
    pub radiance_g: f32,
    /// Unit normal, the side that emits.
    pub normal: Vec3,
    /// Blue radiance.
    pub radiance_b: f32,
}

/// A point, a spot or a direction that shines. 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FlatDelta {
    /// Where it is; of a direction the unit vector towards the light.
    pub place: Vec3,
    /// With which it is chosen, `p_sel`.
    pub probability: f32,
    /// Radiant intensity within the beam; of a direction the irradiance on a plane that faces it.
    pub intensity: Rgb,
    /// Cosine of the angle from the axis up to which that is so.
    pub cos_beam: f32,
    /// Unit axis of a spot.
    pub axis: Vec3,
    /// Cosine of the angle from the axis beyond which there is nothing.
    pub cos_cutoff: f32,
    /// That angle, in radians.
    pub cutoff_angle: f32,
    /// One over the width of the fall-off in radians, or 0 if it has none.
    pub inverse_transition: f32,
    /// Nothing.
    pub padding: [u32; 2],
}

/// An equirectangular image from all around, with a distribution over the cells between texel
/// centres: `width` columns, `max(height, 2) − 1` rows.
#[derive(Clone, Debug, PartialEq)]
pub struct FlatSky {
    /// Columns of the rotation from the world to the image's space, where y is up.
    pub axes: [Vec3; 3],
    /// Factor of all radiances.
    pub scale: f32,
    /// Texels along a row, and rows.
    pub size: [u32; 2],
    /// The last row of cells with a positive value.
    pub last_row: u32,
    /// First words of the rows of cells; of the columns, row by row; each row's last column of
    /// positive value, as in [`PiecewiseConstant2d`](lightshed_sampling::PiecewiseConstant2d); and
    /// the bits of the texels, three to each, row by row.
    pub words: Vec<u32>,
}

/// A camera: rays as [`Camera::ray`](crate::Camera::ray) makes them. 96 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FlatCamera {
    /// Columns of the rotation, …
    pub x_axis: Vec3,
    /// Radius of the aperture; 0 for a pinhole.
    pub aperture_radius: f32,
    /// …
    pub y_axis: Vec3,
    /// Distance of the plane in focus.
    pub focus_distance: f32,
    /// …
    pub z_axis: Vec3,
    /// Distance at which rays start, along the axis.
    pub near_clip: f32,
    /// Where it is.
    pub position: Vec3,
    /// Distance at which rays end, along the axis.
    pub far_clip: f32,
    /// Local direction of the image's top left corner, at z = 1.
    pub corner: [f32; 2],
    /// Step of the local direction for one pixel.
    pub pixel: [f32; 2],
    /// Pixels of the image.
    pub size: [u32; 2],
    /// Nothing.
    pub padding: [u32; 2],
}

const _: () = assert!(size_of::<FlatEmitter>() == 64 && size_of::<FlatDelta>() == 64);
const _: () = assert!(size_of::<FlatCamera>() == 96);
