//! Directions towards a triangle, uniform by solid angle.
//!
//! `p_ω = 1/Ω` for directions that meet the flat triangle `A B C` seen from the origin. As in
//! Arvo 1995 (*Stratified Sampling of Spherical Triangles*) the share `u₀` of the solid angle
//! fixes a point `C'` on the arc `A C` such that `A B C'` has solid angle `u₀Ω`, and
//! `1 − cos θ = u₁ (1 − B·C')` a point on the arc `B C'`. But `C'` is found without any
//! interior angle, whose excess over π cancels for small triangles: let `C' = A cos b + T sin b`
//! with `T` the tangent at `A` towards `C`. Then the formula of Van Oosterom and Strackee for
//! `A B C'` reads, with `h = tan(b/2)` and `t = tan(u₀Ω/2)`,
//!
//! `t = h A·(B×T) / (1 + A·B + h B·T)`, so that `h = t (1 + A·B) / (A·(B×T) − t B·T)`.
//!
//! Inside it computes in `f64`: the arcs of a triangle that spans 10⁻⁵ radians are differences
//! of 10⁻¹⁰.

use super::clamp_or_low;
use super::solid_angle::solid_angle;
use crate::{Density, ONE_MINUS_EPSILON, SolidAngle};
use glam::{DVec3, Vec3};

/// Below this solid angle (an edge of about 10⁻⁴ radians) `f32` directions resolve too little
/// of the triangle.
const MIN_SOLID_ANGLE: f64 = 1e-9;

/// Above this the origin lies so close to the triangle's plane that the arcs between its vertices
/// are not defined.
const MAX_SOLID_ANGLE: f64 = 6.25;

/// Uniform directions towards a triangle.
///
/// ```
/// use lightshed_sampling::{SphericalTriangle, UniformTriangle, glam::Vec3};
///
/// // An emitting triangle as seen from `point`; by its area where it is too small or too close.
/// let vertices = [Vec3::new(0.0, 0.0, 2.0), Vec3::new(1.0, 0.0, 2.0), Vec3::new(0.0, 1.0, 2.0)];
/// let (point, u) = (Vec3::new(0.5, 0.1, 0.0), [0.25, 0.5]);
/// let (barycentric, density) = match SphericalTriangle::new(vertices.map(|v| v - point)) {
///     Some(triangle) => (triangle.sample(u).barycentric, triangle.density()),
///     None => {
///         let barycentric = UniformTriangle::sample(u);
///         let [a, b, c] = vertices;
///         let to = a * barycentric[0] + b * barycentric[1] + c * barycentric[2] - point;
///         let scaled_normal = (b - a).cross(c - a);
///         let cos_theta = scaled_normal.normalize().dot(to.normalize());
///         let by_area = UniformTriangle::density(0.5 * scaled_normal.length());
///         (barycentric, by_area.to_solid_angle(to.length_squared(), cos_theta))
///     }
/// };
/// assert!(density.is_positive() && barycentric.iter().all(|b| *b >= 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalTriangle {
    /// First vertex and the edges to the others, unnormalised, oriented such that `A·(B×C) > 0`.
    corner: DVec3,
    edges: [DVec3; 2],
    /// `A` and `B` on the unit sphere, and the tangent `T`.
    a: DVec3,
    b: DVec3,
    tangent: DVec3,
    /// `A·(B×T)`, `B·T`, `1 + A·B`.
    coefficients: [f64; 3],
    solid_angle: f64,
    /// Whether `B` and `C` were exchanged.
    flipped: bool,
}

/// A direction towards a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SphericalTriangleSample {
    /// Unit direction from the origin.
    pub direction: Vec3,
    /// Barycentric coordinates of the point of the triangle in that direction, in the order of the
    /// vertices: none is negative, their sum is one up to rounding. No intersection test is needed
    /// to find the point.
    pub barycentric: [f32; 3],
}

