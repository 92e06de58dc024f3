//! Linear RGB.

/// Linear RGB with Rec. 709 primaries: radiance, reflectance or a throughput.
pub type Rgb = glam::Vec3;

/// Relative luminance `0.212671 R + 0.715160 G + 0.072169 B` of linear Rec. 709 RGB.
#[inline(always)]
pub fn luminance(rgb: Rgb) -> f32 {
    rgb.dot(Rgb::new(0.212_671, 0.715_160, 0.072_169))
}
