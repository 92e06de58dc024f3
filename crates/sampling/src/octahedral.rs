//! The octahedral map: directions as points of the unit square.
//!
//! A direction `d` is projected onto the octahedron `|x| + |y| + |z| = 1`, `q = d / ‖d‖₁`,
//! whose upper half is dropped onto the square's inner diamond and whose lower half is folded out
//! into the four corners; `uv = (xy + 1) / 2`:
//!
//! ```text
//! xy = (q_x, q_y)                                          if q_z ≥ 0
//! xy = ((1 − |q_y|) sign q_x, (1 − |q_x|) sign q_y)        if q_z < 0,  sign 0 = 1
//! ```
//!
//! Cigolle et al. 2014, *A Survey of Efficient Representations for Independent Unit Vectors*, §3.
//!
//! # Density
//!
//! With `p_uv` a density with respect to area on the unit square (measure [`PrimarySample`]) and
//! `p_ω` one with respect to solid angle, `p_ω = ¼ p_uv ‖q‖₂³`: a face of the octahedron
//! projects without scale onto 4 of the square's area, and a face of distance 1/√3 from the
//! centre whose normal makes the angle `θ` with `d` is seen under
//! `dω = dA cos θ / ‖q‖₂²`.

use glam::{Vec2, Vec3};

use crate::measure::{Density, PrimarySample, SolidAngle};

/// `a`, or `−a` where `x` is negative; both zeros are not.
#[inline(always)]
fn signed(a: f32, x: f32) -> f32 {
    f32::from_bits(a.to_bits() ^ u32::from(x < 0.0) << 31)
}

/// Folds the lower half outward, and back, where `is_lower`. No branch: nothing foretells in which
/// half a direction is.
#[inline(always)]
fn fold(xy: Vec2, is_lower: bool) -> Vec2 {
    let folded = [signed(1.0 - xy.y.abs(), xy.x), signed(1.0 - xy.x.abs(), xy.y)];
    let mask = u32::from(is_lower).wrapping_neg();
    let select = |a: f32, b: f32| f32::from_bits(a.to_bits() ^ (a.to_bits() ^ b.to_bits()) & mask);
    Vec2::new(select(xy.x, folded[0]), select(xy.y, folded[1]))
}

/// Direction → [−1, 1]².
#[inline(always)]
fn project(direction: Vec3) -> Vec2 {
    let norm = direction.x.abs() + direction.y.abs() + direction.z.abs();
    if !(norm > 0.0) {
        return Vec2::ZERO;
    }
    // The quotients may exceed 1 by rounding.
    let xy = (direction.truncate() / norm).clamp(Vec2::NEG_ONE, Vec2::ONE);
    fold(xy, direction.z < 0.0)
}

/// [−1, 1]² → the octahedron.
#[inline(always)]
fn lift(xy: Vec2) -> Vec3 {
    let z = 1.0 - xy.x.abs() - xy.y.abs();
    fold(xy, z < 0.0).extend(z)
}

/// The point of the unit square [0, 1]² for a direction.
///
/// `direction` need not be a unit vector, but `|x| + |y| + |z|` must not overflow. A zero or NaN
/// vector goes to the square's centre, as +z does.
///
/// # Precision
///
/// [`octahedral_decode`] of the result lies within 6·10⁻⁷ radians of the direction.
#[inline]
pub fn octahedral_encode(direction: Vec3) -> Vec2 {
    project(direction) * 0.5 + 0.5
}

/// The unit direction for a point of the unit square; points outside count to the nearest inside.
#[inline]
pub fn octahedral_decode(uv: Vec2) -> Vec3 {
    lift(uv.clamp(Vec2::ZERO, Vec2::ONE) * 2.0 - 1.0).normalize()
}

/// `dω/duv = 4 / ‖q‖₂³`, from 4 at the octahedron's corners to `12√3` at the centres of
/// its faces.
#[inline(always)]
fn solid_angle_per_area(direction: Vec3) -> f32 {
    let norm = direction.x.abs() + direction.y.abs() + direction.z.abs();
    let q = (direction / norm).length();
    4.0 / (q * q * q)
}

/// Density over directions of a density `p_uv` over the unit square: `p_ω = ¼ p_uv ‖q‖₂³`
/// at `direction`, which must not be zero.
#[inline]
pub fn octahedral_to_solid_angle(p_uv: Density<PrimarySample>, direction: Vec3) -> Density<SolidAngle> {
    Density::new(p_uv.value() / solid_angle_per_area(direction))
}

/// Density over the unit square of a density `p_ω` over directions: `p_uv = 4 p_ω / ‖q‖₂³`
/// at `direction`, which must not be zero.
#[inline]
pub fn octahedral_from_solid_angle(p_omega: Density<SolidAngle>, direction: Vec3) -> Density<PrimarySample> {
    Density::new(p_omega.value() * solid_angle_per_area(direction))
}

/// `v` in [−1, 1] to a signed integer of `scale` steps a side, as WGSL's `pack2x16snorm` and
/// `pack4x8snorm` round.
#[inline(always)]
fn quantise(v: f32, scale: f32) -> i32 {
    (0.5 + scale * v).floor() as i32
}

/// A direction in 32 bits, "oct32": two signed normalised 16-bit numbers, x in the low half. The
/// bits of `pack2x16snorm(xy)` in WGSL.
///
/// The six axes are exact; the error is below 6.5·10⁻⁵ radians everywhere.
#[inline]
pub fn octahedral_pack32(direction: Vec3) -> u32 {
    let xy = project(direction);
    let [x, y] = [xy.x, xy.y].map(|v| quantise(v, 32767.0) as u32 & 0xffff);
    x | y << 16
}

/// The unit direction of [`octahedral_pack32`]'s bits; every bit pattern is one.
#[inline]
pub fn octahedral_unpack32(bits: u32) -> Vec3 {
    let [x, y] = [bits as u16, (bits >> 16) as u16].map(|half| (f32::from(half as i16) / 32767.0).max(-1.0));
    lift(Vec2::new(x, y)).normalize()
}

/// A direction in 16 bits, "oct16": two signed normalised 8-bit numbers, x in the low half. The low
/// half of `pack4x8snorm(vec4(xy, 0, 0))` in WGSL.
///
/// The six axes are exact; the error is below 1.7·10⁻² radians everywhere.
#[inline]
pub fn octahedral_pack16(direction: Vec3) -> u16 {
    let xy = project(direction);
    let [x, y] = [xy.x, xy.y].map(|v| quantise(v, 127.0) as u16 & 0xff);
    x | y << 8
}

/// The unit direction of [`octahedral_pack16`]'s bits; every bit pattern is one.
#[inline]
pub fn octahedral_unpack16(bits: u16) -> Vec3 {
    let [x, y] = bits
        .to_le_bytes()
        .map(|byte| (f32::from(byte as i8) / 127.0).max(-1.0));
    lift(Vec2::new(x, y)).normalize()
}
