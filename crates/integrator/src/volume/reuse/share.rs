//! Sharing the trees of a tile: every pixel connects to what is behind every first collision.

use super::TILE_PIXELS;
use super::balance::Control;
use super::crowd::Crowd;
use super::tree::{Behind, Escape, First, Onward, Second, Tree};
use crate::emitter_sampler::EmitterSampler;
use crate::volume::volpath::VolumePathTracer;
use lightshed_film::{RayKind, RayTally};
use lightshed_sampling::{Density, SolidAngle, power_heuristic};
use lightshed_scene::volume::PhaseFunction;
use lightshed_scene::{MediumPhase, PhaseLobe, Rgb};

/// Room for the work on a row of tiles, and what is known of them.
#[derive(Default)]
pub struct Sharing {
    crowd: Crowd,
    /// Of every first collision to what is behind one.
    views: Views,
    control: Control,
}

/// What first collisions see of what is behind one of them, one a lane.
#[derive(Default)]
struct Views {
    /// `f_k` but for albedos, and `p_k` but for roulette, in any unit.
    value: [f32; TILE_PIXELS],
    /// `f_k / Σ_j p_j`.
    share: [f32; TILE_PIXELS],
    /// Whether all have the same phase functions: then those of the own lane are known.
    alike: bool,
    phases: [Phases; TILE_PIXELS],
}

/// Phase functions along a path.
#[derive(Clone, Copy, Default)]
struct Phases {
    /// At the first collision.
    first: f32,
    /// At the second collision towards the emitter that it has seen.
    to_emitter: f32,
    /// The same in the direction in which the path goes on.
    onward: f32,
}

impl Sharing {
    /// Adds to each tree's own light what its tile has found behind first collisions. At most
    /// [`TILE_PIXELS`] trees.
    pub fn share<S: EmitterSampler>(
        &mut self,
        tracer: &VolumePathTracer<'_, S>,
        tally: &RayTally,
        trees: &mut [Tree<S::Site>],
    ) {
        self.crowd.gather(trees.iter().map(|tree| tree.first.as_ref()));
        let control = self.control.value();
        self.control.begin();
        // `s_k − Σ_i f_k / Σ_j p_j`, without albedos.
        let (mut balance, mut light) = ([0.0f32; TILE_PIXELS], [Rgb::ZERO; TILE_PIXELS]);
        let count = self.crowd.count();
        for own in 0..count {
            let Some(behind) = &trees[self.crowd.pixel(own)].behind else {
                continue;
            };
            tally.add(RayKind::Reconnection, count);
            self.connect(tracer, own, behind);
            let brought = match behind {
                Behind::Collision(second) => self.collision(second, own, &mut light),
                Behind::Escape(escape) => {
                    let firsts = |lane: usize| trees[self.crowd.pixel(lane)].first.as_ref();
                    self.escape(&tracer.transport().sampler, firsts, escape, own, &mut light)
                }
            };
            self.control.add(brought);
            if !is_planted() {
                for (balance, share) in balance[..count].iter_mut().zip(&self.views.share) {
                    *balance -= share;
                }
            }
            balance[own] += 1.0 / self.crowd.survival(own);
        }
        for lane in 0..count {
            let tree = &mut trees[self.crowd.pixel(lane)];
            if let Some(first) = &tree.first {
                tree.own += first.throughput * (light[lane] + control * balance[lane]);
            }
        }
    }
}

impl Sharing {
    /// Connects every first collision to what is behind `own`, or only that one if it cannot have
    /// made it by rounding.
    fn connect<S: EmitterSampler>(&mut self, tracer: &VolumePathTracer<'_, S>, own: usize, behind: &Behind) {
        let (scene, crowd) = (tracer.scene(), &self.crowd);
        let views = &mut self.views;
        let medium = crowd.densities(scene, own, behind, &mut views.value);
        views.alike = matches!(medium.phase(), MediumPhase::Single(PhaseLobe::Isotropic));
        let lanes = if views.alike {
            own..own + 1
        } else {
            0..crowd.count()
        };
        for lane in lanes {
            let phases = Phases::new(medium.phase(), crowd, lane, behind);
            if !views.alike {
                views.value[lane] *= phases.first;
            }
            views.phases[lane] = phases;
        }
        if !(views.value[own] > 0.0 && views.value[own] < f32::INFINITY) {
            views.value.fill(0.0);
            views.value[own] = 1.0;
        }
        let pdf = |lane: usize| views.value[lane] * crowd.survival(lane);
        let sum: f32 = (0..crowd.count()).map(pdf).sum();
        for lane in 0..crowd.count() {
            views.share[lane] = views.value[lane] / sum;
        }
    }

