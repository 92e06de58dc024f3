//! The vertices of a batch: eight at a time where surfaces are diffuse or glossy, one at a time
//! elsewhere.
//!
//! A vertex takes the same operations in the same order in lanes and alone, so a path has the same
//! value, bit for bit, in any batch.

use super::escape::Escaped;
use super::guidance::{GuideQuestions, VectorRows, set_vector, vector};
use super::guide::DirectionGuide;
use super::numbers::{VertexLanes, VertexNumbers, emitter_block};
use super::paths::{Paths, Shadows, lanes_within};
use super::purpose::{Purpose, ending_surface, ending_vertex};
use super::scattered_lanes::{ScatteredLanes, facing, is_black, load_rows, load_vectors, store_vectors};
use super::scattering::SurfaceVertex;
use super::transport::{SURVIVAL_CAP, Transport};
use super::vertex_rows::VertexRows;
use crate::emitter_sampler::EmitterSampler;
use lightshed_film::MAX_BATCH;
use lightshed_lanes::{LANES, LaneKernel, LaneMask, Lanes, Vec3Lanes};
use lightshed_sampling::{SobolScrambles, power_heuristic_lanes};
use lightshed_scene::{DiffuseLanes, HitBatch};
use std::f32::consts::FRAC_1_PI;

/// Processes what the rays of `paths` (and their number), their edge number `depth`, have hit:
/// reports to `purpose`, and samples emitters into `shadows` and continuations into `next`, whose
/// number it returns.
pub(super) fn shade<S: EmitterSampler, G: DirectionGuide>(
    transport: &Transport<'_, S, G>,
    depth: u32,
    paths: (&Paths<S::Site>, usize),
    hits: &HitBatch,
    next: &mut Paths<S::Site>,
    shadows: &mut Shadows,
    purpose: &mut impl Purpose,
) -> usize {
    transport.lanes.run(Shade {
        transport,
        depth,
        paths: paths.0,
        alive: paths.1,
        hits,
        next,
        survivors: 0,
        shadows,
        purpose,
    })
}

struct Shade<'a, 's, S: EmitterSampler, G, P> {
    transport: &'a Transport<'s, S, G>,
    depth: u32,
    paths: &'a Paths<S::Site>,
    alive: usize,
    hits: &'a HitBatch,
    next: &'a mut Paths<S::Site>,
    /// How many of `next` there are.
    survivors: usize,
    shadows: &'a mut Shadows,
    purpose: &'a mut P,
}

impl<S: EmitterSampler, G: DirectionGuide, P: Purpose> LaneKernel for Shade<'_, '_, S, G, P> {
    // Guides, observers and caches take longer than what the lanes save beside them.
    const HOT: bool = !G::IS_ACTIVE && !P::OBSERVES && !P::ENDS;
    type Output = usize;

    #[inline(always)]
    fn run<L: Lanes>(mut self) -> usize {
        let block = emitter_block(self.depth, 0);
        // A single row of lanes has its own numbers as fast.
        let common = if self.alive > LANES {
            [
                self.purpose.common::<L>(block),
                self.purpose.common::<L>(block.wrapping_add(1)),
            ]
        } else {
            [None, None]
        };
        let mut place = 0;
        while place < self.alive.min(MAX_BATCH) {
            self.eight::<L>(place, &common);
            place += LANES;
        }
        self.survivors
    }
}

impl<S: EmitterSampler, G: DirectionGuide, P: Purpose> Shade<'_, '_, S, G, P> {
    const GUIDED: bool = G::IS_ACTIVE && !cfg!(lightshed_without = "guide");
    /// Whether nothing but emitters is asked at vertices. Glossy ones are then shaded with the
    /// diffuse ones, if the choice among emitters does not ask for their gloss.
    const PLAIN: bool = !G::IS_ACTIVE && !P::OBSERVES && !P::ENDS;

    /// Samples of the emitters at the vertices.
    #[inline(always)]
    fn samples(&self) -> u32 {
        self.purpose.samples_at(self.transport, self.depth)
    }