impl SphericalTriangle {
    /// The triangle with these vertices relative to the point it is seen from.
    ///
    /// `None` if sampling by solid angle is ill-defined or not worthwhile; the caller then samples
    /// the area. Cases: solid angles below 10⁻⁹ or above 6.25 sr, degenerate triangles,
    /// vertices at the origin or not finite.
    pub fn new(vertices: [Vec3; 3]) -> Option<Self> {
        let [a, mut b, mut c] = vertices.map(Vec3::as_dvec3);
        let omega = solid_angle([a, b, c]);
        if !(MIN_SOLID_ANGLE..MAX_SOLID_ANGLE).contains(&omega) {
            return None;
        }
        let flipped = a.dot((b - a).cross(c - a)) < 0.0;
        if flipped {
            (b, c) = (c, b);
        }
        let edges = [b - a, c - a];
        let (unit_a, unit_b) = (a.try_normalize()?, b.try_normalize()?);
        let tangent = (edges[1] - unit_a * unit_a.dot(edges[1])).try_normalize()?;
        // A·(B×T) from the edge, as the difference of near-equal vectors.
        let across = unit_b - unit_a;
        let sine = unit_a.dot(across.cross(tangent));
        // 1 + A·B = 2 − ½‖A − B‖² is ½‖A + B‖², which does not cancel for opposite
        // ones.
        let one_plus_cos = 0.5 * (unit_a + unit_b).length_squared();
        if !(sine > 0.0 && one_plus_cos > 0.0) {
            return None;
        }
        Some(Self {
            corner: a,
            edges,
            a: unit_a,
            b: unit_b,
            tangent,
            coefficients: [sine, across.dot(tangent), one_plus_cos],
            solid_angle: omega,
            flipped,
        })
    }

