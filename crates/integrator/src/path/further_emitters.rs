//! Samples of emitters beyond the first at the vertices of a batch, where there are several.

use super::connect::connect;
use super::guide::DirectionGuide;
use super::numbers::{emitter_block, emitter_numbers, stratified, stratified_lanes};
use super::paths::{Paths, Shadows, lanes_within};
use super::purpose::Purpose;
use super::scattered_lanes::{is_black, load_vectors, local_above, store_vectors};
use super::scattering::SurfaceVertex;
use super::transport::Transport;
use crate::emitter_sampler::{ChosenLanes, EmitterSampler};
use lightshed_film::MAX_BATCH;
use lightshed_lanes::{LANES, LaneKernel, LaneMask, LaneWords, Lanes, Vec3Lanes};
use lightshed_sampling::{f32_from_u32_lanes, power_heuristic_lanes};
use lightshed_scene::{DiffuseLanes, EmitterLanes, GlossyColumns, HitBatch};
use std::f32::consts::FRAC_1_PI;

/// Samples emitters where the rays of `paths` (and their number), their edge number `depth`, met
/// `hits`: all samples of [`Purpose::samples_at`] but the first. Tells `purpose` of those that
/// nothing blocks.
pub(super) fn further_emitters<S: EmitterSampler, G: DirectionGuide>(
    transport: &Transport<'_, S, G>,
    depth: u32,
    (paths, alive): (&Paths<S::Site>, usize),
    hits: &HitBatch,
    purpose: &mut impl Purpose,
) {
    let mut shadows = Shadows::NONE;
    transport.lanes.run(Further {
        transport,
        depth,
        paths,
        alive,
        hits,
        shadows: &mut shadows,
        purpose,
    });
}

/// Most samples of a path whose emitters are chosen together.
const AHEAD: usize = 8;

/// Samples of eight paths whose emitters are chosen together.
struct Ahead {
    /// Numbers of the first of them, and of the one after the last.
    first: u32,
    end: u32,
    u_select: [[[u32; LANES]; 2]; AHEAD],
    u: [[[f32; LANES]; 2]; AHEAD],
    /// Whether they have been chosen.
    is_chosen: bool,
    chosen: [ChosenLanes; AHEAD],
}

impl Ahead {
    /// Before the first.
    const EMPTY: Self = Self {
        first: 1,
        end: 1,
        u_select: [[[0; LANES]; 2]; AHEAD],
        u: [[[0.0; LANES]; 2]; AHEAD],
        is_chosen: false,
        chosen: [ChosenLanes::NONE; AHEAD],
    };

    /// From sample `first` of `samples` on.
    #[inline(always)]
    fn begin(&mut self, first: u32, samples: u32) {
        (self.first, self.end) = (first, samples.min(first + AHEAD as u32));
    }

    #[inline(always)]
    fn place(&self, number: u32) -> usize {
        (number - self.first) as usize % AHEAD
    }

    /// The words of sample `number` of `samples`.
    #[inline(always)]
    fn set<L: Lanes>(&mut self, number: u32, [low, high, a, b]: [L::Words; 4], samples: u32) {
        let place = self.place(number);
        let u_select = stratified_lanes::<L>([low, high], number, samples);
        self.u_select[place] = [u_select[0].store(), u_select[1].store()];
        let u = [f32_from_u32_lanes::<L>(a), f32_from_u32_lanes::<L>(b)];
        self.u[place] = [u[0].store(), u[1].store()];
    }

    #[inline(always)]
    fn choose<S: EmitterSampler>(&mut self, sampler: &S, sites: &[S::Site; LANES], wanted: u32) {
        let count = (self.end - self.first) as usize % (AHEAD + 1);
        let numbers = &self.u_select[..count];
        self.is_chosen = sampler.choose_lanes(sites, numbers, wanted, &mut self.chosen[..count]);
    }

    /// Sample `number` at the points `from`, which have the data `sites`.
    #[inline(always)]
    fn sample<L: Lanes, S: EmitterSampler>(
        &self,
        sampler: &S,
        (from, sites): (Vec3Lanes<L>, &[S::Site; LANES]),
        number: u32,
        wanted: u32,
    ) -> EmitterLanes<L> {
        let place = self.place(number);
        let u = [L::load(&self.u[place][0]), L::load(&self.u[place][1])];
        if self.is_chosen {
            return sampler.sample_chosen_lanes::<L>(from, &self.chosen[place], u);
        }
        let [low, high] = &self.u_select[place];
        let u_select = [L::Words::load(low), L::Words::load(high)];
        sampler.sample_lanes::<L>(from, sites, u_select, u, wanted)
    }
}

struct Further<'a, 's, S: EmitterSampler, G, P> {
    transport: &'a Transport<'s, S, G>,
    depth: u32,
    paths: &'a Paths<S::Site>,
    alive: usize,
    hits: &'a HitBatch,
    shadows: &'a mut Shadows,
    purpose: &'a mut P,
}

impl<S: EmitterSampler, G: DirectionGuide, P: Purpose> LaneKernel for Further<'_, '_, S, G, P> {
    const HOT: bool = true;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let mut place = 0;
        while place < self.alive.min(MAX_BATCH) {
            self.eight::<L>(place);
            place += LANES;
        }
        self.connect();
    }
}

