//! Properties of every lobe of every material, held to `f64` oracles.
//!
//! A lobe under test is seen through [`Subject`], which can plant a fault, so that each property is
//! also seen to fail.

mod density;
mod furnace;
mod glossy;
mod hostile;
mod oracle;
mod pointwise;
mod reciprocity;
mod rough_coat;
mod selection;
mod validation;

use super::{Bsdf, BsdfValue, ConductorIor, Layers, LobeSample, Material, Microfacet, Roughness};
use crate::Rgb;
use glam::{Vec2, Vec3};
use lightshed_sampling::{Density, Ggx, MicrofacetDistribution, ONE_MINUS_EPSILON};
use lightshed_testkit::integrate_rectangle;

const GGX: Microfacet = Microfacet::Ggx;
const BECKMANN: Microfacet = Microfacet::Beckmann;

/// Angles from the normal, in degrees.
const ANGLES: [f32; 9] = [0.0, 20.0, 45.0, 60.0, 75.0, 85.0, 88.0, 89.5, 89.9];

/// The unit direction at `degrees` from the normal, off the axes of the tangent frame.
fn direction(degrees: f32) -> Vec3 {
    direction_at(degrees, 0.7)
}

fn direction_at(degrees: f32, azimuth: f32) -> Vec3 {
    let (sin, cos) = (degrees as f64).to_radians().sin_cos();
    let (sin_phi, cos_phi) = (azimuth as f64).sin_cos();
    glam::DVec3::new(sin * cos_phi, sin * sin_phi, cos).as_vec3()
}

fn rough(distribution: Microfacet, alpha_u: f32, alpha_v: f32) -> Roughness {
    Roughness {
        distribution,
        alpha_u: alpha_u.into(),
        alpha_v: alpha_v.into(),
    }
}

fn diffuse(reflectance: f32) -> Material {
    Material::Diffuse {
        reflectance: Rgb::splat(reflectance).into(),
    }
}

fn mirror() -> Material {
    Material::Mirror {
        reflectance: Rgb::ONE.into(),
    }
}

/// Gold, roughly.
const GOLD: ConductorIor = ConductorIor {
    eta: Rgb::new(0.143, 0.375, 1.442),
    k: Rgb::new(3.983, 2.386, 1.603),
};

fn conductor(roughness: Option<Roughness>) -> Material {
    Material::Conductor {
        ior: GOLD,
        roughness,
        specular_reflectance: Rgb::ONE.into(),
    }
}

fn dielectric(eta: f32, roughness: Option<Roughness>) -> Material {
    Material::Dielectric {
        eta,
        roughness,
        specular_reflectance: Rgb::ONE.into(),
        specular_transmittance: Rgb::ONE.into(),
    }
}

fn thin_dielectric(eta: f32) -> Material {
    Material::ThinDielectric {
        eta,
        specular_reflectance: Rgb::ONE.into(),
        specular_transmittance: Rgb::ONE.into(),
    }
}

fn plastic(nonlinear: bool, roughness: Option<Roughness>) -> Material {
    Material::Plastic {
        eta: 1.49,
        diffuse_reflectance: Rgb::new(0.8, 0.4, 0.1).into(),
        specular_reflectance: Rgb::ONE.into(),
        nonlinear,
        roughness,
    }
}

fn metallic_roughness(metallic: f32, roughness: f32, transmission: f32) -> Material {
    Material::MetallicRoughness {
        base_color: Rgb::new(0.9, 0.6, 0.2).into(),
        metallic: metallic.into(),
        roughness: roughness.into(),
        transmission: transmission.into(),
        ior: 1.5,
    }
}

fn layered(coat: f32, sheen: Rgb) -> Material {
    Material::Layered {
        base: Box::new(metallic_roughness(0.3, 0.6, 0.0)),
        layers: Box::new(Layers {
            coat: coat.into(),
            coat_roughness: 0.4.into(),
            sheen: sheen.into(),
            sheen_roughness: 0.7.into(),
        }),
    }
}

fn two_sided(front: Material, back: Option<Material>) -> Material {
    Material::TwoSided {
        front: Box::new(front),
        back: back.map(Box::new),
    }
}

fn blend(weight: f32, first: Material, second: Material) -> Material {
    Material::Blend {
        weight: weight.into(),
        first: Box::new(first),
        second: Box::new(second),
    }
}

