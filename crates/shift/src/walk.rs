//! One active path of a tree: its position, its throughput, and its possible reconnection.

use crate::departure::{Arrival, Departure};
use crate::domain::PathDomain;
use crate::mis::{emitter_weight, scattering_weight};
use crate::numbers::PathNumbers;
use crate::roulette::survives;
use crate::sample::{ALL_LOBES, Anchor, PathSample, Technique, pack_direction, unpack_direction};
use crate::world::{End, Endpoint, LobeDirection, Place, Sight, Suffix, SuffixLight, World, max_roughness};
use lightshed_resampling::ContributionWeight;
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Density, PathSeed, PrimarySample, SolidAngle};

/// The reconnection vertex, once the path has left it.
struct Found {
    index: u32,
    place: Place,
    incident: [f32; 2],
    lobes: [u8; 2],
    density: f32,
    /// Of the direction in which the path has left it, over all lobes.
    total_pdf: Density<SolidAngle>,
}

/// How a walk goes on.
pub(crate) enum Onward<W: World> {
    /// To its next vertex.
    Ray(W::Ray),
    /// From its reconnection vertex: to whatever light there is.
    Suffix(Suffix<W::Ray, W::Site>),
}

/// A path `x₁ … x_m` of a tree.
pub(crate) struct Walk<W: World> {
    seed: PathSeed,
    numbers: PathNumbers,
    /// `m`.
    index: u32,
    /// `Π f / p` over all vertices but the current one.
    throughput: Vec3,
    /// One over the probability of having survived roulette.
    weight: f64,
    departure: Option<Departure<W::Site>>,
    /// The current vertex, if it may be reconnected with the one before by all but its own lobe.
    pair: Option<Arrival>,
    found: Option<Found>,
    /// From the first vertex to the viewer.
    wo: Vec3,
    /// Whether one of the vertices that decide about the domain's part has scattered by a delta
    /// lobe.
    specular: bool,
}

/// A path that ends at an emitter, and the weight it has as a candidate.
pub(crate) type Candidate = (PathSample, ContributionWeight<PrimarySample, f64>);

/// A candidate that counts if its last edge is unoccluded.
pub(crate) struct Pending<R> {
    pub candidate: Candidate,
    pub ray: R,
}

impl<W: World> Walk<W> {
    pub fn new(seed: PathSeed) -> Self {
        Self {
            seed,
            numbers: PathNumbers::new(seed),
            index: 1,
            throughput: Vec3::ONE,
            weight: 1.0,
            departure: None,
            pair: None,
            found: None,
            wo: Vec3::ZERO,
            specular: false,
        }
    }

    /// The ray to the first vertex from a sensor.
    pub fn leave_sensor(&mut self, domain: &PathDomain<'_, W>, sensor: &W::Sensor) -> Option<W::Ray> {
        let (ray, direction) = domain.world.sensor_ray(sensor, self.numbers.sensor())?;
        self.wo = -direction;
        Some(ray)
    }

    /// Takes a first vertex as given.
    pub fn start(&mut self, wo: Vec3) {
        self.wo = wo;
    }

    /// What is emitted against the ray from a sensor.
    pub fn seen(&self, domain: &PathDomain<'_, W>, vertex: Option<&W::Vertex>) -> Vec3 {
        End::of(vertex).radiance(domain.world, -self.wo)
    }

    /// Records that the path has come from `before` to `vertex`: whether they may be reconnected,
    /// as far as the lobe of the former and the distance decide it.
    pub fn settle(&mut self, domain: &PathDomain<'_, W>, before: &W::Vertex, vertex: Option<&W::Vertex>) {
        self.pair = self.connectable(domain, before, vertex);
    }

    fn connectable(
        &self,
        domain: &PathDomain<'_, W>,
        before: &W::Vertex,
        vertex: Option<&W::Vertex>,
    ) -> Option<Arrival> {
        let (rules, world) = (&domain.connectability, domain.world);
        let departure = self
            .departure
            .as_ref()
            .filter(|departure| rules.reaches(self.index) && rules.rough(departure.roughness))?;
        let sight = Sight::of(world, departure.position, vertex?);
        if !rules.far(sight.position, sight.offset) {
            return None;
        }
        let arrival = departure.arrival(world, before, &sight);
        rules
            .spreads(Density::new(arrival.density_area))
            .then_some(arrival)
    }

    fn view(&self) -> Vec3 {
        self.departure
            .as_ref()
            .map_or(self.wo, |departure| -departure.direction)
    }

