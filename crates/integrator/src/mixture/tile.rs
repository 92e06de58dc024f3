//! A tile of places, each with a chain: one or more for each pixel.

use super::incident::{Follower, Incident};
use super::options::MixtureOptions;
use crate::emitter_sampler::EmitterSampler;
use crate::light_selection::shading_point;
use crate::ray_batch::NOWHERE;
use crate::restir::primary::Primary;
use crate::reuse_frames::FrameView;
use lightshed_film::{RayKind, RayTally};
use lightshed_guiding::{
    Discovery, Finding, MarkovChain, MarkovState, OFFSET_WORDS, Proposal, TargetLobe, neighbour_offset,
};
use lightshed_resampling::{ChainTile, SetWeight};
use lightshed_sampling::{CounterRng, DirectionDistribution, PassNumbers};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Hit, Ray, Rgb, SurfacePoint, luminance};

/// Most places of a tile.
const MOST: usize = 32;

/// Words of a pixel's part of a pass that each of its states has for itself.
const WORDS_OF_STATE: u32 = 1 << 21;

/// Passes of a frame, after that of camera rays ([`trace_primaries`](crate::restir::primary)).
#[derive(Clone, Copy)]
pub(super) enum Pass {
    Emitters = 1,
    /// In rounds.
    Steps,
}

impl From<Pass> for u32 {
    fn from(pass: Pass) -> Self {
        pass as Self
    }
}

/// Data common to all tiles of a frame.
pub(super) struct Shared<'a, S> {
    pub follower: Follower<'a, S>,
    pub view: FrameView<'a>,
    pub options: &'a MixtureOptions,
    pub tally: &'a RayTally,
    /// What pixels see.
    pub pixels: &'a [Option<Primary>],
    /// The states of the frame before, those of a pixel side by side.
    pub before: &'a [MarkovState],
    /// Pixels of that frame that saw what pixels see; `None` if nothing moves.
    pub seen_at: Option<&'a [Option<u32>]>,
    pub width: usize,
    /// Window of neighbours, in pixels.
    pub window: f32,
    /// Whether emitters are sampled at all.
    pub has_emitter_samples: bool,
}

impl<S> Shared<'_, S> {
    /// The pixel of the previous frame that saw what a pixel sees.
    pub fn source(&self, pixel: usize) -> Option<usize> {
        match self.seen_at {
            None => Some(pixel),
            Some(seen) => seen[pixel].map(|pixel| pixel as usize),
        }
    }
}

/// A direction, and its result.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction {
    direction: Vec3,
    /// `f |cos θ| L` of light that emitter sampling finds, too, and of all other light.
    met: Rgb,
    rest: Rgb,
    /// Density of the BSDF: for a lobe without width it is 1, and all others are 0.
    scattering: f32,
    is_delta: bool,
    /// Density of sampling emitters.
    emitters: f32,
    by: Option<Proposal>,
    /// From where it came, apparently.
    place: Vec3,
}

impl Direction {
    /// Along a lobe that has a width, without light so far.
    fn dark(direction: Vec3, scattering: f32, by: Option<Proposal>) -> Self {
        Self {
            direction,
            met: Rgb::ZERO,
            rest: Rgb::ZERO,
            scattering,
            is_delta: false,
            emitters: 0.0,
            by,
            place: Vec3::ZERO,
        }
    }
}

/// A tile at work.
pub(super) struct Tile<'a, S: EmitterSampler> {
    shared: &'a Shared<'a, S>,
    /// Pixels of the places: one after the other, each as often as it has states.
    pub pixels: Vec<usize>,
    /// The data of pixels that the selection of emitters uses.
    sites: Vec<S::Site>,
    /// The streams of the current step.
    streams: Vec<CounterRng>,
    /// What the places keep.
    pub chains: Vec<MarkovChain>,
    /// Estimates of the places.
    pub values: Vec<Rgb>,
}

