//! The first two vertices of trees: eight at a time where surfaces are diffuse or glossy, one at a
//! time elsewhere, with the same bits.

use super::points::store_all;
use super::tree::Trees;
use crate::emitter_sampler::EmitterSampler;
use crate::path::escape::Escaped;
use crate::path::numbers::{PathWords, VertexLanes, VertexNumbers, emitter_block};
use crate::path::paths::{Paths, Shadows, lanes_within};
use crate::path::scattered_lanes::{is_black, store_vectors};
use crate::path::scattering::{SurfaceVertex, Vertex};
use crate::path::transport::{Bounce, PathState, Shadow, Transport, UNSEEN};
use lightshed_film::MAX_BATCH;
use lightshed_lanes::{LANES, LaneKernel, LaneMask, Lanes, Vec3Lanes};
use lightshed_sampling::power_heuristic_lanes;
use lightshed_scene::glam::Vec2;
use lightshed_scene::{DiffuseLanes, HitBatch, Rgb};

/// Number of the edge that leads to `x₁`, and to `x₂`.
pub const FIRST: u32 = 1;
pub const SECOND: u32 = 2;

/// Samples emitters and directions at the ends of the edges number `DEPTH` of `paths`, which the
/// trees have met: into `shadows`, `next`, whose number is the result, and the trees. Emission is
/// for a tree's own pixel: at `x₂` it is direct light, weighted against the emitter sample of `x₁`.
pub struct Vertices<'a, 's, S: EmitterSampler, const DEPTH: u32> {
    pub transport: &'a Transport<'s, S>,
    pub words: PathWords,
    pub paths: &'a Paths<S::Site>,
    pub alive: usize,
    /// Trees, as bits, that leave out surface emission at `x₁`.
    pub taken: u64,
    pub next: &'a mut Paths<S::Site>,
    pub survivors: usize,
    pub shadows: &'a mut Shadows,
    pub trees: &'a mut Trees,
    /// Trees end where a delta lobe of so many first vertices serves their own pixel alone.
    pub apart: u32,
}

impl<S: EmitterSampler, const DEPTH: u32> LaneKernel for Vertices<'_, '_, S, DEPTH> {
    const HOT: bool = true;
    type Output = usize;

    #[inline(always)]
    fn run<L: Lanes>(mut self) -> usize {
        let mut place = 0;
        while place < self.alive.min(MAX_BATCH) {
            self.eight::<L>(place);
            place += LANES;
        }
        self.survivors
    }
}

impl<S: EmitterSampler, const DEPTH: u32> Vertices<'_, '_, S, DEPTH> {
    /// Paths `place` to `place + 7`.
    #[inline(always)]
    fn eight<L: Lanes>(&mut self, place: usize) {
        let hits = self.hits();
        let wanted = lanes_within(place, self.alive);
        let (mut missed, mut is_delta) = (0, 0);
        for lane in 0..LANES {
            missed |= u32::from(hits.primitive.get_word(place + lane) == HitBatch::NOTHING) << lane;
            if DEPTH == SECOND {
                is_delta |= u32::from(self.paths.pdf.get(place + lane) == f32::INFINITY) << lane;
            }
        }
        missed &= wanted;
        let scene = self.transport.scene;
        let mut others = wanted & !missed;
        if missed != 0 && scene.emitters().environment().is_some() {
            self.escape::<L>(place, missed);
        }
        if L::IN_REGISTERS {
            let mut point = scene.diffuse_lanes::<L>(self.hits(), place, others & !is_delta);
            if self.transport.sampler.uses_gloss() {
                point.glossy = 0;
            }
            let together = point.diffuse | point.glossy;
            self.arrive_all(place, point.emitting & together);
            if together != 0 {
                self.together(place, &point, together);
                others &= !together;
            }
        }
        while others != 0 {
            let lane = others.trailing_zeros() as usize;
            self.arrive(place + lane);
            self.alone(place + lane);
            others &= others - 1;
        }
    }

    #[inline(always)]
    fn hits(&self) -> &HitBatch {
        match DEPTH {
            FIRST => &self.trees.first.hits,
            _ => &self.trees.second.hits,
        }
    }

