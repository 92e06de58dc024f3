//! Surface points of paths in lanes, coordinate by coordinate.

use crate::path::scattered_lanes::{load_vectors, local_above};
use lightshed_lanes::{Column, LANES, LaneMask, Lanes, Vec3Lanes};
use lightshed_sampling::FrameLanes;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{DiffuseLanes, GlossyColumns, GlossyLanes};
use std::f32::consts::FRAC_1_PI;

const ZEROS: [Column; 3] = [const { Column::splat(0.0) }; 3];

/// Up to 64 points on diffuse and glossy surfaces. Sets of points are bits.
pub struct Points {
    position: [Column; 3],
    geometric_normal: [Column; 3],
    offset: Column,
    shading_normal: [Column; 3],
    /// Directions towards the previous vertices in the shading frames, mirrored above the surface,
    /// and the factor of `z` that mirrors.
    outgoing: [Column; 3],
    mirror: Column,
    reflectance: [Column; 3],
    surfaces: GlossyColumns,
    /// Points that there are.
    pub there: u64,
    glossy: u64,
    /// Points seen from the previous vertices.
    seen: u64,
    front: u64,
    back: u64,
}

impl Points {
    pub const NONE: Self = Self {
        position: ZEROS,
        geometric_normal: ZEROS,
        offset: Column::splat(0.0),
        shading_normal: ZEROS,
        outgoing: ZEROS,
        mirror: Column::splat(1.0),
        reflectance: ZEROS,
        surfaces: GlossyColumns::NONE,
        there: 0,
        glossy: 0,
        seen: 0,
        front: 0,
        back: 0,
    };

    /// Forgets all points.
    pub fn clear(&mut self) {
        (self.there, self.glossy, self.seen) = (0, 0, 0);
        (self.front, self.back) = (0, 0);
    }

    /// Sets points `place` to `place + 7`, which were no points before: those of the lanes `there`,
    /// of which `glossy` are glossy, seen along `-incoming` as `seen` and `mirror` say. Returns
    /// where the surfaces of the glossy ones go.
    #[inline(always)]
    pub fn set<L: Lanes>(
        &mut self,
        place: usize,
        point: &DiffuseLanes<L>,
        [there, glossy]: [u32; 2],
        incoming: Vec3Lanes<L>,
        (seen, mirror): (L::Mask, L),
    ) -> &mut GlossyColumns {
        store_all(&mut self.position, place, point.position);
        store_all(&mut self.geometric_normal, place, point.geometric_normal);
        self.offset.store(place, point.offset);
        store_all(&mut self.shading_normal, place, point.shading.normal);
        store_all(&mut self.outgoing, place, local_above(point, mirror, -incoming));
        self.mirror.store(place, mirror);
        store_all(&mut self.reflectance, place, point.reflectance);
        let at = |lanes: u32| u64::from(lanes & there) << place;
        let [front, back] = point.sides();
        self.there |= at(there);
        self.glossy |= at(glossy);
        self.seen |= at(seen.bits());
        self.front |= at(front);
        self.back |= at(back);
        &mut self.surfaces
    }
}

/// Eight points as seen from their previous vertices.
pub struct Near<L: Lanes> {
    pub position: Vec3Lanes<L>,
    geometric_normal: Vec3Lanes<L>,
    offset: L,
    shading: FrameLanes<L>,
    outgoing: Vec3Lanes<L>,
    mirror: L,
    reflectance: Vec3Lanes<L>,
    surfaces: GlossyLanes<L>,
    /// Lanes whose points are seen, and of these the glossy ones.
    pub seen: u32,
    glossy: u32,
}

impl<L: Lanes> Near<L> {
    /// Points `place` to `place + 7`, as far as they are in `lanes`.
    #[inline(always)]
    pub fn load(points: &Points, place: usize, lanes: u32) -> Self {
        let bits = |set: u64| (set >> place) as u32 & lanes;
        let seen = bits(points.seen);
        Self {
            position: load_vectors(&points.position, place),
            geometric_normal: load_vectors(&points.geometric_normal, place),
            offset: points.offset.load(place),
            shading: FrameLanes::from_normal(load_vectors(&points.shading_normal, place)),
            outgoing: load_vectors(&points.outgoing, place),
            mirror: points.mirror.load(place),
            reflectance: load_vectors(&points.reflectance, place),
            surfaces: points.surfaces.load(place),
            seen,
            glossy: bits(points.glossy) & seen,
        }
    }

    /// Values and densities of what is scattered from `direction`, in the lanes that are seen.
    #[inline(always)]
    pub fn evaluate(&self, direction: Vec3Lanes<L>) -> (Vec3Lanes<L>, L) {
        let local = self.shading.to_local(direction);
        let above = Vec3Lanes::new(local.x, local.y, local.z * self.mirror);
        let mut pdf = above.z.max(L::splat(0.0)) * L::splat(FRAC_1_PI);
        let mut value = self.reflectance * pdf;
        if self.glossy != 0 {
            let (other, other_pdf) = self.surfaces.evaluate(self.outgoing, above);
            let glossy = L::Mask::from_bits(self.glossy);
            (value, pdf) = (other.select(glossy, value), other_pdf.select(glossy, pdf));
        }
        (value, pdf)
    }

