//! Scattering at eight vertices on glossy materials at a time.

use super::fresnel::conductor_lanes;
use super::glossy::GlossyRow;
use lightshed_lanes::{Column, LANES, LaneKernel, LaneMask, Lanes, Vec3Lanes};
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

/// What is known of eight materials.
pub(crate) struct GlossyMaterials<'a> {
    pub rows: [&'a GlossyRow; LANES],
    /// Lanes whose albedo and tint are these.
    pub textured: u32,
    pub colors: [Rows; 2],
}

/// [`Bsdf::evaluate`](crate::Bsdf::evaluate) and [`Bsdf::sample`](crate::Bsdf::sample) in lanes.
pub(crate) struct ScatterGlossy<'a> {
    pub materials: GlossyMaterials<'a>,
    pub vertices: &'a GlossyVertices,
}

impl LaneKernel for ScatterGlossy<'_> {
    const HOT: bool = true;
    type Output = GlossyScattering;

    #[inline(always)]
    fn run<L: Lanes>(self) -> GlossyScattering {
        let (surfaces, base_is_last) = GlossyLanes::<L>::new(&self.materials);
        let outgoing = load(&self.vertices.outgoing);
        let u = [L::load(&self.vertices.u[0]), L::load(&self.vertices.u[1])];
        let (wi, sampled) = surfaces.sample(base_is_last, outgoing, L::load(&self.vertices.u_lobe), u);
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

/// Stores what eight materials scatter by, from `place` on.
pub(crate) struct StoreGlossy<'a> {
    pub materials: GlossyMaterials<'a>,
    pub place: usize,
    pub columns: &'a mut GlossyColumns,
}

impl LaneKernel for StoreGlossy<'_> {
    const HOT: bool = true;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (surfaces, _) = GlossyLanes::<L>::new(&self.materials);
        let values = surfaces.values();
        for (column, value) in self.columns.0.iter_mut().zip(values) {
            column.store(self.place, value);
        }
    }
}

/// What up to 64 glossy points scatter by, one column a number, for those who ask one point often:
/// see [`Scene::glossy_columns`](crate::Scene::glossy_columns).
#[derive(Clone, Debug)]
pub struct GlossyColumns([Column; VALUES]);

/// Numbers of one point.
const VALUES: usize = 17;

impl GlossyColumns {
    /// Points that scatter nothing.
    pub const NONE: Self = Self([const { Column::splat(0.0) }; VALUES]);

    /// Points `place` to `place + 7`; `place` is at most the capacity of a [`Column`].
    #[inline(always)]
    pub fn load<L: Lanes>(&self, place: usize) -> GlossyLanes<L> {
        let mut values = [L::splat(0.0); VALUES];
        for (value, column) in values.iter_mut().zip(&self.0) {
            *value = column.load(place);
        }
        GlossyLanes::of(values)
    }

    /// The point `index`, modulo the capacity of a [`Column`], in all lanes.
    #[inline(always)]
    pub fn splat<L: Lanes>(&self, index: usize) -> GlossyLanes<L> {
        let mut values = [L::splat(0.0); VALUES];
        for (value, column) in values.iter_mut().zip(&self.0) {
            *value = L::splat(column.get(index));
        }
        GlossyLanes::of(values)
    }
}

/// What eight glossy points scatter by.
#[derive(Clone, Copy, Debug)]
pub struct GlossyLanes<L: Lanes> {
    albedo: Vec3Lanes<L>,
    tint: Vec3Lanes<L>,
    eta: Vec3Lanes<L>,
    k: Vec3Lanes<L>,
    alpha: L,
    /// Shares in the blend of the base and of the conductor.
    weights: [L; 2],
    /// Probabilities of their lobes.
    shares: [L; 2],
    /// Whether any has a base.
    blended: bool,
    /// Whether all reflect whatever light comes, from any side.
    white: bool,
}

