//! Path trees of pixels, grown many at a time.

use crate::camera_ray::PixelRay;
use crate::emitter_sampler::EmitterSampler;
use crate::path::batch::follow;
use crate::path::guide::DirectionGuide;
use crate::path::numbers::{PathWords, VertexNumbers};
use crate::path::paths::Paths;
use crate::path::purpose::Purpose;
use crate::path::scattering::{SurfaceVertex, Vertex};
use crate::path::transport::{Bounce, PathState, Transport, UNSEEN, met_emission};
use crate::ray_batch::{NOWHERE, add_unhidden, see_emitters};
use crate::visible_emission::VisibleEmission;
use lightshed_film::{MAX_BATCH, RayKind, RayTally};
use lightshed_lanes::Lanes;
use lightshed_sampling::f32_from_u32;
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Ray, Rgb, SurfacePoint};

/// The light that a pixel's path tree found.
pub struct Tree {
    /// Index of the pixel.
    pub pixel: usize,
    /// What only this pixel can use.
    pub own: Rgb,
    /// `x₁`.
    pub first: Option<SurfaceVertex>,
    /// The part behind `x₁`, for any pixel.
    pub shared: Option<Shared>,
}

/// A tree from `x₂` on, as sampled, without the scattering at `x₂`.
pub struct Shared {
    /// `x₂`; its `wo` is towards the tree's own `x₁`.
    pub second: SurfaceVertex,
    /// An emitter sampled at `x₂` that it sees.
    pub emitter: Option<SharedEmitter>,
    /// The direction sampled at `x₂`, in its shading frame.
    pub wi: Option<Vec3>,
    /// Radiance emitted from there, and the density with which the emitter sample would have found
    /// it.
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
pub struct Ground<'a, S> {
    pub transport: &'a Transport<'a, S>,
    pub tally: &'a RayTally,
    pub width: u32,
    pub frame: u32,
    pub words: PathWords,
    /// The estimator of directly visible emission in some pixels, in place of their trees.
    pub visible: Option<&'a VisibleEmission>,
}

/// How a tree goes on: a path, its ray and the tree that it belongs to.
struct Onward<K> {
    tree: usize,
    ray: Ray,
    path: PathState<K>,
}

/// A segment of a tree with its light, if nothing blocks it.
type Brought = (usize, Ray, Rgb);