    #[inline(always)]
    fn arrive_all(&mut self, place: usize, mut met: u32) {
        while met != 0 {
            self.arrive(place + met.trailing_zeros() as usize);
            met &= met - 1;
        }
    }

    /// Adds what the paths of the lanes `missed` find around the scene.
    #[inline(always)]
    fn escape<L: Lanes>(&mut self, place: usize, mut missed: u32) {
        let scene = (self.transport.scene, &self.transport.sampler);
        let found = match L::IN_REGISTERS {
            true => Escaped::of::<L, S>(scene, self.paths, place, (DEPTH, 1), missed),
            false => None,
        };
        let Some(found) = found else {
            return self.arrive_all(place, missed);
        };
        while missed != 0 {
            let lane = missed.trailing_zeros() as usize;
            let owner = self.paths.owner.get_word(place + lane) as usize;
            self.trees.add_own(owner, found.get(lane));
            missed &= missed - 1;
        }
    }

    #[inline(never)]
    fn arrive(&mut self, index: usize) {
        Self::met(self.transport, (self.paths, self.taken), index, self.trees);
    }

    /// Adds emission that one path has met.
    pub fn met(
        transport: &Transport<'_, S>,
        (paths, taken): (&Paths<S::Site>, u64),
        index: usize,
        trees: &mut Trees,
    ) {
        let hit = match DEPTH {
            FIRST => trees.first.hits.get(index),
            _ => trees.second.hits.get(index),
        };
        if DEPTH == FIRST && hit.is_some() && taken >> index & 1 == 1 {
            return;
        }
        let (scene, ray) = (transport.scene, paths.rays.get(index));
        let point = hit.map(|hit| scene.surface(&ray, &hit));
        let path = paths.get(index, DEPTH);
        let met = path.met(scene, &transport.sampler, &ray, point.as_ref());
        trees.add_own(paths.owner.get_word(index) as usize, path.throughput * met);
    }

    /// One path's numbers.
    fn numbers(&self, index: usize) -> VertexNumbers {
        let [pixel, sample] = self.paths.name.each_ref().map(|name| name.get_word(index));
        self.words.vertex(pixel, sample, DEPTH)
    }

    /// Lets a path go on.
    fn push(&mut self, index: usize, path: &PathState<S::Site>, ray: &lightshed_scene::Ray) {
        let names = self.paths.name.each_ref().map(|name| name.get_word(index));
        let owner = self.paths.owner.get_word(index) as usize;
        self.next.begin(self.survivors, path, ray, names, owner);
        self.survivors += 1;
    }

    /// One path that has hit something.
    #[inline(never)]
    fn alone(&mut self, index: usize) {
        let (scene, ray) = (self.transport.scene, self.paths.rays.get(index));
        let Some(hit) = self.hits().get(index) else {
            return;
        };
        let vertex = SurfaceVertex::new(scene, &ray, scene.surface(&ray, &hit));
        match DEPTH {
            FIRST => self.first_alone(index, vertex),
            _ => self.second_alone(index, vertex),
        }
    }

    fn first_alone(&mut self, index: usize, vertex: SurfaceVertex) {
        let (transport, numbers) = (self.transport, self.numbers(index));
        let (at, site) = (transport.scattering(&vertex), transport.site(&vertex));
        let u = (numbers.u_emitter, numbers.u_on_emitter);
        if let Some(light) = transport.emitter_light(&at, &site, 1, u) {
            let shadow = Shadow {
                radiance: SurfaceVertex::weighted(&light),
                ray: light.ray,
            };
            self.shadows.push(&shadow, self.paths.owner.get_word(index));
        }
        if let Some(sample) = at.sample(numbers.u_lobe, numbers.u_direction)
            && sample.weight != Rgb::ZERO
        {
            let path = PathState {
                throughput: sample.weight,
                eta_squared: sample.eta * sample.eta,
                bounce: Some(Bounce {
                    from: vertex.position(),
                    site,
                    pdf: sample.pdf,
                    is_delta: sample.is_delta,
                }),
            };
            self.push(index, &path, &vertex.point.spawn(sample.direction));
        }
        self.trees.first.alone |= 1 << index;
        self.trees.first.known[index] = Some(vertex);
    }

