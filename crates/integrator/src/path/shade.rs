//! The vertices of a batch: eight at a time where surfaces are diffuse, one at a time elsewhere.
//!
//! A vertex takes the same operations in the same order in lanes and alone, so a path has the same
//! value, bit for bit, in any batch.

use super::guide::DirectionGuide;
use super::numbers::{VertexLanes, VertexNumbers};
use super::paths::{Paths, Shadows, lanes_within};
use super::purpose::Purpose;
use super::scattering::SurfaceVertex;
use super::transport::{SURVIVAL_CAP, Transport};
use crate::emitter_sampler::EmitterSampler;
use crate::light_selection::diffuse_shading_point;
use lightshed_film::MAX_BATCH;
use lightshed_lanes::{LANES, LaneKernel, LaneMask, Lanes, Vec3Lanes};
use lightshed_sampling::{CosineHemisphere, power_heuristic_lanes};
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

impl<S: EmitterSampler, G: DirectionGuide, P: Purpose> Shade<'_, '_, S, G, P> {
    /// Whether diffuse surfaces are shaded in lanes. Guides and caches handle one vertex at a time.
    const IN_LANES: bool = !(P::OBSERVES || P::ENDS || (G::IS_ACTIVE && !cfg!(lightshed_without = "guide")));

    /// Whether these lanes shade diffuse surfaces. On arrays one vertex after another gives the same
    /// bits by a tenth of the code.
    const fn pays<L: Lanes>() -> bool {
        Self::IN_LANES && L::IN_REGISTERS
    }

