//! Sampling emitters for eight points at a time, chosen by power or by others.

use super::area::{AreaEmitter, TriangleEmitter};
use super::by_power::SelectedKind;
use super::on_one::NEAR;
use super::{EmitterSample, Emitters, EmittersByPower, EnvironmentChoice, SEGMENT_END, SkySampling};
use crate::surface::{DiffuseLanes, offset_along_lanes, offset_for_lanes};
use glam::Vec3;
use lightshed_lanes::{LANES, LaneMask, LaneWords, Lanes, Vec3Lanes};
use lightshed_sampling::UniformTriangle;

/// Eight samples of emitters.
#[derive(Clone, Copy, Debug)]
pub struct EmitterLanes<L: Lanes> {
    /// [`EmitterSample::emitter`].
    pub emitter: [u32; LANES],
    /// [`EmitterSample::direction`].
    pub direction: Vec3Lanes<L>,
    /// [`EmitterSample::weight`].
    pub weight: Vec3Lanes<L>,
    /// [`EmitterSample::pdf`], per steradian.
    pub pdf_solid_angle: L,
    /// [`EmitterSample::is_delta`].
    pub is_delta: L::Mask,
    /// Lanes that have a sample; nothing is of meaning in the others.
    pub found: L::Mask,
    /// The point aimed at, and whether there is one.
    pub(super) target: Vec3Lanes<L>,
    pub(super) finite: L::Mask,
}

impl<L: Lanes> EmitterLanes<L> {
    /// Those that `sample` gives for the lanes `wanted`.
    #[inline(always)]
    pub fn one_by_one(wanted: u32, mut sample: impl FnMut(usize) -> Option<EmitterSample>) -> Self {
        let mut samples = Others::NONE;
        for lane in (0..LANES).filter(|lane| wanted >> lane & 1 == 1) {
            if let Some(sample) = sample(lane) {
                samples.set(lane, &sample);
            }
        }
        samples.load()
    }

    /// [`EmitterSample::chosen_with`], lane by lane.
    #[inline(always)]
    #[must_use]
    pub fn chosen_with(self, probability: L) -> Self {
        let Vec3Lanes { x, y, z } = self.weight;
        let weight = Vec3Lanes::new(x / probability, y / probability, z / probability);
        let is_finite = |value: L| value.abs().less_equal(L::splat(f32::MAX));
        Self {
            weight,
            pdf_solid_angle: self.pdf_solid_angle * probability,
            found: self.found & is_finite(weight.x) & is_finite(weight.y) & is_finite(weight.z),
            ..self
        }
    }

    /// The same, with those that `sample` gives in the lanes `others`, which had none.
    #[inline(always)]
    #[must_use]
    pub fn or_one_by_one(self, others: u32, sample: impl FnMut(usize) -> Option<EmitterSample>) -> Self {
        if others == 0 {
            return self;
        }
        self.or(others, Self::one_by_one(others, sample))
    }

    /// The same, with those of `rest` in the lanes `others`, which had none.
    #[inline(always)]
    #[must_use]
    pub fn or(self, others: u32, rest: Self) -> Self {
        let mut emitter = self.emitter;
        for (lane, emitter) in emitter.iter_mut().enumerate() {
            if others >> lane & 1 == 1 {
                *emitter = rest.emitter[lane];
            }
        }
        let mask = L::Mask::from_bits(others);
        Self {
            emitter,
            direction: rest.direction.select(mask, self.direction),
            weight: rest.weight.select(mask, self.weight),
            pdf_solid_angle: rest.pdf_solid_angle.select(mask, self.pdf_solid_angle),
            is_delta: self.is_delta | rest.is_delta & mask,
            found: self.found | rest.found & mask,
            target: rest.target.select(mask, self.target),
            finite: self.finite | rest.finite & mask,
        }
    }

