//! Paths of the pixels of a tile: up to their first collisions, and trees behind them.

use super::flight::{self, Nulls, fly, march};
use super::{TILE_PIXELS, burn};
use crate::camera_ray::PixelRay;
use crate::emitter_sampler::EmitterSampler;
use crate::path::numbers::PathWords;
use crate::path::scattering::{MediumVertex, Vertex};
use crate::path::transport::{Bounce, PathState, SURVIVAL_CAP, VertexStream, met_emission};
use crate::volume::volpath::{
    Channels, MOST_CROSSINGS, Resume, SampleNumbers, State, VolumePathTracer, VolumeTracking,
    fly as fly_freely, is_passed,
};
use lightshed_film::{RayKind, RayTally, SampleId};
use lightshed_sampling::{CounterRng, f32_from_u32};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::volume::PhaseFunction;
use lightshed_scene::{Hit, Material, Medium, Ray, Rgb};

/// What one pixel has traced.
pub struct Tree<K> {
    /// Light of the pixel alone.
    pub own: Rgb,
    /// The first collision, if paths go on there in a grey medium.
    pub first: Option<First<K>>,
    /// What it shares.
    pub behind: Option<Behind>,
}

/// The first collision.
pub struct First<K> {
    /// For the selection of emitters.
    pub site: K,
    pub medium: u32,
    pub position: Vec3,
    /// The same in the space of the medium's grid.
    pub place: Vec3,
    /// Direction of travel of the camera ray.
    pub incoming: Vec3,
    /// With the albedo.
    pub throughput: Rgb,
    /// Probability that roulette lets a path go on from here.
    pub survival: f32,
}

/// What is behind a first collision.
pub enum Behind {
    Collision(Second),
    Escape(Escape),
}

/// A flight from the first collision past everything.
pub struct Escape {
    pub direction: Vec3,
    /// The same in the space of the medium's grid.
    pub movement: Vec3,
    /// `None` if they are too many to be shared.
    pub nulls: Option<Nulls>,
    /// From there.
    pub radiance: Rgb,
}

/// The second collision and what is behind it.
pub struct Second {
    pub position: Vec3,
    /// The same in the space of the medium's grid.
    pub place: Vec3,
    pub nulls: Nulls,
    /// Radiance that is emitted, for each collision.
    pub emitted: Rgb,
    pub albedo: Rgb,
    pub emitter: Option<SeenEmitter>,
    pub onward: Option<Onward>,
}

/// An emitter as seen from the second collision.
pub struct SeenEmitter {
    pub direction: Vec3,
    /// `T L_e / p_e`.
    pub weight: Rgb,
    /// `p_e`, in the solid-angle measure.
    pub pdf: f32,
    pub is_delta: bool,
}

/// Light from the direction in which the path goes on from the second collision.
pub struct Onward {
    pub direction: Vec3,
    /// Emission that the flight in that direction meets, without MIS weight.
    pub met: Rgb,
    /// Density with which an emitter sample finds it, in the solid-angle measure.
    pub met_pdf: f32,
    /// What is scattered or emitted beyond.
    pub beyond: Rgb,
    /// Whether it is weighted for its own pixel alone: the flight meets a second emitter behind the
    /// first.
    pub is_own: bool,
}

/// What trees are grown in.
pub struct Ground<'t, 'a, S> {
    pub tracer: &'t VolumePathTracer<'a, S>,
    pub tally: &'t RayTally,
    pub opens: bool,
    pub words: PathWords,
    pub frame: u32,
}

/// A pixel of a tile.
#[derive(Clone, Copy)]
struct Place {
    pixel: [u32; 2],
    /// The tile's first pixel.
    leader: [u32; 2],
    /// Number in the tile, and of its pixels.
    index: u32,
    count: u32,
}

/// How an edge ends.
enum End {
    /// In a collision in this medium, there.
    Collision(u32, Vec3),
    /// At a hit, or past everything.
    Flown(Option<Hit>),
    /// At no place, after too many boundaries.
    Lost,
}

/// Words of a pixel's stream from which on the tile's first flights take theirs, and the pixel's
/// own paths: behind those of the camera and of the first vertex.
const TILE_STREAM: u32 = 32;
const OWN_STREAM: u32 = 1 << 20;

fn name([x, y]: [u32; 2]) -> u32 {
    y << 16 | x
}

impl<S: EmitterSampler> Ground<'_, '_, S> {
    fn stream(&self, pixel: [u32; 2], first: u32) -> CounterRng {
        let mut rng = CounterRng::new(self.words.seed, name(pixel), self.frame);
        rng.set_dimension(first);
        rng
    }

