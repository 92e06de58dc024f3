//! Orientation of lights: cones of normals, and the angle around each normal within which light
//! leaves.

use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// Orientation of a light or of a group of lights (Conty Estevez and Kulla 2018, §4.1).
///
/// Every normal lies within `normals_angle` of `axis`, and light leaves only within
/// `emission_angle` of a normal: at an angle θ from its normal a light has at most `cos θ` of its
/// intensity (for θ beyond π/2, nothing). Angles in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientationCone {
    /// Unit axis.
    pub axis: Vec3,
    /// Half-angle θ_o of the cone of normals, in [0, π].
    pub normals_angle: f32,
    /// Angle θ_e around a normal within which light leaves, in [0, π].
    pub emission_angle: f32,
}

impl OrientationCone {
    /// Light leaves in all directions, everywhere with full intensity: a point light.
    pub const ALL: Self = Self {
        axis: Vec3::Z,
        normals_angle: PI,
        emission_angle: FRAC_PI_2,
    };

    /// A diffuse one-sided surface of unit `normal`: `cos θ` of the intensity at θ from it.
    pub fn diffuse(normal: Vec3) -> Self {
        Self {
            axis: normal,
            normals_angle: 0.0,
            emission_angle: FRAC_PI_2,
        }
    }

    /// Full intensity up to `angle` from the unit `axis` and nothing beyond: contains a spot light
    /// that is cut off there.
    pub fn spot(axis: Vec3, angle: f32) -> Self {
        Self {
            axis,
            normals_angle: angle,
            emission_angle: 0.0,
        }
    }

    /// A unit axis and angles within their ranges.
    #[inline]
    pub fn is_valid(&self) -> bool {
        // Without branches: trees check a million of them.
        let angle = |a: f32| (0.0..=PI).contains(&a);
        ((self.axis.length_squared() - 1.0).abs() < 1e-3)
            & angle(self.normals_angle)
            & angle(self.emission_angle)
    }

    /// A cone that contains both (Conty Estevez and Kulla 2018, algorithm 1), least up to rounding
    /// and never less.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        let (wide, narrow) = if self.normals_angle >= other.normals_angle {
            (self, other)
        } else {
            (other, self)
        };
        let emission_angle = wide.emission_angle.max(narrow.emission_angle);
        let between = angle_between(wide.axis, narrow.axis);
        if (between + narrow.normals_angle).min(PI) <= wide.normals_angle {
            return Self {
                emission_angle,
                ..*wide
            };
        }
        // Rounding outwards: axes and angles err by a few units in the last place.
        let normals_angle = 0.5 * (wide.normals_angle + between + narrow.normals_angle) + 1e-5;
        let rotation = normals_angle - wide.normals_angle;
        let axis = turned(wide.axis, narrow.axis, rotation);
        match axis {
            Some(axis) if normals_angle < PI => Self {
                axis,
                normals_angle,
                emission_angle,
            },
            _ => Self {
                normals_angle: PI,
                emission_angle,
                ..*wide
            },
        }
    }

    /// `1 − cos θ_o` plus what the emission adds around it: the measure M_Ω of directions
    /// (Conty Estevez and Kulla 2018, §4.4), from 0… for one direction to 4π for all.
    pub fn measure(&self) -> f32 {
        let (o, e) = (self.normals_angle, self.emission_angle);
        let w = (o + e).min(PI);
        2.0 * PI * (1.0 - o.cos())
            + FRAC_PI_2 * (2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos())
    }
}

/// The angle between unit vectors, accurate near 0 and π (Kahan).
pub(crate) fn angle_between(a: Vec3, b: Vec3) -> f32 {
    2.0 * (a - b).length().atan2((a + b).length())
}

/// `a` turned by `angle` towards `b`, across to any side for opposite vectors.
fn turned(a: Vec3, b: Vec3, angle: f32) -> Option<Vec3> {
    let a = a.try_normalize()?;
    let across = (b - a * a.dot(b)).normalize_or_zero();
    // Of nearly opposite vectors little but rounding is left, and much of that is along `a`.
    let across = across - a * a.dot(across);
    let across = if across.length_squared() > 0.5 {
        across.normalize()
    } else {
        a.any_orthonormal_vector()
    };
    (a * angle.cos() + across * angle.sin()).try_normalize()
}