    /// Where rays towards the side of `direction` start.
    #[inline(always)]
    pub fn origins_towards(&self, direction: Vec3Lanes<L>) -> Vec3Lanes<L> {
        origins(self.position, self.geometric_normal, self.offset, direction)
    }
}

/// One point in all lanes, seen from anywhere.
pub struct Far<L: Lanes> {
    pub position: Vec3Lanes<L>,
    pub geometric_normal: Vec3Lanes<L>,
    offset: L,
    shading: FrameLanes<L>,
    reflectance: Vec3Lanes<L>,
    /// If it is glossy.
    surface: Option<GlossyLanes<L>>,
    front: L::Mask,
    back: L::Mask,
}

impl<L: Lanes> Far<L> {
    /// The point number `index`.
    #[inline(always)]
    pub fn load(points: &Points, index: usize) -> Self {
        let is_in = |set: u64| set >> index & 1 == 1;
        let all = |set: u64| L::Mask::from_bits(if is_in(set) { (1 << LANES) - 1 } else { 0 });
        Self {
            position: splat(&points.position, index),
            geometric_normal: splat(&points.geometric_normal, index),
            offset: L::splat(points.offset.get(index)),
            shading: FrameLanes::from_normal(splat(&points.shading_normal, index)),
            reflectance: splat(&points.reflectance, index),
            surface: match is_in(points.glossy) {
                true => Some(points.surfaces.splat(index)),
                false => None,
            },
            front: all(points.front),
            back: all(points.back),
        }
    }

    /// The point as seen along `outgoing`, unit vectors away from it.
    #[inline(always)]
    pub fn seen_from(&self, outgoing: Vec3Lanes<L>) -> Seen<L> {
        let (zero, local) = (L::splat(0.0), self.shading.to_local(outgoing));
        let mirror = L::splat(1.0).copysign(local.z);
        Seen {
            lanes: (self.front & zero.less(local.z)) | (self.back & local.z.less(zero)),
            mirror,
            outgoing: Vec3Lanes::new(local.x, local.y, local.z * mirror),
        }
    }

    /// Values and densities of what is scattered from the direction `wi` of its shading frame, the
    /// same in all lanes: zero in lanes that do not see the point.
    #[inline(always)]
    pub fn evaluate(&self, seen: &Seen<L>, wi: Vec3) -> (Vec3Lanes<L>, L) {
        let zero = L::splat(0.0);
        let [x, y, z] = wi.to_array().map(L::splat);
        let above = Vec3Lanes::new(x, y, z * seen.mirror);
        let (value, pdf) = match &self.surface {
            Some(surface) => surface.evaluate(seen.outgoing, above),
            None => {
                let pdf = above.z.max(zero) * L::splat(FRAC_1_PI);
                (self.reflectance * pdf, pdf)
            }
        };
        let nothing = Vec3Lanes::new(zero, zero, zero);
        (value.select(seen.lanes, nothing), pdf.select(seen.lanes, zero))
    }

    /// Where rays towards the sides of `direction` start.
    #[inline(always)]
    pub fn origins_towards(&self, direction: Vec3Lanes<L>) -> Vec3Lanes<L> {
        origins(self.position, self.geometric_normal, self.offset, direction)
    }
}

/// How eight others see a point.
pub struct Seen<L: Lanes> {
    lanes: L::Mask,
    mirror: L,
    /// In the shading frame, mirrored above the surface.
    outgoing: Vec3Lanes<L>,
}

/// [`SurfacePoint::origin_towards`](lightshed_scene::SurfacePoint::origin_towards).
#[inline(always)]
fn origins<L: Lanes>(
    position: Vec3Lanes<L>,
    normal: Vec3Lanes<L>,
    offset: L,
    direction: Vec3Lanes<L>,
) -> Vec3Lanes<L> {
    position + normal * offset.copysign(direction.dot(normal))
}

/// Sets vectors `place` to `place + 7`.
#[inline(always)]
pub fn store_all<L: Lanes>(columns: &mut [Column; 3], place: usize, v: Vec3Lanes<L>) {
    columns[0].store(place, v.x);
    columns[1].store(place, v.y);
    columns[2].store(place, v.z);
}

/// The vector number `index`, in all lanes.
#[inline(always)]
fn splat<L: Lanes>(columns: &[Column; 3], index: usize) -> Vec3Lanes<L> {
    Vec3Lanes::splat(columns.each_ref().map(|column| column.get(index)))
}

/// The vector number `index`.
#[inline(always)]
pub fn vector(columns: &[Column; 3], index: usize) -> Vec3 {
    Vec3::from(columns.each_ref().map(|column| column.get(index)))
}