    /// Paths `place` to `place + 7`.
    #[inline(always)]
    fn eight<L: Lanes>(&mut self, place: usize) {
        let wanted = lanes_within(place, self.alive);
        let mut missed = 0;
        for lane in 0..LANES {
            missed |= u32::from(self.hits.primitive.get_word(place + lane) == HitBatch::NOTHING) << lane;
        }
        missed &= wanted;
        let scene = self.transport.scene;
        let point = match const { Self::pays::<L>() } {
            true => Some(scene.diffuse_lanes::<L>(self.hits, place, wanted & !missed)),
            false => None,
        };
        let [name, further] = &self.paths.name;
        let names = [name.load_words::<L>(place), further.load_words::<L>(place)];
        let block = VertexLanes::<L>::first_block(self.depth);
        let numbers = VertexLanes::<L>::from_blocks([
            self.purpose.words::<L>(names, block),
            self.purpose.words::<L>(names, block + 1),
        ]);
        let mut met = point.as_ref().map_or(0, |point| point.emitting);
        if scene.emitters().environment().is_some() {
            met |= missed;
        }
        while met != 0 {
            self.arrive(place + met.trailing_zeros() as usize);
            met &= met - 1;
        }
        let mut others = wanted & !missed;
        if let Some(point) = point
            && point.diffuse != 0
        {
            self.diffuse(place, &point, &numbers);
            others &= !point.diffuse;
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
        if P::ENDS && !self.purpose.goes_on(place, depth, &mut state, &ray, &vertex) {
            return;
        }
        let seen = |vertex| self.purpose.scatter(place, vertex);
        let next = self
            .transport
            .advance_at(&mut state, &vertex, depth, &mut numbers, seen);
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

    /// [`Transport::advance`] of the paths on diffuse surfaces, without emission.
    #[inline(always)]
    fn diffuse<L: Lanes>(&mut self, place: usize, point: &DiffuseLanes<L>, numbers: &VertexLanes<L>) {
        let paths = self.paths;
        let zero = L::splat(0.0);
        let [_, ray_direction] = paths.rays.load::<L>(place);
        let normal = point.shading.normal;
        let (seen, mirror) = point.seen_from(normal.dot(-ray_direction));
        let seen = seen & L::Mask::from_bits(point.diffuse);
        let throughput = load_vectors::<L>(&paths.throughput, place);
        let owner = paths.owner.load_words::<L>(place);

        let sites = self.sites(point, mirror);
        let light = self.transport.sampler.sample_lanes::<L>(
            point.position,
            &sites,
            numbers.u_emitter(),
            numbers.u_on_emitter(),
            seen.bits(),
        );
        let pdf = (normal.dot(light.direction) * mirror).max(zero) * L::splat(FRAC_1_PI);
        let value = point.reflectance * pdf;
        let black = value.x.equal(zero) & value.y.equal(zero) & value.z.equal(zero);
        let weight = power_heuristic_lanes(light.pdf_solid_angle, pdf);
        let weight = L::splat(1.0).select(light.is_delta, weight);
        let radiance = throughput * (value * light.weight * weight);
        let shadow = (seen & light.found & !black).bits();
        let (origin, direction, t_max) = light.shadow_rays(point);
        let shadows = &mut *self.shadows;
        shadows
            .rays
            .store_compressed(shadows.count, origin, direction, t_max, shadow);
        store_vectors(&mut shadows.radiance, shadows.count, radiance, shadow);
        shadows
            .owner
            .store_words_compressed::<L>(shadows.count, owner, shadow);
        shadows.count += shadow.count_ones() as usize;

        let local = CosineHemisphere::sample_lanes(numbers.u_direction());
        let mut throughput = throughput * point.reflectance;
        let black = throughput.x.equal(zero) & throughput.y.equal(zero) & throughput.z.equal(zero);
        let mut survives = seen & zero.less(local.z) & !black;
        let eta_squared = paths.eta_squared.load::<L>(place);
        if self.depth >= self.transport.roulette_depth {
            let survival = (throughput.max_element() * eta_squared).min(L::splat(SURVIVAL_CAP));
            survives = survives & numbers.u_roulette().less(survival);
            throughput = Vec3Lanes::new(
                throughput.x / survival,
                throughput.y / survival,
                throughput.z / survival,
            );
        }
        let direction = point
            .shading
            .to_world(Vec3Lanes::new(local.x, local.y, local.z * mirror));
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
        next.pdf
            .store_compressed(to, local.z * L::splat(FRAC_1_PI), survives);
        for (next, name) in next.name.iter_mut().zip(&paths.name) {
            next.store_words_compressed::<L>(to, name.load_words::<L>(place), survives);
        }
        next.owner.store_words_compressed::<L>(to, owner, survives);
        if size_of::<S::Site>() > 0 {
            let lanes = (0..LANES).filter(|lane| survives >> lane & 1 == 1);
            for (place, lane) in (to..MAX_BATCH).zip(lanes) {
                next.sites[place] = sites[lane];
            }
        }
        self.survivors += survives.count_ones() as usize;
    }

    /// What the choice among emitters knows of points on diffuse surfaces.
    #[inline(always)]
    fn sites<L: Lanes>(&self, point: &DiffuseLanes<L>, mirror: L) -> [S::Site; LANES] {
        if size_of::<S::Site>() == 0 {
            return [S::Site::default(); LANES];
        }
        let zero = L::splat(0.0);
        let normal = point.shading.to_world(Vec3Lanes::new(zero, zero, mirror));
        let rows = [point.position, normal, point.reflectance].map(Vec3Lanes::store);
        std::array::from_fn(|lane| {
            let [position, normal, reflectance] = rows.map(|rows| rows.map(|row| row[lane]).into());
            let at = || diffuse_shading_point(position, normal, reflectance);
            self.transport.sampler.site(at)
        })
    }
}

#[inline(always)]
fn load_vectors<L: Lanes>(columns: &[lightshed_lanes::Column; 3], place: usize) -> Vec3Lanes<L> {
    Vec3Lanes::new(
        columns[0].load(place),
        columns[1].load(place),
        columns[2].load(place),
    )
}

#[inline(always)]
fn store_vectors<L: Lanes>(
    columns: &mut [lightshed_lanes::Column; 3],
    place: usize,
    v: Vec3Lanes<L>,
    mask: u32,
) {
    columns[0].store_compressed(place, v.x, mask);
    columns[1].store_compressed(place, v.y, mask);
    columns[2].store_compressed(place, v.z, mask);
}
