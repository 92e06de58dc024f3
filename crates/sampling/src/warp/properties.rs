//! What every warp must satisfy, and faults that show that the checks can fail.
//!
//! A [`Case`] is one warp at one parameter over a [`Chart`], a map of the unit square onto the
//! warp's domain whose Jacobian is known in `f64`. [`verify`] checks
//! 1. `∫ p = 1`, by adaptive quadrature over the chart;
//! 2. a histogram of samples over the chart against `∫_bin p` (χ², false-positive rate 10⁻⁶
//!    a case);
//! 3. `p(x(u)) · |∂x/∂u| = 1` by finite differences;
//! 4. `invert(sample(u)) = u` within a bound, and near enough to sample nearly the same point at
//!    hostile `u`;
//! 5. finite samples of positive, finite density at hostile `u` (density zero is allowed at extreme
//!    `u` where stated);
//!
//! and that each of 1–4 fails with a fault planted into the case.

use glam::{Vec2, Vec3};
use lightshed_testkit::{
    check_faults, chi_squared_test, hostile_unit_f32, integrate_rectangle, jacobian_determinant, rng,
    uniform_f32,
};

type Point = [f64; 3];

/// A map of the unit square onto a domain.
pub(super) struct Chart {
    /// `s` in [0, 1]² → the point, and area of the domain per area of the square.
    at: Box<dyn Fn([f64; 2]) -> (Point, f64)>,
    /// The inverse of `at`.
    locate: Box<dyn Fn(Point) -> [f64; 2]>,
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn normalize(a: Point) -> Point {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}

fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `Σ a_i v_i`.
fn combine<const N: usize>(a: [f64; N], v: [Point; N]) -> Point {
    core::array::from_fn(|k| (0..N).map(|i| a[i] * v[i][k]).sum())
}

impl Chart {
    /// Directions within `maximum` radians of `axis`, `θ = w (e^{Ls} − 1)`: uniform near the
    /// axis and logarithmic beyond the width `w`.
    pub(super) fn cap(axis: Vec3, width: f64, maximum: f64) -> Self {
        let z = normalize(axis.to_array().map(f64::from));
        let helper = if z[0].abs() < 0.6 {
            [1.0, 0.0, 0.0]
        } else {
            [0.0, 1.0, 0.0]
        };
        let x = normalize(cross(helper, z));
        let y = cross(z, x);
        let scale = (maximum / width).ln_1p();
        Self {
            at: Box::new(move |s| {
                let theta = width * (scale * s[0]).exp_m1();
                let (sin_phi, cos_phi) = (core::f64::consts::TAU * s[1]).sin_cos();
                let (sin, cos) = theta.sin_cos();
                let jacobian = core::f64::consts::TAU * sin * scale * (theta + width);
                (combine([sin * cos_phi, sin * sin_phi, cos], [x, y, z]), jacobian)
            }),
            locate: Box::new(move |p| {
                let (px, py, pz) = (dot(p, x), dot(p, y), dot(p, z));
                let theta = px.hypot(py).atan2(pz);
                let phi = py.atan2(px) / core::f64::consts::TAU;
                [(theta / width).ln_1p() / scale, phi - phi.floor()]
            }),
        }
    }

    /// The unit disk in the plane z = 0, by radius and angle.
    pub(super) fn disk() -> Self {
        use core::f64::consts::TAU;
        Self {
            at: Box::new(|s| {
                let (sin, cos) = (TAU * s[1]).sin_cos();
                ([s[0] * cos, s[0] * sin, 0.0], TAU * s[0])
            }),
            locate: Box::new(|p| {
                let phi = p[1].atan2(p[0]) / TAU;
                [p[0].hypot(p[1]), phi - phi.floor()]
            }),
        }
    }

    /// The rectangle `[low, high]` in the plane z = 0.
    pub(super) fn rectangle(low: [f64; 2], high: [f64; 2]) -> Self {
        let size = [high[0] - low[0], high[1] - low[1]];
        Self {
            at: Box::new(move |s| {
                (
                    [low[0] + s[0] * size[0], low[1] + s[1] * size[1], 0.0],
                    size[0] * size[1],
                )
            }),
            locate: Box::new(move |p| [(p[0] - low[0]) / size[0], (p[1] - low[1]) / size[1]]),
        }
    }