    /// Grows a tree for each pixel of a tile, at most [`TILE_PIXELS`].
    pub fn grow(&self, pixels: &[[u32; 2]], trees: &mut Vec<Tree<S::Site>>) {
        trees.clear();
        let (Some(&leader), scene) = (pixels.first(), self.tracer.scene()) else {
            return;
        };
        let count = pixels.len().min(TILE_PIXELS);
        let mut rays = [Ray::segment(Vec3::ZERO, Vec3::Z, 0.0); TILE_PIXELS];
        let mut hits = [None; TILE_PIXELS];
        let numbers = self.words.camera(name(leader), self.frame).map(f32_from_u32);
        for (ray, [x, y]) in rays.iter_mut().zip(pixels) {
            *ray = PixelRay::through(scene.camera(), Vec2::new(*x as f32, *y as f32), numbers).ray;
        }
        self.tally.add(RayKind::Camera, count);
        let (rays, hits) = (&rays[..count], &mut hits[..count]);
        scene.accelerator().intersect_many(rays, hits);
        let stream = self.stream(leader, TILE_STREAM);
        for (index, ((&pixel, ray), hit)) in pixels.iter().zip(rays).zip(hits).enumerate() {
            let place = Place {
                pixel,
                leader,
                index: index as u32,
                count: count as u32,
            };
            trees.push(self.grow_one(place, *ray, *hit, stream.clone()));
        }
    }

    /// Up to the first collision; `tile_stream` is that of all first flights of the tile.
    fn grow_one(
        &self,
        place: Place,
        ray: Ray,
        hit: Option<Hit>,
        mut tile_stream: CounterRng,
    ) -> Tree<S::Site> {
        let (tracer, transport) = (self.tracer, self.tracer.transport());
        let scene = transport.scene;
        let mut tree = Tree {
            own: Rgb::ZERO,
            first: None,
            behind: None,
        };
        if transport.max_depth == 0 {
            return tree;
        }
        let id = |[x, y]: [u32; 2]| SampleId {
            x,
            y,
            index: self.frame,
        };
        let mut numbers = SampleNumbers::new(self.words, id(place.leader));
        let own = SampleNumbers::new(self.words, id(place.pixel)).without_flight();
        let hero = match tracer.is_spectral() {
            true => tile_stream.next_u32(),
            false => 0,
        };
        let mut state = State::start(ray, tracer.camera_medium(), hero, own);
        let known = Some(hit.map(|hit| scene.settled(&ray, hit)));
        let end = self.edge(&mut state, known, |medium, ray, t_max, channels| {
            let mut numbers = numbers.flight(1, &mut tile_stream);
            let flight = burn::fly(medium, ray, t_max, channels, &mut numbers);
            tree.own += flight.emitted;
            flight.distance
        });
        let mut rng = self.stream(place.pixel, OWN_STREAM);
        match end {
            End::Collision(index, position) if scene.media()[index as usize].is_grey() => {
                self.first(&mut tree, place, state, (index, position), &mut rng);
            }
            End::Collision(index, position) => {
                let medium = &scene.media()[index as usize];
                if tracer.leave(&mut state, medium, position, &mut rng).is_some() {
                    self.go_on(&mut state, &mut rng);
                }
                tree.own += self.counted(&state);
            }
            End::Flown(hit) => {
                tracer.walk_on(&mut state, Resume::flown(hit), &mut rng);
                tree.own += self.counted(&state);
            }
            End::Lost => (),
        }
        tree
    }

    /// Follows a path from its first collision on, which is not shared.
    fn go_on(&self, state: &mut State<S::Site>, rng: &mut CounterRng) {
        let (tracer, scene) = (self.tracer, self.tracer.scene());
        let mut emitted = Rgb::ZERO;
        let end = self.edge(state, None, |medium, ray, t_max, channels| {
            let flight = burn::fly(medium, ray, t_max, channels, rng);
            emitted += flight.emitted;
            flight.distance
        });
        state.radiance += state.path.throughput * emitted;
        match end {
            End::Collision(index, position) => {
                let medium = &scene.media()[index as usize];
                if tracer.leave(state, medium, position, rng).is_some() {
                    tracer.walk_on(state, Resume::NEW, rng);
                }
            }
            End::Flown(hit) => tracer.walk_on(state, Resume::flown(hit), rng),
            End::Lost => (),
        }
    }

    /// Light of a path that has ended, whose rays are counted.
    fn counted(&self, state: &State<S::Site>) -> Rgb {
        self.count(state.depth.saturating_sub(1));
        state.radiance
    }