impl<'a, S: EmitterSampler> Tile<'a, S> {
    /// Without places.
    pub fn new(shared: &'a Shared<'a, S>) -> Self {
        Self {
            shared,
            pixels: Vec::new(),
            sites: Vec::new(),
            streams: Vec::new(),
            chains: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Begins anew with these pixels.
    pub fn begin(&mut self, pixels: impl Iterator<Item = usize>) {
        let shared = self.shared;
        let states = shared.options.states as usize;
        self.pixels.clear();
        self.pixels
            .extend(pixels.flat_map(|pixel| std::iter::repeat_n(pixel, states)));
        let count = self.pixels.len();
        self.sites.clear();
        self.sites
            .extend(self.pixels.iter().map(|&pixel| match &shared.pixels[pixel] {
                Some(at) => (shared.follower.sampler).site(|| shading_point(&at.point, &at.bsdf, at.wo)),
                None => S::Site::default(),
            }));
        self.chains.clear();
        self.chains.resize(count, MarkovChain::START);
        self.values.clear();
        self.values.resize(count, Rgb::ZERO);
    }

    /// The stream of a place.
    fn stream(&self, numbers: PassNumbers, place: usize) -> CounterRng {
        let mut stream = numbers.pixel(self.pixels[place]);
        let state = place as u32 % self.shared.options.states;
        if state > 0 {
            stream.set_dimension(stream.dimension() + state * WORDS_OF_STATE);
        }
        stream
    }

    fn primary(&self, place: usize) -> Option<&'a Primary> {
        self.shared.pixels[self.pixels[place]].as_ref()
    }

    /// Share of the BSDF in a technique at a pixel: everything if there is no lobe, or nothing that
    /// it could serve.
    fn defensive(&self, at: &Primary, technique: &Option<TargetLobe>) -> f32 {
        if technique.is_some() && at.bsdf.has_non_delta() {
            self.shared.options.chains.defensive_share
        } else {
            1.0
        }
    }

    /// Selects a direction at a place; returns the ray to be traced, if it may contribute.
    fn choose(
        &mut self,
        place: usize,
        at: &Primary,
        technique: &Option<TargetLobe>,
    ) -> Option<(Direction, Rgb)> {
        let defensive = self.defensive(at, technique);
        let rng = &mut self.streams[place];
        let (choice, u_lobe, u) = (rng.next_f32(), rng.next_f32(), rng.next_2d());
        let shading = &at.point.shading;
        if let Some(lobe) = technique
            && choice >= defensive
        {
            let (direction, _) = lobe.at(at.point.position, shading.normal).sample(u)?;
            let scattered = at.bsdf.evaluate(at.wo, shading.to_local(direction));
            let dark = Direction::dark(direction, scattered.pdf.value(), Some(Proposal::Lobe));
            return Some((dark, scattered.value));
        }
        let sample = at.bsdf.sample(at.wo, u_lobe, Vec2::from(u))?;
        let direction = shading.to_world(sample.wi);
        if sample.is_delta {
            let mut dark = Direction::dark(direction, 1.0, None);
            dark.is_delta = true;
            return Some((dark, sample.weight));
        }
        // What is known of the rounded direction, as for any other.
        let scattered = at.bsdf.evaluate(at.wo, shading.to_local(direction));
        let dark = Direction::dark(direction, scattered.pdf.value(), Some(Proposal::Scattering));
        Some((dark, scattered.value))
    }

    /// Density with which emitter samples find what a ray hit.
    fn emitter_pdf(&self, place: usize, at: &Primary, ray: &Ray, met: Option<&SurfacePoint>) -> f32 {
        if !self.shared.options.samples_emitters {
            return 0.0;
        }
        let (sampler, site, from) = (
            self.shared.follower.sampler,
            &self.sites[place],
            at.point.position,
        );
        match met {
            Some(point) => sampler.pdf(from, site, point),
            None => sampler.pdf_environment(from, site, ray.direction),
        }
        .value()
    }
}

impl<S: EmitterSampler> ChainTile for Tile<'_, S> {
    type State = MarkovState;
    type Technique = Option<TargetLobe>;
    type Sample = Direction;

    /// States may be those of neighbours in the frame before (Algorithm 2).
    fn begin_step(&mut self, step: usize, states: &mut [MarkovState]) {
        let shared = self.shared;
        let numbers = shared.view.numbers.pass(Pass::Steps).round(step as u32);
        self.streams.clear();
        for place in 0..self.pixels.len() {
            self.streams.push(self.stream(numbers, place));
        }
        if shared.before.is_empty() {
            return;
        }
        let count = shared.options.states as usize;
        let height = shared.before.len() / (shared.width * count);
        for (place, state) in states.iter_mut().enumerate() {
            if self.primary(place).is_none() {
                continue;
            }
            let pixel = self.pixels[place];
            let source = shared.source(pixel).unwrap_or(pixel);
            let corner = [source % shared.width, source / shared.width].map(|c| c as f32 + 0.5);
            let rng = &mut self.streams[place];
            let mut found = Discovery::new(*state);
            for _ in 0..shared.options.chains.neighbours {
                let words: [u32; OFFSET_WORDS] = std::array::from_fn(|_| rng.next_u32());
                let [x, y] = neighbour_offset(words, shared.window);
                let inside = |at: f32, size: usize| (at.max(0.0) as usize).min(size - 1);
                let neighbour =
                    inside(corner[1] + y, height) * shared.width + inside(corner[0] + x, shared.width);
                // Any of its states.
                let which = if count > 1 {
                    rng.next_u32() as usize % count
                } else {
                    0
                };
                found.consider(&shared.before[neighbour * count + which], rng.next_f32());
                if found.has_found() {
                    break;
                }
            }
            *state = found.state();
        }
    }

    fn technique(&self, state: &MarkovState) -> Option<TargetLobe> {
        state.lobe(&self.shared.options.chains)
    }

