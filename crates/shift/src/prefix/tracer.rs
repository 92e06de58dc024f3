//! Tracing of prefixes, many at a time, with the light found along them.

use super::domain::PrefixDomain;
use super::sample::PrefixSample;
use crate::departure::Departure;
use crate::domain::Start;
use crate::mis::emitter_weight;
use crate::numbers::PathNumbers;
use crate::roulette::survives;
use crate::world::{End, Endpoint, RayKind, Sight, World};
use lightshed_resampling::ContributionWeight;
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{PathSeed, PrimarySample};

/// Traces prefixes by scattering, depth by depth, all prefixes of a call together. Each depends on
/// its domain and seed alone.
///
/// A path may have no prefix: it leaves the scene, is absorbed, or finds no two consecutive rough
/// vertices before its maximum length. It does not belong to the domain, but the light found along
/// it counts.
pub struct PrefixTracer<W: World> {
    roulette_from: u32,
    /// Least edges of paths whose light counts.
    least_length: u32,
    walks: Vec<Walk<W>>,
    /// The active walks, and the vertices that they have reached.
    places: Vec<usize>,
    vertices: Vec<Option<W::Vertex>>,
    origins: Vec<usize>,
    before: Vec<Option<W::Vertex>>,
    next_places: Vec<usize>,
    rays: Vec<W::Ray>,
    pending: Vec<(usize, Vec3)>,
    pending_rays: Vec<W::Ray>,
    occluded: Vec<bool>,
}

/// Where a prefix starts, and its random numbers.
pub struct PrefixStart<'d, 'w, W: World> {
    /// The domain.
    pub domain: &'d PrefixDomain<'w, W>,
    /// Source of the random numbers.
    pub seed: PathSeed,
    /// Uniform numbers of the lobe and of the direction at the first vertex, in place of those of
    /// the seed: prefixes of a gather may be stratified by them. Such a prefix must not be reused,
    /// for no shift can replay it.
    pub first: Option<[f32; 3]>,
}

impl<'d, 'w, W: World> PrefixStart<'d, 'w, W> {
    /// With all numbers from the seed.
    pub fn new(domain: &'d PrefixDomain<'w, W>, seed: PathSeed) -> Self {
        Self {
            domain,
            seed,
            first: None,
        }
    }
}

/// What a prefix has found.
pub enum PrefixFinding<'a, V> {
    /// Light by a path that ends before the prefix does: its contribution to the pixel's radiance.
    Light(Vec3),
    /// The prefix, its last vertex, and its contribution weight: one over the probability of having
    /// survived roulette.
    Prefix(&'a PrefixSample, &'a V, ContributionWeight<PrimarySample, f64>),
}

struct Walk<W: World> {
    seed: PathSeed,
    numbers: PathNumbers,
    first: Option<[f32; 3]>,
    /// Number of the current vertex.
    index: u32,
    throughput: Vec3,
    /// One over the probability of having survived roulette.
    weight: f64,
    wo: Vec3,
    departure: Option<Departure<W::Site>>,
}

impl<W: World> Walk<W> {
    fn new(&PrefixStart { seed, first, .. }: &PrefixStart<'_, '_, W>) -> Self {
        Self {
            seed,
            numbers: PathNumbers::new(seed),
            first,
            index: 1,
            throughput: Vec3::ONE,
            weight: 1.0,
            wo: Vec3::ZERO,
            departure: None,
        }
    }

    /// The contribution of an emitter sampled from the current vertex, if nothing blocks it.
    fn sample_emitter(&mut self, world: &W, vertex: &W::Vertex) -> Option<(Vec3, W::Ray)> {
        let (u_select, u) = self.numbers.emitter(self.index);
        let endpoint = world.sample_emitter(vertex, u_select, u)?;
        let connection = world.connect(vertex, &endpoint)?;
        let scattering = world.evaluate(vertex, self.wo, connection.direction);
        let is_delta = matches!(endpoint, Endpoint::Delta(_));
        let incident = connection.radiance / connection.pdf.value();
        let weight = emitter_weight(connection.pdf, scattering.pdf, is_delta);
        let light = self.throughput * scattering.value * incident * weight * self.weight as f32;
        (light.max_element() > 0.0 && light.is_finite()).then_some((light, connection.ray))
    }