    /// The interval `[0, ∞)` of the x axis, `x = s/(1 − s)/rate`, constant in y.
    pub(super) fn half_line(rate: f64) -> Self {
        Self {
            at: Box::new(move |s| {
                (
                    [s[0] / (1.0 - s[0]) / rate, s[1], 0.0],
                    (1.0 - s[0]).powi(-2) / rate,
                )
            }),
            locate: Box::new(move |p| [p[0] * rate / (1.0 + p[0] * rate), p[1]]),
        }
    }

    /// A flat triangle by its barycentric coordinates.
    pub(super) fn triangle(vertices: [Vec3; 3]) -> Self {
        let [a, b, c] = vertices.map(|v| v.to_array().map(f64::from));
        let (e, f) = (sub(b, a), sub(c, a));
        let n = cross(e, f);
        let nn = dot(n, n);
        Self {
            at: Box::new(move |s| {
                // s₀ runs from a to the opposite edge, s₁ along it.
                let point = combine([1.0, s[0] * (1.0 - s[1]), s[0] * s[1]], [a, e, f]);
                (point, s[0] * nn.sqrt())
            }),
            locate: Box::new(move |p| {
                let d = sub(p, a);
                let (v, w) = (dot(cross(d, f), n) / nn, dot(cross(e, d), n) / nn);
                [v + w, if v + w == 0.0 { 0.0 } else { w / (v + w) }]
            }),
        }
    }

    /// A flat parallelogram `corner + s₀ a + s₁ b`.
    pub(super) fn parallelogram(corner: Vec3, a: Vec3, b: Vec3) -> Self {
        let [corner, a, b] = [corner, a, b].map(|v| v.to_array().map(f64::from));
        let n = cross(a, b);
        let nn = dot(n, n);
        Self {
            at: Box::new(move |s| (combine([1.0, s[0], s[1]], [corner, a, b]), nn.sqrt())),
            locate: Box::new(move |p| {
                let d = sub(p, corner);
                [dot(cross(d, b), n) / nn, dot(cross(a, d), n) / nn]
            }),
        }
    }

    /// This flat chart seen from the origin: directions to its points in the plane through `point`
    /// with `normal`.
    pub(super) fn projected(self, point: Vec3, normal: Vec3) -> Self {
        let [point, normal] = [point, normal].map(|v| v.to_array().map(f64::from));
        let normal = normalize(normal);
        let (at, locate) = (self.at, self.locate);
        Self {
            at: Box::new(move |s| {
                let (p, jacobian) = at(s);
                let squared = dot(p, p);
                let direction = normalize(p);
                (direction, jacobian * dot(direction, normal).abs() / squared)
            }),
            locate: Box::new(move |d| {
                let distance = dot(point, normal) / dot(d, normal);
                locate(d.map(|x| x * distance))
            }),
        }
    }
}

type Sample = Box<dyn Fn([f32; 2]) -> Vec3>;
type Density = Box<dyn Fn(Vec3) -> f32>;
type Inverse = Box<dyn Fn(Vec3) -> Option<[f32; 2]>>;

/// One warp at one parameter. Planar points lie in z = 0.
pub(super) struct Case {
    pub(super) name: String,
    pub(super) sample: Sample,
    pub(super) density: Density,
    pub(super) invert: Inverse,
    pub(super) chart: Chart,
    /// Tolerance of the integral around one.
    pub(super) integral_tolerance: f64,
    /// Tolerance of `p |J|` around one. Infinite if the rounding of points allows no finite
    /// differences.
    pub(super) jacobian_tolerance: f64,
    /// Tolerance of `u` in the round trip.
    pub(super) inverse_tolerance: f32,
    /// Whether the points are unit vectors.
    pub(super) directions: bool,
    /// Whether rounding may put samples at extreme `u` just outside the support.
    pub(super) rounds_off_support: bool,
}

impl Case {
    /// A warp onto directions with tolerances for well-conditioned ones.
    pub(super) fn directions(
        name: impl Into<String>,
        chart: Chart,
        sample: impl Fn([f32; 2]) -> Vec3 + 'static,
        density: impl Fn(Vec3) -> f32 + 'static,
        invert: impl Fn(Vec3) -> Option<[f32; 2]> + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            sample: Box::new(sample),
            density: Box::new(density),
            invert: Box::new(invert),
            chart,
            integral_tolerance: 1e-5,
            jacobian_tolerance: 1e-3,
            inverse_tolerance: 1e-6,
            directions: true,
            rounds_off_support: false,
        }
    }

