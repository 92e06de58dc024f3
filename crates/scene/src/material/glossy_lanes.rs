//! Scattering at eight vertices on glossy materials at a time.

use super::fresnel::conductor_lanes;
use super::glossy::GlossyRow;
use lightshed_lanes::{LANES, LaneKernel, LaneMask, Lanes, Vec3Lanes};
use lightshed_sampling::{CosineHemisphere, GgxLanes};
use std::f32::consts::FRAC_1_PI;

/// Vectors of eight lanes, coordinate by coordinate.
type Rows = [[f32; LANES]; 3];

/// What is asked about eight vertices. Directions are in the shading frames, mirrored so that
/// `outgoing` is above the surface.
#[derive(Clone, Copy, Debug)]
pub struct GlossyVertices {
    /// Towards the previous vertices.
    pub outgoing: Rows,
    /// Directions for which the scattering function is asked for.
    pub towards: Rows,
    /// Numbers in [0, 1) that choose the lobes.
    pub u_lobe: [f32; LANES],
    /// Numbers in [0, 1) that choose the directions.
    pub u: [[f32; LANES]; 2],
}

/// The answers.
#[derive(Clone, Copy, Debug)]
pub struct GlossyScattering {
    /// [`BsdfValue::value`](crate::BsdfValue::value) of the directions that were asked for.
    pub value: Rows,
    /// [`BsdfValue::pdf`](crate::BsdfValue::pdf) of them, per steradian.
    pub pdf_solid_angle: [f32; LANES],
    /// Sampled directions, [`BsdfSample::wi`](crate::BsdfSample::wi), mirrored as the vertices.
    pub direction: Rows,
    /// [`BsdfSample::weight`](crate::BsdfSample::weight).
    pub throughput: Rows,
    /// [`BsdfSample::pdf`](crate::BsdfSample::pdf), per steradian.
    pub direction_pdf_solid_angle: [f32; LANES],
    /// Lanes that have a sample; the last three are of no meaning in the others.
    pub scatters: u32,
}

/// [`Bsdf::evaluate`](crate::Bsdf::evaluate) and [`Bsdf::sample`](crate::Bsdf::sample) in lanes.
pub(crate) struct ScatterGlossy<'a> {
    pub materials: [&'a GlossyRow; LANES],
    /// Lanes whose albedo and tint are these.
    pub textured: u32,
    pub colors: &'a [Rows; 2],
    pub vertices: &'a GlossyVertices,
}

impl LaneKernel for ScatterGlossy<'_> {
    const HOT: bool = true;
    type Output = GlossyScattering;

    #[inline(always)]
    fn run<L: Lanes>(self) -> GlossyScattering {
        let surfaces = Surfaces::<L>::load(&self);
        let outgoing = load(&self.vertices.outgoing);
        let u = [L::load(&self.vertices.u[0]), L::load(&self.vertices.u[1])];
        let (wi, sampled) = surfaces.sample(outgoing, L::load(&self.vertices.u_lobe), u);
        // One after the other through the same code, which is long.
        let mut directions = [load(&self.vertices.towards), wi];
        let mut densities = [L::splat(0.0); 2];
        for side in 0..2 {
            let (value, pdf) = surfaces.evaluate(outgoing, directions[side]);
            (directions[side], densities[side]) = (value, pdf);
        }
        let [value, other] = directions;
        let [pdf, other_pdf] = densities;
        let weight = Vec3Lanes::new(other.x / other_pdf, other.y / other_pdf, other.z / other_pdf);
        let scatters = sampled & L::splat(0.0).less(other_pdf);
        GlossyScattering {
            value: value.store(),
            pdf_solid_angle: pdf.store(),
            direction: wi.store(),
            throughput: weight.store(),
            direction_pdf_solid_angle: other_pdf.store(),
            scatters: scatters.bits(),
        }
    }
}

/// Eight materials.
struct Surfaces<L: Lanes> {
    albedo: Vec3Lanes<L>,
    tint: Vec3Lanes<L>,
    eta: Vec3Lanes<L>,
    k: Vec3Lanes<L>,
    ggx: GgxLanes<L>,
    /// Shares in the blend of the base and of the conductor.
    weights: [L; 2],
    /// Probabilities of their lobes.
    shares: [L; 2],
    base_is_last: L::Mask,
    /// Whether any has a base.
    blended: bool,
    /// Whether all reflect whatever light comes, from any side.
    white: bool,
}