    /// Scatters at the current vertex.
    fn scatter(&mut self, world: &W, vertex: &W::Vertex, roulette_from: u32) -> Option<W::Ray> {
        let (u_lobe, u_direction) = match self.first {
            Some([lobe, u, v]) if self.index == 1 => (lobe, [u, v]),
            _ => {
                let numbers = self.numbers.scatter(self.index);
                (numbers.lobe, numbers.direction)
            }
        };
        let sampled = world.sample_lobe(vertex, self.wo, u_lobe, u_direction)?;
        let throughput = self.throughput;
        self.throughput *= sampled.scattering.weight();
        if !(self.throughput.max_element() > 0.0 && self.throughput.is_finite()) {
            return None;
        }
        let (numbers, index) = (&mut self.numbers, self.index);
        if index >= roulette_from && !survives(numbers, index, self.throughput, &mut self.weight) {
            return None;
        }
        self.departure = Some(Departure {
            site: world.site(vertex),
            position: world.position(vertex),
            wo: self.wo,
            throughput,
            direction: sampled.wi,
            lobe: sampled.lobe,
            roughness: world.lobe_roughness(vertex, sampled.lobe),
            pdf: sampled.scattering.pdf,
            total_pdf: sampled.total_pdf,
            is_delta: sampled.is_delta,
        });
        self.index += 1;
        self.wo = -sampled.wi;
        Some(world.ray(vertex, sampled.wi))
    }

    /// Emission at the point that the current ray has hit.
    fn met(&self, world: &W, vertex: Option<&W::Vertex>) -> Option<Vec3> {
        let departure = self.departure.as_ref()?;
        let (radiance, emitter_pdf) = departure.met(world, End::of(vertex))?;
        let weight = departure.weight(emitter_pdf);
        Some(self.throughput * radiance * weight * self.weight as f32)
    }

    /// The prefix that ends at the vertex arrived at.
    fn finish(&self, world: &W, before: &W::Vertex, vertex: &W::Vertex) -> Option<PrefixSample> {
        let departure = self.departure.as_ref()?;
        let sight = Sight::of(world, departure.position, vertex);
        let arrival = departure.arrival(world, before, &sight);
        let sample = PrefixSample {
            seed: self.seed,
            index: self.index,
            lobe: departure.lobe,
            place: world.place(vertex),
            density: arrival.density_area,
            throughput: arrival.throughput,
            wo: -arrival.direction,
        };
        let throughput = arrival.throughput;
        (throughput.max_element() > 0.0 && throughput.is_finite()).then_some(sample)
    }
}

impl<W: World> PrefixTracer<W> {
    /// Roulette may end a prefix from vertex number `roulette_from` on (the first surface is number
    /// 1).
    pub fn new(roulette_from: u32) -> Self {
        Self {
            roulette_from,
            least_length: 0,
            walks: Vec::new(),
            places: Vec::new(),
            vertices: Vec::new(),
            origins: Vec::new(),
            before: Vec::new(),
            next_places: Vec::new(),
            rays: Vec::new(),
            pending: Vec::new(),
            pending_rays: Vec::new(),
            occluded: Vec::new(),
        }
    }

    /// Without the light of paths of fewer than `edges` edges (that from the camera included),
    /// which is left to another estimator. The prefixes stay the same, bit for bit.
    #[must_use]
    pub fn with_least_length(mut self, edges: u32) -> Self {
        self.least_length = edges;
        self
    }

