//! Directions towards a rectangle, uniform by solid angle.
//!
//! `p_ω = 1/Ω` for directions that meet the rectangle seen from the origin, an area-preserving
//! map of the square as in Ureña, Fajardo and King 2013 (*An Area-Preserving Parametrization for
//! Spherical Rectangles*). In a frame along the edges the rectangle is
//! `[x₀, x₁] × [y₀, y₁]` in the plane `z = −h`, and the part to the left of `x` has
//! solid angle `G(x) − G(x₀)` with
//!
//! `G(x) = A₁ − A₀`, `tan Aᵢ = x yᵢ / (h √(x² + yᵢ² + h²))`.
//!
//! Let `c = x/√(x² + h²)` and `βᵢ = yᵢ/√(yᵢ² + h²)`. Then `sin Aᵢ = c βᵢ`, and
//! the addition theorem solves `G(x) = φ` for
//!
//! `c = sin φ / √((β₁ − β₀)² + 4 β₀ β₁ sin²(φ/2))`.
//!
//! Here `φ = G(x₀) + u₀Ω`. Over a given `x`, `y/√(x² + h² + y²)` is uniform, and `u₁`
//! fixes `y` by it. Inside it computes in `f64`.

use super::clamp_or_low;
use crate::{Density, ONE_MINUS_EPSILON, SolidAngle};
use glam::{DVec3, Vec3};

/// Below this solid angle `f32` directions resolve too little of the rectangle.
const MIN_SOLID_ANGLE: f64 = 1e-9;

/// Above this the origin lies in the rectangle.
const MAX_SOLID_ANGLE: f64 = 6.25;

/// Tolerance of right angles (the cosine between edges).
const MAX_COSINE: f64 = 1e-5;

/// Uniform directions towards a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalRectangle {
    /// Unit vectors along the edges, and away from the rectangle.
    axes: [DVec3; 3],
    x: [f64; 2],
    y: [f64; 2],
    /// Distance of the plane, positive.
    h: f64,
    /// `β₀` and `β₁`.
    beta: [f64; 2],
    /// `G(x₀)`.
    start: f64,
    solid_angle: f64,
}

/// A direction towards a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SphericalRectangleSample {
    /// Unit direction from the origin.
    pub direction: Vec3,
    /// Position in units of the edges, in [0, 1]²: the point in that direction is
    /// `corner + s₀ edge₀ + s₁ edge₁`.
    pub position: [f32; 2],
}

impl SphericalRectangle {
    /// The rectangle `corner + [0, 1] edge₀ + [0, 1] edge₁`, relative to the point it is seen
    /// from.
    ///
    /// `None` if sampling by solid angle is ill-defined or not worthwhile; the caller then samples
    /// the area. Cases: edges that are not at right angles (to 10⁻⁵), solid angles below
    /// 10⁻⁹ or above 6.25 sr, degenerate rectangles, vectors that are not finite.
    pub fn new(corner: Vec3, edges: [Vec3; 2]) -> Option<Self> {
        let corner = corner.as_dvec3();
        let [e, f] = edges.map(Vec3::as_dvec3);
        let (x_axis, along) = (e.try_normalize()?, f.try_normalize()?);
        if !(x_axis.dot(along).abs() <= MAX_COSINE) {
            return None;
        }
        let y_axis = (along - x_axis * x_axis.dot(along)).try_normalize()?;
        let mut z_axis = x_axis.cross(y_axis);
        let mut h = -corner.dot(z_axis);
        if h < 0.0 {
            (z_axis, h) = (-z_axis, -h);
        }
        let (x0, y0) = (corner.dot(x_axis), corner.dot(y_axis));
        let (x, y) = ([x0, x0 + e.length()], [y0, y0 + f.length()]);
        let start = strip(x[0], y, h);
        let solid_angle = strip(x[1], y, h) - start;
        if !(h > 0.0 && (MIN_SOLID_ANGLE..MAX_SOLID_ANGLE).contains(&solid_angle)) {
            return None;
        }
        Some(Self {
            axes: [x_axis, y_axis, z_axis],
            x,
            y,
            h,
            beta: y.map(|y| y / length(y, h)),
            start,
            solid_angle,
        })
    }