/// One of each, with a name for messages.
fn zoo() -> Vec<(&'static str, Material)> {
    vec![
        ("diffuse", diffuse(0.7)),
        ("mirror", mirror()),
        ("smooth conductor", conductor(None)),
        ("ggx conductor", conductor(Some(rough(GGX, 0.3, 0.3)))),
        ("anisotropic ggx conductor", conductor(Some(rough(GGX, 0.1, 0.5)))),
        ("beckmann conductor", conductor(Some(rough(BECKMANN, 0.2, 0.2)))),
        (
            "anisotropic beckmann conductor",
            conductor(Some(rough(BECKMANN, 0.6, 0.15))),
        ),
        ("smooth dielectric", dielectric(1.5, None)),
        ("ggx dielectric", dielectric(1.5, Some(rough(GGX, 0.3, 0.3)))),
        (
            "anisotropic ggx dielectric",
            dielectric(1.33, Some(rough(GGX, 0.2, 0.5))),
        ),
        (
            "beckmann dielectric",
            dielectric(1.5, Some(rough(BECKMANN, 0.25, 0.25))),
        ),
        ("air bubble", dielectric(0.75, Some(rough(GGX, 0.3, 0.3)))),
        ("thin dielectric", thin_dielectric(1.5)),
        ("plastic", plastic(false, None)),
        ("nonlinear plastic", plastic(true, None)),
        ("ggx plastic", plastic(true, Some(rough(GGX, 0.2, 0.2)))),
        (
            "beckmann plastic",
            plastic(false, Some(rough(BECKMANN, 0.3, 0.3))),
        ),
        ("gltf dielectric", metallic_roughness(0.0, 0.5, 0.0)),
        ("gltf metal", metallic_roughness(1.0, 0.6, 0.0)),
        ("gltf transmission", metallic_roughness(0.2, 0.7, 0.8)),
        ("gltf clear coat", layered(1.0, Rgb::ZERO)),
        ("gltf sheen", layered(0.0, Rgb::new(0.3, 0.6, 0.9))),
        (
            "gltf sheen below a coat",
            two_sided(layered(0.5, Rgb::new(0.9, 0.2, 0.2)), None),
        ),
        ("two-sided diffuse", two_sided(diffuse(0.4), None)),
        (
            "two-sided with two faces",
            two_sided(conductor(Some(rough(GGX, 0.4, 0.4))), Some(diffuse(0.9))),
        ),
        (
            "blend",
            blend(0.3, diffuse(0.5), conductor(Some(rough(BECKMANN, 0.3, 0.3)))),
        ),
        (
            "nested blend",
            two_sided(
                blend(0.6, mirror(), blend(0.5, diffuse(0.2), plastic(true, None))),
                None,
            ),
        ),
    ]
}

/// Faults to plant into a lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// The density of a reflection is left that of the half vector.
    NoHalfVectorJacobian,
    /// Height-correlated masking in place of the separable.
    HeightCorrelated { alpha: f32 },
    /// The density is not joint with the choice of the lobe.
    NoLobeProbability,
    /// Transmitted radiance is not scaled by `1/η²`.
    NoEtaSquared { eta: f32 },
    /// The value lacks `|cos θ_i|`.
    NoCosine,
    /// The density is that of the direction pushed towards the normal.
    ShiftedDensity,
}

/// A BSDF with perhaps a fault in it.
struct Subject {
    bsdf: Bsdf,
    fault: Option<Fault>,
}

impl Subject {
    fn new(material: &Material, fault: Option<Fault>) -> Self {
        material.validate().expect("sound test material");
        Self {
            bsdf: material.at(Vec2::ZERO),
            fault,
        }
    }

