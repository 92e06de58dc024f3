//! Path trees of pixels, grown many at a time.

use crate::path::next_event::{Bounce, SampleCounts, Shadow, met_emission, sample_emission};
use crate::path::walk::{Lengths, NOWHERE, Walk, add_unhidden, see_emitters, trace_walks};
use lightshed_film::MAX_BATCH;
use lightshed_film::{RayKind, RayTally};
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Bsdf, Hit, Ray, Rgb, Scene, SurfacePoint};

/// A surface point of a path.
#[derive(Clone)]
pub struct Vertex {
    pub point: SurfacePoint,
    pub bsdf: Bsdf,
    /// Towards the vertex before, in the shading frame.
    pub wo: Vec3,
}

impl Vertex {
    fn new(scene: &Scene, ray: &Ray, hit: &Hit) -> Self {
        let point = scene.surface(ray, hit);
        Self {
            bsdf: scene.bsdf(&point),
            wo: point.shading.to_local(-ray.direction),
            point,
        }
    }
}

/// The light that a pixel's path tree found.
pub struct Tree {
    /// Index of the pixel.
    pub pixel: usize,
    /// What only this pixel can use.
    pub own: Rgb,
    /// `x₁`.
    pub first: Option<Vertex>,
    /// What is behind `x₁`, for any pixel.
    pub shared: Option<Shared>,
}

/// A tree from `x₂` on, as its sampling left it, without the scattering at `x₂`.
pub struct Shared {
    /// `x₂`; its `wo` is towards the tree's own `x₁`.
    pub second: Vertex,
    /// An emitter sampled at `x₂` that it sees.
    pub emitter: Option<SharedEmitter>,
    /// The direction sampled at `x₂`, in its shading frame.
    pub wi: Option<Vec3>,
    /// Radiance emitted from there, and the density with which the emitter sample would have found it.
    pub met: Option<(Rgb, f32)>,
    /// Radiance reflected from there.
    pub beyond: Rgb,
}

/// An emitter as seen from `x₂`.
pub struct SharedEmitter {
    /// Towards it, in the shading frame of `x₂`.
    pub wi: Vec3,
    /// `L_e / p_e`.
    pub weight: Rgb,
    /// `p_e`, in the solid-angle measure.
    pub pdf: f32,
    pub is_delta: bool,
}

impl Shared {
    /// Whether there is any light to share.
    pub fn is_lit(&self) -> bool {
        self.emitter.is_some() || self.met.is_some() || self.beyond != Rgb::ZERO
    }
}

/// What trees are grown in.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    pub scene: &'a Scene,
    pub tally: &'a RayTally,
    pub lengths: Lengths,
    pub width: u32,
    pub frame: u32,
    pub seed: u64,
}

/// How a tree goes on from `x₁`.
struct Start {
    tree: usize,
    rng: CounterRng,
    ray: Ray,
    bounce: Bounce,
    throughput: Rgb,
}