    /// [`EmitterSample::shadow_ray`]: origin, direction and end.
    #[inline(always)]
    pub fn shadow_rays(&self, from: &DiffuseLanes<L>) -> (Vec3Lanes<L>, Vec3Lanes<L>, L) {
        let origin = from.origin_towards(self.direction);
        let direction = (self.target - origin).select(self.finite, self.direction);
        let t_max = L::splat(SEGMENT_END).select(self.finite, L::splat(f32::INFINITY));
        (origin, direction, t_max)
    }
}

/// Samples, lane by lane.
struct Others {
    emitter: [u32; LANES],
    direction: [[f32; LANES]; 3],
    weight: [[f32; LANES]; 3],
    pdf: [f32; LANES],
    target: [[f32; LANES]; 3],
    found: u32,
    is_delta: u32,
    finite: u32,
}

impl Others {
    const NONE: Self = Self {
        emitter: [0; LANES],
        direction: [[0.0; LANES]; 3],
        weight: [[0.0; LANES]; 3],
        pdf: [0.0; LANES],
        target: [[0.0; LANES]; 3],
        found: 0,
        is_delta: 0,
        finite: 0,
    };

    #[inline(always)]
    fn set(&mut self, lane: usize, sample: &EmitterSample) {
        let target = sample.target.unwrap_or(Vec3::ZERO);
        for axis in 0..3 {
            self.direction[axis][lane] = sample.direction[axis];
            self.weight[axis][lane] = sample.weight[axis];
            self.target[axis][lane] = target[axis];
        }
        self.emitter[lane] = sample.emitter;
        self.pdf[lane] = sample.pdf.value();
        self.found |= 1 << lane;
        self.is_delta |= u32::from(sample.is_delta) << lane;
        self.finite |= u32::from(sample.target.is_some()) << lane;
    }

    #[inline(always)]
    fn load<L: Lanes>(&self) -> EmitterLanes<L> {
        EmitterLanes {
            emitter: self.emitter,
            direction: load_vectors(&self.direction),
            weight: load_vectors(&self.weight),
            pdf_solid_angle: L::load(&self.pdf),
            is_delta: L::Mask::from_bits(self.is_delta),
            found: L::Mask::from_bits(self.found),
            target: load_vectors(&self.target),
            finite: L::Mask::from_bits(self.finite),
        }
    }
}

#[inline(always)]
fn load_vectors<L: Lanes>(rows: &[[f32; LANES]; 3]) -> Vec3Lanes<L> {
    Vec3Lanes::new(L::load(&rows[0]), L::load(&rows[1]), L::load(&rows[2]))
}

impl EmittersByPower<'_> {
    /// [`EmittersByPower::sample`] for eight points, those in the lanes `wanted`; `u_select` are
    /// the low and the high halves. Bit for bit.
    #[inline(always)]
    pub fn sample_lanes<L: Lanes>(
        &self,
        from: Vec3Lanes<L>,
        u_select: [L::Words; 2],
        u: [L; 2],
        wanted: u32,
    ) -> EmitterLanes<L> {
        let (mut records, mut emitter) = ([NO_TRIANGLE; LANES], [0; LANES]);
        let (mut triangles, mut skies, mut others) = (0, 0, 0);
        let (low, high) = (u_select[0].store(), u_select[1].store());
        for lane in 0..LANES {
            if wanted >> lane & 1 == 0 {
                continue;
            }
            match self.select_kind(u64::from(high[lane]) << 32 | u64::from(low[lane])) {
                SelectedKind::Area(index, AreaEmitter::Triangle(record)) => {
                    (records[lane], emitter[lane]) = (record, index);
                    triangles |= 1 << lane;
                }
                SelectedKind::Environment => skies |= 1 << lane,
                SelectedKind::Area(..) | SelectedKind::Other => others |= 1 << lane,
            }
        }
        if !skies_together::<L>(skies) {
            others |= skies;
            skies = 0;
        }
        let (from_rows, u0, u1) = (from.store(), u[0].store(), u[1].store());
        let sample = |lane: usize| {
            let u_select = u64::from(high[lane]) << 32 | u64::from(low[lane]);
            let from = Vec3::new(from_rows[0][lane], from_rows[1][lane], from_rows[2][lane]);
            self.sample(from, u_select, [u0[lane], u1[lane]])
        };
        if skies != 0 {
            let emitters = self.emitters();
            let sampled = emitters.sample_sky_lanes(self.environment_choice(), u, skies);
            if triangles == 0 {
                return sampled.or_one_by_one(others, sample);
            }
            let on_triangles = TriangleLanes::<L>::of(records).sample(emitter, from, u, triangles);
            return on_triangles.or(skies, sampled).or_one_by_one(others, sample);
        }
        if triangles == 0 {
            return EmitterLanes::one_by_one(others, sample);
        }
        let sampled = TriangleLanes::<L>::of(records).sample(emitter, from, u, triangles);
        sampled.or_one_by_one(others, sample)
    }
}

