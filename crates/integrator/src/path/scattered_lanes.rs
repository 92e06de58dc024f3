//! Eight vertices on diffuse and glossy surfaces: a sample of the emitters and a direction of each.

use super::guidance::VectorRows;
use super::numbers::VertexLanes;
use super::transport::Transport;
use crate::emitter_sampler::EmitterSampler;
use crate::light_selection::diffuse_shading_point;
use lightshed_lanes::{Column, LANES, LaneMask, Lanes, Vec3Lanes};
use lightshed_lights::ShadingPoint;
use lightshed_sampling::CosineHemisphere;
use lightshed_scene::{DiffuseLanes, EmitterLanes, GlossyVertices, HitBatch, Rgb};
use std::f32::consts::FRAC_1_PI;

/// What the surfaces at eight vertices scatter, without a guide.
pub(super) struct ScatteredLanes<L: Lanes, K> {
    /// Lanes whose surface is seen; nothing is of meaning in the others.
    pub seen: L::Mask,
    /// Factor of local `z` that brings the previous vertices above the surface.
    pub mirror: L,
    pub sites: [K; LANES],
    pub light: EmitterLanes<L>,
    /// `f |cos θ|` towards the emitters, and the density of that direction by the surface.
    pub value: Vec3Lanes<L>,
    pub pdf: L,
    /// Sampled directions in the shading frames, above the surfaces, and their densities.
    pub local: Vec3Lanes<L>,
    pub direction_pdf: L,
    /// `f |cos θ| / p` of them.
    pub weight: Vec3Lanes<L>,
    /// Lanes that have such a direction.
    pub scatters: L::Mask,
}

impl<L: Lanes, K> ScatteredLanes<L, K> {
    /// Lanes whose emitter sample is scattered.
    #[inline(always)]
    pub fn lit(&self) -> L::Mask {
        self.seen & self.light.found & !is_black(self.value)
    }
}

impl<S: EmitterSampler, G> Transport<'_, S, G> {
    /// At points of the hits from `place` on, in the lanes `wanted`; those of `glossy` are glossy.
    #[inline(always)]
    pub(super) fn scatter_lanes<L: Lanes>(
        &self,
        (hits, place): (&HitBatch, usize),
        point: &DiffuseLanes<L>,
        [wanted, glossy]: [u32; 2],
        ray_direction: Vec3Lanes<L>,
        numbers: &VertexLanes<L>,
    ) -> ScatteredLanes<L, S::Site> {
        let zero = L::splat(0.0);
        let normal = point.shading.normal;
        let (seen, mirror) = point.seen_from(normal.dot(-ray_direction));
        let seen = seen & L::Mask::from_bits(wanted);
        let sites = self.sites(point, mirror, glossy);
        let light = self.sampler.sample_lanes::<L>(
            point.position,
            &sites,
            numbers.u_emitter(),
            numbers.u_on_emitter(),
            seen.bits(),
        );
        let mut pdf = (normal.dot(light.direction) * mirror).max(zero) * L::splat(FRAC_1_PI);
        let mut value = point.reflectance * pdf;
        let mut local = CosineHemisphere::sample_lanes(numbers.u_direction());
        let mut direction_pdf = local.z * L::splat(FRAC_1_PI);
        let mut weight = point.reflectance;
        let mut scatters = seen & zero.less(local.z);
        if glossy != 0 {
            let [u0, u1] = numbers.u_direction();
            let vertices = GlossyVertices {
                outgoing: local_above(point, mirror, -ray_direction).store(),
                towards: local_above(point, mirror, light.direction).store(),
                u_lobe: numbers.u_lobe().store(),
                u: [u0.store(), u1.store()],
            };
            let found = self
                .scene
                .scatter_glossy(self.lanes, hits, place, glossy, &vertices);
            let lanes = L::Mask::from_bits(glossy);
            pdf = L::load(&found.pdf_solid_angle).select(lanes, pdf);
            value = load_rows::<L>(&found.value).select(lanes, value);
            local = load_rows::<L>(&found.direction).select(lanes, local);
            direction_pdf = L::load(&found.direction_pdf_solid_angle).select(lanes, direction_pdf);
            weight = load_rows::<L>(&found.throughput).select(lanes, weight);
            scatters = seen & L::Mask::from_bits(found.scatters & glossy | scatters.bits() & !glossy);
        }
        ScatteredLanes {
            seen,
            mirror,
            sites,
            light,
            value,
            pdf,
            local,
            direction_pdf,
            weight,
            scatters,
        }
    }

    /// What the choice among emitters knows of the points, but for their gloss.
    #[inline(always)]
    pub(super) fn sites<L: Lanes>(
        &self,
        point: &DiffuseLanes<L>,
        mirror: L,
        glossy: u32,
    ) -> [S::Site; LANES] {
        if !self.sampler.uses_site() {
            return [S::Site::default(); LANES];
        }
        let rows = [
            point.position.store(),
            facing(point, mirror).store(),
            point.reflectance.store(),
        ];
        std::array::from_fn(|lane| {
            let [position, normal, reflectance] = rows.map(|rows| rows.map(|row| row[lane]).into());
            self.sampler.site(|| match glossy >> lane & 1 {
                0 => diffuse_shading_point(position, normal, reflectance),
                // Only the existence of a bound is known.
                _ => ShadingPoint {
                    reflectance_bound: f32::MAX,
                    ..diffuse_shading_point(position, normal, Rgb::ZERO)
                },
            })
        })
    }
}

/// Shading normals on the side that `mirror` says.
#[inline(always)]
pub(super) fn facing<L: Lanes>(point: &DiffuseLanes<L>, mirror: L) -> Vec3Lanes<L> {
    let zero = L::splat(0.0);
    point.shading.to_world(Vec3Lanes::new(zero, zero, mirror))
}

/// Directions in the shading frames, mirrored as `mirror` says.
#[inline(always)]
pub(super) fn local_above<L: Lanes>(
    point: &DiffuseLanes<L>,
    mirror: L,
    direction: Vec3Lanes<L>,
) -> Vec3Lanes<L> {
    let local = point.shading.to_local(direction);
    Vec3Lanes::new(local.x, local.y, local.z * mirror)
}

/// Where all channels are zero.
#[inline(always)]
pub(super) fn is_black<L: Lanes>(value: Vec3Lanes<L>) -> L::Mask {
    let zero = L::splat(0.0);
    value.x.equal(zero) & value.y.equal(zero) & value.z.equal(zero)
}

#[inline(always)]
pub(super) fn load_rows<L: Lanes>(rows: &VectorRows) -> Vec3Lanes<L> {
    Vec3Lanes::new(L::load(&rows[0]), L::load(&rows[1]), L::load(&rows[2]))
}

/// Vectors `place` to `place + 7`.
#[inline(always)]
pub(super) fn load_vectors<L: Lanes>(columns: &[Column; 3], place: usize) -> Vec3Lanes<L> {
    Vec3Lanes::new(
        columns[0].load(place),
        columns[1].load(place),
        columns[2].load(place),
    )
}

/// Sets the vectors from `place` on to those of the lanes of `mask`.
#[inline(always)]
pub(super) fn store_vectors<L: Lanes>(columns: &mut [Column; 3], place: usize, v: Vec3Lanes<L>, mask: u32) {
    columns[0].store_compressed(place, v.x, mask);
    columns[1].store_compressed(place, v.y, mask);
    columns[2].store_compressed(place, v.z, mask);
}
