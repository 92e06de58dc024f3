//! A trilinear density along a ray: a cubic within each cell.

/// `ρ(s) = c₀ + c₁ s + c₂ s² + c₃ s³` over the part of a cell that a ray crosses, `s` in
/// [0, 1].
#[derive(Clone, Copy, Debug)]
pub(super) struct Cubic {
    coefficients: [f64; 4],
}

impl Cubic {
    /// From the corners of the cell, x fastest, the position in the cell where the ray enters, and
    /// its direction from there.
    #[inline(always)]
    pub fn new(corners: &[f32; 8], entry: [f64; 3], along: [f64; 3]) -> Self {
        let [x, y, z] = entry;
        let [dx, dy, dz] = along;
        // Along x each of the four edges is linear in s, then each of two faces quadratic.
        let edge = |i: usize| {
            let (a, b) = (f64::from(corners[i]), f64::from(corners[i + 1]));
            [a + (b - a) * x, (b - a) * dx]
        };
        let face = |p: [f64; 2], q: [f64; 2]| {
            let e = [q[0] - p[0], q[1] - p[1]];
            [p[0] + e[0] * y, p[1] + e[1] * y + e[0] * dy, e[1] * dy]
        };
        let (p, q) = (face(edge(0), edge(2)), face(edge(4), edge(6)));
        let e = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
        Self {
            coefficients: [
                p[0] + e[0] * z,
                p[1] + e[1] * z + e[0] * dz,
                p[2] + e[2] * z + e[1] * dz,
                e[2] * dz,
            ],
        }
    }

    /// `ρ(s)`, not below 0.
    #[inline(always)]
    pub fn value(&self, s: f64) -> f64 {
        let [c0, c1, c2, c3] = self.coefficients;
        (c0 + s * (c1 + s * (c2 + s * c3))).max(0.0)
    }

    /// `∫₀ˢ ρ`, not below 0.
    #[inline(always)]
    pub fn integral(&self, s: f64) -> f64 {
        let [c0, c1, c2, c3] = self.coefficients;
        (s * (c0 + s * (c1 / 2.0 + s * (c2 / 3.0 + s * c3 / 4.0)))).max(0.0)
    }

    /// The least `s` in [0, 1] with `∫₀ˢ ρ = target`, for a target from 0 to the whole
    /// integral: Newton's method on a monotone quartic, kept within a shrinking bracket by
    /// bisection.
    #[inline]
    pub fn invert(&self, target: f64) -> f64 {
        let (mut low, mut high) = (0.0f64, 1.0f64);
        let whole = self.integral(1.0);
        let mut s = if whole > 0.0 {
            (target / whole).clamp(0.0, 1.0)
        } else {
            0.0
        };
        for _ in 0..80 {
            let error = self.integral(s) - target;
            if error > 0.0 {
                high = s;
            } else {
                low = s;
            }
            let newton = s - error / self.value(s);
            // Where the density vanishes the step is infinite or NaN, and fails the comparison.
            let next = if newton >= low && newton <= high {
                newton
            } else {
                0.5 * (low + high)
            };
            let done = (next - s).abs() <= 1e-14;
            s = next;
            if done {
                break;
            }
        }
        s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_testkit::{integrate, rng, uniform_f64};

    fn trilinear(c: &[f32; 8], p: [f64; 3]) -> f64 {
        (0..8)
            .map(|i| {
                let weight: f64 = (0..3)
                    .map(|a| if i >> a & 1 == 1 { p[a] } else { 1.0 - p[a] })
                    .product();
                weight * f64::from(c[i])
            })
            .sum()
    }

    /// Random cells, with zeros and very different corners among them.
    fn cells() -> impl Iterator<Item = ([f32; 8], [f64; 3], [f64; 3])> {
        let mut rng = rng(5);
        (0..500).map(move |case| {
            let corners = core::array::from_fn(|i| match case % 4 {
                0 => uniform_f64(&mut rng) as f32,
                1 if i < 7 => 0.0,
                1 => 1e-6,
                2 => 10f64.powf(-30.0 * uniform_f64(&mut rng)) as f32,
                _ => (uniform_f64(&mut rng) * 1.5 - 0.5).max(0.0) as f32,
            });
            let a: [f64; 3] = core::array::from_fn(|_| uniform_f64(&mut rng));
            let b: [f64; 3] = core::array::from_fn(|i| match case % 7 {
                0 => a[i],
                1 => 1.0 - a[i],
                _ => uniform_f64(&mut rng),
            });
            (corners, a, [b[0] - a[0], b[1] - a[1], b[2] - a[2]])
        })
    }

    #[test]
    fn the_cubic_is_the_interpolant() {
        for (corners, entry, along) in cells() {
            let cubic = Cubic::new(&corners, entry, along);
            let at = |s: f64| trilinear(&corners, core::array::from_fn(|a| entry[a] + s * along[a]));
            for s in [0.0, 0.3, 0.5, 0.9, 1.0] {
                assert!((cubic.value(s) - at(s)).abs() < 1e-14);
                let truth = integrate(at, 0.0, s, 1e-12).value;
                assert!((cubic.integral(s) - truth).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn the_integral_inverts() {
        for (corners, entry, along) in cells() {
            let cubic = Cubic::new(&corners, entry, along);
            let whole = cubic.integral(1.0);
            for f in [0.0, 1e-12, 1e-6, 0.01, 0.3, 0.5, 0.99, 1.0 - 1e-12, 1.0] {
                let s = cubic.invert(f * whole);
                assert!((0.0..=1.0).contains(&s));
                assert!(
                    (cubic.integral(s) - f * whole).abs() <= 1e-12 * whole,
                    "{f}: {s} in {cubic:?}"
                );
            }
        }
    }
}