    /// A warp onto points of the plane.
    pub(super) fn plane(
        name: impl Into<String>,
        chart: Chart,
        sample: impl Fn([f32; 2]) -> Vec2 + 'static,
        density: impl Fn(Vec2) -> f32 + 'static,
        invert: impl Fn(Vec2) -> Option<[f32; 2]> + 'static,
    ) -> Self {
        Self {
            directions: false,
            ..Self::directions(
                name,
                chart,
                move |u| sample(u).extend(0.0),
                move |p| density(p.truncate()),
                move |p| invert(p.truncate()),
            )
        }
    }

    pub(super) fn tolerances(mut self, integral: f64, jacobian: f64, inverse: f32) -> Self {
        self.integral_tolerance = integral;
        self.jacobian_tolerance = jacobian;
        self.inverse_tolerance = inverse;
        self
    }
}

/// Faults that are planted into every case.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// The density is 1 % too large everywhere.
    DensityOffByOnePercent,
    /// `u₀` is warped once more, and the density ignores it: a dropped Jacobian.
    DroppedJacobian,
    /// The inverse returns `(u₁, u₀)`.
    SwappedInverse,
}

const BINS: usize = 12;
const SAMPLES: usize = 1 << 16;

/// Checks everything in the list at the top of this file.
#[track_caller]
pub(super) fn verify(case: &Case) {
    let caught = |faults: &[Fault], check: &dyn Fn(Option<Fault>) -> Result<(), String>| {
        if let Err(error) = check_faults(faults, check) {
            panic!("{}: {error}", case.name);
        }
    };
    let masses = bin_masses(case);
    caught(&[Fault::DensityOffByOnePercent], &|fault| {
        check_integral(case, &masses, fault)
    });
    caught(&[Fault::DroppedJacobian], &|fault| {
        check_histogram(case, &masses, fault)
    });
    if case.jacobian_tolerance.is_finite() {
        caught(
            &[Fault::DroppedJacobian, Fault::DensityOffByOnePercent],
            &|fault| check_jacobian(case, fault),
        );
    }
    caught(&[Fault::SwappedInverse], &|fault| check_inverse(case, fault));
    check_extremes(case);
}

fn to_vec3(p: Point) -> Vec3 {
    Vec3::from_array(p.map(|x| x as f32))
}

fn sample(case: &Case, u: [f32; 2], fault: Option<Fault>) -> Vec3 {
    match fault {
        Some(Fault::DroppedJacobian) => (case.sample)([u[0] * (0.9 + 0.1 * u[0]), u[1] * (0.9 + 0.1 * u[1])]),
        _ => (case.sample)(u),
    }
}

fn density_factor(fault: Option<Fault>) -> f64 {
    match fault {
        Some(Fault::DensityOffByOnePercent) => 1.01,
        _ => 1.0,
    }
}

fn bin_masses(case: &Case) -> Vec<f64> {
    let tolerance = 0.1 * case.integral_tolerance / (BINS * BINS) as f64;
    let size = 1.0 / BINS as f64;
    (0..BINS * BINS)
        .map(|bin| {
            let low = [(bin / BINS) as f64 * size, (bin % BINS) as f64 * size];
            let high = low.map(|x| x + size);
            let integrand = |x, y| {
                let (point, jacobian) = (case.chart.at)([x, y]);
                jacobian * f64::from((case.density)(to_vec3(point)))
            };
            integrate_rectangle(integrand, low, high, tolerance).value
        })
        .collect()
}

fn check_integral(case: &Case, masses: &[f64], fault: Option<Fault>) -> Result<(), String> {
    let total = masses.iter().sum::<f64>() * density_factor(fault);
    if (total - 1.0).abs() <= case.integral_tolerance {
        Ok(())
    } else {
        Err(format!("density integrates to {total}"))
    }
}

fn check_histogram(case: &Case, masses: &[f64], fault: Option<Fault>) -> Result<(), String> {
    let mut rng = rng(0x5eed);
    let mut observed = vec![0u64; BINS * BINS];
    for _ in 0..SAMPLES {
        let u = [uniform_f32(&mut rng), uniform_f32(&mut rng)];
        let s = (case.chart.locate)(sample(case, u, fault).to_array().map(f64::from));
        if !s.iter().all(|x| (-1e-3..1.001).contains(x)) {
            return Err(format!(
                "sample at {u:?} lies outside the domain, at {s:?} in the chart"
            ));
        }
        let bin = s.map(|x| ((x * BINS as f64) as usize).min(BINS - 1));
        observed[bin[0] * BINS + bin[1]] += 1;
    }
    let expected: Vec<f64> = masses.iter().map(|m| m.max(0.0) * SAMPLES as f64).collect();
    chi_squared_test(&observed, &expected, 1e-6)
        .map(drop)
        .map_err(|e| e.to_string())
}