    /// Paths `place` to `place + 7`; `common` is what the words of the vertex's two blocks have in
    /// common.
    #[inline(always)]
    fn eight<L: Lanes>(&mut self, place: usize, common: &[Option<SobolScrambles>; 2]) {
        let wanted = lanes_within(place, self.alive);
        let mut missed = 0;
        for lane in 0..LANES {
            missed |= u32::from(self.hits.primitive.get_word(place + lane) == HitBatch::NOTHING) << lane;
        }
        missed &= wanted;
        let scene = self.transport.scene;
        let [name, further] = &self.paths.name;
        let names = [name.load_words::<L>(place), further.load_words::<L>(place)];
        let block = emitter_block(self.depth, 0);
        let blocks = [
            self.purpose.words_by::<L>(common[0].as_ref(), names, block),
            self.purpose
                .words_by::<L>(common[1].as_ref(), names, block.wrapping_add(1)),
        ];
        let numbers = VertexLanes::<L>::from_blocks(blocks, self.samples());
        let mut others = wanted & !missed;
        if missed != 0 && scene.emitters().environment().is_some() {
            self.escape::<L>(place, missed);
        }
        // On arrays one vertex after another gives the same bits by a tenth of the code.
        if L::IN_REGISTERS {
            let mut point = scene.diffuse_lanes::<L>(self.hits, place, others);
            if !Self::PLAIN || self.transport.sampler.uses_gloss() {
                point.glossy = 0;
            }
            let together = point.diffuse | point.glossy;
            self.arrive_all(place, point.emitting & together);
            if together != 0 {
                self.together(place, &point, &numbers);
                others &= !together;
            }
        }
        if others != 0 {
            let numbers = numbers.store();
            while others != 0 {
                let lane = others.trailing_zeros() as usize;
                self.alone(place + lane, &numbers.get(lane));
                others &= others - 1;
            }
        }
    }

    /// Tells what the paths of the lanes `met` have met; `place` is that of the first lane.
    #[inline(always)]
    fn arrive_all(&mut self, place: usize, mut met: u32) {
        while met != 0 {
            self.arrive(place + met.trailing_zeros() as usize);
            met &= met - 1;
        }
    }

    /// Tells what the paths of the lanes `missed` find around the scene.
    #[inline(always)]
    fn escape<L: Lanes>(&mut self, place: usize, mut missed: u32) {
        let scene = (self.transport.scene, &self.transport.sampler);
        let samples = self
            .purpose
            .samples_at(self.transport, self.depth.wrapping_sub(1));
        let found = match P::TAKES_ESCAPED && L::IN_REGISTERS {
            true => Escaped::of::<L, S>(scene, self.paths, place, (self.depth, samples), missed),
            false => None,
        };
        let Some(found) = found else {
            return self.arrive_all(place, missed);
        };
        while missed != 0 {
            let lane = missed.trailing_zeros() as usize;
            let owner = self.paths.owner.get_word(place + lane) as usize;
            self.purpose.escape(owner, self.depth, found.get(lane));
            missed &= missed - 1;
        }
    }

    /// Tells what one path has met.
    #[inline(never)]
    fn arrive(&mut self, index: usize) {
        let (scene, ray) = (self.transport.scene, self.paths.rays.get(index));
        let point = self.hits.get(index).map(|hit| scene.surface(&ray, &hit));
        let owner = self.paths.owner.get_word(index) as usize;
        let path = self.paths.get(index, self.depth);
        self.purpose
            .arrive(self.transport, owner, self.depth, &path, &ray, point.as_ref());
    }

    /// [`Transport::advance`] of one path that has hit something, and what it has met.
    #[inline(never)]
    fn alone(&mut self, index: usize, mut numbers: &VertexNumbers) {
        let (scene, ray) = (self.transport.scene, self.paths.rays.get(index));
        let Some(hit) = self.hits.get(index) else {
            return;
        };
        let point = scene.surface(&ray, &hit);
        let owner = self.paths.owner.get_word(index);
        let mut state = self.paths.get(index, self.depth);
        let (place, depth) = (owner as usize, self.depth);
        self.purpose
            .arrive(self.transport, place, depth, &state, &ray, Some(&point));
        let vertex = SurfaceVertex::new(scene, &ray, point);
        if P::ENDS {
            let ending = ending_surface(depth, &state, &ray, &vertex);
            match self.purpose.goes_on(place, &ending, &ray) {
                Some(throughput) => state.throughput = throughput,
                None => return,
            }
        }
        let at = (depth, self.samples());
        let watched = P::OBSERVES && self.purpose.watches(place);
        let seen = watched.then_some(|vertex| self.purpose.scatter(place, vertex));
        let next = self
            .transport
            .advance(&mut state, &vertex, at, &mut numbers, seen);
        if let Some(shadow) = &next.shadow {
            self.shadows.push(shadow, owner);
        }
        if let Some(ray) = &next.ray {
            let to = self.survivors;
            self.next.set(to, &state, ray);
            for (next, name) in self.next.name.iter_mut().zip(&self.paths.name) {
                next.set_word(to, name.get_word(index));
            }
            self.next.owner.set_word(to, owner);
            self.survivors += 1;
        }
    }