    /// Counts edges, each with an emitter sample.
    fn count(&self, edges: u32) {
        self.tally.add(RayKind::Path, edges as usize);
        if !self.tracer.scene().emitters().is_empty() {
            self.tally.add(RayKind::Emitter, edges as usize);
        }
    }

    /// The first collision: an emitter sample, and the second flight.
    fn first(
        &self,
        tree: &mut Tree<S::Site>,
        place: Place,
        mut state: State<S::Site>,
        (index, position): (u32, Vec3),
        rng: &mut CounterRng,
    ) {
        let (tracer, transport) = (self.tracer, self.tracer.transport());
        let scene = transport.scene;
        let medium = &scene.media()[index as usize];
        let before = state.channels.weight();
        let albedo = medium.albedo_at(position);
        if transport.max_depth < 2 || albedo == Rgb::ZERO {
            return;
        }
        let incoming = state.ray.direction;
        let vertex = MediumVertex {
            medium,
            position,
            incoming,
        };
        let (at, site) = (transport.scattering(&vertex), transport.site(&vertex));
        let throughput = before * albedo;
        let own = self.words.vertex(name(place.pixel), self.frame, 1);
        if let Some(light) = transport.emitter_light(&at, &site, 1, (&own).emitter()) {
            self.tally.add(RayKind::Emitter, 1);
            let transmittance = match scene.passes_grid_alone(&light.ray, index) {
                Some(false) => Rgb::ZERO,
                Some(true) => Rgb::splat(march(medium, &light.ray, rng)),
                None => tracer.transmittance(light.ray, Some(index), rng),
            };
            tree.own += throughput * MediumVertex::weighted(&light) * transmittance;
        }
        let survival = match 1 >= transport.roulette_depth {
            true => albedo.max_element().min(SURVIVAL_CAP),
            false => 1.0,
        };
        tree.first = Some(First {
            site,
            medium: index,
            position,
            place: flight::place(medium, position),
            incoming,
            throughput,
            survival,
        });
        // Directions are stratified over the tile and its frames.
        let sample = self.frame.wrapping_mul(place.count).wrapping_add(place.index);
        let together = self.words.vertex(name(place.leader), sample, 1);
        state.path.throughput = albedo;
        let Some(onward) = transport.scatter(&mut state.path, &at, site, 1, 0.0, &mut &together) else {
            return;
        };
        state.depth = 2;
        state.ray = Ray::new(position, onward.direction);
        self.tally.add(RayKind::Path, 1);
        // Shared if it collides before any surface, or if there is none.
        let hit = (!scene.medium_is_clear(index)).then(|| scene.nearest(&state.ray));
        let t_max = hit.flatten().map_or(f32::INFINITY, |hit| hit.t);
        let flown = fly(medium, &state.ray, t_max, rng);
        let Some(distance) = flown.distance else {
            if self.opens && scene.passes_grid_alone(&state.ray, index) == Some(true) {
                tree.behind = Some(Behind::Escape(Escape {
                    direction: state.ray.direction,
                    movement: flight::movement(medium, state.ray.direction),
                    nulls: flown.nulls,
                    radiance: met_emission(scene, &state.ray, None),
                }));
                return;
            }
            let hit = hit.unwrap_or_else(|| scene.nearest(&state.ray));
            tracer.walk_on(&mut state, Resume::flown(hit), rng);
            tree.own += self.counted(&state);
            return;
        };
        let position = state.ray.origin + state.ray.direction * distance;
        if let Some(nulls) = flown.nulls {
            tree.behind = Some(Behind::Collision(self.second(
                state,
                (index, position),
                nulls,
                rng,
            )));
            return;
        }
        if tracer.collide(&mut state, medium, position, rng).is_some() {
            tracer.walk_on(&mut state, Resume::NEW, rng);
        }
        tree.own += self.counted(&state);
    }