    /// The path that ends at an emitter sampled from the current vertex, if it can contribute.
    pub fn sample_emitter(
        &mut self,
        domain: &PathDomain<'_, W>,
        vertex: &W::Vertex,
    ) -> Option<Pending<W::Ray>> {
        let world = domain.world;
        if !domain.part.has(self.specular) {
            return None;
        }
        let (u_select, u) = self.numbers.emitter(self.index);
        let endpoint = world.sample_emitter(vertex, u_select, u)?;
        let connection = world.connect(vertex, &endpoint)?;
        let scattering = world.evaluate(vertex, self.view(), connection.direction);
        if scattering.value == Vec3::ZERO {
            return None;
        }
        let is_delta = matches!(endpoint, Endpoint::Delta(_));
        let other = if is_delta { Density::ZERO } else { connection.pdf };
        let incident = connection.radiance / connection.pdf.value();
        let here = scattering.value * incident * emitter_weight(other, scattering.pdf, is_delta);
        let rules = &domain.connectability;
        let length = self.index + 1;
        let widest = max_roughness(world, vertex);
        let pair = self
            .pair
            .filter(|pair| rules.returns(widest, pair.distance_squared));
        let sample = if let Some(pair) = pair {
            let anchor = Anchor::Vertex {
                place: world.place(vertex),
                incident: pack_direction(connection.direction),
            };
            let lobes = [pair.lobe_before, ALL_LOBES];
            let mut sample =
                PathSample::new(self.seed, length, Technique::Emitter, (self.index, anchor), lobes);
            sample.radiance = incident.to_array();
            sample.density = pair.density_area;
            sample.emitter_pdf = other.value();
            // Evaluated for the direction as it is stored.
            let stored = unpack_direction(pack_direction(connection.direction));
            let scattering = world.evaluate(vertex, -pair.direction, stored);
            let here = scattering.value * incident * emitter_weight(other, scattering.pdf, is_delta);
            return self.pending(sample, pair.throughput * here, connection.ray);
        } else if rules.reaches(length)
            && rules.rough(widest)
            && domain.far_enough(vertex, self.view(), &endpoint)
        {
            let anchor = Anchor::Emitter(endpoint);
            let lobes = [ALL_LOBES, 0];
            let mut sample = PathSample::new(self.seed, length, Technique::Emitter, (length, anchor), lobes);
            sample.density = connection.own_density.value();
            sample
        } else {
            self.replayed(length, Technique::Emitter)
        };
        self.pending(sample, self.throughput * here, connection.ray)
    }

    /// A candidate, if it contributes anything.
    fn candidate(&self, mut sample: PathSample, contribution: Vec3) -> Option<Candidate> {
        if !(contribution.max_element() > 0.0 && contribution.is_finite()) {
            return None;
        }
        sample.contribution = contribution.to_array();
        let weight = ContributionWeight::new(self.weight).ok()?;
        Some((sample, weight))
    }

    fn pending(&self, sample: PathSample, contribution: Vec3, ray: W::Ray) -> Option<Pending<W::Ray>> {
        let candidate = self.candidate(sample, contribution)?;
        Some(Pending { candidate, ray })
    }

    /// Scatters at the current vertex: the direction to continue, or the end of the path.
    pub fn scatter(
        &mut self,
        domain: &PathDomain<'_, W>,
        vertex: &W::Vertex,
        roulette_from: u32,
    ) -> Option<Onward<W>> {
        let world = domain.world;
        let wo = self.view();
        let numbers = self.numbers.scatter(self.index);
        let mut sampled = world.sample_lobe(vertex, wo, numbers.lobe, numbers.direction)?;
        self.specular = domain
            .part
            .scattered(self.specular, self.index, sampled.is_delta)?;
        let roughness = world.lobe_roughness(vertex, sampled.lobe);
        let rules = &domain.connectability;
        let pair = self
            .pair
            .filter(|pair| rules.returns(roughness, pair.distance_squared));
        let throughput = self.throughput;
        if let Some(pair) = pair {
            let wo = -pair.direction;
            self.throughput = pair.throughput;
            // From here on the direction is the stored one.
            let incident = pack_direction(sampled.wi);
            let wi = unpack_direction(incident);
            let scattering = world.evaluate_lobe(vertex, wo, wi, sampled.lobe);
            let total_pdf = world.evaluate(vertex, wo, wi).pdf;
            sampled = LobeDirection {
                wi,
                scattering,
                total_pdf,
                ..sampled
            };
            self.found = Some(Found {
                index: self.index,
                place: world.place(vertex),
                incident,
                lobes: [pair.lobe_before, sampled.lobe],
                density: pair.density_area * scattering.pdf.value(),
                total_pdf,
            });
        }
        let weight = sampled.scattering.weight();
        self.throughput *= weight;
        if !(self.throughput.max_element() > 0.0 && self.throughput.is_finite()) {
            return None;
        }
        let (numbers, index) = (&mut self.numbers, self.index);
        if index >= roulette_from && !survives(numbers, index, self.throughput, &mut self.weight) {
            return None;
        }
        self.index += 1;
        if let Some(found) = &self.found {
            return Some(Onward::Suffix(Suffix {
                ray: world.ray(vertex, sampled.wi),
                direction: sampled.wi,
                site: world.site(vertex),
                total_pdf: found.total_pdf,
                seed: self.seed,
                importance: self.throughput.max_element() * self.weight as f32,
            }));
        }
        self.departure = Some(Departure {
            site: world.site(vertex),
            position: world.position(vertex),
            wo,
            throughput,
            direction: sampled.wi,
            lobe: sampled.lobe,
            roughness,
            pdf: sampled.scattering.pdf,
            total_pdf: sampled.total_pdf,
            is_delta: sampled.is_delta,
        });
        Some(Onward::Ray(world.ray(vertex, sampled.wi)))
    }