    /// Lets diffuse vertices of the lanes `lanes` end: the lanes that go on, and their throughputs.
    /// `place` is that of the first lane.
    #[inline(never)]
    fn end(&mut self, place: usize, points: [&VectorRows; 2], lanes: u32) -> (u32, VectorRows) {
        let (mut left, mut throughput) = (0, [[0.0; LANES]; 3]);
        for lane in (0..LANES).filter(|lane| lanes >> lane & 1 == 1) {
            let index = place + lane;
            let (state, ray) = (self.paths.get(index, self.depth), self.paths.rays.get(index));
            let point = points.map(|rows| vector(rows, lane));
            let vertex = ending_vertex(self.depth, &state, &ray, point, 1.0);
            let owner = self.paths.owner.get_word(index) as usize;
            if let Some(onward) = self.purpose.goes_on(owner, &vertex, &ray) {
                left |= 1 << lane;
                set_vector(&mut throughput, lane, onward);
            }
        }
        (left, throughput)
    }

    /// Reports the diffuse vertices of those of the lanes `lanes` that are watched.
    #[inline(never)]
    fn report(&mut self, place: usize, vertices: &VertexRows, lanes: u32) {
        for lane in (0..LANES).filter(|lane| lanes >> lane & 1 == 1) {
            let owner = self.paths.owner.get_word(place + lane) as usize;
            if self.purpose.watches(owner) {
                let incoming = self.paths.rays.get(place + lane).direction;
                self.purpose
                    .scatter(owner, vertices.get(lane, self.depth, incoming));
            }
        }
    }