    fn draw(
        &mut self,
        _step: usize,
        techniques: &[Option<TargetLobe>],
        samples: &mut Vec<Option<Direction>>,
    ) {
        let shared = self.shared;
        let scene = shared.follower.scene;
        let (mut rays, mut owners, mut count) = ([NOWHERE; MOST], [(0, Rgb::ZERO); MOST], 0);
        for (place, technique) in techniques.iter().enumerate() {
            let chosen = match self.primary(place) {
                Some(at) => self.choose(place, at, technique),
                None => None,
            };
            samples.push(chosen.map(|(direction, _)| direction));
            if let (Some((direction, value)), Some(at)) = (chosen, self.primary(place))
                && value != Rgb::ZERO
            {
                rays[count] = at.point.spawn(direction.direction);
                owners[count] = (place, value);
                count += 1;
            }
        }
        let mut hits: [Option<Hit>; MOST] = [None; MOST];
        scene
            .accelerator()
            .intersect_many(&rays[..count], &mut hits[..count]);
        let mut further = 0;
        for ((ray, hit), (place, value)) in rays.iter().zip(hits).zip(owners).take(count) {
            let hit = hit.map(|hit| (hit, scene.surface(ray, &hit)));
            let (incident, more) = shared.follower.follow(*ray, hit, &mut self.streams[place]);
            further += more;
            let Incident { met, rest, distance } = incident;
            let (Some(sample), Some(at)) = (&mut samples[place], self.primary(place)) else {
                continue;
            };
            if met != Rgb::ZERO && !sample.is_delta {
                sample.emitters = self.emitter_pdf(place, at, ray, hit.as_ref().map(|(_, point)| point));
            }
            (sample.met, sample.rest) = (value * met, value * rest);
            sample.place = at.point.position + sample.direction * distance;
        }
        shared.tally.add(RayKind::Path, count + further);
    }

    fn density(&self, place: usize, technique: &Option<TargetLobe>, sample: &Direction) -> f64 {
        let Some(at) = self.primary(place) else {
            return 0.0;
        };
        let defensive = self.defensive(at, technique);
        let own = f64::from(defensive) * f64::from(sample.scattering);
        match technique {
            Some(lobe) if defensive < 1.0 && !sample.is_delta => {
                let seen = lobe.at(at.point.position, at.point.shading.normal);
                own + f64::from(1.0 - defensive) * f64::from(seen.pdf(sample.direction).value())
            }
            _ => own,
        }
    }

    fn advance(
        &mut self,
        _step: usize,
        place: usize,
        state: &mut MarkovState,
        technique: &Option<TargetLobe>,
        sample: Option<&Direction>,
    ) {
        let (Some(sample), Some(at)) = (sample, self.primary(place)) else {
            return;
        };
        let Some(proposal) = sample.by else {
            return;
        };
        let density = self.density(place, technique, sample);
        let light = f64::from(luminance(sample.met + sample.rest));
        let found = (density > 0.0).then_some(Finding {
            place: sample.place,
            estimate: (light / density) as f32,
            brightness: (light / f64::from(sample.scattering.max(f32::MIN_POSITIVE))) as f32,
        });
        let u = self.streams[place].next_f32();
        let chains = &self.shared.options.chains;
        self.chains[place].advance(state, at.point.position, proposal, found, u, chains);
    }

    fn other_density(&self, _place: usize, sample: &Direction) -> f64 {
        f64::from(sample.emitters)
    }

    fn draw_other(&mut self, first: usize, place: usize, samples: &mut Vec<Direction>) {
        let shared = self.shared;
        let Some(at) = self.primary(place).filter(|at| at.bsdf.has_non_delta()) else {
            return;
        };
        if !shared.has_emitter_samples {
            return;
        }
        let mut rng = self.stream(shared.view.numbers.pass(Pass::Emitters), place);
        rng.set_dimension(rng.dimension() + 8 * first as u32);
        let (u_select, u) = (rng.next_u64(), rng.next_2d());
        let from = at.point.position;
        let sampler = shared.follower.sampler;
        let Some(light) = sampler.sample(from, &self.sites[place], u_select, u) else {
            return;
        };
        if !light.is_delta && !shared.options.samples_emitters {
            return;
        }
        let scattered = at
            .bsdf
            .evaluate(at.wo, at.point.shading.to_local(light.direction));
        if scattered.value == Rgb::ZERO {
            return;
        }
        shared.tally.add(RayKind::Emitter, 1);
        if shared.follower.scene.occluded(&light.shadow_ray(&at.point)) {
            return;
        }
        let mut sample = Direction::dark(light.direction, scattered.pdf.value(), None);
        // Nothing else finds a point or a direction: there the density is a probability of
        // selection.
        (sample.met, sample.emitters) = if light.is_delta {
            sample.scattering = 0.0;
            sample.is_delta = true;
            (scattered.value * light.weight, 1.0)
        } else {
            (
                scattered.value * light.weight * light.pdf.value(),
                light.pdf.value(),
            )
        };
        samples.push(sample);
    }

    fn add(&mut self, place: usize, sample: &Direction, weight: SetWeight) {
        let [met, rest] = [(sample.met, weight.merged()), (sample.rest, weight.of_set())]
            .map(|(value, weight)| (value.as_dvec3() * weight).as_vec3());
        // Zero times an infinite weight is no number.
        let rest = if sample.rest == Rgb::ZERO { Rgb::ZERO } else { rest };
        self.values[place] += met + rest;
    }
}
