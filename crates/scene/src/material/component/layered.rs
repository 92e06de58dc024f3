//! A sheen and a clear coat over an opaque metallic-roughness surface (`KHR_materials_sheen`,
//! `KHR_materials_clearcoat`).
//!
//! With `f_b` the base, `s` the sheen's colour, `c` the coat's share, `F(x) = 0.04 + 0.96 (1 − x)⁵`
//! and `n_o = cos θ_o`, `n_i = cos θ_i`:
//!
//! `f = K (S f_b + s f_s) + c F(wo·h) D_c G2 / (4 n_o n_i)`
//!
//! - `K = min(1 − c F(n_o), 1 − c F(n_i))`, what the coat lets through. The extension has
//!   `1 − c F(n_o)`, and `F(n_o)` for the coat itself; both agree with these where the coat is
//!   smooth, and these are reciprocal.
//! - `f_s = D V`, `D = (2 + 1/α) sin^{1/α} θ_h / 2π` (Estevez and Kulla 2017, "Production Friendly
//!   Microfacet Sheen BRDF", eq. 2), `V = 1/(4 (n_o + n_i − n_o n_i))` (Neubelt and Pettineo 2013);
//!   `α` is the square of the sheen's roughness, at least 0.02.
//! - `S = min(1 − max(s) E(n_o), 1 − max(s) E(n_i))`, `E(n) = ∫ f_s cos θ_i dω_i`, tabulated.
//!
//! The sheen belongs to the diffuse lobe. With a sheen, one half of that lobe's samples is uniform
//! over the hemisphere: towards the horizon `f_s` grows as `1/(n_o + n_i)`, which the density
//! `n_i / π` would turn into rare bright dots.

use super::{Draw, LobeEvaluation, MAX_COMPONENT_LOBES, MetallicRoughness, Scatter};
use crate::Rgb;
use glam::{Vec2, Vec3};
use lightshed_sampling::{Ggx, UniformHemisphere};
use std::f32::consts::{PI, TAU};
use std::sync::LazyLock;

/// Lobe 0 is the base's reflection, lobe 1 diffuse with the sheen, lobe 2 the coat.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Layered {
    base_color: Rgb,
    metallic: f32,
    f0: f32,
    /// `α` of the base.
    alpha: f32,
    coat: f32,
    coat_alpha: f32,
    sheen: Rgb,
    sheen_alpha: f32,
}

// No larger than the largest other component: every BSDF has room for four of them.
const _: () = assert!(size_of::<Layered>() <= 48);

/// Least `α` of a sheen: below it nothing is left but a rim of a few degrees, as noise.
const LEAST_SHEEN_ALPHA: f32 = 0.02;

/// Nodes of the table of `E` along each axis.
const NODES: usize = 24;

/// `E` at `n = (i/23)²` and `α = (j/23)²`, at least [`LEAST_SHEEN_ALPHA`].
static ALBEDOS: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let node = |index: usize| (index as f32 / (NODES - 1) as f32).powi(2);
    let of = |index: usize| {
        let (n, alpha) = (node(index % NODES), node(index / NODES).max(LEAST_SHEEN_ALPHA));
        sheen_albedo(n.max(1e-4), alpha)
    };
    (0..NODES * NODES).map(of).collect()
});

/// Computes the table unless it exists.
pub(in super::super) fn prepare() {
    LazyLock::force(&ALBEDOS);
}

/// `E` by quadrature over the upper hemisphere.
fn sheen_albedo(n: f32, alpha: f32) -> f32 {
    const STEPS: [usize; 2] = [48, 48];
    let wo = Vec3::new((1.0 - n * n).max(0.0).sqrt(), 0.0, n);
    let mut sum = 0.0;
    for i in 0..STEPS[0] {
        // Nodes are close to the horizon, where the sheen is.
        let t = (i as f32 + 0.5) / STEPS[0] as f32;
        let (cos, step) = (t * t, 2.0 * t / STEPS[0] as f32);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        for j in 0..STEPS[1] {
            let phi = PI * (j as f32 + 0.5) / STEPS[1] as f32;
            let wi = Vec3::new(sin * phi.cos(), sin * phi.sin(), cos);
            // One half of the azimuths is like the other.
            sum += sheen_lobe(wo, wi, alpha) * cos * step * TAU / STEPS[1] as f32;
        }
    }
    sum.min(1.0)
}

