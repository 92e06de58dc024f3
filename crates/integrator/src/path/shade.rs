//! The vertices of a batch: eight at a time where surfaces are diffuse or glossy, one at a time
//! elsewhere.
//!
//! A vertex takes the same operations in the same order in lanes and alone, so a path has the same
//! value, bit for bit, in any batch.

use super::guidance::{GuideQuestions, VectorRows, set_vector, vector};
use super::guide::DirectionGuide;
use super::numbers::{VertexLanes, VertexNumbers};
use super::paths::{Paths, Shadows, lanes_within};
use super::purpose::{Purpose, ending_surface, ending_vertex};
use super::scattering::SurfaceVertex;
use super::transport::{SURVIVAL_CAP, Transport};
use super::vertex_rows::VertexRows;
use crate::emitter_sampler::EmitterSampler;
use crate::light_selection::diffuse_shading_point;
use lightshed_film::MAX_BATCH;
use lightshed_lanes::{LANES, LaneKernel, LaneMask, Lanes, Vec3Lanes};
use lightshed_sampling::{CosineHemisphere, power_heuristic_lanes};
use lightshed_scene::{DiffuseLanes, GlossyVertices, HitBatch};
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
        let mut place = 0;
        while place < self.alive.min(MAX_BATCH) {
            self.eight::<L>(place);
            place += LANES;
        }
        self.survivors
    }
}

impl<S: EmitterSampler, G: DirectionGuide, P: Purpose> Shade<'_, '_, S, G, P> {
    const GUIDED: bool = G::IS_ACTIVE && !cfg!(lightshed_without = "guide");
    /// Whether nothing but emitters is asked at vertices, and no more of them than their positions.
    /// Glossy ones are then shaded with the diffuse ones.
    const PLAIN: bool = !G::IS_ACTIVE && !P::OBSERVES && !P::ENDS && size_of::<S::Site>() == 0;

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
        let [name, further] = &self.paths.name;
        let names = [name.load_words::<L>(place), further.load_words::<L>(place)];
        let block = VertexLanes::<L>::first_block(self.depth);
        let numbers = VertexLanes::<L>::from_blocks([
            self.purpose.words::<L>(names, block),
            self.purpose.words::<L>(names, block + 1),
        ]);
        let mut others = wanted & !missed;
        let environment = match scene.emitters().environment() {
            Some(_) => missed,
            None => 0,
        };
        // On arrays one vertex after another gives the same bits by a tenth of the code.
        if L::IN_REGISTERS {
            let point = scene.diffuse_lanes::<L>(self.hits, place, others);
            let together = point.diffuse | if Self::PLAIN { point.glossy } else { 0 };
            self.arrive_all(place, point.emitting & together | environment);
            if together != 0 {
                self.together(place, &point, &numbers);
                others &= !together;
            }
        } else {
            self.arrive_all(place, environment);
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
        let watched = P::OBSERVES && self.purpose.watches(place);
        let seen = watched.then_some(|vertex| self.purpose.scatter(place, vertex));
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
        let (seen, mirror) = point.seen_from(normal.dot(-ray_direction));
        let seen = seen & L::Mask::from_bits(lanes);
        let owner = paths.owner.load_words::<L>(place);

        let sites = self.sites(point, mirror);
        let light = self.transport.sampler.sample_lanes::<L>(
            point.position,
            &sites,
            numbers.u_emitter(),
            numbers.u_on_emitter(),
            seen.bits(),
        );
        let mut pdf = (normal.dot(light.direction) * mirror).max(zero) * L::splat(FRAC_1_PI);
        let mut value = point.reflectance * pdf;
        let mut local = CosineHemisphere::sample_lanes(numbers.u_direction());
        // Densities by the BSDF and of the mixture with the guide, if there is one.
        let mut scattering_pdf = local.z * L::splat(FRAC_1_PI);
        let mut weight = point.reflectance;
        let mut scatters = seen & zero.less(local.z);
        if Self::PLAIN && point.glossy != 0 {
            let [u0, u1] = numbers.u_direction();
            let vertices = GlossyVertices {
                outgoing: local_above(point, mirror, -ray_direction).store(),
                towards: local_above(point, mirror, light.direction).store(),
                u_lobe: numbers.u_lobe().store(),
                u: [u0.store(), u1.store()],
            };
            let transport = self.transport;
            let found =
                transport
                    .scene
                    .scatter_glossy(transport.lanes, self.hits, place, point.glossy, &vertices);
            let glossy = L::Mask::from_bits(point.glossy);
            pdf = L::load(&found.pdf_solid_angle).select(glossy, pdf);
            value = load_rows::<L>(&found.value).select(glossy, value);
            local = load_rows::<L>(&found.direction).select(glossy, local);
            scattering_pdf = L::load(&found.direction_pdf_solid_angle).select(glossy, scattering_pdf);
            weight = load_rows::<L>(&found.throughput).select(glossy, weight);
            scatters =
                seen & L::Mask::from_bits(found.scatters & point.glossy | scatters.bits() & !point.glossy);
        }
        let black = value.x.equal(zero) & value.y.equal(zero) & value.z.equal(zero);
        let lit = seen & light.found & !black;

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

        let mis = power_heuristic_lanes(light.pdf_solid_angle, light_pdf);
        let mis = one.select(light.is_delta, mis);
        let radiance = before * (value * light.weight * mis);
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
        let black = throughput.x.equal(zero) & throughput.y.equal(zero) & throughput.z.equal(zero);
        let mut survives = scatters & !black;
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

    /// What the choice among emitters knows of points on diffuse surfaces.
    #[inline(always)]
    fn sites<L: Lanes>(&self, point: &DiffuseLanes<L>, mirror: L) -> [S::Site; LANES] {
        if !self.transport.sampler.uses_site() {
            return [S::Site::default(); LANES];
        }
        let normal = facing(point, mirror);
        let rows = [point.position, normal, point.reflectance].map(Vec3Lanes::store);
        std::array::from_fn(|lane| {
            let [position, normal, reflectance] = rows.map(|rows| rows.map(|row| row[lane]).into());
            let at = || diffuse_shading_point(position, normal, reflectance);
            self.transport.sampler.site(at)
        })
    }
}

/// Shading normals on the side that `mirror` says.
#[inline(always)]
fn facing<L: Lanes>(point: &DiffuseLanes<L>, mirror: L) -> Vec3Lanes<L> {
    let zero = L::splat(0.0);
    point.shading.to_world(Vec3Lanes::new(zero, zero, mirror))
}

/// Directions in the shading frames, mirrored as `mirror` says.
#[inline(always)]
fn local_above<L: Lanes>(point: &DiffuseLanes<L>, mirror: L, direction: Vec3Lanes<L>) -> Vec3Lanes<L> {
    let local = point.shading.to_local(direction);
    Vec3Lanes::new(local.x, local.y, local.z * mirror)
}

#[inline(always)]
fn load_rows<L: Lanes>(rows: &VectorRows) -> Vec3Lanes<L> {
    Vec3Lanes::new(L::load(&rows[0]), L::load(&rows[1]), L::load(&rows[2]))
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
