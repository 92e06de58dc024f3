//! Pixels over one-dimensional functions, and the shift between them.

use lightshed::resampling::{
    Domain, DomainReservoir, Jacobian, Reservoir, Ris, ShiftMapping, Shifted, Tractable, Undefined,
};
use lightshed::sampling::{CounterRng, PrimarySample, f64_from_u64};

/// A pixel's integrand over `u` in [0, 1): it looks at the world interval
/// `[start, start + length)`, where a lobe moves with the pixel and a bright, narrow peak stands
/// still that is hidden from some pixels.
#[derive(Clone, Copy, Debug)]
pub struct Pixel {
    start: f64,
    length: f64,
    centre: f64,
    peak_visible: bool,
}

impl Pixel {
    /// The pixel at an offset from the one of interest. Where the scene is `occluded`, half of the
    /// pixels do not see the peak.
    pub fn at(dx: i32, dy: i32, occluded: bool) -> Self {
        let (x, y) = (f64::from(dx), f64::from(dy));
        Self {
            start: 0.01 * x,
            length: 1.0 + 0.3 * (0.05 * y).tanh(),
            centre: 0.5 + 0.03 * x + 0.02 * y,
            peak_visible: !occluded || dx + 2 * dy <= 1,
        }
    }

    fn world(&self, w: f64) -> f64 {
        let lobe = (1.0 - ((w - self.centre) / 0.25).powi(2)).max(0.0).powi(2);
        let peak = if self.peak_visible {
            (1.0 - ((w - 0.85) / 0.05).powi(2)).max(0.0)
        } else {
            0.0
        };
        lobe + 2.0 * peak
    }

    /// The world position looked at.
    pub fn place(&self, u: f64) -> f64 {
        self.start + self.length * u
    }

    /// `f(u)`, an integrand in primary sample space.
    pub fn integrand(&self, u: f64) -> f64 {
        self.world(self.start + self.length * u) * self.length
    }

    /// A second integrand, such as a colour channel, of which the target knows nothing.
    pub fn coloured(&self, u: f64) -> f64 {
        self.integrand(u) * (1.0 + 0.8 * (21.0 * (self.start + self.length * u)).sin())
    }

    /// `∫ f` by the midpoint rule.
    pub fn integral(f: impl Fn(f64) -> f64) -> f64 {
        let steps = 400_000;
        (0..steps)
            .map(|i| f((f64::from(i) + 0.5) / f64::from(steps)))
            .sum::<f64>()
            / f64::from(steps)
    }

    /// `candidates` uniform candidates and RIS.
    pub fn draw(&self, candidates: u32, confidence: f32, rng: &mut CounterRng) -> DomainReservoir<Self> {
        let mut ris = Ris::<f64, PrimarySample>::new();
        let weight = Tractable::<PrimarySample>::from_density(1.0)
            .map(Tractable::weight)
            .unwrap_or_default();
        for _ in 0..candidates {
            let u = f64_from_u64(rng.next_u64());
            ris.candidate(u, self.target(&u), weight, rng);
        }
        let reservoir: Reservoir<f64, PrimarySample> = ris.finish(confidence);
        reservoir
    }
}

impl Domain for Pixel {
    type Sample = f64;
    type Space = PrimarySample;
    fn target(&self, &u: &f64) -> f64 {
        self.integrand(u)
    }
}

/// Keeps the world position: undefined where the other pixel does not look.
pub struct SamePlace;

impl ShiftMapping<Pixel> for SamePlace {
    fn shift(&self, &u: &f64, from: &Pixel, to: &Pixel) -> Result<Shifted<f64>, Undefined> {
        let place = (from.start + from.length * u - to.start) / to.length;
        if !(0.0..1.0).contains(&place) {
            return Err(Undefined::OutsideDomain);
        }
        let jacobian = Jacobian::new(from.length / to.length)?;
        Ok(Shifted {
            sample: place,
            jacobian,
            target: to.integrand(place),
        })
    }
}