/// `f_s`.
fn sheen_lobe(wo: Vec3, wi: Vec3, alpha: f32) -> f32 {
    let h = (wo + wi).normalize_or(Vec3::Z);
    let sin2 = (1.0 - h.z * h.z).clamp(0.0, 1.0);
    let inverse = 1.0 / alpha;
    let distribution = (2.0 + inverse) * sin2.powf(0.5 * inverse) / TAU;
    let (no, ni) = (wo.z.max(0.0), wi.z.max(0.0));
    distribution / (4.0 * (no + ni - no * ni)).max(1e-6)
}

impl Layered {
    /// A coat and a sheen, each with its `α`, over an opaque isotropic base.
    pub fn new(
        base: MetallicRoughness,
        (coat, coat_alpha): (f32, f32),
        (sheen, sheen_alpha): (Rgb, f32),
    ) -> Self {
        Self {
            base_color: base.base_color,
            metallic: base.metallic,
            f0: base.f0,
            alpha: base.distribution.alpha().0,
            coat,
            coat_alpha,
            sheen,
            sheen_alpha: sheen_alpha.max(LEAST_SHEEN_ALPHA),
        }
    }

    /// What lies below.
    fn base(&self) -> MetallicRoughness {
        MetallicRoughness {
            base_color: self.base_color,
            metallic: self.metallic,
            transmission: 0.0,
            f0: self.f0,
            distribution: Ggx::new(self.alpha, self.alpha),
        }
    }

    fn coat_distribution(&self) -> Ggx {
        Ggx::new(self.coat_alpha, self.coat_alpha)
    }

    /// `c F`.
    fn coat_share(&self, cos: f32) -> f32 {
        let x = (1.0 - cos).clamp(0.0, 1.0);
        self.coat * (0.04 + 0.96 * (x * x) * (x * x) * x)
    }

    /// `E` between the nodes of the table.
    fn albedo(&self, cos: f32) -> f32 {
        let table = &*ALBEDOS;
        let last = (NODES - 1) as f32;
        let [x, y] = [cos, self.sheen_alpha].map(|v| v.clamp(0.0, 1.0).sqrt() * last);
        let [column, row] = [x, y].map(|v| (v as usize).min(NODES - 2));
        let (s, t) = (x - column as f32, y - row as f32);
        let at = |i: usize, j: usize| table[(row + j) * NODES + column + i];
        let (near, far) = (
            at(0, 0) + (at(1, 0) - at(0, 0)) * s,
            at(0, 1) + (at(1, 1) - at(0, 1)) * s,
        );
        near + (far - near) * t
    }

    /// The coat's own lobe for `wi` above the surface.
    #[inline]
    fn coated(&self, wo: Vec3, wi: Vec3) -> LobeEvaluation {
        let h = (wo + wi).normalize_or(Vec3::Z);
        let (value, pdf) = MetallicRoughness::microfacets_of(&self.coat_distribution(), wo, wi, h);
        LobeEvaluation {
            value: Rgb::splat(self.coat_share(wo.dot(h)) * value),
            pdf,
        }
    }

    /// A lobe of the base below the other layers, of which the diffuse one has the sheen.
    #[inline]
    fn covered(
        &self,
        lobe: u8,
        mut found: LobeEvaluation,
        (coat, both): (f32, f32),
        [wo, wi]: [Vec3; 2],
    ) -> LobeEvaluation {
        found.value *= both;
        if lobe == 1 && self.sheen != Rgb::ZERO {
            found.value += self.sheen * (coat * sheen_lobe(wo, wi, self.sheen_alpha) * wi.z);
            found.pdf = 0.5 * (found.pdf + 1.0 / TAU);
        }
        found
    }

    /// What the coat lets through, `K`, and that times what the sheen does, `K S`.
    fn below(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        let through = |cos: f32| 1.0 - self.coat_share(cos);
        let coat = through(wo.z).min(through(wi.z)).max(0.0);
        let most = self.sheen.max_element();
        if most <= 0.0 {
            return (coat, coat);
        }
        let through = |cos: f32| 1.0 - most * self.albedo(cos);
        (coat, coat * through(wo.z).min(through(wi.z)).max(0.0))
    }
}

impl Scatter for Layered {
    const LOBES: u8 = 3;