    /// The second collision, and what is behind it.
    fn second(
        &self,
        mut state: State<S::Site>,
        (index, position): (u32, Vec3),
        nulls: Nulls,
        rng: &mut CounterRng,
    ) -> Second {
        let (tracer, transport) = (self.tracer, self.tracer.transport());
        let medium = &transport.scene.media()[index as usize];
        let mut second = Second {
            position,
            place: flight::place(medium, position),
            nulls,
            emitted: match medium.emission() {
                Some(_) => medium.emission_per_collision(position),
                None => Rgb::ZERO,
            },
            albedo: medium.albedo_at(position),
            emitter: None,
            onward: None,
        };
        if transport.max_depth < 3 || second.albedo == Rgb::ZERO {
            return second;
        }
        let vertex = MediumVertex {
            medium,
            position,
            incoming: state.ray.direction,
        };
        let site = transport.site(&vertex);
        let (u_select, u) = rng.emitter();
        if let Some(light) = transport.sampler.sample(position, &site, u_select, u) {
            self.tally.add(RayKind::Emitter, 1);
            let transmittance = tracer.transmittance(vertex.shadow_ray(&light), Some(index), rng);
            second.emitter = Some(SeenEmitter {
                direction: light.direction,
                weight: light.weight * transmittance,
                pdf: light.pdf.value(),
                is_delta: light.is_delta,
            });
        }
        let sample = medium.phase().sample(vertex.incoming, rng.direction());
        let before = state.path.throughput.max_element() * second.albedo.max_element();
        let mut survival = 1.0;
        if 2 >= transport.roulette_depth {
            survival = before.min(SURVIVAL_CAP);
            if rng.roulette() >= survival {
                return second;
            }
        }
        state.path = PathState {
            throughput: Rgb::splat(1.0 / survival),
            // Only for roulette.
            eta_squared: before,
            bounce: Some(Bounce {
                from: position,
                site,
                pdf: sample.pdf,
                is_delta: false,
            }),
        };
        // A path of its own, by a channel of its own.
        if tracer.is_spectral() {
            state.channels = Channels::new(rng.next_u32());
        }
        state.ray = Ray::new(position, sample.direction);
        (state.depth, state.radiance) = (3, Rgb::ZERO);
        second.onward = self.onward(state, rng);
        second
    }

    /// Light along the ray of `state`, which has left the second collision.
    fn onward(&self, mut state: State<S::Site>, rng: &mut CounterRng) -> Option<Onward> {
        let (tracer, scene) = (self.tracer, self.tracer.scene());
        let mut onward = Onward {
            direction: state.ray.direction,
            met: Rgb::ZERO,
            met_pdf: 0.0,
            beyond: Rgb::ZERO,
            is_own: false,
        };
        self.tally.add(RayKind::Path, 1);
        let end = self.edge(&mut state, None, |medium, ray, t_max, channels| {
            fly_freely(medium, ray, t_max, VolumeTracking::Delta, channels, rng)
        });
        match end {
            End::Collision(index, place) => {
                let medium = &scene.media()[index as usize];
                if tracer.collide(&mut state, medium, place, rng).is_some() {
                    tracer.walk_on(&mut state, Resume::NEW, rng);
                }
            }
            End::Flown(hit) => {
                let point = hit.map(|hit| scene.surface(&state.ray, &hit));
                let (path, sampler) = (&state.path, &tracer.transport().sampler);
                if let Some((met, pdf)) = path.met_and_pdf(scene, sampler, &state.ray, point.as_ref()) {
                    onward.met = path.throughput * state.channels.weight() * met;
                    onward.met_pdf = pdf.value();
                }
                onward.is_own = point.is_some_and(|point| {
                    matches!(scene.materials()[point.material as usize], Material::Null)
                });
                if hit.is_some() {
                    tracer.walk_on(&mut state, Resume::met(hit), rng);
                }
            }
            End::Lost => (),
        }
        self.count(state.depth.saturating_sub(3));
        onward.beyond = state.radiance;
        (onward.met != Rgb::ZERO || onward.beyond != Rgb::ZERO).then_some(onward)
    }

    /// Follows a path to the end of its edge: through boundaries of media, which `fly` crosses.
    fn edge(
        &self,
        state: &mut State<S::Site>,
        mut known: Option<Option<Hit>>,
        mut fly: impl FnMut(&Medium, &Ray, f32, &mut Channels) -> Option<f32>,
    ) -> End {
        let scene = self.tracer.scene();
        for _ in 0..MOST_CROSSINGS {
            let mut hit = known.take();
            if hit.is_none() && !state.medium.is_some_and(|medium| scene.medium_is_clear(medium)) {
                hit = Some(scene.nearest(&state.ray));
            }
            if let Some(index) = state.medium {
                let medium = &scene.media()[index as usize];
                let t_max = hit.flatten().map_or(state.ray.t_max, |hit| hit.t);
                if let Some(t) = fly(medium, &state.ray, t_max, &mut state.channels) {
                    return End::Collision(index, state.ray.origin + state.ray.direction * t);
                }
            }
            let hit = hit.unwrap_or_else(|| scene.nearest(&state.ray));
            match hit {
                Some(hit) if is_passed(scene, hit.primitive) => {
                    let point = scene.surface(&state.ray, &hit);
                    state.cross(scene, &point);
                }
                hit => return End::Flown(hit),
            }
        }
        End::Lost
    }
}