    /// Adds light from a second collision to that of all first ones. What it is for `own` alone,
    /// per share.
    fn collision(&self, second: &Second, own: usize, light: &mut [Rgb; TILE_PIXELS]) -> Rgb {
        let (views, crowd) = (&self.views, &self.crowd);
        let scattered = |phases: &Phases| second.emitted + second.albedo * second.light_of_emitter(phases);
        let mut brought = Rgb::ZERO;
        // What goes on from there is shared by densities with the direction.
        let onward = second.onward.as_ref();
        let together = onward.filter(|onward| !onward.is_own);
        if views.alike {
            let phases = &views.phases[own];
            let mut each = scattered(phases);
            if let Some(onward) = together {
                each += second.albedo * onward.seen(phases);
            }
            if each.is_finite() {
                for (light, share) in light[..crowd.count()].iter_mut().zip(&views.share) {
                    *light += each * *share;
                }
                brought = each;
            }
        } else {
            let pdf = |lane: usize| views.value[lane] * crowd.survival(lane) * views.phases[lane].onward;
            let sum: f32 = match together {
                Some(_) => (0..crowd.count()).map(pdf).sum(),
                None => 0.0,
            };
            for (lane, light) in light[..crowd.count()].iter_mut().enumerate() {
                let (phases, share) = (&views.phases[lane], views.share[lane]);
                if share == 0.0 {
                    continue;
                }
                let mut here = scattered(phases) * share;
                if let Some(onward) = together {
                    let share = views.value[lane] * phases.onward / sum;
                    here += second.albedo * onward.seen(phases) * share;
                }
                if here.is_finite() {
                    *light += here;
                    if lane == own {
                        brought = here / share;
                    }
                }
            }
        }
        if let Some(onward) = onward.filter(|onward| onward.is_own) {
            let here = second.albedo * onward.seen(&views.phases[own]) / crowd.survival(own);
            if here.is_finite() {
                light[own] += here;
                brought += here / views.share[own];
            }
        }
        brought
    }

    /// The same of light from afar.
    fn escape<'f, S: EmitterSampler>(
        &self,
        sampler: &S,
        firsts: impl Fn(usize) -> Option<&'f First<S::Site>>,
        escape: &Escape,
        own: usize,
        light: &mut [Rgb; TILE_PIXELS],
    ) -> Rgb
    where
        S::Site: 'f,
    {
        if escape.radiance == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let (views, mut brought) = (&self.views, Rgb::ZERO);
        let seen = |lane: usize, phase: f32| {
            let pdf = firsts(lane)
                .map(|first| sampler.pdf_environment(first.position, &first.site, escape.direction));
            // With its MIS weight against the emitter sample there.
            let light = pdf.map(|pdf| escape.radiance * power_heuristic(density(phase), pdf));
            light.filter(|light| light.is_finite()).unwrap_or(Rgb::ZERO)
        };
        if views.alike && !sampler.uses_site() {
            brought = seen(own, views.phases[own].first);
            for (light, share) in light[..self.crowd.count()].iter_mut().zip(&views.share) {
                *light += brought * *share;
            }
            return brought;
        }
        for (lane, light) in light[..self.crowd.count()].iter_mut().enumerate() {
            if views.share[lane] > 0.0 {
                let phases = &views.phases[if views.alike { own } else { lane }];
                let here = seen(lane, phases.first);
                *light += here * views.share[lane];
                if lane == own {
                    brought = here;
                }
            }
        }
        brought
    }
}

impl Phases {
    fn new(phase: &MediumPhase, crowd: &Crowd, lane: usize, behind: &Behind) -> Self {
        let direction = crowd.direction(lane, behind);
        let scattered = |to| phase.phase_between(direction, to);
        let mut phases = Self {
            first: phase.phase_between(crowd.incoming(lane), direction),
            ..Self::default()
        };
        if let Behind::Collision(second) = behind {
            if let Some(seen) = &second.emitter {
                phases.to_emitter = scattered(seen.direction);
            }
            if let Some(onward) = &second.onward {
                phases.onward = scattered(onward.direction);
            }
        }
        phases
    }
}

impl Second {
    /// Light of the emitter that it has seen. Emitters are found in two ways from there; the power
    /// heuristic combines them for each pixel separately.
    fn light_of_emitter(&self, phases: &Phases) -> Rgb {
        let Some(seen) = &self.emitter else {
            return Rgb::ZERO;
        };
        let mis = match seen.is_delta {
            true => 1.0,
            false => power_heuristic(density(seen.pdf), density(phases.to_emitter)),
        };
        seen.weight * (phases.to_emitter * mis)
    }
}

impl Onward {
    /// Light from the direction in which the path goes on.
    fn seen(&self, phases: &Phases) -> Rgb {
        self.met * power_heuristic(density(phases.onward), density(self.met_pdf)) + self.beyond
    }
}

/// Whether a test has planted the fault that the control variate forgets what is shared.
#[inline(always)]
fn is_planted() -> bool {
    #[cfg(test)]
    return UNBALANCED.get();
    #[cfg(not(test))]
    false
}

#[cfg(test)]
thread_local! {
    pub(super) static UNBALANCED: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}

fn density(pdf: f32) -> Density<SolidAngle> {
    Density::new(pdf)
}