    #[inline]
    fn probabilities(&self, wo: Vec3, inside: bool) -> [f32; MAX_COMPONENT_LOBES] {
        let [specular, diffuse, _] = self.base().probabilities(wo, inside);
        let share = self.coat_share(wo.z);
        // Enough for a sharp highlight, which is brighter than what is below.
        let coat = if self.coat > 0.0 {
            share.max(0.1 * self.coat)
        } else {
            0.0
        };
        let below = (1.0 - share).max(0.0);
        let specular = specular * below;
        let diffuse = (diffuse + 0.5 * self.sheen.max_element()) * below;
        let scale = 1.0 / (specular + diffuse + coat).max(1e-30);
        [specular * scale, diffuse * scale, coat * scale]
    }

    fn roughness(&self, lobe: u8) -> f32 {
        match lobe {
            2 => self.coat_distribution().alpha().0.min(1.0),
            _ => self.base().roughness(lobe),
        }
    }

    #[inline]
    fn evaluate(&self, lobe: u8, wo: Vec3, wi: Vec3, inside: bool) -> LobeEvaluation {
        if wi.z <= 0.0 {
            return LobeEvaluation::default();
        }
        if lobe == 2 {
            return self.coated(wo, wi);
        }
        let found = self.base().evaluate(lobe, wo, wi, inside);
        self.covered(lobe, found, self.below(wo, wi), [wo, wi])
    }

    #[inline]
    fn evaluate_lobes(&self, wo: Vec3, wi: Vec3, inside: bool) -> [LobeEvaluation; MAX_COMPONENT_LOBES] {
        let nothing = LobeEvaluation::default();
        if wi.z <= 0.0 {
            return [nothing; MAX_COMPONENT_LOBES];
        }
        let below = self.below(wo, wi);
        let [specular, diffuse, _] = self.base().evaluate_lobes(wo, wi, inside);
        // Without a coat nothing chooses its lobe.
        let coat = if self.coat > 0.0 {
            self.coated(wo, wi)
        } else {
            nothing
        };
        [
            self.covered(0, specular, below, [wo, wi]),
            self.covered(1, diffuse, below, [wo, wi]),
            coat,
        ]
    }

    #[inline]
    fn sample(&self, lobe: u8, wo: Vec3, u: Vec2, inside: bool) -> Option<Draw> {
        match lobe {
            2 => {
                let coat = MetallicRoughness {
                    distribution: self.coat_distribution(),
                    ..self.base()
                };
                coat.sample(0, wo, u, inside)
            }
            1 if self.sheen != Rgb::ZERO => {
                let u_half = Vec2::new(2.0 * u.x - f32::from(u8::from(u.x >= 0.5)), u.y);
                if u.x < 0.5 {
                    return self.base().sample(lobe, wo, u_half, inside);
                }
                let wi = UniformHemisphere::sample(u_half.to_array());
                Some(Draw::Direction { wi, eta: 1.0 })
            }
            _ => self.base().sample(lobe, wo, u, inside),
        }
    }

    fn albedo_hint(&self) -> Rgb {
        self.base().albedo_hint() * (1.0 - 0.04 * self.coat) + Rgb::splat(0.04 * self.coat) + self.sheen * 0.2
    }