    /// The triangle's solid angle `Ω` in steradians.
    #[inline(always)]
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle as f32
    }

    /// Density of [`SphericalTriangle::sample`] per solid angle, `1/Ω`, of every direction that
    /// meets the triangle.
    #[inline(always)]
    pub fn density(&self) -> Density<SolidAngle> {
        Density::new((1.0 / self.solid_angle) as f32)
    }

    /// Maps `u` in [0, 1)² to a direction towards the triangle.
    pub fn sample(&self, u: [f32; 2]) -> SphericalTriangleSample {
        let [u0, u1] = u.map(f64::from);
        let [sine, b_dot_t, one_plus_cos] = self.coefficients;
        // h = numerator / denominator = tan(b/2); held as sine and cosine since it may be infinite.
        let (sin_area, cos_area) = (0.5 * u0 * self.solid_angle).sin_cos();
        let numerator = sin_area * one_plus_cos;
        let denominator = cos_area * sine - sin_area * b_dot_t;
        let length = (numerator * numerator + denominator * denominator).sqrt();
        let (sin_half_arc, cos_half_arc) = (numerator / length, denominator / length);
        // C' − A = −2 sin²(b/2) A + sin b T.
        let from_a = self.a * (-2.0 * sin_half_arc * sin_half_arc)
            + self.tangent * (2.0 * sin_half_arc * cos_half_arc);
        // The arc from B to C', by C' − B.
        let chord = (self.a - self.b) + from_a;
        let one_minus_cos = u1 * (0.5 * chord.length_squared()).min(2.0);
        // Any direction works if C' is B or opposite to it.
        let across = (chord - self.b * self.b.dot(chord))
            .try_normalize()
            .unwrap_or_else(|| self.b.any_orthonormal_vector());
        let sin_theta = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
        let from_b = across * sin_theta - self.b * one_minus_cos;
        let direction = self.b + from_b;
        SphericalTriangleSample {
            direction: direction.as_vec3(),
            barycentric: self.barycentric(direction, (self.b - self.a) + from_b),
        }
    }

    /// Barycentric coordinates of the point in direction `direction`, given also as its difference
    /// to `A`: with edges `e`, `f` and `n = e×f` the point `λω = A + b₁e + b₂f` has
    /// `b₁ = ω·(f×A)/ω·n`, `b₂ = ω·(A×e)/ω·n`, and `Â` contributes nothing.
    #[expect(clippy::manual_clamp, reason = "NaN must not pass")]
    fn barycentric(&self, direction: DVec3, from_a: DVec3) -> [f32; 3] {
        let [e, f] = self.edges;
        let scale = 1.0 / direction.dot(e.cross(f));
        // Written so that NaN becomes zero: the origin may lie on an edge, to all digits.
        let first = (from_a.dot(f.cross(self.corner)) * scale).max(0.0).min(1.0);
        let second = (from_a.dot(self.corner.cross(e)) * scale)
            .max(0.0)
            .min(1.0 - first);
        let corner = 1.0 - first - second;
        if self.flipped {
            [corner, second, first]
        } else {
            [corner, first, second]
        }
        .map(|x| x as f32)
    }

    /// The `u` that [`SphericalTriangle::sample`] maps to a unit direction that hits the triangle;
    /// clamped to the square for one that misses. The error comes from the rounding of the
    /// direction: about 10⁻⁷ over the triangle's angular size in `u₁`, over the distance to
    /// `B` in `u₀` (at `B` itself `u₀` is lost).
    pub fn invert(&self, direction: Vec3) -> [f32; 2] {
        let direction = direction.as_dvec3().normalize_or(self.b);
        // C' lies where the great circle through B and ω meets that through A and C. With m its
        // normal, it is along ±((T·m) A − (A·m) T): on the side of the middle of the arc, also
        // where rounding puts it beyond an end.
        let normal = self.b.cross(direction - self.b);
        let meeting = self.a * self.tangent.dot(normal) - self.tangent * self.a.dot(normal);
        let middle = self.a + (self.corner + self.edges[1]).normalize_or_zero();
        let Some(c) = (meeting * meeting.dot(middle).signum()).try_normalize() else {
            return [0.0, 0.0];
        };
        let u0 = solid_angle([self.a, self.b, c]) / self.solid_angle;
        let u1 = (direction - self.b).length_squared() / (c - self.b).length_squared();
        [u0, u1].map(|x| clamp_or_low(x as f32, 0.0, ONE_MINUS_EPSILON))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::properties::{Case, Chart, assert_frozen, verify};
    use lightshed_testkit::{hostile_f32, hostile_unit_f32};

    fn case(name: &str, vertices: [Vec3; 3]) -> Case {
        let triangle = SphericalTriangle::new(vertices).unwrap();
        let normal = (vertices[1] - vertices[0]).cross(vertices[2] - vertices[0]);
        Case::directions(
            name,
            Chart::triangle(vertices).projected(vertices[0], normal),
            move |u| triangle.sample(u).direction,
            move |_| triangle.density().value(),
            move |d| Some(triangle.invert(d)),
        )
    }

    #[test]
    fn properties_hold() {
        verify(&case("octant", [Vec3::X, Vec3::Y, Vec3::Z]).tolerances(1e-5, 1e-3, 3e-6));
        let skewed = [
            Vec3::new(1.0, 2.0, 0.5),
            Vec3::new(-3.0, 1.0, 1.0),
            Vec3::new(0.2, -1.0, 0.7),
        ];
        verify(&case("skewed", skewed).tolerances(1e-5, 1e-3, 3e-5));
        verify(&case("flipped", [skewed[0], skewed[2], skewed[1]]).tolerances(1e-5, 1e-3, 3e-5));
        let sliver = [
            Vec3::new(-5.0, 0.0, 1.0),
            Vec3::new(5.0, 0.1, 1.0),
            Vec3::new(5.0, -0.1, 1.0),
        ];
        verify(&case("sliver", sliver).tolerances(1e-5, 5e-3, 1e-3));
        let close = [
            Vec3::new(-4.0, -3.0, 0.05),
            Vec3::new(5.0, -3.0, 0.05),
            Vec3::new(0.0, 6.0, 0.05),
        ];
        verify(&case("close", close).tolerances(1e-4, 2e-3, 1e-4));
        let small = [
            Vec3::new(1.0, 0.0, 10.0),
            Vec3::new(1.1, 0.0, 10.0),
            Vec3::new(1.0, 0.1, 10.01),
        ];
        verify(&case("small", small).tolerances(1e-5, 5e-3, 1e-3));
    }

    #[test]
    fn barycentric_coordinates_name_the_point_in_the_direction() {
        for vertices in [
            [Vec3::X, Vec3::Y, Vec3::Z],
            [Vec3::X, Vec3::Z, Vec3::Y],
            [
                Vec3::new(1.0, 0.0, 10.0),
                Vec3::new(1.001, 0.0, 10.0),
                Vec3::new(1.0, 0.001, 10.01),
            ],
        ] {
            let triangle = SphericalTriangle::new(vertices).unwrap();
            for u in hostile_unit_f32().flat_map(|a| hostile_unit_f32().map(move |b| [a, b])) {
                let sample = triangle.sample(u);
                let b = sample.barycentric;
                assert!(b.iter().all(|x| (0.0..=1.0).contains(x)), "{u:?}: {b:?}");
                let point = vertices[0] * b[0] + vertices[1] * b[1] + vertices[2] * b[2];
                let distance = (point.normalize() - sample.direction).length();
                assert!(distance < 4e-7, "{u:?}: {b:?} is {distance} off");
            }
        }
    }

    #[test]
    fn tiny_triangles_are_sampled_uniformly() {
        // Where directions have no digits left, barycentric coordinates still do: each has a mean
        // of a third.
        let vertices = [
            Vec3::new(0.0, 0.0, 1.0),
            Vec3::new(1e-4, 0.0, 1.0),
            Vec3::new(0.0, 1e-4, 1.0),
        ];
        let triangle = SphericalTriangle::new(vertices).unwrap();
        let mut mean = [0.0f64; 3];
        for i in 0..64 * 64 {
            let u = [(i % 64) as f32, (i / 64) as f32].map(|x| (x + 0.5) / 64.0);
            for (mean, b) in mean.iter_mut().zip(triangle.sample(u).barycentric) {
                *mean += f64::from(b) / 4096.0;
            }
        }
        assert!(mean.iter().all(|m| (m - 1.0 / 3.0).abs() < 1e-3), "{mean:?}");
    }

    #[test]
    fn degenerate_triangles_are_refused() {
        for vertices in [
            [Vec3::X, Vec3::X, Vec3::Y],
            [Vec3::ZERO, Vec3::X, Vec3::Y],
            [Vec3::X, Vec3::Y, Vec3::X + Vec3::Y],
            [Vec3::Z, Vec3::new(1e-6, 0.0, 1.0), Vec3::new(0.0, 1e-6, 1.0)],
            [Vec3::NAN, Vec3::X, Vec3::Y],
            [Vec3::X, Vec3::INFINITY, Vec3::Y],
        ] {
            assert!(SphericalTriangle::new(vertices).is_none(), "{vertices:?}");
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
                for vertices in [
                    [Vec3::new(x, y, 1.0), Vec3::new(y, x, x), Vec3::X],
                    [Vec3::new(x, 0.0, 1.0), Vec3::new(0.0, y, 1.0), -Vec3::Z],
                ] {
                    let Some(triangle) = SphericalTriangle::new(vertices) else {
                        continue;
                    };
                    accepted += 1;
                    for sample in u.map(|u| triangle.sample(u)) {
                        assert!(
                            (sample.direction.length() - 1.0).abs() < 1e-5,
                            "{vertices:?} {sample:?}"
                        );
                        assert!(
                            sample.barycentric.iter().all(|b| (0.0..=1.0).contains(b)),
                            "{vertices:?}"
                        );
                        let back = triangle.invert(sample.direction);
                        assert!(
                            back.iter().all(|x| (0.0..1.0).contains(x)),
                            "{vertices:?} {back:?}"
                        );
                    }
                }
            }
        }
        assert!(accepted > 500, "{accepted}");
    }

    #[test]
    fn values_are_stable() {
        let triangle = SphericalTriangle::new([Vec3::X, Vec3::Y, Vec3::new(0.5, 0.5, 2.0)]).unwrap();
        assert_frozen(
            |u| triangle.sample(u).direction,
            [
                Vec3::new(0.58827776, 0.80576664, 0.06833271),
                Vec3::new(0.76264846, 0.35714287, 0.5392739),
                Vec3::new(0.28936663, 0.7653811, 0.5748554),
            ],
        );
    }
}