    fn second_alone(&mut self, index: usize, second: SurfaceVertex) {
        let (transport, numbers) = (self.transport, self.numbers(index));
        let owner = self.paths.owner.get_word(index);
        let mut path = self.paths.get(index, DEPTH);
        if path.bounce.as_ref().is_some_and(|bounce| bounce.is_delta) {
            if self.apart >= FIRST {
                return;
            }
            // No other pixel can reach this point: an ordinary path.
            let next = transport.advance(&mut path, &second, (DEPTH, 1), &mut &numbers, UNSEEN);
            if let Some(shadow) = &next.shadow {
                self.shadows.push(shadow, owner);
            }
            if let Some(ray) = &next.ray {
                self.push(index, &path, ray);
            }
            return;
        }
        let site = transport.site(&second);
        self.sample_emitter(index, &second, &site, &numbers);
        self.leave_second(index, &path, &second, site, &numbers);
        self.trees.second_of[owner as usize % MAX_BATCH] = index as u8;
        self.trees.second.alone |= 1 << index;
        self.trees.second.known[index] = Some(second);
    }

    /// An emitter sample at `x₂`, for any scattered direction. One that this pixel cannot use is
    /// left out, and so does not count for its technique.
    fn sample_emitter(
        &mut self,
        index: usize,
        second: &SurfaceVertex,
        site: &S::Site,
        numbers: &VertexNumbers,
    ) {
        if !second.has_non_delta() {
            return;
        }
        let (u_select, u) = (numbers.u_emitter, numbers.u_on_emitter);
        let sampler = &self.transport.sampler;
        let Some(light) = sampler.sample(second.position(), site, u_select, u) else {
            return;
        };
        let wi = second.point.shading.to_local(light.direction);
        if second.bsdf.evaluate(second.wo, wi).value == Rgb::ZERO {
            return;
        }
        let behind = &mut self.trees.behind;
        for axis in 0..3 {
            behind.light[axis].set(index, wi[axis]);
            behind.light_weight[axis].set(index, light.weight[axis]);
        }
        behind.light_pdf.set(index, light.pdf.value());
        behind.light_is_delta |= u64::from(light.is_delta) << index;
        let shadow = Shadow {
            ray: second.shadow_ray(&light),
            radiance: Rgb::ZERO,
        };
        self.shadows.push(&shadow, self.paths.owner.get_word(index));
    }

    /// A direction at `x₂`. A delta lobe serves the own pixel alone.
    fn leave_second(
        &mut self,
        index: usize,
        before: &PathState<S::Site>,
        second: &SurfaceVertex,
        site: S::Site,
        numbers: &VertexNumbers,
    ) {
        let SurfaceVertex { point, bsdf, wo, .. } = second;
        let Some(sample) = bsdf.sample(*wo, numbers.u_lobe, Vec2::from(numbers.u_direction)) else {
            return;
        };
        if sample.weight == Rgb::ZERO || (sample.is_delta && self.apart >= SECOND) {
            return;
        }
        let (before, eta_squared) = (before.throughput, sample.eta * sample.eta);
        let mut path = PathState {
            throughput: before * sample.weight,
            eta_squared,
            bounce: Some(Bounce {
                from: point.position,
                site,
                pdf: sample.pdf,
                is_delta: sample.is_delta,
            }),
        };
        if !sample.is_delta {
            path.throughput = Rgb::ONE;
            // Roulette takes the path as one that begins here: whether it ends must not depend on
            // which pixel made it.
            path.eta_squared = 1.0;
            let behind = &mut self.trees.behind;
            behind.scattered |= 1 << index;
            for axis in 0..3 {
                behind.wi[axis].set(index, sample.wi[axis]);
            }
        }
        self.push(index, &path, &point.spawn(point.shading.to_world(sample.wi)));
    }

