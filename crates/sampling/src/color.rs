//! Linear RGB.

/// Linear RGB with Rec. 709 primaries: radiance, reflectance or a throughput.
pub type Rgb = glam::Vec3;

/// Weights of linear Rec. 709 red, green and blue in [`luminance`]: the second row of the matrix
/// from RGB to CIE XYZ (Pharr, Jakob and Humphreys 2016, *Physically Based Rendering*, §5.2.2).
/// They add up to 1. All crates and shaders of this project take these; the rounded 0.2126, 0.7152,
/// 0.0722 of ITU-R BT.709 differ in the fourth digit.
pub const LUMINANCE: Rgb = Rgb::new(0.212_671, 0.715_160, 0.072_169);

/// Relative luminance `Y = 0.212671 R + 0.715160 G + 0.072169 B` of linear Rec. 709 RGB, in the
/// unit of `rgb`. Target functions and the selection of emitters weight colours by it.
#[inline(always)]
pub fn luminance(rgb: Rgb) -> f32 {
    rgb.dot(LUMINANCE)
}
