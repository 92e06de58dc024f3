//! How far boxes are visited beyond a hit.
//!
//! Where surfaces lie in one plane, a box on the floor say, a ray meets them at distances that are
//! equal but for rounding, and so is the distance at which it enters a flat box. If the box of a
//! surface that seems nearer were left out since it begins a little beyond a hit, the answer would
//! depend on which of them the tree visits first. So boxes count as beyond a hit only if they are
//! by more than the errors of both distances.

use glam::Vec3;

/// Errors of coordinates relative to the greatest coordinate of a scene. The distances at which a
/// triangle is hit and a box is entered are off by some units in the last place of it, divided by
/// the cosine between the ray and the plane's normal.
const RELATIVE: f32 = 8.0 * f32::EPSILON;

/// Rays at most so many times as flat to a plane of coordinates as to another are covered: those
/// along a plane would visit everything.
const FLATTEST: f32 = 1e4;

/// Errors of coordinates in a scene within this box.
pub fn uncertainty(min: Vec3, max: Vec3) -> f32 {
    min.abs().max(max.abs()).max_element() * RELATIVE
}

/// The error of a ray parameter where coordinates have errors of `uncertainty`. Of the inverse
/// coordinates of the direction, `least` is the one of the least magnitude.
#[inline(always)]
pub fn slack(uncertainty: f32, inverse_direction: [f32; 3], least: f32) -> f32 {
    let [x, y, z] = [
        inverse_direction[0].abs(),
        inverse_direction[1].abs(),
        inverse_direction[2].abs(),
    ];
    // One instruction each, which `f32::max` is not.
    let steeper = if x > y { x } else { y };
    let steepest = if z > steeper { z } else { steeper };
    let bound = least.abs() * FLATTEST;
    uncertainty * if steepest < bound { steepest } else { bound }
}