impl<L: Lanes> Surfaces<L> {
    #[inline(always)]
    fn load(asked: &ScatterGlossy<'_>) -> Self {
        let [r0, r1, r2, r3, r4, r5, r6, r7] = asked.materials;
        let [ar, ag, ab, tr, tg, tb, base, conductor] = L::load_transposed([
            &r0.0[0], &r1.0[0], &r2.0[0], &r3.0[0], &r4.0[0], &r5.0[0], &r6.0[0], &r7.0[0],
        ]);
        let [er, eg, eb, kr, kg, kb, alpha, last] = L::load_transposed([
            &r0.0[1], &r1.0[1], &r2.0[1], &r3.0[1], &r4.0[1], &r5.0[1], &r6.0[1], &r7.0[1],
        ]);
        let mut albedo = Vec3Lanes::new(ar, ag, ab);
        let mut tint = Vec3Lanes::new(tr, tg, tb);
        if asked.textured != 0 {
            let mask = L::Mask::from_bits(asked.textured);
            albedo = load(&asked.colors[0]).select(mask, albedo);
            tint = load(&asked.colors[1]).select(mask, tint);
        }
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        // As `Component::importance`. What has nothing to be compared with is always chosen.
        let importance = [base * albedo.max_element(), conductor * tint.max_element()];
        let total = importance[0] + importance[1];
        let (any, blended) = (zero.less(total), zero.less(base));
        let (eta, k) = (Vec3Lanes::new(er, eg, eb), Vec3Lanes::new(kr, kg, kb));
        let white = er.equal(zero) & eg.equal(zero) & eb.equal(zero) & kr.equal(one) & kg.equal(one);
        Self {
            albedo,
            tint,
            eta,
            k,
            ggx: GgxLanes::new(alpha),
            weights: [base, conductor],
            shares: [
                (importance[0] / total).select(any & blended, zero),
                (importance[1] / total).select(any, zero).select(blended, one),
            ],
            base_is_last: one.equal(last),
            blended: blended.bits() != 0,
            white: (white & kb.equal(one)).bits() == ALL,
        }
    }

    /// Values and densities in directions `wi`.
    #[inline(always)]
    fn evaluate(&self, wo: Vec3Lanes<L>, wi: Vec3Lanes<L>) -> (Vec3Lanes<L>, L) {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let nothing = Vec3Lanes::new(zero, zero, zero);
        let above = zero.less(wi.z);
        let h = (wo + wi).normalize_or(nothing);
        let facing = wo.dot(h);
        let density = self.ggx.visible_normal_density(wo, h) / (L::splat(4.0) * facing);
        let density = density.select(above & zero.less(facing), zero);
        let mut reflectance = self.tint;
        if !self.white {
            reflectance = reflectance * conductor_lanes(facing.max(zero).min(one), self.eta, self.k);
        }
        let value = reflectance * (density * self.ggx.masking(wi));
        let value = value.select(above, nothing) * self.weights[1];
        let pdf = density * self.shares[1];
        if !self.blended {
            return (value, pdf);
        }
        let density = wi.z.max(zero) * L::splat(FRAC_1_PI);
        let base = self.albedo * density * self.weights[0];
        (value + base, pdf + density * self.shares[0])
    }

    /// Directions, and where there are any that may have a density.
    #[inline(always)]
    fn sample(&self, wo: Vec3Lanes<L>, u_lobe: L, u: [L; 2]) -> (Vec3Lanes<L>, L::Mask) {
        let zero = L::splat(0.0);
        let h = self.ggx.sample_visible_normal(wo, u);
        let wi = h * (L::splat(2.0) * wo.dot(h)) - wo;
        let scatters = zero.less(wi.z);
        if !self.blended {
            return (wi, scatters);
        }
        let [base, conductor] = self.shares;
        let first = conductor.select(self.base_is_last, base);
        let second = base.select(self.base_is_last, conductor);
        let picks_first = zero.less(first) & (u_lobe.less(first) | !zero.less(second));
        let picks_base = (picks_first & !self.base_is_last) | (!picks_first & self.base_is_last);
        let any = zero.less(first) | zero.less(second);
        let diffuse = CosineHemisphere::sample_lanes(u);
        (diffuse.select(picks_base, wi), any & (picks_base | scatters))
    }
}

const ALL: u32 = (1 << LANES) - 1;

#[inline(always)]
fn load<L: Lanes>(rows: &Rows) -> Vec3Lanes<L> {
    Vec3Lanes::new(L::load(&rows[0]), L::load(&rows[1]), L::load(&rows[2]))
}