    fn importance(&self) -> f32 {
        self.albedo_hint().max_element().max(0.05)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_testkit::check_faults;

    fn layered(coat: f32, sheen: f32, base: f32) -> Layered {
        let base = MetallicRoughness {
            base_color: Rgb::splat(base),
            metallic: 0.0,
            transmission: 0.0,
            f0: 0.04,
            distribution: Ggx::new(0.25, 0.25),
        };
        Layered::new(base, (coat, 0.01), (Rgb::splat(sheen), 0.25))
    }

    fn direction(degrees: f64) -> Vec3 {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Vec3::new(sin as f32, 0.0, cos as f32)
    }

    /// The sheen at 60° and −40° beside each other in `f64`, over a black base without reflection.
    #[test]
    fn a_sheen_is_its_formula() {
        check_faults(&["without the cosine", "α for the roughness"], |fault| {
            let mut layered = layered(0.0, 0.5, 0.0);
            if fault == Some("α for the roughness") {
                layered.sheen_alpha = 0.5;
            }
            let (wo, wi) = (direction(60.0), direction(-40.0));
            let (no, ni) = (60_f64.to_radians().cos(), 40_f64.to_radians().cos());
            // The half vector is at 10°.
            let sin = 10_f64.to_radians().sin();
            let d = (2.0 + 4.0) * sin.powi(4) / std::f64::consts::TAU;
            let mut expected = 0.5 * d / (4.0 * (no + ni - no * ni));
            if fault != Some("without the cosine") {
                expected *= ni;
            }
            let found = f64::from(layered.evaluate(1, wo, wi, false).value.x);
            match (found / expected - 1.0).abs() < 1e-4 {
                true => Ok(()),
                false => Err(format!("{found} for {expected}")),
            }
        })
        .unwrap();
    }

    /// A smooth coat over black sends `c F(cos θ)` in all, at 75° and at 0°; what is below it is
    /// seen through `1 − c F`.
    #[test]
    fn a_coat_reflects_as_much_as_it_takes() {
        for degrees in [0.0, 75.0] {
            let coated = layered(0.5, 0.0, 0.0);
            let wo = direction(degrees);
            let x = 1.0 - degrees.to_radians().cos();
            let share = 0.5 * (0.04 + 0.96 * x.powi(5));
            let (mut sum, count) = (0.0, 64);
            for i in 0..count * count {
                let u = Vec2::new((i % count) as f32 + 0.5, (i / count) as f32 + 0.5) / count as f32;
                if let Some(Draw::Direction { wi, .. }) = coated.sample(2, wo, u, false) {
                    let found = coated.evaluate(2, wo, wi, false);
                    sum += f64::from(found.value.x / found.pdf) / f64::from(count * count);
                }
            }
            assert!((sum / share - 1.0).abs() < 0.03, "{degrees}: {sum} for {share}");
            let mirrored = Vec3::new(-wo.x, 0.0, wo.z);
            let [bare, below] =
                [0.0, 0.5].map(|coat| layered(coat, 0.0, 0.8).evaluate(1, wo, mirrored, false));
            let ratio = f64::from(below.value.x / bare.value.x);
            assert!((ratio - (1.0 - share)).abs() < 1e-5, "{degrees}: {ratio}");
        }
    }

    /// A sample of the sheen is bounded however close to the horizon it is seen: `2π D V n_i` of
    /// the uniform half, twice. By the cosine alone it is not.
    #[test]
    fn samples_of_a_sheen_are_bounded() {
        let mut velvet = layered(0.0, 1.0, 0.0);
        velvet.sheen_alpha = LEAST_SHEEN_ALPHA;
        check_faults(&["by the cosine alone"], |fault| {
            let mut greatest = 0.0_f32;
            for (wo, steps) in [89.9, 89.0, 80.0, 45.0].map(|degrees| (direction(degrees), 200)) {
                for i in 0..steps * steps {
                    let u = Vec2::new((i % steps) as f32 + 0.5, (i / steps) as f32 + 0.5) / steps as f32;
                    if let Some(Draw::Direction { wi, .. }) = velvet.sample(1, wo, u, false) {
                        let found = velvet.evaluate(1, wo, wi, false);
                        let pdf = match fault {
                            Some(_) => wi.z / PI,
                            None => found.pdf,
                        };
                        greatest = greatest.max(found.value.x / pdf);
                    }
                }
            }
            let most = 2.0 * TAU * (2.0 + 1.0 / LEAST_SHEEN_ALPHA) / TAU / 4.0;
            match greatest < most {
                true => Ok(()),
                false => Err(format!("{greatest} beyond {most}")),
            }
        })
        .unwrap();
    }

    /// All that is scattered from `wo`.
    fn energy(layered: &Layered, wo: Vec3) -> f32 {
        let (mut sum, count) = (0.0, 96);
        for lobe in 0..3 {
            for i in 0..count * count {
                let u = Vec2::new((i % count) as f32 + 0.5, (i / count) as f32 + 0.5) / count as f32;
                if let Some(Draw::Direction { wi, .. }) = layered.sample(lobe, wo, u, false) {
                    let found = layered.evaluate(lobe, wo, wi, false);
                    if found.pdf > 0.0 {
                        sum += found.value.x / found.pdf / (count * count) as f32;
                    }
                }
            }
        }
        sum
    }

    /// Layers on white add no energy to it. The base alone has a little more than one close to the
    /// horizon, by glTF's formulas.
    #[test]
    fn layers_gain_no_energy() {
        for degrees in [0.0, 30.0, 60.0, 80.0, 87.0] {
            let wo = direction(degrees);
            let bare = energy(&layered(0.0, 0.0, 1.0), wo);
            for (coat, sheen) in [(1.0, 0.0), (0.0, 1.0), (0.7, 0.6)] {
                let found = energy(&layered(coat, sheen, 1.0), wo);
                assert!(
                    found < bare.max(1.0) + 0.02,
                    "{coat} {sheen} {degrees}: {found}, {bare}"
                );
                assert!(found > 0.5, "{coat} {sheen} {degrees}: {found}");
            }
        }
    }
}
