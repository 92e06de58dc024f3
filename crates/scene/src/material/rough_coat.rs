//! Transmittance of a rough dielectric boundary, tabulated.
//!
//! With visible normals `h` of density `D_v` seen from the direction at `μ = cos θ`, `wt` the
//! direction refracted in `h` and `wr` the one reflected:
//! - transmittance from outside `T(μ; α, η) = ∫ D_v(h) (1 − F(wo·h; η)) G1(wt) dh`
//! - reflectance for diffuse light from inside
//!   `R_int(α, η) = 2 ∫_0^1 μ ∫ D_v(h) F(wo·h; 1/η) G1(wr) dh dμ`
//!
//! both with single scattering only. They vary smoothly, so that a table of a few thousand entries,
//! computed on first use, holds them to about 2e-3. Axes: `√μ`, `√α` over `[0, 1]` and
//! `√r`, `r = (η − 1)/(η + 1)`, over `r ∈ [0, ½]`, that is `η ∈ [1, 3]`; interpolation
//! is cubic. Values outside are clamped to these ranges; anisotropic roughness enters by its
//! geometric mean.

use super::fresnel;
use super::microfacet::Distribution;
use crate::material::Microfacet;
use glam::Vec3;
use std::sync::LazyLock;

/// Angles at which the quadrature is done.
const COARSE_MU_NODES: usize = 24;
/// Angles in the table, filled in by cubic interpolation, between which it is linear.
const MU_NODES: usize = 6 * (COARSE_MU_NODES - 1) + 1;
const ALPHA_NODES: usize = 14;
const ETA_NODES: usize = 10;
/// Largest `r = (η − 1)/(η + 1)`.
const MAX_R: f32 = 0.5;
/// Nodes in polar angle and azimuth of the quadrature over visible normals.
const NORMAL_NODES: [usize; 2] = [24, 12];
/// Nodes of the quadrature over angles in `R_int`.
const INTERNAL_MU_NODES: usize = 16;

/// Largest index of refraction that the tables hold.
pub(super) const MAX_ETA: f32 = 3.0;

struct Tables {
    /// `[eta][alpha][mu]`.
    transmittance: Vec<f32>,
    /// `[eta][alpha]`.
    internal_reflectance: Vec<f32>,
}

static GGX: LazyLock<Tables> = LazyLock::new(|| Tables::new(Microfacet::Ggx));
static BECKMANN: LazyLock<Tables> = LazyLock::new(|| Tables::new(Microfacet::Beckmann));

fn tables(distribution: &Distribution) -> &'static Tables {
    match distribution {
        Distribution::Ggx(_) => &GGX,
        Distribution::Beckmann(_) => &BECKMANN,
    }
}

/// Computes the tables of a distribution unless they exist.
pub(super) fn prepare(kind: Microfacet) {
    match kind {
        Microfacet::Ggx => LazyLock::force(&GGX),
        Microfacet::Beckmann => LazyLock::force(&BECKMANN),
    };
}

/// `T(cos θ; α, η)`.
pub(super) fn transmittance(distribution: &Distribution, eta: f32, cos: f32) -> f32 {
    let table = &tables(distribution).transmittance;
    let position = cos.clamp(0.0, 1.0).sqrt() * (MU_NODES - 1) as f32;
    let node = (position as usize).min(MU_NODES - 2);
    let share = position - node as f32;
    interpolate(distribution, eta, |row| {
        let row = row * MU_NODES + node;
        table[row] + (table[row + 1] - table[row]) * share
    })
    .clamp(0.0, 1.0)
}

/// `T(cos θ; α, η)` at equal steps of `√cos θ` from 0 to 1, between which it is linear.
pub(super) fn transmittances(distribution: &Distribution, eta: f32) -> Vec<f32> {
    let table = &tables(distribution).transmittance;
    let node = |node| interpolate(distribution, eta, |row| table[row * MU_NODES + node]);
    (0..MU_NODES).map(node).collect()
}

/// `R_int(α, η)`.
pub(super) fn internal_reflectance(distribution: &Distribution, eta: f32) -> f32 {
    let table = &tables(distribution).internal_reflectance;
    interpolate(distribution, eta, |row| table[row]).clamp(0.0, 1.0)
}

/// Cubic interpolation of `value(eta node · ALPHA_NODES + alpha node)`.
fn interpolate(distribution: &Distribution, eta: f32, value: impl Fn(usize) -> f32) -> f32 {
    let r = ((eta - 1.0) / (eta + 1.0)).clamp(0.0, MAX_R) / MAX_R;
    let (eta_node, eta_weights) = cubic(r.sqrt() * (ETA_NODES - 1) as f32, ETA_NODES);
    let alpha = distribution.mean_alpha().min(1.0).sqrt();
    let (alpha_node, alpha_weights) = cubic(alpha * (ALPHA_NODES - 1) as f32, ALPHA_NODES);
    let mut sum = 0.0;
    for (i, eta_weight) in eta_weights.iter().enumerate() {
        let row = (eta_node + i) * ALPHA_NODES + alpha_node;
        let inner: f32 = alpha_weights
            .iter()
            .enumerate()
            .map(|(j, w)| w * value(row + j))
            .sum();
        sum += eta_weight * inner;
    }
    sum
}