fn check_jacobian(case: &Case, fault: Option<Fault>) -> Result<(), String> {
    // Away from the edges, from u₀ = u₁ and u₀ + u₁ = 1, and from multiples of a quarter,
    // where warps have creases.
    for u0 in [0.11, 0.34, 0.6, 0.83] {
        for u1 in [0.28, 0.45, 0.77, 0.94] {
            let map = |u: [f64; 2]| sample(case, u.map(|x| x as f32), fault).to_array().map(f64::from);
            let estimate = jacobian_determinant(map, [u0, u1], 1.0 / 32.0);
            let point = sample(case, [u0 as f32, u1 as f32], fault);
            let product = estimate.value * f64::from((case.density)(point)) * density_factor(fault);
            if !((product - 1.0).abs() <= case.jacobian_tolerance + 3.0 * estimate.error / estimate.value) {
                return Err(format!("p |J| = {product} at u = {:?}; {estimate:?}", [u0, u1]));
            }
        }
    }
    Ok(())
}

fn check_inverse(case: &Case, fault: Option<Fault>) -> Result<(), String> {
    let mut rng = rng(0x1234);
    let random: Vec<[f32; 2]> = (0..4096)
        .map(|_| [uniform_f32(&mut rng), uniform_f32(&mut rng)])
        .collect();
    let hostile = hostile_unit_f32().flat_map(|a| hostile_unit_f32().map(move |b| [a, b]));
    for u in random.into_iter().chain(hostile) {
        let point = (case.sample)(u);
        let extreme = u.iter().any(|x| !(1e-6..0.9999).contains(x));
        let Some(mut back) = (case.invert)(point) else {
            if extreme && case.rounds_off_support {
                continue;
            }
            return Err(format!("no inverse at u = {u:?}"));
        };
        if let Some(Fault::SwappedInverse) = fault {
            back.swap(0, 1);
        }
        if !back.iter().all(|x| (0.0..1.0).contains(x)) {
            return Err(format!("u = {u:?} came back as {back:?}, outside [0, 1)"));
        }
        // Azimuths are periodic.
        let error = [0, 1].map(|i| (back[i] - u[i]).abs()).map(|d| d.min(1.0 - d));
        // Where the map contracts, the rounding of the point loses `u`; then the point must return.
        // At the poles it contracts like a square root, and the rounding of `u` loses the point
        // itself.
        let again = (case.sample)(back);
        let difference = (again - point).abs();
        let lost = difference.cmple(3e-7 * point.abs()).all();
        let near = extreme && difference.max_element() <= 2e-3 * point.abs().max_element();
        if !(error[0] <= case.inverse_tolerance && error[1] <= case.inverse_tolerance || lost || near) {
            return Err(format!("u = {u:?} came back as {back:?}"));
        }
    }
    Ok(())
}

fn check_extremes(case: &Case) {
    for u0 in hostile_unit_f32() {
        for u1 in hostile_unit_f32() {
            let u = [u0, u1];
            let point = (case.sample)(u);
            assert!(point.is_finite(), "{}: u = {u:?} gives {point}", case.name);
            if case.directions {
                let length = point.length();
                assert!(
                    (length - 1.0).abs() < 1e-6,
                    "{}: u = {u:?} has length {length}",
                    case.name
                );
            }
            let density = (case.density)(point);
            let extreme = u.iter().any(|x| !(1e-6..0.9999).contains(x));
            assert!(
                density.is_finite()
                    && (density > 0.0 || density == 0.0 && extreme && case.rounds_off_support),
                "{}: density {density} at u = {u:?}",
                case.name
            );
            if let Some(back) = (case.invert)(point) {
                assert!(
                    back.iter().all(|x| (0.0..1.0).contains(x)),
                    "{}: u = {u:?} came back as {back:?}",
                    case.name
                );
            }
        }
    }
}

/// Asserts that samples at fixed `u` have not changed, to 10⁻⁶ of their size (platforms'
/// logarithms and arc functions differ by units in the last place).
#[track_caller]
pub(super) fn assert_frozen(sample: impl Fn([f32; 2]) -> Vec3, expected: [Vec3; 3]) {
    let got = [[0.1, 0.2], [0.5, 0.75], [0.85, 0.3]].map(sample);
    for (value, expected) in got.into_iter().zip(expected) {
        let error = (value - expected).abs().max_element();
        assert!(
            error <= 1e-6 * expected.abs().max_element(),
            "values have changed: {got:?}"
        );
    }
}
