//! Paths as samples for a field.

use super::field::{FieldDirections, SceneField};
use super::together::Together;
use crate::path::guide::{DirectionGuide, GuidedVertex};
use crate::path::observer::{ObservedPath, PathDirection, PathObserver, PathVertex};
use lightshed_film::SampleId;
use lightshed_guiding::{FlightArrival, GuidingSample, Visit};
use lightshed_sampling::{CounterRng, Density, DirectionDistribution, luminance};
use lightshed_scene::Rgb;
use lightshed_scene::glam::Vec3;

/// Passes the results of paths to a field, vertex by vertex.
///
/// A vertex at which a path continued by a lobe that has a width gives a sample of weight
/// `w = Y(L_o)`: the luminance found from there on, divided by the throughput up to the vertex. So
/// `w` estimates `∫ f |cos θ| L_i dω` by the density of the mixture that was actually sampled,
/// with the MIS weights of emitters that were hit and with all factors of roulette. Emitters that
/// were sampled at the vertex itself do not count: a guide does not help to find them.
#[derive(Clone, Copy, Debug)]
pub struct FieldRecorder<'f> {
    field: &'f SceneField,
    /// Paths are kept whose random word is not above this.
    threshold: u32,
    /// Whether some paths tell what they found at each vertex, for roulette.
    visits: bool,
    /// Whether the same paths tell what they found at the ends of their flights.
    flights: bool,
    /// Whether only what the field does not know is kept.
    explores: bool,
}

/// The word of a path's stream that decides whether it is kept; the path itself does not use it.
const KEEP_WORD: u32 = u32::MAX;
/// The word that decides whether a path tells what it found behind each vertex …
const VISIT_WORD: u32 = u32::MAX - 1;
/// … as one of so many does.
const VISITING: u32 = 4;

impl<'f> FieldRecorder<'f> {
    /// Keeps this share of the paths, chosen by the names of their samples.
    pub fn new(field: &'f SceneField, share: f64) -> Self {
        let threshold = (share * f64::from(u32::MAX)) as u32;
        Self {
            field,
            threshold,
            visits: false,
            flights: false,
            explores: false,
        }
    }

    /// Of paths by the BSDF alone: keeps directions that found light and that the field would
    /// sample less often than the BSDF does.
    pub fn exploring(field: &'f SceneField) -> Self {
        Self {
            explores: true,
            ..Self::new(field, 1.0)
        }
    }

    /// With `visits` the field learns, too, what paths find behind their vertices.
    #[must_use]
    pub fn with_visits(mut self, visits: bool) -> Self {
        self.visits = visits;
        self
    }

    /// With `flights` the field learns, too, what paths find where flights through media end.
    #[must_use]
    pub fn with_flights(mut self, flights: bool) -> Self {
        self.flights = flights;
        self
    }
}

impl FieldRecorder<'_> {
    /// A vertex as the field sees it.
    fn seen(&self, vertex: &PathVertex) -> GuidedVertex {
        let reflects = vertex.normal.is_some() && self.field.uses_reflection();
        GuidedVertex {
            position: vertex.position,
            normal: vertex.normal,
            outgoing: -vertex.incoming,
            lit: reflects.then_some(vertex.lit),
        }
    }

    /// The factor of densities in the measure in which the field learns: where it samples products
    /// with what surfaces reflect, their part is left out.
    fn measure(&self, vertex: &PathVertex, direction: Vec3) -> f32 {
        if !self.field.uses_reflection() {
            return 1.0;
        }
        match self.field.guide(&self.seen(vertex)) {
            Some((FieldDirections::Product(product), _)) => 1.0 / product.ratio(direction),
            _ => 1.0,
        }
    }

    /// Whether the field samples the direction in which a path goes on at least as often as the
    /// BSDF.
    fn knows(&self, vertex: &PathVertex, onward: &PathDirection) -> bool {
        let known = self.field.guide(&self.seen(vertex));
        known.is_some_and(|(directions, _)| {
            directions.pdf(onward.direction).value() >= onward.scattering_pdf.value()
        })
    }

    /// Tells what a path found behind each of its vertices.
    fn visit(&self, path: &ObservedPath<'_>) {
        let mut visits = Together::new(NO_VISIT, |visits: &[Visit]| self.field.visit(visits));
        for vertex in path.vertices {
            if vertex.onward.is_some_and(|onward| onward.is_delta) {
                continue;
            }
            visits.push(Visit {
                position: vertex.position,
                found: luminance(found_behind(path, vertex)),
                survival: vertex.onward.map_or(1.0, |onward| onward.survival),
            });
        }
        visits.finish();
    }

    /// Tells what a path found at the ends of its flights.
    fn arrive(&self, path: &ObservedPath<'_>) {
        for arrival in path.arrivals {
            let behind = path.contributions.iter().skip(arrival.before);
            let found = over(behind.map(|light| light.radiance).sum(), arrival.throughput);
            self.field.arrive(&[FlightArrival {
                position: arrival.position,
                end: arrival.end,
                found: luminance(found),
            }]);
        }
    }
}

