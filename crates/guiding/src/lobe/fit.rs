//! The fit of the table: for each cell the linearly transformed cosine of greatest likelihood.
//!
//! Directions are sampled by visible normals of GGX (Heitz 2018) and weigh `G1(ω)`, so that they
//! follow the lobe of a white microfacet surface with separable masking. The fit maximises
//! `Σ w ln((1 − ε) D(ω) + ε cos θ/π)`: a lobe that gives a direction next to nothing is as bad
//! as it would be as a density of samples. All in `f64`.

use super::table::SIZE;
use super::{cosine_at, roughness_at};
use std::f64::consts::PI;

/// Share of the cosine in the likelihood.
const DEFENSIVE: f64 = 0.05;
/// What a unit of shear costs in likelihood.
const SHEAR: f64 = 2e-3;
/// Samples along each axis.
const SAMPLES: usize = 40;

pub type V = [f64; 3];

pub fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn unit(a: V) -> V {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}

fn masking(alpha: f64, cosine: f64) -> f64 {
    let squared = cosine * cosine;
    2.0 / (1.0 + (1.0 + alpha * alpha * (1.0 - squared) / squared).sqrt())
}

/// `f cos θ` of a white microfacet surface.
pub fn ggx(alpha: f64, wo: V, wi: V) -> f64 {
    if wi[2] <= 0.0 || wo[2] <= 0.0 {
        return 0.0;
    }
    let h = unit([wo[0] + wi[0], wo[1] + wi[1], wo[2] + wi[2]]);
    let a2 = alpha * alpha;
    let bottom = (h[0] * h[0] + h[1] * h[1]) / a2 + h[2] * h[2];
    let normals = 1.0 / (PI * a2 * bottom * bottom);
    normals * masking(alpha, wo[2]) * masking(alpha, wi[2]) / (4.0 * wo[2])
}

/// A direction by visible normals, and its weight.
pub fn ggx_sample(alpha: f64, wo: V, u: [f64; 2]) -> Option<(V, f64)> {
    let v = unit([alpha * wo[0], alpha * wo[1], wo[2]]);
    let across = v[0].hypot(v[1]);
    let t1 = if across > 0.0 {
        [-v[1] / across, v[0] / across, 0.0]
    } else {
        [1.0, 0.0, 0.0]
    };
    let t2 = [
        v[1] * t1[2] - v[2] * t1[1],
        v[2] * t1[0] - v[0] * t1[2],
        v[0] * t1[1] - v[1] * t1[0],
    ];
    let (r, phi) = (u[0].sqrt(), 2.0 * PI * u[1]);
    let (x, y) = (r * phi.cos(), r * phi.sin());
    let s = 0.5 * (1.0 + v[2]);
    let y = (1.0 - s) * (1.0 - x * x).max(0.0).sqrt() + s * y;
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    let n: V = std::array::from_fn(|i| x * t1[i] + y * t2[i] + z * v[i]);
    let h = unit([alpha * n[0], alpha * n[1], n[2].max(0.0)]);
    let along = 2.0 * dot(wo, h);
    let wi: V = std::array::from_fn(|i| along * h[i] - wo[i]);
    (wi[2] > 0.0).then(|| (wi, masking(alpha, wi[2])))
}

/// `D(ω)` of a row of the table, for a roughness and a viewer in the half-plane of x below zero.
pub fn density(row: [f64; 4], alpha: f64, wo: V, wi: V) -> f64 {
    let [offset, along, shear, across] = row;
    let (m11, m22) = (along * alpha, across * alpha);
    // Angles from the normal: of the mirrored viewer, of the peak from there, back by the shear.
    let peak = (-wo[0]).atan2(wo[2]) + (offset * alpha).clamp(-1.0, 1.0).asin();
    let (sine, cosine) = (peak - shear.atan()).sin_cos();
    let (x, z) = ([cosine, 0.0, -sine], [sine, 0.0, cosine]);
    let (px, pz) = (dot(x, wi), dot(z, wi));
    let w = [(px - shear * pz) / m11, wi[1] / m22, pz];
    let squared = dot(w, w);
    w[2].max(0.0) / (PI * m11 * m22 * squared * squared)
}