/// Whether samples of the environment in these lanes are taken together: a few are as fast one by
/// one.
#[inline(always)]
fn skies_together<L: Lanes>(lanes: u32) -> bool {
    L::IN_REGISTERS && lanes.count_ones() > 2
}

impl Emitters {
    /// Samples of the environment in the lanes `wanted`.
    #[inline(always)]
    fn sample_sky_lanes<L: Lanes>(
        &self,
        choice: EnvironmentChoice,
        u: [L; 2],
        wanted: u32,
    ) -> EmitterLanes<L> {
        let Some(environment) = self.environment() else {
            return EmitterLanes::one_by_one(0, |_| None);
        };
        let zero = L::splat(0.0);
        let sample = environment.sample_lanes(choice.sky(), u);
        let pdf = choice.pdf_lanes(sample.pdf_solid_angle);
        let Vec3Lanes { x, y, z } = sample.radiance;
        EmitterLanes {
            emitter: [self.environment_index(); LANES],
            direction: sample.direction,
            weight: Vec3Lanes::new(x / pdf, y / pdf, z / pdf),
            pdf_solid_angle: pdf,
            is_delta: L::Mask::from_bits(0),
            found: L::Mask::from_bits(wanted) & zero.less(sample.pdf_solid_angle),
            target: Vec3Lanes::new(zero, zero, zero),
            finite: L::Mask::from_bits(0),
        }
    }

    /// [`sample_at_infinity`](Self::sample_at_infinity) in the lanes `wanted`. Bit for bit.
    #[inline(always)]
    pub fn sample_at_infinity_lanes<L: Lanes>(
        &self,
        sky: SkySampling,
        u_select: &[u64; LANES],
        u: [L; 2],
        wanted: u32,
    ) -> EmitterLanes<L> {
        let mut skies = 0;
        for (lane, &u_select) in u_select.iter().enumerate() {
            skies |= u32::from(self.selects_environment(u_select)) << lane;
        }
        skies &= wanted;
        let u_rows = [u[0].store(), u[1].store()];
        let sample =
            |lane: usize| self.sample_at_infinity(sky, u_select[lane], [u_rows[0][lane], u_rows[1][lane]]);
        if !skies_together::<L>(skies) {
            return EmitterLanes::one_by_one(wanted, sample);
        }
        let sampled = self.sample_sky_lanes(self.choice_at_infinity(sky), u, skies);
        sampled.or_one_by_one(wanted & !skies, sample)
    }

    /// [`Emitters::sample_on`] for eight points, those in the lanes `wanted`, and an emitter for
    /// each. Bit for bit.
    #[inline(always)]
    pub fn sample_on_lanes<L: Lanes>(
        &self,
        from: Vec3Lanes<L>,
        emitter: [u32; LANES],
        u: [L; 2],
        wanted: u32,
    ) -> EmitterLanes<L> {
        let (mut records, mut triangles) = ([NO_TRIANGLE; LANES], 0);
        for lane in 0..LANES {
            if wanted >> lane & 1 == 1
                && let Some(AreaEmitter::Triangle(record)) = self.areas.get(emitter[lane] as usize)
            {
                records[lane] = record;
                triangles |= 1 << lane;
            }
        }
        let records = TriangleLanes::<L>::of(records);
        let far = triangles & !records.near(from).bits();
        let sampled = records.sample(emitter, from, u, far);
        let others = wanted & !far;
        let (from, u0, u1) = (from.store(), u[0].store(), u[1].store());
        sampled.or_one_by_one(others, |lane| {
            let from = Vec3::new(from[0][lane], from[1][lane], from[2][lane]);
            self.sample_on(from, emitter[lane], [u0[lane], u1[lane]])
        })
    }
}

