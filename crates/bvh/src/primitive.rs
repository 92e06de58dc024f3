//! What trees are built over.

use glam::Vec3;
use lightshed_spatial::Bounds;

/// Most primitives of one tree.
pub const MAX_PRIMITIVES: usize = 1 << 29;

/// Anything with a box.
pub trait Primitive: Sync {
    /// The box around it. Non-finite if the primitive is: the build then names it as its error.
    fn bounds(&self) -> Bounds;
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
        let [a, b, c] = *self;
        // Zero, or NaN where a coordinate is not finite: `min` and `max` lose NaNs.
        let finite = a * 0.0 + b * 0.0 + c * 0.0;
        Bounds::new(a.min(b).min(c) + finite, a.max(b).max(c) + finite)
    }
}

impl<T: Primitive + ?Sized> Primitive for &T {
    #[inline(always)]
    fn bounds(&self) -> Bounds {
        (**self).bounds()
    }
}