    /// Traces a prefix for each start and passes its results to `visit`, with the number of the
    /// start, in an order that depends on the starts alone. With `with_light`, the light along the
    /// way is estimated, too; otherwise no emitter is sampled.
    pub fn trace(
        &mut self,
        starts: &[PrefixStart<'_, '_, W>],
        with_light: bool,
        mut visit: impl FnMut(usize, PrefixFinding<'_, W::Vertex>),
    ) {
        let Some(world) = starts.first().map(|start| start.domain.world()) else {
            return;
        };
        self.begin(world, starts, with_light, &mut visit);
        while !self.places.is_empty() {
            self.leave(world, starts, with_light);
            self.occluded.clear();
            self.occluded.resize(self.pending_rays.len(), false);
            world.occluded_many(&self.pending_rays, RayKind::Emitter, &mut self.occluded);
            for ((number, light), &occluded) in self.pending.iter().zip(&self.occluded) {
                if !occluded {
                    visit(*number, PrefixFinding::Light(*light));
                }
            }
            std::mem::swap(&mut self.places, &mut self.next_places);
            std::mem::swap(&mut self.vertices, &mut self.before);
            self.vertices.clear();
            self.vertices.resize(self.rays.len(), None);
            world.trace_many(&self.rays, RayKind::Path, &mut self.vertices);
            self.arrive(world, starts, with_light, &mut visit);
        }
    }

    /// The first vertices.
    fn begin(
        &mut self,
        world: &W,
        starts: &[PrefixStart<'_, '_, W>],
        with_light: bool,
        visit: &mut impl FnMut(usize, PrefixFinding<'_, W::Vertex>),
    ) {
        self.walks.clear();
        self.walks.extend(starts.iter().map(Walk::new));
        self.places.clear();
        self.rays.clear();
        for (number, start) in starts.iter().enumerate() {
            let walk = &mut self.walks[number];
            if let Start::Sensor(sensor) = start.domain.start()
                && let Some((ray, direction)) = world.sensor_ray(sensor, walk.numbers.sensor())
            {
                walk.wo = -direction;
                self.rays.push(ray);
                self.places.push(number);
            }
        }
        self.vertices.clear();
        self.vertices.resize(self.rays.len(), None);
        world.trace_many(&self.rays, RayKind::Sensor, &mut self.vertices);
        if with_light && self.least_length <= 1 {
            for (&number, vertex) in self.places.iter().zip(&self.vertices) {
                let radiance = End::of(vertex.as_ref()).radiance(world, -self.walks[number].wo);
                if radiance != Vec3::ZERO && starts[number].domain.max_length() >= 1 {
                    visit(number, PrefixFinding::Light(radiance));
                }
            }
        }
        for (number, start) in starts.iter().enumerate() {
            if let Start::Vertex { first, wo } = start.domain.start() {
                self.walks[number].wo = *wo;
                self.places.push(number);
                self.vertices.push(Some(first.clone()));
            }
        }
    }

    /// From every vertex, possibly a path to an emitter, and a ray to the next vertex.
    fn leave(&mut self, world: &W, starts: &[PrefixStart<'_, '_, W>], with_light: bool) {
        self.pending.clear();
        self.pending_rays.clear();
        self.next_places.clear();
        self.rays.clear();
        self.origins.clear();
        for (place, (&number, vertex)) in self.places.iter().zip(&self.vertices).enumerate() {
            let (walk, length) = (&mut self.walks[number], starts[number].domain.max_length());
            let Some(vertex) = vertex.as_ref().filter(|_| walk.index < length) else {
                continue;
            };
            if with_light
                && walk.index + 1 >= self.least_length
                && let Some((light, ray)) = walk.sample_emitter(world, vertex)
            {
                self.pending.push((number, light));
                self.pending_rays.push(ray);
            }
            if let Some(ray) = walk.scatter(world, vertex, self.roulette_from) {
                self.rays.push(ray);
                self.next_places.push(number);
                self.origins.push(place);
            }
        }
    }

    /// The results of the rays: light, ends of prefixes, or vertices to continue from.
    fn arrive(
        &mut self,
        world: &W,
        starts: &[PrefixStart<'_, '_, W>],
        with_light: bool,
        visit: &mut impl FnMut(usize, PrefixFinding<'_, W::Vertex>),
    ) {
        for (place, &number) in self.places.iter().enumerate() {
            let (walk, domain) = (&self.walks[number], starts[number].domain);
            if with_light
                && walk.index >= self.least_length
                && let Some(light) = walk.met(world, self.vertices[place].as_ref())
            {
                visit(number, PrefixFinding::Light(light));
            }
            let left = walk
                .departure
                .as_ref()
                .map(|left| (left.position, left.roughness));
            let ends = |vertex: &&W::Vertex| domain.ends(left, vertex);
            let Some(vertex) = self.vertices[place].as_ref().filter(ends) else {
                continue;
            };
            if walk.index < domain.max_length()
                && let Some(before) = &self.before[self.origins[place]]
                && let Some(sample) = walk.finish(world, before, vertex)
                && let Ok(weight) = ContributionWeight::new(walk.weight)
            {
                visit(number, PrefixFinding::Prefix(&sample, vertex, weight));
            }
            self.vertices[place] = None;
        }
    }
}