impl Ground<'_> {
    /// Grows a tree for each pixel, at most [`MAX_BATCH`].
    pub fn grow(&self, pixels: &[usize], trees: &mut Vec<Tree>) {
        trees.clear();
        if self.lengths.max_depth == 0 {
            return;
        }
        let starts = self.first_vertices(pixels, trees);
        let mut walks = match self.lengths.max_depth {
            1 => return,
            2 => {
                self.last_edges(&starts, trees);
                return;
            }
            _ => self.second_vertices(starts, trees),
        };
        trace_walks(self.scene, self.tally, self.lengths, 3, &mut walks, |walk| {
            let tree = &mut trees[walk.owner];
            match &mut tree.shared {
                Some(shared) if shared.wi.is_some() => {
                    (shared.met, shared.beyond) = (walk.met, walk.radiance);
                }
                _ => tree.own += walk.before * walk.radiance,
            }
        });
    }

    /// `x₁` with its emission, a sample of the emitters, and a direction.
    fn first_vertices(&self, pixels: &[usize], trees: &mut Vec<Tree>) -> Vec<Start> {
        let (scene, camera) = (self.scene, self.scene.camera());
        let count = pixels.len().min(MAX_BATCH);
        let (mut rays, mut hits) = ([NOWHERE; MAX_BATCH], [None; MAX_BATCH]);
        let mut rngs = Vec::with_capacity(count);
        for (ray, &pixel) in rays.iter_mut().zip(pixels) {
            let (x, y) = (pixel as u32 % self.width, pixel as u32 / self.width);
            let mut rng = CounterRng::new(self.seed, y << 16 | x, self.frame);
            let film = Vec2::new(x as f32, y as f32) + Vec2::from(rng.next_2d());
            let u_lens = if camera.has_lens() {
                rng.next_2d()
            } else {
                [0.5; 2]
            };
            *ray = camera.ray(film, u_lens);
            rngs.push(rng);
        }
        self.tally.add(RayKind::Camera, count);
        scene
            .accelerator()
            .intersect_many(&rays[..count], &mut hits[..count]);
        let mut starts = Vec::with_capacity(count);
        let mut shadows = Vec::with_capacity(count);
        for (((&pixel, ray), hit), mut rng) in pixels.iter().zip(&rays).zip(&hits).zip(rngs) {
            let first = hit.map(|hit| Vertex::new(scene, ray, &hit));
            let own = met_emission(scene, ray, first.as_ref().map(|first| &first.point), None);
            let tree = trees.len();
            if let Some(Vertex { point, bsdf, wo }) = first.as_ref().filter(|_| self.lengths.max_depth > 1) {
                let shadow = sample_emission(scene, point, bsdf, *wo, SampleCounts::ONE_EACH, &mut rng);
                shadows.extend(shadow.map(|shadow| (tree, shadow)));
                let u_lobe = rng.next_f32();
                if let Some(sample) = bsdf.sample(*wo, u_lobe, Vec2::from(rng.next_2d()))
                    && sample.weight != Rgb::ZERO
                {
                    starts.push(Start {
                        tree,
                        ray: point.spawn(point.shading.to_world(sample.wi)),
                        bounce: Bounce {
                            from: point.position,
                            pdf: sample.pdf,
                            is_delta: sample.is_delta,
                            counts: SampleCounts::ONE_EACH,
                        },
                        throughput: sample.weight,
                        rng,
                    });
                }
            }
            trees.push(Tree {
                pixel,
                own,
                first,
                shared: None,
            });
        }
        add_unhidden(scene, self.tally, &shadows, |tree, radiance| {
            trees[tree].own += radiance;
        });
        starts
    }

    /// Edges from `x₁` where paths have two: only what they meet emits counts.
    fn last_edges(&self, starts: &[Start], trees: &mut [Tree]) {
        let (mut rays, mut hits) = ([NOWHERE; MAX_BATCH], [None; MAX_BATCH]);
        let (mut hidden, count) = ([false; MAX_BATCH], starts.len());
        for (ray, start) in rays.iter_mut().zip(starts) {
            *ray = start.ray;
        }
        self.tally.add(RayKind::Path, count);
        see_emitters(
            self.scene,
            &mut rays[..count],
            &mut hits[..count],
            &mut hidden[..count],
        );
        for ((start, hit), _) in starts.iter().zip(hits).zip(hidden).filter(|(_, hidden)| !hidden) {
            self.collect(start, hit.as_ref(), trees);
        }
    }

    /// What the edge from `x₁` met, seen by its own pixel alone: direct light, weighted against the emitter sample at `x₁`.
    fn collect(&self, start: &Start, hit: Option<&Hit>, trees: &mut [Tree]) {
        let point = hit.map(|hit| self.scene.surface(&start.ray, hit));
        let emitted = met_emission(self.scene, &start.ray, point.as_ref(), Some(start.bounce));
        trees[start.tree].own += start.throughput * emitted;
    }

    /// `x₂` with a sample of the emitters and a direction; walks go on from there.
    fn second_vertices(&self, starts: Vec<Start>, trees: &mut [Tree]) -> Vec<Walk> {
        let (mut rays, mut hits) = ([NOWHERE; MAX_BATCH], [None; MAX_BATCH]);
        for (ray, start) in rays.iter_mut().zip(&starts) {
            *ray = start.ray;
        }
        let count = starts.len();
        self.tally.add(RayKind::Path, count);
        self.scene
            .accelerator()
            .intersect_many(&rays[..count], &mut hits[..count]);
        let mut walks = Vec::with_capacity(count);
        // Light for the own pixel alone, and for all.
        let (mut shadows, mut shared_shadows) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for (start, hit) in starts.into_iter().zip(hits) {
            self.collect(&start, hit.as_ref(), trees);
            let Some(hit) = hit else { continue };
            let second = Vertex::new(self.scene, &start.ray, &hit);
            let is_delta = start.bounce.is_delta;
            let mut walk = Walk {
                owner: start.tree,
                rng: start.rng,
                ray: start.ray,
                bounce: start.bounce,
                before: start.throughput,
                throughput: Rgb::ONE,
                eta_squared: 1.0,
                radiance: Rgb::ZERO,
                keep_apart: false,
                met: None,
            };
            if is_delta {
                // No other pixel can reach this point: an ordinary path.
                let scattered = walk.scatter(self.scene, &second.point, 2, self.lengths);
                let before = start.throughput;
                let shadow = scattered.shadow.map(|Shadow { ray, radiance }| Shadow {
                    ray,
                    radiance: before * radiance,
                });
                shadows.extend(shadow.map(|shadow| (start.tree, shadow)));
                walks.extend(scattered.goes_on.then_some(walk));
                continue;
            }
            let mut shared = Shared {
                emitter: None,
                wi: None,
                met: None,
                beyond: Rgb::ZERO,
                second,
            };
            if let Some((shadow, emitter)) = self.sample_emitter(&shared.second, &mut walk.rng) {
                shared.emitter = Some(emitter);
                shared_shadows.push((start.tree, shadow));
            }
            if let Some(walk) = self.leave_second(walk, &mut shared) {
                walks.push(walk);
            }
            trees[start.tree].shared = Some(shared);
        }
        add_unhidden(self.scene, self.tally, &shadows, |tree, radiance| {
            trees[tree].own += radiance;
        });
        let mut seen = [false; MAX_BATCH];
        add_unhidden(self.scene, self.tally, &shared_shadows, |tree, _| {
            seen[tree] = true
        });
        for (tree, _) in shared_shadows {
            if let Some(shared) = trees[tree].shared.as_mut().filter(|_| !seen[tree]) {
                shared.emitter = None;
            }
        }
        walks
    }

    /// An emitter sample at `x₂`, whatever the direction that it is scattered to.
    fn sample_emitter(&self, second: &Vertex, rng: &mut CounterRng) -> Option<(Shadow, SharedEmitter)> {
        let (u_select, u) = (rng.next_u64(), rng.next_2d());
        if !second.bsdf.has_non_delta() {
            return None;
        }
        let light = self.scene.emitters().sample(second.point.position, u_select, u)?;
        let wi = second.point.shading.to_local(light.direction);
        // A sample that this pixel cannot use is left out, and so does not count as its technique's.
        if second.bsdf.evaluate(second.wo, wi).value == Rgb::ZERO {
            return None;
        }
        let shadow = Shadow {
            ray: light.shadow_ray(&second.point),
            radiance: light.weight,
        };
        let emitter = SharedEmitter {
            wi,
            weight: light.weight,
            pdf: light.pdf.value(),
            is_delta: light.is_delta,
        };
        Some((shadow, emitter))
    }

    /// A direction at `x₂`. By a delta lobe it is of use to the own pixel alone.
    fn leave_second(&self, mut walk: Walk, shared: &mut Shared) -> Option<Walk> {
        let Vertex { point, bsdf, wo } = &shared.second;
        let u_lobe = walk.rng.next_f32();
        let sample = bsdf.sample(*wo, u_lobe, Vec2::from(walk.rng.next_2d()))?;
        if sample.weight == Rgb::ZERO {
            return None;
        }
        walk.before = if sample.is_delta {
            walk.before * sample.weight
        } else {
            // For roulette alone. Colours are left out: what is black here, red times green say, may not be so from elsewhere.
            Rgb::splat(walk.before.max_element() * sample.weight.max_element())
        };
        walk.eta_squared = sample.eta * sample.eta;
        walk.bounce = Bounce {
            from: point.position,
            pdf: sample.pdf,
            is_delta: sample.is_delta,
            counts: SampleCounts::ONE_EACH,
        };
        walk.ray = point.spawn(point.shading.to_world(sample.wi));
        if !sample.is_delta {
            walk.keep_apart = true;
            shared.wi = Some(sample.wi);
        }
        Some(walk)
    }
}