    fn corrupt(&self, lobe: u8, wo: Vec3, wi: Vec3, mut value: Rgb, mut pdf: f32) -> BsdfValue {
        let reflects = wo.z * wi.z > 0.0;
        match self.fault {
            Some(Fault::NoHalfVectorJacobian) if reflects => {
                pdf *= 4.0 * wo.dot((wo + wi).normalize_or_zero());
            }
            Some(Fault::HeightCorrelated { alpha }) if reflects => {
                let ggx = Ggx::new(alpha, alpha);
                let separable = ggx.masking(wo) * ggx.masking(wi);
                if separable > 0.0 {
                    value *= ggx.masking_shadowing(wo, wi) / separable;
                }
            }
            Some(Fault::NoLobeProbability) => pdf /= self.bsdf.lobe_probability(lobe, wo).max(1e-6),
            Some(Fault::NoEtaSquared { eta }) if !reflects => value *= relative(eta, wo).powi(2),
            Some(Fault::NoCosine) => value /= wi.z.abs().max(1e-6),
            _ => {}
        }
        BsdfValue {
            value,
            pdf: Density::new(pdf),
        }
    }

    fn evaluate_lobe(&self, lobe: u8, wo: Vec3, wi: Vec3) -> BsdfValue {
        let seen = match self.fault {
            Some(Fault::ShiftedDensity) => (wi + Vec3::new(0.0, 0.0, 0.05 * wi.z.signum())).normalize(),
            _ => wi,
        };
        let found = self.bsdf.evaluate_lobe(lobe, wo, seen);
        self.corrupt(lobe, wo, wi, found.value, found.pdf.value())
    }

    fn sample_lobe(&self, lobe: u8, wo: Vec3, u: Vec2) -> Option<LobeSample> {
        let sample = self.bsdf.sample_lobe(lobe, wo, u)?;
        let BsdfValue { value, pdf } = self.corrupt(lobe, wo, sample.wi, sample.value, sample.pdf.value());
        Some(LobeSample { value, pdf, ..sample })
    }
}

/// Index of the far side over that of the side of `wo`.
fn relative(eta: f32, wo: Vec3) -> f32 {
    if wo.z > 0.0 { eta } else { 1.0 / eta }
}

/// Midpoints of a `side × side` grid over the unit square.
fn grid(side: usize) -> impl Iterator<Item = Vec2> {
    let step = 1.0 / side as f32;
    (0..side * side).map(move |i| Vec2::new((i % side) as f32 + 0.5, (i / side) as f32 + 0.5) * step)
}

/// `∫∫ f` over the unit square, adaptively, with nodes crowding at its edges: there lie the
/// tails of distributions.
fn integrate_unit_square(f: impl Fn(f64, f64) -> f64, tolerance: f64) -> f64 {
    // u = s³(10 − 15s + 6s²), du = 30 s²(1−s)² ds.
    let stretch = |s: f64| {
        (
            s * s * s * (10.0 - 15.0 * s + 6.0 * s * s),
            30.0 * (s * (1.0 - s)).powi(2),
        )
    };
    let integrand = |s: f64, t: f64| {
        let ((u, du), (v, dv)) = (stretch(s), stretch(t));
        f(u, v) * du * dv
    };
    let corners = [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.5, 0.5]];
    corners
        .iter()
        .map(|low| integrate_rectangle(integrand, *low, [low[0] + 0.5, low[1] + 0.5], 0.25 * tolerance).value)
        .sum()
}

/// Mean of `f` of a sample of the lobe (zero for lost ones) over its random numbers.
fn mean_over_samples(
    subject: &Subject,
    lobe: u8,
    wo: Vec3,
    tolerance: f64,
    f: impl Fn(&LobeSample) -> f64,
) -> f64 {
    let integrand = |u: f64, v: f64| {
        let u = Vec2::new(
            (u as f32).min(ONE_MINUS_EPSILON),
            (v as f32).min(ONE_MINUS_EPSILON),
        );
        subject.sample_lobe(lobe, wo, u).map_or(0.0, |sample| f(&sample))
    };
    if subject.bsdf.is_delta(lobe) {
        integrand(0.5, 0.5)
    } else {
        integrate_unit_square(integrand, tolerance)
    }
}

/// `∫ η_i² f_l |cos θ_i| dω_i` by sampling the lobe: the share of *power* that it scatters,
/// in one colour channel.
fn sampled_albedo(subject: &Subject, lobe: u8, wo: Vec3, channel: usize) -> f64 {
    mean_over_samples(subject, lobe, wo, 2e-4, |sample| {
        let power = f64::from(sample.value[channel] * sample.eta * sample.eta);
        if sample.is_delta {
            power
        } else {
            power * f64::from(sample.probability) / f64::from(sample.pdf.value())
        }
    })
}
