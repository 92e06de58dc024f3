//! What trees are built over.

use glam::{Vec3, Vec4, Vec4Swizzles};
use lightshed_spatial::Bounds;

/// Most primitives of one tree.
pub const MAX_PRIMITIVES: usize = 1 << 29;

/// Anything with a box.
pub trait Primitive: Sync {
    /// The box around it. Non-finite if the primitive is: the build then names it as its error.
    fn bounds(&self) -> Bounds;

    /// Least and greatest corner of [`Self::bounds`] as builders take them: in four lanes, of which
    /// the last means nothing.
    #[inline(always)]
    fn corners(&self) -> [Vec4; 2] {
        let Bounds { min, max } = self.bounds();
        [min.extend(0.0), max.extend(0.0)]
    }
}

impl Primitive for Bounds {
    #[inline(always)]
    fn bounds(&self) -> Bounds {
        *self
    }
}

/// The corners of a triangle.
impl Primitive for [Vec3; 3] {
    #[inline(always)]
    fn bounds(&self) -> Bounds {
        let [min, max] = self.corners();
        Bounds::new(min.xyz(), max.xyz())
    }

    #[inline(always)]
    fn corners(&self) -> [Vec4; 2] {
        // Four of the nine coordinates at a time: one load each.
        let numbers: &[f32; 9] = bytemuck::cast_ref(self);
        let four = |from: usize| Vec4::from_slice(&numbers[from..from + 4]);
        let (a, b, c) = (four(0), four(3), four(5).yzwx());
        // Zero, or NaN where a coordinate is not finite: `min` and `max` lose NaNs.
        let finite = a * 0.0 + b * 0.0 + c * 0.0;
        [a.min(b).min(c) + finite, a.max(b).max(c) + finite]
    }
}

impl<T: Primitive + ?Sized> Primitive for &T {
    #[inline(always)]
    fn bounds(&self) -> Bounds {
        (**self).bounds()
    }

    #[inline(always)]
    fn corners(&self) -> [Vec4; 2] {
        (**self).corners()
    }
}
