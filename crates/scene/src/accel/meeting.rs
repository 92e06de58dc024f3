//! Where rays meet triangles, from what they see of the corners: the end of every watertight test.

use lightshed_lanes::AnyLanes;

/// A triangle and some rays, or some triangles and a ray.
#[derive(Clone, Copy)]
pub struct Meeting<L: AnyLanes> {
    /// Ray parameters of the hits.
    pub t: L,
    /// Weights of the first and second vertex.
    pub weights: [L; 2],
    /// Which are hit beyond 0.
    pub hit: L::Mask,
}

impl<L: AnyLanes> Meeting<L> {
    /// From the signed areas opposite the corners, the corners' coordinates along the rays, and
    /// `1 / d[kz]`, as [`crate::accel::triangle`] says.
    #[inline(always)]
    pub fn new(areas: [L; 3], z: [L; 3], inverse_z: L) -> Self {
        Self::of_one_sign(one_sign(areas), areas, z, inverse_z)
    }

    /// The same where it is known which of the areas have one sign.
    #[inline(always)]
    pub fn of_one_sign(
        one_sign: L::Mask,
        [area_a, area_b, area_c]: [L; 3],
        [z_a, z_b, z_c]: [L; 3],
        inverse_z: L,
    ) -> Self {
        // A determinant of zero (a triangle seen edge-on, or without area) gives NaN or ∞ below,
        // which no comparison passes.
        let inverse_determinant = L::splat(1.0) / (area_a + (area_b + area_c));
        let z = area_a * z_a + (area_b * z_b + area_c * z_c);
        let t = z * inverse_z * inverse_determinant;
        Self {
            t,
            weights: [area_a * inverse_determinant, area_b * inverse_determinant],
            hit: one_sign & L::splat(0.0).less(t),
        }
    }

    /// The same with hits before `t_max` alone.
    #[inline(always)]
    pub fn before(self, t_max: L) -> Self {
        Self {
            hit: self.hit & self.t.less(t_max),
            ..self
        }
    }
}

/// Where the areas have one sign; zero has both.
#[inline(always)]
pub fn one_sign<L: AnyLanes>([a, b, c]: [L; 3]) -> L::Mask {
    let zero = L::splat(0.0);
    zero.less_equal(a.min(b.min(c))) | a.max(b.max(c)).less_equal(zero)
}