    /// The rectangle's solid angle `Ω` in steradians.
    #[inline(always)]
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle as f32
    }

    /// Density of [`SphericalRectangle::sample`] per solid angle, `1/Ω`, of every direction that
    /// meets the rectangle.
    #[inline(always)]
    pub fn density(&self) -> Density<SolidAngle> {
        Density::new((1.0 / self.solid_angle) as f32)
    }

    /// Maps `u` in [0, 1)² to a direction towards the rectangle.
    pub fn sample(&self, u: [f32; 2]) -> SphericalRectangleSample {
        let [u0, u1] = u.map(f64::from);
        let [b0, b1] = self.beta;
        let (sin_half, cos_half) = (0.5 * (self.start + u0 * self.solid_angle)).sin_cos();
        let numerator = 2.0 * sin_half * cos_half;
        let denominator_squared = (b1 - b0) * (b1 - b0) + 4.0 * b0 * b1 * sin_half * sin_half;
        // x = h c/√(1 − c²), with both under one root.
        let rest = (denominator_squared - numerator * numerator).max(f64::MIN_POSITIVE);
        let x = (self.h * numerator / rest.sqrt()).clamp(self.x[0], self.x[1]);

        let distance = length(x, self.h);
        let [eta0, eta1] = self.y.map(|y| y / length(distance, y));
        let eta = eta0 + u1 * (eta1 - eta0);
        let y = distance * eta / ((1.0 - eta) * (1.0 + eta)).max(f64::MIN_POSITIVE).sqrt();
        let y = y.clamp(self.y[0], self.y[1]);

        let [x_axis, y_axis, z_axis] = self.axes;
        let point = x_axis * x + y_axis * y - z_axis * self.h;
        SphericalRectangleSample {
            direction: (point / point.length()).as_vec3(),
            position: [
                ((x - self.x[0]) / (self.x[1] - self.x[0])) as f32,
                ((y - self.y[0]) / (self.y[1] - self.y[0])) as f32,
            ],
        }
    }

    /// The `u` that [`SphericalRectangle::sample`] maps to a direction that hits the rectangle. It
    /// is clamped to the square for a direction that misses, and [0, 0] for one that points away
    /// from the plane. The error comes from the rounding of the direction: about 10⁻⁷ over the
    /// rectangle's angular size.
    pub fn invert(&self, direction: Vec3) -> [f32; 2] {
        let direction = direction.as_dvec3();
        let [along_x, along_y, along_z] = self.axes.map(|axis| axis.dot(direction));
        if !(along_z < 0.0) {
            return [0.0, 0.0];
        }
        let scale = -self.h / along_z;
        let (x, y) = (scale * along_x, scale * along_y);
        let x = x.clamp(self.x[0], self.x[1]);
        let u0 = (strip(x, self.y, self.h) - self.start) / self.solid_angle;
        let distance = length(x, self.h);
        let [eta0, eta1, eta] = [self.y[0], self.y[1], y].map(|y| y / length(distance, y));
        let u1 = (eta - eta0) / (eta1 - eta0);
        [u0, u1].map(|x| clamp_or_low(x as f32, 0.0, ONE_MINUS_EPSILON))
    }
}

/// `√(a² + b²)`. Overflow and underflow of the squares do not matter: these are lengths that
/// fit in `f32`.
#[inline(always)]
fn length(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}