fn samples(alpha: f64, wo: V) -> Vec<(V, f64)> {
    let mut found = Vec::new();
    for i in 0..SAMPLES {
        for j in 0..SAMPLES {
            let u = [
                (i as f64 + 0.5) / SAMPLES as f64,
                (j as f64 + 0.5) / SAMPLES as f64,
            ];
            found.extend(ggx_sample(alpha, wo, u));
        }
    }
    found
}

fn loss(row: [f64; 4], alpha: f64, wo: V, samples: &[(V, f64)]) -> f64 {
    let sum: f64 = samples
        .iter()
        .map(|&(wi, weight)| {
            let mixed = (1.0 - DEFENSIVE) * density(row, alpha, wo, wi) + DEFENSIVE * wi[2] / PI;
            -weight * mixed.ln()
        })
        .sum();
    // A likelihood that is not a number is the worst.
    if sum.is_finite() { sum } else { f64::INFINITY }
}

/// Nelder and Mead's simplex search.
fn minimise(start: [f64; 4], f: impl Fn([f64; 4]) -> f64) -> [f64; 4] {
    let mut simplex: Vec<([f64; 4], f64)> = (0..5)
        .map(|i| {
            let mut p = start;
            if i > 0 {
                p[i - 1] += 0.1;
            }
            (p, f(p))
        })
        .collect();
    for _ in 0..400 {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        if simplex[4].1 - simplex[0].1 < 1e-9 * simplex[0].1.abs() {
            break;
        }
        let middle: [f64; 4] =
            std::array::from_fn(|k| simplex[..4].iter().map(|s| s.0[k]).sum::<f64>() / 4.0);
        let worst = simplex[4].0;
        let at = |t: f64| {
            let p: [f64; 4] = std::array::from_fn(|k| middle[k] + t * (worst[k] - middle[k]));
            (p, f(p))
        };
        let reflected = at(-1.0);
        if reflected.1 < simplex[0].1 {
            let expanded = at(-2.0);
            simplex[4] = if expanded.1 < reflected.1 {
                expanded
            } else {
                reflected
            };
        } else if reflected.1 < simplex[3].1 {
            simplex[4] = reflected;
        } else {
            let contracted = at(if reflected.1 < simplex[4].1 { -0.5 } else { 0.5 });
            if contracted.1 < simplex[4].1.min(reflected.1) {
                simplex[4] = contracted;
            } else {
                let best = simplex[0].0;
                for s in &mut simplex[1..] {
                    s.0 = std::array::from_fn(|k| best[k] + 0.5 * (s.0[k] - best[k]));
                    s.1 = f(s.0);
                }
            }
        }
    }
    simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
    simplex[0].0
}

/// The row of the table for a roughness and the viewer's cosine.
pub fn fit(alpha: f64, cosine: f64) -> [f64; 4] {
    let wo = [-(1.0 - cosine * cosine).sqrt(), 0.0, cosine];
    let samples = samples(alpha, wo);
    let total: f64 = samples.iter().map(|(_, w)| w).sum();
    // Logarithms of what has to be positive.
    let row = |p: [f64; 4]| [p[0], p[1].exp(), p[2], p[3].exp()];
    // Of a narrow lobe, axis and shear say the same: the least shear is taken.
    let f = |p: [f64; 4]| loss(row(p), alpha, wo, &samples) + SHEAR * total * p[2] * p[2];
    // Once more from what was found: a simplex may be stuck.
    row(minimise(minimise([0.0, 0.5, 0.0, 0.5], f), f))
}

/// The whole table.
pub fn table() -> Vec<[f32; 4]> {
    let row = |i: usize| fit(roughness_at(i / SIZE).into(), cosine_at(i % SIZE).into());
    (0..SIZE * SIZE).map(|i| row(i).map(|x| x as f32)).collect()
}