/// Whether a path is the one in four, by its sample's name, that tells of its vertices and flights.
fn is_visiting(path: &ObservedPath<'_>) -> bool {
    let pixel = path.id.y << 16 | path.id.x;
    CounterRng::at(path.seed, pixel, path.id.index, VISIT_WORD) <= u32::MAX / VISITING
}

/// `a / b` by channel; 0 where nothing arrives.
fn over(found: Rgb, throughput: Rgb) -> Rgb {
    let over = |found: f32, throughput: f32| if throughput > 0.0 { found / throughput } else { 0.0 };
    let Rgb { x, y, z } = throughput;
    Rgb::new(over(found.x, x), over(found.y, y), over(found.z, z))
}

/// Radiance that a path found behind a vertex, over the throughput with which it arrived there.
fn found_behind(path: &ObservedPath<'_>, vertex: &PathVertex) -> Rgb {
    let behind = path.contributions.iter();
    let behind = behind.filter(|light| light.edges > vertex.depth + u32::from(light.is_sampled_emitter));
    over(behind.map(|light| light.radiance).sum(), vertex.throughput)
}

const NO_VISIT: Visit = Visit {
    position: Vec3::ZERO,
    found: 0.0,
    survival: 1.0,
};

impl PathObserver for FieldRecorder<'_> {
    fn wants(&self, id: SampleId, seed: u64) -> bool {
        let pixel = id.y << 16 | id.x;
        self.threshold == u32::MAX || CounterRng::at(seed, pixel, id.index, KEEP_WORD) <= self.threshold
    }

    fn observe(&self, path: &ObservedPath<'_>) {
        if (self.visits || self.flights) && is_visiting(path) {
            if self.visits {
                self.visit(path);
            }
            if self.flights {
                self.arrive(path);
            }
        }
        // Nothing is learnt from what found nothing.
        if path.contributions.is_empty() {
            return;
        }
        let mut samples = Together::new(NOTHING, |samples: &[GuidingSample]| self.field.record(samples));
        for (index, vertex) in path.vertices.iter().enumerate() {
            let Some(onward) = vertex.onward.filter(|onward| !onward.is_delta) else {
                continue;
            };
            let scattered = found_behind(path, vertex);
            if scattered == Rgb::ZERO || self.explores && self.knows(vertex, &onward) {
                continue;
            }
            // A path may end at the emitter that it hit, without a vertex there.
            let hit = || {
                let mut found = path.contributions.iter();
                found.find_map(|light| light.place.filter(|_| light.edges == vertex.depth + 1))
            };
            let next = path.vertices.get(index + 1);
            let next = next.map(|next| next.position).or_else(hit);
            let measure = self.measure(vertex, onward.direction);
            samples.push(GuidingSample {
                position: vertex.position,
                direction: onward.direction,
                distance: next.map_or(f32::INFINITY, |next| next.distance(vertex.position)),
                weight: luminance(scattered),
                pdf: onward.pdf * measure,
                scattering_pdf: onward.scattering_pdf * measure,
            });
        }
        samples.finish();
    }
}

/// A sample that teaches nothing.
pub(crate) const NOTHING: GuidingSample = GuidingSample {
    position: Vec3::ZERO,
    direction: Vec3::Z,
    distance: 0.0,
    weight: 0.0,
    pdf: Density::ZERO,
    scattering_pdf: Density::ZERO,
};