/// `G(x)`: the signed solid angle over `[0, x] × [y₀, y₁]` at distance `h`.
fn strip(x: f64, y: [f64; 2], h: f64) -> f64 {
    let [a0, a1] = y.map(|y| (x * y).atan2(h * (x * x + y * y + h * h).sqrt()));
    a1 - a0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::properties::{Case, Chart, assert_frozen, verify};
    use crate::warp::solid_angle::triangle_solid_angle;
    use lightshed_testkit::{hostile_f32, hostile_unit_f32};

    fn case(name: &str, corner: Vec3, edges: [Vec3; 2]) -> Case {
        let rectangle = SphericalRectangle::new(corner, edges).unwrap();
        Case::directions(
            name,
            Chart::parallelogram(corner, edges[0], edges[1]).projected(corner, edges[0].cross(edges[1])),
            move |u| rectangle.sample(u).direction,
            move |_| rectangle.density().value(),
            move |d| Some(rectangle.invert(d)),
        )
    }

    #[test]
    fn properties_hold() {
        let edges = [Vec3::X * 2.0, Vec3::Y];
        verify(&case("straddling", Vec3::new(-0.5, -0.3, -1.0), edges).tolerances(1e-5, 1e-3, 3e-6));
        verify(&case("aside", Vec3::new(0.5, 0.3, 1.0), edges).tolerances(1e-5, 1e-3, 3e-6));
        verify(&case("far aside", Vec3::new(-6.0, -8.0, 0.7), edges).tolerances(1e-5, 5e-3, 1e-4));
        verify(&case("close", Vec3::new(-0.5, -0.3, 0.05), edges).tolerances(1e-4, 3e-3, 1e-5));
        let tilted = [Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.8, 0.6, 0.0) * 0.3];
        verify(&case("tilted", Vec3::new(1.0, -1.0, 2.0), tilted).tolerances(1e-5, 2e-3, 1e-5));
        let small = [Vec3::X * 0.1, Vec3::new(0.0, 0.06, 0.08)];
        verify(&case("small", Vec3::new(1.0, 3.0, 10.0), small).tolerances(1e-5, 1e-2, 1e-3));
    }

    #[test]
    fn the_solid_angle_is_that_of_two_triangles() {
        for scale in [1.0f32, 0.1, 1e-3] {
            let (corner, e, f) = (Vec3::new(0.3, -0.2, 1.5), Vec3::X * scale, Vec3::Y * scale * 0.5);
            let rectangle = SphericalRectangle::new(corner, [e, f]).unwrap();
            let (b, c, d) = (corner + e, corner + e + f, corner + f);
            let expected = triangle_solid_angle(corner, b, c) + triangle_solid_angle(corner, c, d);
            assert!((rectangle.solid_angle() / expected - 1.0).abs() < 1e-4, "{scale}");
        }
    }

    #[test]
    fn the_position_names_the_point_in_the_direction() {
        let (corner, edges) = (Vec3::new(-0.5, -0.3, 0.2), [Vec3::X * 2.0, Vec3::Y]);
        let rectangle = SphericalRectangle::new(corner, edges).unwrap();
        for u in hostile_unit_f32().flat_map(|a| hostile_unit_f32().map(move |b| [a, b])) {
            let sample = rectangle.sample(u);
            assert!(sample.position.iter().all(|x| (0.0..=1.0).contains(x)));
            let point = corner + edges[0] * sample.position[0] + edges[1] * sample.position[1];
            assert!((point.normalize() - sample.direction).length() < 4e-7, "{u:?}");
        }
    }

    #[test]
    fn degenerate_rectangles_are_refused() {
        for (corner, edges) in [
            (Vec3::Z, [Vec3::X, Vec3::X]),
            (Vec3::Z, [Vec3::X, Vec3::ZERO]),
            (Vec3::Z, [Vec3::X, Vec3::new(0.01, 1.0, 0.0)]),
            (Vec3::new(1.0, 1.0, 0.0), [Vec3::X, Vec3::Y]),
            (Vec3::new(-0.5, -0.5, 0.0), [Vec3::X, Vec3::Y]),
            (Vec3::NAN, [Vec3::X, Vec3::Y]),
            (Vec3::Z * 1e10, [Vec3::X, Vec3::Y]),
        ] {
            assert!(
                SphericalRectangle::new(corner, edges).is_none(),
                "{corner} {edges:?}"
            );
        }
    }

    #[test]
    fn whatever_is_accepted_gives_unit_directions() {
        let u = [
            [0.0, 0.0],
            [0.5, 0.5],
            [ONE_MINUS_EPSILON; 2],
            [0.0, ONE_MINUS_EPSILON],
        ];
        let mut accepted = 0;
        for x in hostile_f32() {
            for y in hostile_f32() {
                for (corner, edges) in [
                    (Vec3::new(x, y, 1.0), [Vec3::X, Vec3::Y]),
                    (Vec3::new(-0.5, -0.5, x), [Vec3::X * y, Vec3::Y]),
                    (Vec3::new(-1.0, -1.0, -1.0), [Vec3::X * x, Vec3::Z * y]),
                ] {
                    let Some(rectangle) = SphericalRectangle::new(corner, edges) else {
                        continue;
                    };
                    accepted += 1;
                    for sample in u.map(|u| rectangle.sample(u)) {
                        assert!(
                            (sample.direction.length() - 1.0).abs() < 1e-6,
                            "{corner} {edges:?} {sample:?}"
                        );
                        assert!(
                            sample.position.iter().all(|s| (0.0..=1.0).contains(s)),
                            "{corner} {edges:?}"
                        );
                        let back = rectangle.invert(sample.direction);
                        assert!(
                            back.iter().all(|x| (0.0..1.0).contains(x)),
                            "{corner} {edges:?} {back:?}"
                        );
                    }
                }
            }
        }
        assert!(accepted > 500, "{accepted}");
    }

    #[test]
    fn values_are_stable() {
        let rectangle =
            SphericalRectangle::new(Vec3::new(-0.5, -0.3, 1.0), [Vec3::X * 2.0, Vec3::Y]).unwrap();
        assert_frozen(
            |u| rectangle.sample(u).direction,
            [
                Vec3::new(-0.3168426, -0.108235955, 0.9422822),
                Vec3::new(0.190176, 0.35354885, 0.9158801),
                Vec3::new(0.649848, -0.014705454, 0.7599219),
            ],
        );
    }
}