    /// The path for light that arrives behind the reconnection vertex.
    pub fn take_in(&self, light: &SuffixLight) -> Option<Candidate> {
        let found = self.found.as_ref()?;
        let (length, technique, arriving, omega, emitter_pdf) = match *light {
            SuffixLight::Met {
                radiance,
                emitter_pdf,
            } => {
                let omega = scattering_weight(found.total_pdf, emitter_pdf);
                (
                    found.index + 1,
                    Technique::Scattering,
                    radiance,
                    omega,
                    emitter_pdf,
                )
            }
            SuffixLight::Scattered {
                length,
                is_sampled_emitter,
                radiance,
            } => {
                let technique = if is_sampled_emitter {
                    Technique::Emitter
                } else {
                    Technique::Scattering
                };
                (length, technique, radiance, 1.0, Density::ZERO)
            }
        };
        let anchor = Anchor::Vertex {
            place: found.place,
            incident: found.incident,
        };
        let mut sample = PathSample::new(self.seed, length, technique, (found.index, anchor), found.lobes);
        sample.density = found.density;
        sample.radiance = arriving.to_array();
        sample.emitter_pdf = emitter_pdf.value();
        self.candidate(sample, self.throughput * arriving * omega)
    }

    /// The path that ends where the current ray from `before` has arrived: at `vertex`, or at
    /// infinity. `None` if nothing is emitted there.
    pub fn arrive(
        &self,
        domain: &PathDomain<'_, W>,
        before: &W::Vertex,
        vertex: Option<&W::Vertex>,
    ) -> Option<Candidate> {
        let world = domain.world;
        let departure = self.departure.as_ref()?;
        let (radiance, emitter_pdf) = departure.met(world, End::of(vertex))?;
        let omega = departure.weight(emitter_pdf);
        let rules = &domain.connectability;
        let length = self.index;
        let rough = rules.reaches(length) && rules.rough(departure.roughness);
        let (sample, contribution) = match (&self.pair, vertex) {
            (Some(pair), Some(vertex)) => {
                let total_pdf = world.evaluate(before, departure.wo, pair.direction).pdf;
                let omega = scattering_weight(total_pdf, emitter_pdf);
                let endpoint = Endpoint::Surface(world.place(vertex));
                let sample = self.ending(length, endpoint, departure.lobe, pair.density_area);
                (sample, pair.throughput * radiance * omega)
            }
            (_, None) if rough && self.spreads_out(domain, before, departure) => {
                let endpoint = Endpoint::Direction(departure.direction);
                let sample = self.ending(length, endpoint, departure.lobe, departure.pdf.value());
                (sample, self.throughput * radiance * omega)
            }
            _ => {
                let sample = self.replayed(length, Technique::Scattering);
                (sample, self.throughput * radiance * omega)
            }
        };
        self.candidate(sample, contribution)
    }

    /// Whether the lobe that leads to infinity is wide enough.
    fn spreads_out(
        &self,
        domain: &PathDomain<'_, W>,
        before: &W::Vertex,
        departure: &Departure<W::Site>,
    ) -> bool {
        let rules = &domain.connectability;
        // As a shift evaluates it, not as it was sampled.
        rules.footprint().is_none() || {
            let Departure {
                wo, direction, lobe, ..
            } = *departure;
            rules.spreads_out(domain.world.evaluate_lobe(before, wo, direction, lobe).pdf)
        }
    }

    /// A path that reconnects to the emitter it has hit.
    fn ending(&self, length: u32, endpoint: Endpoint, lobe: u8, density: f32) -> PathSample {
        let anchor = (length, Anchor::Emitter(endpoint));
        let mut sample = PathSample::new(self.seed, length, Technique::Scattering, anchor, [lobe, 0]);
        sample.density = density;
        sample
    }

    /// A path of all replay.
    fn replayed(&self, length: u32, technique: Technique) -> PathSample {
        let mut sample = PathSample::new(self.seed, length, technique, (length + 1, Anchor::None), [0, 0]);
        sample.density = 1.0;
        sample
    }

    /// Number of the current vertex.
    pub fn index(&self) -> u32 {
        self.index
    }
}