impl<S: EmitterSampler> Ground<'_, S> {
    /// Grows a tree for each pixel, at most [`MAX_BATCH`].
    pub fn grow(&self, pixels: &[usize], trees: &mut Vec<Tree>) {
        trees.clear();
        if self.transport.max_depth == 0 {
            return;
        }
        let starts = self.first_vertices(pixels, trees);
        match self.transport.max_depth {
            1 => (),
            2 => self.last_edges(&starts, trees),
            _ => self.follow(self.second_vertices(starts, trees), trees),
        }
    }

    /// Names of a pixel's random numbers.
    fn names(&self, pixel: usize) -> [u32; 2] {
        let (x, y) = (pixel as u32 % self.width, pixel as u32 / self.width);
        [y << 16 | x, self.frame]
    }

    /// Those of the vertex at the end of edge `depth`.
    fn numbers(&self, pixel: usize, depth: u32) -> VertexNumbers {
        let [pixel, sample] = self.names(pixel);
        self.words.vertex(pixel, sample, depth)
    }

    /// `x₁` with its emission, a sample of the emitters, and a direction.
    fn first_vertices(&self, pixels: &[usize], trees: &mut Vec<Tree>) -> Vec<Onward<S::Site>> {
        let (transport, scene) = (self.transport, self.transport.scene);
        let count = pixels.len().min(MAX_BATCH);
        let (mut rays, mut hits) = ([NOWHERE; MAX_BATCH], [None; MAX_BATCH]);
        for (ray, &pixel) in rays.iter_mut().zip(pixels) {
            let [name, sample] = self.names(pixel);
            let corner = Vec2::new((name & 0xffff) as f32, (name >> 16) as f32);
            let numbers = self.words.camera(name, sample).map(f32_from_u32);
            *ray = PixelRay::through(scene.camera(), corner, numbers).ray;
        }
        self.tally.add(RayKind::Camera, count);
        scene
            .accelerator()
            .intersect_many(&rays[..count], &mut hits[..count]);
        let mut starts = Vec::with_capacity(count);
        let mut brought: Vec<Brought> = Vec::with_capacity(count);
        for ((&pixel, ray), hit) in pixels.iter().zip(&rays).zip(&hits) {
            let point = hit.map(|hit| scene.surface(ray, &hit));
            let own = match &point {
                Some(_) if self.visible.is_some_and(|visible| visible.takes(pixel)) => Rgb::ZERO,
                _ => met_emission(scene, ray, point.as_ref()),
            };
            let (tree, first) = (
                trees.len(),
                point.map(|point| SurfaceVertex::new(scene, ray, point)),
            );
            if let Some(vertex) = first.as_ref().filter(|_| transport.max_depth > 1) {
                let numbers = self.numbers(pixel, 1);
                let (at, site) = (transport.scattering(vertex), transport.site(vertex));
                let u = (numbers.u_emitter, numbers.u_on_emitter);
                let light = transport.emitter_light(&at, &site, u);
                brought.extend(light.map(|light| (tree, light.ray, SurfaceVertex::weighted(&light))));
                if let Some(sample) = at.sample(numbers.u_lobe, numbers.u_direction)
                    && sample.weight != Rgb::ZERO
                {
                    let bounce = Bounce {
                        from: vertex.position(),
                        site,
                        pdf: sample.pdf,
                        is_delta: sample.is_delta,
                    };
                    starts.push(Onward {
                        tree,
                        ray: vertex.point.spawn(sample.direction),
                        path: PathState {
                            throughput: sample.weight,
                            eta_squared: sample.eta * sample.eta,
                            bounce: Some(bounce),
                        },
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
        add_unhidden(scene, self.tally, &brought, |tree, radiance| {
            trees[tree].own += radiance;
        });
        starts
    }

    /// Edges from `x₁` if paths have two: only emission that they hit counts.
    fn last_edges(&self, starts: &[Onward<S::Site>], trees: &mut [Tree]) {
        let scene = self.transport.scene;
        let (mut rays, mut hits) = ([NOWHERE; MAX_BATCH], [None; MAX_BATCH]);
        let (mut hidden, count) = ([false; MAX_BATCH], starts.len());
        for (ray, start) in rays.iter_mut().zip(starts) {
            *ray = start.ray;
        }
        self.tally.add(RayKind::Path, count);
        see_emitters(
            scene,
            &mut rays[..count],
            &mut hits[..count],
            &mut hidden[..count],
        );
        for ((start, hit), _) in starts.iter().zip(hits).zip(hidden).filter(|(_, hidden)| !hidden) {
            let point = hit.map(|hit| scene.surface(&start.ray, &hit));
            self.collect(start, point.as_ref(), trees);
        }
    }

    /// The hit of the edge from `x₁`, seen by its own pixel alone: direct light, weighted against
    /// the emitter sample at `x₁`.
    fn collect(&self, start: &Onward<S::Site>, point: Option<&SurfacePoint>, trees: &mut [Tree]) {
        let (scene, sampler) = (self.transport.scene, &self.transport.sampler);
        let met = start.path.met(scene, sampler, &start.ray, point);
        trees[start.tree].own += start.path.throughput * met;
    }

    /// `x₂` with a sample of the emitters and a direction; paths go on from there.
    fn second_vertices(&self, mut starts: Vec<Onward<S::Site>>, trees: &mut [Tree]) -> Vec<Onward<S::Site>> {
        let (transport, scene) = (self.transport, self.transport.scene);
        let (mut rays, mut hits) = ([NOWHERE; MAX_BATCH], [None; MAX_BATCH]);
        for (ray, start) in rays.iter_mut().zip(&starts) {
            *ray = start.ray;
        }
        let count = starts.len();
        self.tally.add(RayKind::Path, count);
        scene
            .accelerator()
            .intersect_many(&rays[..count], &mut hits[..count]);
        let mut onward = Vec::with_capacity(count);
        // Light for the tree's own pixel alone, and for all.
        let mut brought: Vec<Brought> = Vec::with_capacity(count);
        let mut shared_brought: Vec<Brought> = Vec::with_capacity(count);
        for (start, hit) in starts.iter_mut().zip(hits) {
            let point = hit.map(|hit| scene.surface(&start.ray, &hit));
            self.collect(start, point.as_ref(), trees);
            let Some(point) = point else { continue };
            let (tree, numbers) = (start.tree, self.numbers(trees[start.tree].pixel, 2));
            if start.path.bounce.as_ref().is_some_and(|bounce| bounce.is_delta) {
                // No other pixel can reach this point: an ordinary path.
                let mut path = start.path.clone();
                let next = transport.advance(&mut path, &start.ray, &point, 2, &mut &numbers, UNSEEN);
                brought.extend(next.shadow.map(|shadow| (tree, shadow.ray, shadow.radiance)));
                onward.extend(next.ray.map(|ray| Onward { tree, ray, path }));
                continue;
            }
            let mut shared = Shared {
                emitter: None,
                wi: None,
                met: None,
                beyond: Rgb::ZERO,
                second: SurfaceVertex::new(scene, &start.ray, point),
            };
            let site = transport.site(&shared.second);
            if let Some((ray, emitter)) = self.sample_emitter(&shared.second, &site, &numbers) {
                shared_brought.push((tree, ray, emitter.weight));
                shared.emitter = Some(emitter);
            }
            onward.extend(self.leave_second(start, site, &mut shared, &numbers));
            trees[tree].shared = Some(shared);
        }
        add_unhidden(scene, self.tally, &brought, |tree, radiance| {
            trees[tree].own += radiance;
        });
        let mut seen = [false; MAX_BATCH];
        add_unhidden(scene, self.tally, &shared_brought, |tree, _| seen[tree] = true);
        for (tree, ..) in shared_brought {
            if let Some(shared) = trees[tree].shared.as_mut().filter(|_| !seen[tree]) {
                shared.emitter = None;
            }
        }
        onward
    }

    /// An emitter sample at `x₂`, for any scattered direction, and the segment that must be free.
    fn sample_emitter(
        &self,
        second: &SurfaceVertex,
        site: &S::Site,
        numbers: &VertexNumbers,
    ) -> Option<(Ray, SharedEmitter)> {
        if !second.has_non_delta() {
            return None;
        }
        let (u_select, u) = (numbers.u_emitter, numbers.u_on_emitter);
        let light = self
            .transport
            .sampler
            .sample(second.position(), site, u_select, u)?;
        let wi = second.point.shading.to_local(light.direction);
        // A sample that this pixel cannot use is left out, and so does not count for its technique.
        if second.bsdf.evaluate(second.wo, wi).value == Rgb::ZERO {
            return None;
        }
        let emitter = SharedEmitter {
            wi,
            weight: light.weight,
            pdf: light.pdf.value(),
            is_delta: light.is_delta,
        };
        Some((second.shadow_ray(&light), emitter))
    }

    /// A direction at `x₂`. A delta lobe serves the own pixel alone.
    fn leave_second(
        &self,
        start: &Onward<S::Site>,
        site: S::Site,
        shared: &mut Shared,
        numbers: &VertexNumbers,
    ) -> Option<Onward<S::Site>> {
        let SurfaceVertex { point, bsdf, wo, .. } = &shared.second;
        let sample = bsdf.sample(*wo, numbers.u_lobe, Vec2::from(numbers.u_direction))?;
        if sample.weight == Rgb::ZERO {
            return None;
        }
        let (before, eta_squared) = (start.path.throughput, sample.eta * sample.eta);
        let mut path = PathState {
            throughput: before * sample.weight,
            eta_squared,
            bounce: Some(Bounce {
                from: point.position,
                site,
                pdf: sample.pdf,
                is_delta: sample.is_delta,
            }),
        };
        if !sample.is_delta {
            path.throughput = Rgb::ONE;
            // Only for roulette. Colours are left out: black here (red times green, for example)
            // may not be black from elsewhere.
            path.eta_squared *= before.max_element() * sample.weight.max_element();
            shared.wi = Some(sample.wi);
        }
        Some(Onward {
            tree: start.tree,
            ray: point.spawn(point.shading.to_world(sample.wi)),
            path,
        })
    }

    /// Traces paths from `x₂` on to their ends.
    fn follow(&self, onward: Vec<Onward<S::Site>>, trees: &mut [Tree]) {
        let mut paths = Paths::new();
        let mut found = Behind {
            words: self.words,
            tally: self.tally,
            is_apart: [false; MAX_BATCH],
            met: [None; MAX_BATCH],
            radiances: [Rgb::ZERO; MAX_BATCH],
        };
        for (index, Onward { tree, ray, path }) in onward.iter().enumerate() {
            paths.begin(index, path, ray, self.names(trees[*tree].pixel), *tree);
            found.is_apart[*tree] = trees[*tree]
                .shared
                .as_ref()
                .is_some_and(|shared| shared.wi.is_some());
        }
        follow(self.transport, &mut paths, onward.len(), BEHIND, &mut found);
        for Onward { tree, .. } in onward {
            match &mut trees[tree].shared {
                Some(shared) if found.is_apart[tree] => {
                    (shared.met, shared.beyond) = (found.met[tree], found.radiances[tree]);
                }
                _ => trees[tree].own += found.radiances[tree],
            }
        }
    }
}

/// Number of the edge that leads away from `x₂`.
const BEHIND: u32 = 3;

/// Results of paths behind `x₂`, by tree.
struct Behind<'a> {
    words: PathWords,
    tally: &'a RayTally,
    /// Whether the hit of the first edge is stored separately.
    is_apart: [bool; MAX_BATCH],
    /// Radiance that the first edge hit, without MIS weight, and the density with which emitter
    /// sampling would have found it, in the solid-angle measure.
    met: [Option<(Rgb, f32)>; MAX_BATCH],
    radiances: [Rgb; MAX_BATCH],
}

impl Purpose for Behind<'_> {
    #[inline(always)]
    fn words<L: Lanes>(&self, names: [L::Words; 2], block: u32) -> [L::Words; 4] {
        self.words.vertex_lanes::<L>(names, block)
    }

    fn arrive<S: EmitterSampler, G: DirectionGuide>(
        &mut self,
        transport: &Transport<'_, S, G>,
        place: usize,
        depth: u32,
        path: &PathState<S::Site>,
        ray: &Ray,
        point: Option<&SurfacePoint>,
    ) {
        let (scene, sampler) = (transport.scene, &transport.sampler);
        if depth > BEHIND || !self.is_apart[place] {
            self.radiances[place] += path.throughput * path.met(scene, sampler, ray, point);
            return;
        }
        let radiance = met_emission(scene, ray, point);
        if let Some(bounce) = path.bounce.as_ref().filter(|_| radiance != Rgb::ZERO) {
            self.met[place] = Some((radiance, bounce.emitter_pdf(sampler, ray, point).value()));
        }
    }

    fn connect(&mut self, place: usize, _length: u32, radiance: Rgb) {
        self.radiances[place] += radiance;
    }

    fn count(&mut self, path: usize, emitter: usize) {
        self.tally.add(RayKind::Path, path);
        self.tally.add(RayKind::Emitter, emitter);
    }
}
