//! The tent filter: `p(x) = 1 − |x|` on [−1, 1], the sum of two uniforms.

use crate::{Area, Density, ONE_MINUS_EPSILON};
use glam::Vec2;

/// Offsets with the density `(1 − |x|)(1 − |y|)` of a bilinear (tent) reconstruction filter of
/// radius one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tent;

impl Tent {
    /// Maps `u` in [0, 1)² to an offset in (−1, 1)².
    #[inline(always)]
    pub fn sample(u: [f32; 2]) -> Vec2 {
        Vec2::new(tent(u[0]), tent(u[1]))
    }

    /// Density of [`Tent::sample`] per unit area; 0 outside [−1, 1]².
    #[inline(always)]
    pub fn density(offset: Vec2) -> Density<Area> {
        Density::new((1.0 - offset.x.abs()).max(0.0) * (1.0 - offset.y.abs()).max(0.0))
    }

    /// The `u` that [`Tent::sample`] maps to `offset`, within 2·10⁻⁷ in each coordinate;
    /// offsets outside are moved to the border.
    #[inline]
    pub fn invert(offset: Vec2) -> [f32; 2] {
        [offset.x, offset.y].map(|x| {
            let distance = 1.0 - x.abs().min(1.0);
            let tail = 0.5 * distance * distance;
            (if x < 0.0 { tail } else { 1.0 - tail }).min(ONE_MINUS_EPSILON)
        })
    }
}

#[inline(always)]
fn tent(u: f32) -> f32 {
    // Below one cell of u the middle of the cell is taken, so that no sample has density zero.
    let tail = u.min(1.0 - u).max(0.25 * f32::EPSILON);
    (1.0 - (2.0 * tail).sqrt()).copysign(u - 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::properties::{Case, Chart, assert_frozen, verify};
    use glam::Vec3;

    #[test]
    fn properties_hold() {
        verify(&Case::plane(
            "tent",
            Chart::rectangle([-1.0, -1.0], [1.0, 1.0]),
            Tent::sample,
            |p| Tent::density(p).value(),
            |p| Some(Tent::invert(p)),
        ));
    }

    #[test]
    fn outside_the_density_is_zero() {
        assert_eq!(Tent::density(Vec2::new(1.5, 0.0)), Density::ZERO);
        assert_eq!(Tent::invert(Vec2::new(-3.0, 3.0)), [0.0, ONE_MINUS_EPSILON]);
        assert_eq!(Tent::sample([0.5, 0.5]), Vec2::ZERO);
    }

    #[test]
    fn values_are_stable() {
        assert_frozen(
            |u| Tent::sample(u).extend(0.0),
            [
                Vec3::new(-0.5527864, -0.36754447, 0.0),
                Vec3::new(0.0, 0.29289323, 0.0),
                Vec3::new(0.45227748, -0.22540331, 0.0),
            ],
        );
    }
}
