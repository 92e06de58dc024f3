//! Noise for procedural densities.

use glam::{IVec3, Vec3};

/// Uniform numbers in [0, 1) at the points of a lattice: the finaliser of MurmurHash3 over their
/// mixed coordinates.
fn lattice(p: IVec3) -> f32 {
    let mut h = (p.x as u32)
        .wrapping_mul(0x8da6_b343)
        .wrapping_add((p.y as u32).wrapping_mul(0xd816_3841))
        .wrapping_add((p.z as u32).wrapping_mul(0xcb1a_b31f));
    h = (h ^ h >> 16).wrapping_mul(0x85eb_ca6b);
    h = (h ^ h >> 13).wrapping_mul(0xc2b2_ae35);
    (h ^ h >> 16) as f32 * (1.0 / 4_294_967_296.0)
}

/// Smooth in between, in [0, 1].
fn noise(p: Vec3) -> f32 {
    let base = p.floor();
    let f = p - base;
    let f = f * f * (Vec3::splat(3.0) - 2.0 * f);
    let base = base.as_ivec3();
    let corner = |x, y, z| lattice(base + IVec3::new(x, y, z));
    let along = |y, z| corner(0, y, z) + f.x * (corner(1, y, z) - corner(0, y, z));
    let across = |z| along(0, z) + f.y * (along(1, z) - along(0, z));
    across(0) + f.z * (across(1) - across(0))
}

/// `octaves` of noise, each half as strong and twice as fine; in [0, 1], around ½.
pub fn fractal(p: Vec3, octaves: u32) -> f32 {
    let (mut sum, mut total, mut p) = (0.0, 0.0, p);
    for octave in 0..octaves {
        let weight = 0.5f32.powi(octave as i32);
        sum += weight * noise(p);
        total += weight;
        // No multiple of the lattice, so that octaves do not line up.
        p = p * 2.03 + Vec3::new(17.1, 5.3, 11.7);
    }
    sum / total
}

/// 0 up to `low`, 1 from `high` on, smooth in between.
pub fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