    /// The paths of the lanes `together`, without emission.
    #[inline(always)]
    fn together<L: Lanes>(&mut self, place: usize, point: &DiffuseLanes<L>, together: u32) {
        let (paths, transport) = (self.paths, self.transport);
        let one = L::splat(1.0);
        let names = paths.name.each_ref().map(|name| name.load_words::<L>(place));
        let block = emitter_block(DEPTH, 0);
        let numbers = VertexLanes::<L>::from_blocks(
            [
                self.words.vertex_lanes::<L>(names, block),
                self.words.vertex_lanes::<L>(names, block + 1),
            ],
            1,
        );
        let [_, incoming] = paths.rays.load::<L>(place);
        let lanes = [together, point.glossy];
        let scattered = transport.scatter_lanes((self.hits(), place), point, lanes, incoming, &numbers);
        let lit = scattered.lit().bits();
        let (mirror, light) = (scattered.mirror, &scattered.light);
        let vertex = match DEPTH {
            FIRST => &mut self.trees.first,
            _ => &mut self.trees.second,
        };
        let sides = (scattered.seen, mirror);
        let surfaces = vertex.points.set(place, point, lanes, incoming, sides);
        if point.glossy != 0 {
            let scene = transport.scene;
            scene.glossy_columns(transport.lanes, &vertex.hits, place, point.glossy, surfaces);
        }

        let local = Vec3Lanes::new(scattered.local.x, scattered.local.y, scattered.local.z * mirror);
        let owner = paths.owner.load_words::<L>(place);
        let (shadows, next, to) = (&mut *self.shadows, &mut *self.next, self.survivors);
        if DEPTH == FIRST {
            let mis = power_heuristic_lanes(light.pdf_solid_angle, scattered.pdf);
            let mis = one.select(light.is_delta, mis);
            let radiance = scattered.value * light.weight * mis;
            store_vectors(&mut shadows.radiance, shadows.count, radiance, lit);
        } else {
            let behind = &mut self.trees.behind;
            store_all(&mut behind.light, place, point.shading.to_local(light.direction));
            store_all(&mut behind.light_weight, place, light.weight);
            behind.light_pdf.store(place, light.pdf_solid_angle);
            behind.light_is_delta |= u64::from(light.is_delta.bits() & lit) << place;
            store_all(&mut behind.wi, place, local);
            for lane in (0..LANES).filter(|lane| together >> lane & 1 == 1) {
                let tree = paths.owner.get_word(place + lane) as usize;
                self.trees.second_of[tree % MAX_BATCH] = (place + lane) as u8;
            }
        }
        let (origin, direction, t_max) = light.shadow_rays(point);
        shadows
            .rays
            .store_compressed(shadows.count, origin, direction, t_max, lit);
        shadows
            .owner
            .store_words_compressed::<L>(shadows.count, owner, lit);
        shadows.count += lit.count_ones() as usize;

        let survives = (scattered.scatters & !is_black(scattered.weight)).bits();
        let direction = point.shading.to_world(local);
        let infinity = L::splat(f32::INFINITY);
        let origin = point.origin_towards(direction);
        next.rays
            .store_compressed(to, origin, direction, infinity, survives);
        if DEPTH == FIRST {
            store_vectors(&mut next.throughput, to, scattered.weight, survives);
            next.eta_squared.store_compressed(to, one, survives);
        } else {
            self.trees.behind.scattered |= u64::from(survives) << place;
            store_vectors(&mut next.throughput, to, Vec3Lanes::new(one, one, one), survives);
            next.eta_squared.store_compressed(to, one, survives);
        }
        store_vectors(&mut next.from, to, point.position, survives);
        next.pdf.store_compressed(to, scattered.direction_pdf, survives);
        for (next, name) in next.name.iter_mut().zip(names) {
            next.store_words_compressed::<L>(to, name, survives);
        }
        next.owner.store_words_compressed::<L>(to, owner, survives);
        if transport.sampler.uses_site() {
            let lanes = (0..LANES).filter(|lane| survives >> lane & 1 == 1);
            for (place, lane) in (to..MAX_BATCH).zip(lanes) {
                next.sites[place] = scattered.sites[lane];
            }
        }
        self.survivors += survives.count_ones() as usize;
    }
}