impl<L: Lanes> GlossyLanes<L> {
    /// Of eight materials, and in which of them the base comes last.
    #[inline(always)]
    fn new(asked: &GlossyMaterials<'_>) -> (Self, L::Mask) {
        let [r0, r1, r2, r3, r4, r5, r6, r7] = asked.rows;
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
        let shares = [
            (importance[0] / total).select(any & blended, zero),
            (importance[1] / total).select(any, zero).select(blended, one),
        ];
        let ([ar, ag, ab], [tr, tg, tb]) = ([albedo.x, albedo.y, albedo.z], [tint.x, tint.y, tint.z]);
        let surfaces = Self::of([
            ar, ag, ab, tr, tg, tb, er, eg, eb, kr, kg, kb, alpha, base, conductor, shares[0], shares[1],
        ]);
        (surfaces, one.equal(last))
    }

    #[inline(always)]
    fn of(values: [L; VALUES]) -> Self {
        let [
            ar,
            ag,
            ab,
            tr,
            tg,
            tb,
            er,
            eg,
            eb,
            kr,
            kg,
            kb,
            alpha,
            base,
            conductor,
            own,
            other,
        ] = values;
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let white = er.equal(zero) & eg.equal(zero) & eb.equal(zero) & kr.equal(one) & kg.equal(one);
        Self {
            albedo: Vec3Lanes::new(ar, ag, ab),
            tint: Vec3Lanes::new(tr, tg, tb),
            eta: Vec3Lanes::new(er, eg, eb),
            k: Vec3Lanes::new(kr, kg, kb),
            alpha,
            weights: [base, conductor],
            shares: [own, other],
            blended: zero.less(base).bits() != 0,
            white: (white & kb.equal(one)).bits() == ALL,
        }
    }

    #[inline(always)]
    fn values(&self) -> [L; VALUES] {
        let [base, conductor] = self.weights;
        let [own, other] = self.shares;
        let ([ar, ag, ab], [tr, tg, tb]) = (parts(self.albedo), parts(self.tint));
        let ([er, eg, eb], [kr, kg, kb]) = (parts(self.eta), parts(self.k));
        [
            ar, ag, ab, tr, tg, tb, er, eg, eb, kr, kg, kb, self.alpha, base, conductor, own, other,
        ]
    }

    /// [`BsdfValue::value`](crate::BsdfValue::value) and [`BsdfValue::pdf`](crate::BsdfValue::pdf),
    /// both per steradian, of directions `wi` seen from `wo`. These are unit vectors in the shading
    /// frames, mirrored so that `wo` is above the surface.
    #[inline(always)]
    pub fn evaluate(&self, wo: Vec3Lanes<L>, wi: Vec3Lanes<L>) -> (Vec3Lanes<L>, L) {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let nothing = Vec3Lanes::new(zero, zero, zero);
        let above = zero.less(wi.z);
        let h = (wo + wi).normalize_or(nothing);
        let facing = wo.dot(h);
        let ggx = GgxLanes::new(self.alpha);
        let density = ggx.visible_normal_density(wo, h) / (L::splat(4.0) * facing);
        let density = density.select(above & zero.less(facing), zero);
        let mut reflectance = self.tint;
        if !self.white {
            reflectance = reflectance * conductor_lanes(facing.max(zero).min(one), self.eta, self.k);
        }
        let value = reflectance * (density * ggx.masking(wi));
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
    fn sample(
        &self,
        base_is_last: L::Mask,
        wo: Vec3Lanes<L>,
        u_lobe: L,
        u: [L; 2],
    ) -> (Vec3Lanes<L>, L::Mask) {
        let zero = L::splat(0.0);
        let h = GgxLanes::new(self.alpha).sample_visible_normal(wo, u);
        let wi = h * (L::splat(2.0) * wo.dot(h)) - wo;
        let scatters = zero.less(wi.z);
        if !self.blended {
            return (wi, scatters);
        }
        let [base, conductor] = self.shares;
        let first = conductor.select(base_is_last, base);
        let second = base.select(base_is_last, conductor);
        let picks_first = zero.less(first) & (u_lobe.less(first) | !zero.less(second));
        let picks_base = (picks_first & !base_is_last) | (!picks_first & base_is_last);
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

#[inline(always)]
fn parts<L: Lanes>(v: Vec3Lanes<L>) -> [L; 3] {
    [v.x, v.y, v.z]
}