/// First of four nodes around `position` and the weights of Lagrange's cubic through them.
fn cubic(position: f32, count: usize) -> (usize, [f32; 4]) {
    let first = (position as usize).saturating_sub(1).min(count - 4);
    let t = position - first as f32;
    let (a, b, c, d) = (t, t - 1.0, t - 2.0, t - 3.0);
    (
        first,
        [
            b * c * d / -6.0,
            a * c * d / 2.0,
            a * b * d / -2.0,
            a * b * c / 6.0,
        ],
    )
}

impl Tables {
    fn new(kind: Microfacet) -> Self {
        let mut transmittance = Vec::with_capacity(ETA_NODES * ALPHA_NODES * MU_NODES);
        let mut internal_reflectance = Vec::with_capacity(ETA_NODES * ALPHA_NODES);
        for eta_node in 0..ETA_NODES {
            let r = MAX_R * (eta_node as f32 / (ETA_NODES - 1) as f32).powi(2);
            let eta = (1.0 + r) / (1.0 - r);
            for alpha_node in 0..ALPHA_NODES {
                let root = alpha_node as f32 / (ALPHA_NODES - 1) as f32;
                let alpha = root * root;
                let coarse: [f32; COARSE_MU_NODES] = std::array::from_fn(|node| {
                    let root = node as f32 / (COARSE_MU_NODES - 1) as f32;
                    transmitted(kind, alpha, eta, root * root)
                });
                transmittance.extend((0..MU_NODES).map(|node| {
                    let position = node as f32 * (COARSE_MU_NODES - 1) as f32 / (MU_NODES - 1) as f32;
                    let (first, weights) = cubic(position, COARSE_MU_NODES);
                    weights
                        .iter()
                        .zip(&coarse[first..])
                        .map(|(w, value)| w * value)
                        .sum::<f32>()
                }));
                // Midpoints in √μ: μ dμ = 2 s³ ds.
                let sum: f32 = (0..INTERNAL_MU_NODES)
                    .map(|i| {
                        let s = (i as f32 + 0.5) / INTERNAL_MU_NODES as f32;
                        2.0 * s * s * s * reflected(kind, alpha, 1.0 / eta, s * s)
                    })
                    .sum();
                internal_reflectance.push(2.0 * sum / INTERNAL_MU_NODES as f32);
            }
        }
        Self {
            transmittance,
            internal_reflectance,
        }
    }
}

/// Mean of `f(wo, h)` over visible normals, `∫ D_v(h) f dh`.
///
/// Laid out by `D(h) cos θ_h dh = dξ dφ/2π`, whose `tan θ_h` is closed form for both
/// distributions, over the azimuths from which `h` faces `wo` only, so that the integrand has no
/// kink: `cos φ > −cot θ_o / tan θ_h`.
fn mean_over_normals(kind: Microfacet, alpha: f32, mu: f32, f: impl Fn(Vec3, Vec3) -> f32) -> f32 {
    // Exactly at the horizon nothing is visible: the limit is taken.
    let mu = mu.max(1e-4);
    let alpha = alpha.max(1e-3);
    let wo = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
    let [rings, sectors] = NORMAL_NODES;
    let (mut sum, mut weights) = (0.0, 0.0);
    for ring in 0..rings {
        // Nodes crowd at both ends, where the tails are: ξ = s³(10 − 15s + 6s²), 1 − ξ the
        // same of r = 1 − s.
        let s = (ring as f32 + 0.5) / rings as f32;
        let r = 1.0 - s;
        let xi = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
        let rest = r * r * r * (10.0 - 15.0 * r + 6.0 * r * r);
        let tan = match kind {
            Microfacet::Ggx => alpha * (xi / rest).sqrt(),
            Microfacet::Beckmann => alpha * (-rest.ln()).sqrt(),
        };
        let cos = 1.0 / (1.0 + tan * tan).sqrt();
        let visible = (-wo.z / (wo.x * tan).max(f32::MIN_POSITIVE)).max(-1.0).acos();
        for sector in 0..sectors {
            let phi = visible * (sector as f32 + 0.5) / sectors as f32;
            let h = Vec3::new(tan * cos * phi.cos(), tan * cos * phi.sin(), cos);
            let weight = s * s * r * r * visible * wo.dot(h).max(0.0) / cos;
            weights += weight;
            sum += weight * f(wo, h);
        }
    }
    // The density integrates to one: dividing by its own quadrature cancels most of the error.
    sum / weights
}

fn transmitted(kind: Microfacet, alpha: f32, eta: f32, mu: f32) -> f32 {
    let distribution = Distribution::new(kind, alpha, alpha);
    mean_over_normals(kind, alpha, mu, |wo, h| {
        let cos = wo.dot(h).clamp(0.0, 1.0);
        let interface = fresnel::dielectric(cos, eta);
        let wt = (cos / eta - interface.cos_transmitted) * h - wo / eta;
        if wt.z < 0.0 {
            (1.0 - interface.reflectance) * distribution.masking(wt)
        } else {
            0.0
        }
    })
}

fn reflected(kind: Microfacet, alpha: f32, eta: f32, mu: f32) -> f32 {
    let distribution = Distribution::new(kind, alpha, alpha);
    mean_over_normals(kind, alpha, mu, |wo, h| {
        let cos = wo.dot(h).clamp(0.0, 1.0);
        let wr = 2.0 * cos * h - wo;
        if wr.z > 0.0 {
            fresnel::dielectric(cos, eta).reflectance * distribution.masking(wr)
        } else {
            0.0
        }
    })
}
