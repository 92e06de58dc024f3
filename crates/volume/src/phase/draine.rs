//! Draine's phase function.
//!
//! `p = (1/4π) · (1 − g²)/(1 + g² − 2 g c)^{3/2} · (1 + α c²)/(1 + α (1 + 2g²)/3)`,
//! `c = cos θ` (Draine 2003, eq. 4): Henyey–Greenstein at `α = 0`, Rayleigh at `g = 0, α = 1`,
//! Cornette–Shanks at `α = 1`. `g` is not its mean cosine unless `α = 0`.
//!
//! With `x = √(1 + g² − 2 g c)` in place of `c` the distribution function is
//! `−a/x − b x + x³ α/(12 g²)` with constants `a` and `b`, monotone in `x`: its inverse is
//! found by Newton's method, safeguarded by bisection, in `f64`.

use super::{PhaseError, PhaseFunction, ScatteringAngle, check_asymmetry};
use core::f64::consts::PI;

/// Below this magnitude `g` counts as 0, for density and samples alike: the division by `g²`
/// leaves eight digits there.
const MIN_ASYMMETRY: f64 = 1e-4;

/// Draine scattering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draine {
    g: f64,
    alpha: f64,
    /// `(1 − g²) / (4π (1 + α (1 + 2g²)/3))`.
    factor: f64,
}

impl Draine {
    /// With the parameters `g`, positive forward, and `α ≥ 0`. A `|g|` below 10⁻⁴ counts
    /// as 0.
    ///
    /// # Errors
    /// [`PhaseError::Asymmetry`] for `g` beyond ±[`MAX_ASYMMETRY`](super::MAX_ASYMMETRY),
    /// [`PhaseError::Alpha`] for `α` out of [0, [`MAX_DRAINE_ALPHA`](super::MAX_DRAINE_ALPHA)].
    pub fn new(g: f32, alpha: f32) -> Result<Self, PhaseError> {
        let g = f64::from(check_asymmetry(g)?);
        let g = if g.abs() < MIN_ASYMMETRY { 0.0 } else { g };
        if !(0.0..=super::MAX_DRAINE_ALPHA).contains(&alpha) {
            return Err(PhaseError::Alpha);
        }
        let alpha = f64::from(alpha);
        let factor = (1.0 - g * g) / (4.0 * PI * (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0));
        Ok(Self { g, alpha, factor })
    }

    /// `2π p` at `s = 1 − c`, `c` measured from the lobe (`g` taken as positive).
    #[inline]
    fn density(&self, s: f64) -> f64 {
        let (c, g) = (1.0 - s, self.g.abs());
        let squared = (1.0 - g).powi(2) + 2.0 * g * s;
        2.0 * PI * self.factor * (1.0 + self.alpha * c * c) / (squared * squared.sqrt())
    }

    /// The probability of a `1 − c` below `s`, `c` measured from the lobe.
    #[inline]
    fn cumulative(&self, s: f64) -> f64 {
        let g = self.g.abs();
        let alpha = self.alpha;
        if g == 0.0 {
            // ∫ (1 + α (1 − s)²) ds.
            let cubes = (1.0 - (1.0 - s).powi(3)) / 3.0;
            return 2.0 * PI * self.factor * (s + alpha * cubes);
        }
        // From x₀ = 1 − g to x = √((1 − g)² + 2 g s): ∫ (1 + α c²)/x² dx / g, with c
        // = (w − x²)/2g, w = 1 + g². Every difference of powers of x is a multiple of x −
        // x₀ = 2 g s/(x + x₀).
        let x0 = 1.0 - g;
        let x = (x0 * x0 + 2.0 * g * s).sqrt();
        let w = 1.0 + g * g;
        let quarter = alpha / (4.0 * g * g);
        let terms = (1.0 + quarter * w * w) / (x * x0) - 2.0 * quarter * w
            + quarter * (x * x + x * x0 + x0 * x0) / 3.0;
        2.0 * PI * self.factor * 2.0 * s / (x + x0) * terms
    }
}

impl PhaseFunction for Draine {
    #[inline]
    fn phase_at(&self, angle: ScatteringAngle) -> f32 {
        let s = f64::from(angle.lobe_ahead(self.g as f32).one_minus_cos);
        (self.density(s) / (2.0 * PI)) as f32
    }

    fn sample_angle(&self, u: f32) -> ScatteringAngle {
        let target = f64::from(u);
        let (mut low, mut high) = (0.0f64, 2.0f64);
        // Start from Henyey–Greenstein's answer.
        let g = self.g.abs();
        let d = 1.0 + g - 2.0 * g * target;
        let mut s = (1.0 - g) * target * ((1.0 - g * g) / d + 1.0 - g) / d;
        for _ in 0..64 {
            let error = self.cumulative(s) - target;
            if error > 0.0 {
                high = s;
            } else {
                low = s;
            }
            let newton = s - error / self.density(s);
            let next = if newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            let done = (next - s).abs() <= 1e-9 * next;
            s = next;
            if done {
                break;
            }
        }
        ScatteringAngle::from_one_minus_cos((s as f32).clamp(0.0, 2.0)).lobe_ahead(self.g as f32)
    }
}