const NO_TRIANGLE: &TriangleEmitter = &TriangleEmitter::NONE;

/// Eight triangles.
struct TriangleLanes<L: Lanes> {
    corner: Vec3Lanes<L>,
    edges: [Vec3Lanes<L>; 2],
    normal: Vec3Lanes<L>,
    radiance: Vec3Lanes<L>,
    pdf_area: L,
}

impl<L: Lanes> TriangleLanes<L> {
    #[inline(always)]
    fn of(records: [&TriangleEmitter; LANES]) -> Self {
        let [r0, r1, r2, r3, r4, r5, r6, r7] = records;
        let ([l0, h0], [l1, h1], [l2, h2], [l3, h3]) = (r0.halves(), r1.halves(), r2.halves(), r3.halves());
        let ([l4, h4], [l5, h5], [l6, h6], [l7, h7]) = (r4.halves(), r5.halves(), r6.halves(), r7.halves());
        let [ax, ay, az, bx, by, bz, cx, cy] = L::load_transposed([l0, l1, l2, l3, l4, l5, l6, l7]);
        let [cz, nx, ny, nz, red, green, blue, pdf_area] =
            L::load_transposed([h0, h1, h2, h3, h4, h5, h6, h7]);
        Self {
            corner: Vec3Lanes::new(ax, ay, az),
            edges: [Vec3Lanes::new(bx, by, bz), Vec3Lanes::new(cx, cy, cz)],
            normal: Vec3Lanes::new(nx, ny, nz),
            radiance: Vec3Lanes::new(red, green, blue),
            pdf_area,
        }
    }

    /// Where `from` is near, as [`TriangleEmitter::is_near`].
    #[inline(always)]
    fn near(&self, from: Vec3Lanes<L>) -> L::Mask {
        let [a, b] = self.edges;
        let to_center = self.corner + (a + b) * L::splat(1.0 / 3.0) - from;
        let size_squared = a.dot(a) + b.dot(b);
        to_center
            .dot(to_center)
            .less(L::splat(NEAR * NEAR) * size_squared)
    }

    /// [`TriangleEmitter::sample`] in the lanes `wanted`.
    #[inline(always)]
    fn sample(&self, emitter: [u32; LANES], from: Vec3Lanes<L>, u: [L; 2], wanted: u32) -> EmitterLanes<L> {
        let zero = L::splat(0.0);
        let [v, w] = UniformTriangle::sample_lanes(u);
        let (along, across) = (self.edges[0] * v, self.edges[1] * w);
        let point = self.corner + along + across;
        let d = point - from;
        let distance_squared = d.dot(d);
        let facing = -self.normal.dot(d);
        let distance = distance_squared.sqrt();
        let cos_theta = (facing / distance).abs();
        let pdf = self.pdf_area * distance_squared / cos_theta;
        let wanted = L::Mask::from_bits(wanted);
        let found = wanted & zero.less(facing) & zero.less(cos_theta) & zero.less(pdf);
        let pdf = pdf.min(L::splat(f32::MAX));
        let magnitude = self.corner.abs() + along.abs() + across.abs();
        let extent = self.edges[0].abs().max(self.edges[1].abs()).max_element();
        let offset = offset_for_lanes(self.normal, magnitude, extent);
        let radiance = self.radiance;
        EmitterLanes {
            emitter,
            direction: Vec3Lanes::new(d.x / distance, d.y / distance, d.z / distance),
            weight: Vec3Lanes::new(radiance.x / pdf, radiance.y / pdf, radiance.z / pdf),
            pdf_solid_angle: pdf,
            is_delta: L::Mask::from_bits(0),
            found,
            target: offset_along_lanes(point, self.normal, offset, from - point),
            finite: found,
        }
    }
}
