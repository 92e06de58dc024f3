//! Flights that are guided between colliding and passing.

use super::flight::transmittance;
use super::{State, VolumePathTracer, is_passed};
use crate::emitter_sampler::EmitterSampler;
use crate::path::guide::DirectionGuide;
use crate::path::observer::PathObserver;
use lightshed_guiding::FlightEnd;
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::{
    DensityField, FlightGuiding, Interval, guided_homogeneous_flight, guided_tracking,
};
use lightshed_scene::{Hit, Medium, MediumDensity, SurfacePoint, luminance};

impl<S: EmitterSampler, G: DirectionGuide, O: PathObserver> VolumePathTracer<'_, S, G, O> {
    /// How the next flight of a path is guided, if it is.
    #[inline(always)]
    pub(super) fn guiding(&self, state: &State<S::Site>) -> Option<FlightGuiding> {
        if !G::IS_ACTIVE || cfg!(lightshed_without = "guide") {
            return None;
        }
        let medium = &self.transport().scene.media()[state.medium? as usize];
        self.transport().guide.flights().filter(|_| medium.is_grey())
    }

    /// Tells of the end of a flight, if somebody watches and the path may still find something
    /// there.
    #[inline(always)]
    pub(super) fn arrive(&self, state: &mut State<S::Site>, position: Vec3, end: FlightEnd) {
        if let Some(trail) = &mut state.trail
            && state.medium.is_some()
            && state.depth < self.transport().max_depth
        {
            let throughput = state.path.throughput * state.channels.weight();
            trail.arrive(position, end, throughput);
        }
    }

    /// Where a guided flight through a grey medium up to `hit` collides, `Some(None)` if it passes;
    /// `None` where too little is known. The throughput takes up the flight's weight.
    #[inline(never)]
    pub(super) fn guided_flight(
        &self,
        state: &mut State<S::Site>,
        guiding: &FlightGuiding,
        medium: &Medium,
        hit: Option<Hit>,
        t_max: f32,
        rng: &mut CounterRng,
    ) -> Option<Option<f32>> {
        let (guide, ray) = (&self.transport().guide, state.ray);
        if state.depth >= self.transport().max_depth {
            if medium.emission().is_some() {
                return None;
            }
            // A collision would find nothing.
            state.path.throughput *= transmittance(medium, &ray, t_max, self.tracking, rng);
            return Some(None);
        }
        guide.arrival_worth(ray.origin, FlightEnd::Collision)?;
        let passing = self.passing_worth(state, hit)?;
        let worth = |t: f32| {
            let position = ray.origin + ray.direction * t;
            guide.arrival_worth(position, FlightEnd::Collision).unwrap_or(0.0)
        };
        let extinction = medium.extinction().x * ray.direction.length();
        let flight = match medium.density() {
            MediumDensity::Grid(field) => {
                let field_ray = field.field_ray(&ray);
                let interval = Interval { t0: 0.0, t1: t_max };
                let segments = field.majorants().segments(&field_ray, interval);
                let density = &mut field.grid().accessor();
                guided_tracking(
                    density,
                    &field_ray,
                    segments,
                    extinction,
                    (worth, passing),
                    guiding,
                    rng,
                )
            }
            MediumDensity::Homogeneous => {
                guided_homogeneous_flight(extinction, t_max, (worth, passing), guiding, rng)
            }
        };
        state.path.throughput *= flight.weight;
        Some(flight.distance)
    }

    /// The worth of coming through to `hit`, or to infinity: what is emitted there, with its MIS
    /// weight, and what paths have found.
    fn passing_worth(&self, state: &State<S::Site>, hit: Option<Hit>) -> Option<f32> {
        let (scene, sampler) = (self.transport().scene, &self.transport().sampler);
        let (guide, ray) = (&self.transport().guide, &state.ray);
        let Some(hit) = hit else {
            return Some(luminance(state.path.met(scene, sampler, ray, None)));
        };
        let position = ray.origin + ray.direction * hit.t;
        if is_passed(scene, hit.primitive) {
            return guide.arrival_worth(position, FlightEnd::Boundary);
        }
        let mut emitted = 0.0;
        if scene.primitive_emitter(hit.primitive) != SurfacePoint::NO_EMITTER {
            let point = scene.surface(ray, &hit);
            emitted = luminance(state.path.met(scene, sampler, ray, Some(&point)));
        }
        Some(guide.arrival_worth(position, FlightEnd::Surface)?.hypot(emitted))
    }
}