    /// [`Transport::advance`] of the paths on diffuse surfaces, and on glossy ones if paths are
    /// plain, without emission.
    #[inline(always)]
    fn together<L: Lanes>(&mut self, place: usize, point: &DiffuseLanes<L>, numbers: &VertexLanes<L>) {
        let paths = self.paths;
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let mut before = load_vectors::<L>(&paths.throughput, place);
        let mut lanes = point.diffuse;
        if Self::PLAIN {
            lanes |= point.glossy;
        }
        if P::ENDS {
            let points = [point.position.store(), point.geometric_normal.store()];
            let (left, throughput) = self.end(place, [&points[0], &points[1]], lanes);
            if left == 0 {
                return;
            }
            lanes = left;
            before = load_rows::<L>(&throughput);
        }
        let [_, ray_direction] = paths.rays.load::<L>(place);
        let normal = point.shading.normal;
        let owner = paths.owner.load_words::<L>(place);
        let glossy = if Self::PLAIN { point.glossy } else { 0 };
        let from = (self.hits, place);
        let scattered = self
            .transport
            .scatter_lanes(from, point, [lanes, glossy], ray_direction, numbers);
        let lit = scattered.lit();
        let ScatteredLanes {
            seen,
            mirror,
            sites,
            light,
            value,
            pdf,
            local,
            direction_pdf: mut scattering_pdf,
            mut weight,
            mut scatters,
        } = scattered;

        let mut direction = point
            .shading
            .to_world(Vec3Lanes::new(local.x, local.y, local.z * mirror));
        let (mut direction_pdf, mut light_pdf) = (scattering_pdf, pdf);
        let (mut judged, mut by_guide) = (L::Mask::from_bits(0), one);
        if Self::GUIDED {
            let [u0, u1] = numbers.u_direction();
            let questions = GuideQuestions {
                position: point.position.store(),
                normal: normal.store(),
                outgoing: (-ray_direction).store(),
                light: light.direction.store(),
                // The weight of what nothing else can hit is 1.
                lit: (lit & !light.is_delta).bits(),
                own: direction.store(),
                scatters: scatters.bits(),
                u_lobe: numbers.u_lobe().store(),
                u: [u0.store(), u1.store()],
                throughput: before.store(),
                depth: self.depth,
            };
            let answers = questions.ask(self.transport, seen.bits());
            judged = L::Mask::from_bits(answers.judged);
            by_guide = L::load(&answers.survival);
            let share = L::load(&answers.share);
            let (own, has) = (one - share, zero.less(share));
            light_pdf = pdf * own + L::load(&answers.light_pdf) * share;
            let picked = L::Mask::from_bits(answers.picked);
            let guided = load_rows::<L>(&answers.direction);
            let guided_pdf = (normal.dot(guided) * mirror).max(zero) * L::splat(FRAC_1_PI);
            direction = guided.select(picked, direction);
            scattering_pdf = guided_pdf.select(picked, scattering_pdf);
            direction_pdf = scattering_pdf * own + L::load(&answers.pdf) * share;
            let value = point.reflectance * guided_pdf;
            let of_guide = Vec3Lanes::new(
                value.x / direction_pdf,
                value.y / direction_pdf,
                value.z / direction_pdf,
            );
            let by_bsdf = point.reflectance * (scattering_pdf / direction_pdf);
            weight = of_guide.select(picked, by_bsdf.select(has, point.reflectance));
            let infinity = L::splat(f32::INFINITY);
            let finite = of_guide.x.less(infinity) & of_guide.y.less(infinity) & of_guide.z.less(infinity);
            let sound = zero.less(direction_pdf) & finite & !L::Mask::from_bits(answers.failed);
            scatters = (scatters & !picked) | (seen & picked & sound);
        }

        let samples = self.samples() as f32;
        let (samples, share) = (L::splat(samples), L::splat(1.0 / samples));
        let mis = power_heuristic_lanes(light.pdf_solid_angle * samples, light_pdf);
        let mis = one.select(light.is_delta, mis);
        let radiance = before * (value * light.weight * mis) * share;
        let shadow = lit.bits();
        let (origin, shadow_direction, t_max) = light.shadow_rays(point);
        let shadows = &mut *self.shadows;
        shadows
            .rays
            .store_compressed(shadows.count, origin, shadow_direction, t_max, shadow);
        store_vectors(&mut shadows.radiance, shadows.count, radiance, shadow);
        shadows
            .owner
            .store_words_compressed::<L>(shadows.count, owner, shadow);
        shadows.count += shadow.count_ones() as usize;

        let mut throughput = before * weight;
        let mut survives = scatters & !is_black(throughput);
        let eta_squared = paths.eta_squared.load::<L>(place);
        let mut survival = one;
        if self.depth >= self.transport.roulette_depth || (Self::GUIDED && judged.bits() != 0) {
            if self.depth >= self.transport.roulette_depth {
                survival = (throughput.max_element() * eta_squared).min(L::splat(SURVIVAL_CAP));
            }
            if Self::GUIDED {
                survival = by_guide.select(judged, survival);
            }
            survives = survives & numbers.u_roulette().less(survival);
            throughput = Vec3Lanes::new(
                throughput.x / survival,
                throughput.y / survival,
                throughput.z / survival,
            );
        }
        let survives = survives.bits();
        let (to, next) = (self.survivors, &mut *self.next);
        next.rays.store_compressed(
            to,
            point.origin_towards(direction),
            direction,
            L::splat(f32::INFINITY),
            survives,
        );
        store_vectors(&mut next.throughput, to, throughput, survives);
        next.eta_squared.store_compressed(to, eta_squared, survives);
        store_vectors(&mut next.from, to, point.position, survives);
        next.pdf.store_compressed(to, direction_pdf, survives);
        for (next, name) in next.name.iter_mut().zip(&paths.name) {
            next.store_words_compressed::<L>(to, name.load_words::<L>(place), survives);
        }
        next.owner.store_words_compressed::<L>(to, owner, survives);
        if self.transport.sampler.uses_site() {
            let lanes = (0..LANES).filter(|lane| survives >> lane & 1 == 1);
            for (place, lane) in (to..MAX_BATCH).zip(lanes) {
                next.sites[place] = sites[lane];
            }
        }
        self.survivors += survives.count_ones() as usize;
        if P::OBSERVES {
            let vertices = VertexRows {
                position: point.position.store(),
                normal: normal.store(),
                facing: facing(point, mirror).store(),
                reflectance: point.reflectance.store(),
                throughput: [before.store(), throughput.store()],
                lit: shadow,
                emitter: light.emitter,
                light: light.direction.store(),
                light_pdf: light.pdf_solid_angle.store(),
                onward: survives,
                direction: direction.store(),
                pdf: direction_pdf.store(),
                scattering_pdf: scattering_pdf.store(),
                survival: survival.store(),
            };
            self.report(place, &vertices, lanes);
        }
    }
}
