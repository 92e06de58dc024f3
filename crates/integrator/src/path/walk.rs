//! Ordinary path tracing from some vertex on, many walks at the same depth.

use crate::path::next_event::{Bounce, SampleCounts, Shadow, met_emission, sample_emission};
use lightshed_film::MAX_BATCH;
use lightshed_film::{RayKind, RayTally};
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Bsdf, Hit, Ray, Rgb, Scene, SurfacePoint};

/// Probability at which roulette keeps even the brightest path, so that paths between mirrors end.
const SURVIVAL_CAP: f32 = 0.95;

/// In unused places of a batch.
pub(crate) const NOWHERE: Ray = Ray {
    origin: Vec3::ZERO,
    direction: Vec3::Z,
    t_max: 0.0,
};

/// How long paths are.
#[derive(Clone, Copy)]
pub(crate) struct Lengths {
    /// Longest path, in edges.
    pub max_depth: u32,
    /// Edges from which on roulette may end a path.
    pub roulette_depth: u32,
}

/// A path on its way.
#[derive(Clone)]
pub(crate) struct Walk {
    /// Which tree it belongs to.
    pub owner: usize,
    pub rng: CounterRng,
    /// The edge to trace next.
    pub ray: Ray,
    /// How that left its surface.
    pub bounce: Bounce,
    /// Throughput up to where the walk began, which is the owner's business; for roulette.
    pub before: Rgb,
    pub throughput: Rgb,
    pub eta_squared: f32,
    /// Collected from where the walk began.
    pub radiance: Rgb,
    /// Whether what the next edge meets emits is to be kept apart, in `met`.
    pub keep_apart: bool,
    /// Radiance that the first edge met, without MIS weight, and the density with which sampling emitters would have found
    /// it, in the solid-angle measure.
    pub met: Option<(Rgb, f32)>,
}

/// What follows from a vertex.
pub(crate) struct Scattered {
    /// Light from an emitter, times the throughput, if nothing is in between.
    pub shadow: Option<Shadow>,
    /// Whether the walk goes on.
    pub goes_on: bool,
}

impl Lengths {
    /// Those that the scene's settings ask for.
    pub fn of(scene: &Scene) -> Self {
        let settings = scene.settings();
        Self {
            max_depth: settings.max_depth.unwrap_or(u32::MAX),
            roulette_depth: settings.roulette_depth,
        }
    }
}

impl Walk {
    /// Takes in what the walk's ray met.
    fn collect(&mut self, scene: &Scene, point: Option<&SurfacePoint>) {
        if !self.keep_apart {
            self.radiance += self.throughput * met_emission(scene, &self.ray, point, Some(self.bounce));
            return;
        }
        self.keep_apart = false;
        let radiance = met_emission(scene, &self.ray, point, None);
        if radiance != Rgb::ZERO {
            let pdf = match point {
                Some(point) => scene.emitters().pdf(self.bounce.from, point),
                None => scene.emitters().pdf_environment(self.ray.direction),
            };
            self.met = Some((radiance, pdf.value()));
        }
    }

    /// Scatters at `point`, the vertex at the end of edge number `depth`: an emitter sample and the next direction.
    pub fn scatter(
        &mut self,
        scene: &Scene,
        point: &SurfacePoint,
        depth: u32,
        lengths: Lengths,
    ) -> Scattered {
        let bsdf = scene.bsdf(point);
        let wo = point.shading.to_local(-self.ray.direction);
        let shadow = sample_emission(scene, point, &bsdf, wo, SampleCounts::ONE_EACH, &mut self.rng);
        let shadow = shadow.map(|Shadow { ray, radiance }| Shadow {
            ray,
            radiance: self.throughput * radiance,
        });
        let goes_on = self.continues(point, &bsdf, wo, depth, lengths).is_some();
        Scattered { shadow, goes_on }
    }

    /// The next direction; `None` ends the walk.
    fn continues(
        &mut self,
        point: &SurfacePoint,
        bsdf: &Bsdf,
        wo: Vec3,
        depth: u32,
        lengths: Lengths,
    ) -> Option<()> {
        let u_lobe = self.rng.next_f32();
        let sample = bsdf.sample(wo, u_lobe, Vec2::from(self.rng.next_2d()))?;
        self.throughput *= sample.weight;
        self.eta_squared *= sample.eta * sample.eta;
        let brightness = (self.before * self.throughput).max_element();
        if brightness == 0.0 {
            return None;
        }
        if depth >= lengths.roulette_depth {
            let survival = (brightness * self.eta_squared).min(SURVIVAL_CAP);
            if self.rng.next_f32() >= survival {
                return None;
            }
            self.throughput /= survival;
        }
        self.bounce = Bounce {
            from: point.position,
            pdf: sample.pdf,
            is_delta: sample.is_delta,
            counts: SampleCounts::ONE_EACH,
        };
        self.ray = point.spawn(point.shading.to_world(sample.wi));
        Some(())
    }
}