impl<S: EmitterSampler, G: DirectionGuide, P: Purpose> Further<'_, '_, S, G, P> {
    /// Paths `place` to `place + 7`.
    #[inline(always)]
    fn eight<L: Lanes>(&mut self, place: usize) {
        let mut others = lanes_within(place, self.alive);
        for lane in 0..LANES {
            let is_missed = self.hits.primitive.get_word(place + lane) == HitBatch::NOTHING;
            others &= !(u32::from(is_missed) << lane);
        }
        if L::IN_REGISTERS {
            let scene = self.transport.scene;
            let mut point = scene.diffuse_lanes::<L>(self.hits, place, others);
            if self.transport.sampler.uses_gloss() {
                point.glossy = 0;
            }
            let together = point.diffuse | point.glossy;
            if together != 0 {
                self.together(place, &point, together);
                others &= !together;
            }
        }
        while others != 0 {
            self.alone(place + others.trailing_zeros() as usize);
            others &= others - 1;
        }
    }

    /// All samples of one path.
    #[inline(never)]
    fn alone(&mut self, index: usize) {
        let (transport, ray) = (self.transport, self.paths.rays.get(index));
        let Some(hit) = self.hits.get(index) else {
            return;
        };
        let vertex = SurfaceVertex::new(transport.scene, &ray, transport.scene.surface(&ray, &hit));
        let throughput = self.paths.get(index, self.depth).throughput;
        let names = [0, 1].map(|name| self.paths.name[name].get_word(index));
        let owner = self.paths.owner.get_word(index);
        let samples = self.purpose.samples_at(transport, self.depth);
        let (at, site) = (transport.scattering(&vertex), transport.site(&vertex));
        for number in 1..samples {
            let block = emitter_block(self.depth, number);
            let (u_select, u) = emitter_numbers(self.purpose.words_alone(names, block));
            let u = (stratified(u_select, number, samples), u);
            if let Some(light) = transport.emitter_light(&at, &site, samples, u) {
                let shadow = Transport::<S, G>::shadow::<SurfaceVertex>(&light, throughput, samples);
                self.make_room();
                self.shadows.push(&shadow, owner);
            }
        }
    }

    /// All samples of the paths of the lanes `lanes`, on diffuse and glossy surfaces.
    #[inline(always)]
    fn together<L: Lanes>(&mut self, place: usize, point: &DiffuseLanes<L>, lanes: u32) {
        let (transport, paths) = (self.transport, self.paths);
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let [_, ray_direction] = paths.rays.load::<L>(place);
        let normal = point.shading.normal;
        let (seen, mirror) = point.seen_from(normal.dot(-ray_direction));
        let seen = seen & L::Mask::from_bits(lanes);
        let sites = transport.sites(point, mirror, point.glossy);
        let mut glossy = GlossyColumns::NONE;
        if point.glossy != 0 {
            let scene = transport.scene;
            scene.glossy_columns(transport.lanes, self.hits, place, point.glossy, &mut glossy);
        }
        let throughput = load_vectors::<L>(&paths.throughput, place);
        let owner = paths.owner.load_words::<L>(place);
        let [name, further] = &paths.name;
        let names = [name.load_words::<L>(place), further.load_words::<L>(place)];
        let samples = self.purpose.samples_at(transport, self.depth);
        let (count, share) = (L::splat(samples as f32), L::splat(1.0 / samples as f32));
        let mut ahead = Ahead::EMPTY;
        let mut number = 1;
        while number < samples {
            if number == ahead.end {
                ahead.begin(number, samples);
                for place in number..ahead.end {
                    let words = self.purpose.words::<L>(names, emitter_block(self.depth, place));
                    ahead.set::<L>(place, words, samples);
                }
                ahead.choose(&transport.sampler, &sites, seen.bits());
            }
            let from = point.position;
            let light = ahead.sample::<L, S>(&transport.sampler, (from, &sites), number, seen.bits());
            let mut pdf = (normal.dot(light.direction) * mirror).max(zero) * L::splat(FRAC_1_PI);
            let mut value = point.reflectance * pdf;
            if point.glossy != 0 {
                let outgoing = local_above(point, mirror, -ray_direction);
                let towards = local_above(point, mirror, light.direction);
                let (of_glossy, pdf_of_glossy) = glossy.load::<L>(place).evaluate(outgoing, towards);
                let is_glossy = L::Mask::from_bits(point.glossy);
                value = of_glossy.select(is_glossy, value);
                pdf = pdf_of_glossy.select(is_glossy, pdf);
            }
            let mis = power_heuristic_lanes(light.pdf_solid_angle * count, pdf);
            let mis = one.select(light.is_delta, mis);
            let radiance = throughput * (value * light.weight * mis) * share;
            let lit = (seen & light.found & !is_black(value)).bits();
            let (origin, direction, t_max) = light.shadow_rays(point);
            self.make_room();
            let shadows = &mut *self.shadows;
            shadows
                .rays
                .store_compressed(shadows.count, origin, direction, t_max, lit);
            store_vectors(&mut shadows.radiance, shadows.count, radiance, lit);
            shadows
                .owner
                .store_words_compressed::<L>(shadows.count, owner, lit);
            shadows.count += lit.count_ones() as usize;
            number += 1;
        }
    }

    /// Makes room for eight.
    #[inline(always)]
    fn make_room(&mut self) {
        if self.shadows.count + LANES > MAX_BATCH {
            self.connect();
        }
    }

    #[inline(never)]
    fn connect(&mut self) {
        self.purpose.count(0, self.shadows.count);
        connect(self.transport.scene, self.shadows, self.depth + 1, self.purpose);
    }
}