/// Traces walks, at most [`MAX_BATCH`], to their ends; `depth` is the number of the edge that is next. `finish` takes each.
pub(crate) fn trace_walks(
    scene: &Scene,
    tally: &RayTally,
    lengths: Lengths,
    mut depth: u32,
    walks: &mut Vec<Walk>,
    mut finish: impl FnMut(Walk),
) {
    let mut rays = [NOWHERE; MAX_BATCH];
    let mut hits: [Option<Hit>; MAX_BATCH] = [None; MAX_BATCH];
    let mut occluded = [false; MAX_BATCH];
    let mut shadows: Vec<(usize, Shadow)> = Vec::with_capacity(MAX_BATCH);
    while !walks.is_empty() && depth <= lengths.max_depth {
        let count = walks.len().min(MAX_BATCH);
        for (ray, walk) in rays.iter_mut().zip(walks.iter()) {
            *ray = walk.ray;
        }
        tally.add(RayKind::Path, count);
        let is_last = depth == lengths.max_depth;
        if is_last {
            see_emitters(
                scene,
                &mut rays[..count],
                &mut hits[..count],
                &mut occluded[..count],
            );
        } else {
            scene
                .accelerator()
                .intersect_many(&rays[..count], &mut hits[..count]);
        }
        shadows.clear();
        let mut goes_on = [false; MAX_BATCH];
        for (place, walk) in walks.iter_mut().enumerate() {
            if is_last && occluded[place] {
                continue;
            }
            let point = hits[place].map(|hit| scene.surface(&walk.ray, &hit));
            walk.collect(scene, point.as_ref());
            if let Some(point) = point.filter(|_| !is_last) {
                let scattered = walk.scatter(scene, &point, depth, lengths);
                shadows.extend(scattered.shadow.map(|shadow| (place, shadow)));
                goes_on[place] = scattered.goes_on;
            }
        }
        add_unhidden(scene, tally, &shadows, |place, radiance| {
            walks[place].radiance += radiance;
        });
        depth += 1;
        let mut place = 0;
        let ended = walks.extract_if(.., |_| {
            place += 1;
            !goes_on[place - 1]
        });
        ended.for_each(&mut finish);
    }
    walks.drain(..).for_each(finish);
}

/// Traces rays of which only emission matters: `hits` are the nearest emitting surfaces, `occluded` whether something else is
/// in front of them, or of the environment. Where nothing emits, nothing is traced.
pub(crate) fn see_emitters(scene: &Scene, rays: &mut [Ray], hits: &mut [Option<Hit>], occluded: &mut [bool]) {
    scene.intersect_emitting_many(rays, hits);
    let everywhere = scene.emitters().environment().is_some();
    let (mut kept, mut places) = (0, [0; MAX_BATCH]);
    for place in 0..rays.len() {
        let ray = rays[place];
        // What is not asked about counts as hidden.
        occluded[place] = true;
        if everywhere || hits[place].is_some() {
            rays[kept] = Ray {
                t_max: hits[place].map_or(ray.t_max, |hit| hit.t),
                ..ray
            };
            places[kept] = place;
            kept += 1;
        }
    }
    let mut hidden = [false; MAX_BATCH];
    scene
        .accelerator()
        .occluded_many(&rays[..kept], &mut hidden[..kept]);
    for (&place, hidden) in places[..kept].iter().zip(hidden) {
        occluded[place] = hidden;
    }
}

/// Hands on the light of those shadows, at most [`MAX_BATCH`], in whose way nothing is.
pub(crate) fn add_unhidden(
    scene: &Scene,
    tally: &RayTally,
    shadows: &[(usize, Shadow)],
    mut add: impl FnMut(usize, Rgb),
) {
    let (mut rays, mut hidden) = ([NOWHERE; MAX_BATCH], [false; MAX_BATCH]);
    let count = shadows.len().min(MAX_BATCH);
    for (ray, (_, shadow)) in rays.iter_mut().zip(shadows) {
        *ray = shadow.ray;
    }
    tally.add(RayKind::Emitter, count);
    scene
        .accelerator()
        .occluded_many(&rays[..count], &mut hidden[..count]);
    for ((place, shadow), hidden) in shadows.iter().zip(hidden) {
        if !hidden {
            add(*place, shadow.radiance);
        }
    }
}
