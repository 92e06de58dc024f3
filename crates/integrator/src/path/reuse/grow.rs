//! Path trees of pixels, grown many at a time.

use super::points::vector;
use super::tree::{Trees, Vertex};
use super::vertices::{FIRST, SECOND, Vertices};
use crate::emitter_sampler::EmitterSampler;
use crate::path::batch::follow;
use crate::path::guide::DirectionGuide;
use crate::path::numbers::PathWords;
use crate::path::paths::{Paths, Shadows};
use crate::path::purpose::Purpose;
use crate::path::short::ShortPaths;
use crate::path::start::Start;
use crate::path::transport::{PathState, Transport};
use crate::visible_emission::VisibleEmission;
use lightshed_film::{MAX_BATCH, RayKind, RayTally, SampleId};
use lightshed_lanes::Lanes;
use lightshed_scene::{Ray, Rgb, SurfacePoint};

/// What trees are grown in.
pub struct Ground<'a, S> {
    pub transport: &'a Transport<'a, S>,
    pub tally: &'a RayTally,
    pub width: u32,
    pub frame: u32,
    pub words: PathWords,
    /// The estimator of directly visible emission in some pixels, in place of their trees.
    pub visible: Option<&'a VisibleEmission>,
    /// The estimator of short paths in some pixels, in place of their trees.
    pub short: Option<&'a ShortPaths>,
    /// Trees end where a delta lobe of so many first vertices serves their own pixel alone.
    pub apart: u32,
}

/// Room for the paths of a batch, made once for many batches: what is left in it is not read.
pub struct Rooms<K> {
    paths: Paths<K>,
    onward: Paths<K>,
    shadows: Shadows,
}

impl<K: Copy + Default> Rooms<K> {
    pub fn new() -> Self {
        Self {
            paths: Paths::new(),
            onward: Paths::new(),
            shadows: Shadows::NONE,
        }
    }
}

// Not derived: a derive would ask for `S: Copy`.
impl<S> Clone for Ground<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S> Copy for Ground<'_, S> {}

impl<S: EmitterSampler> Ground<'_, S> {
    /// Grows a tree for each pixel, at most [`MAX_BATCH`].
    pub fn grow(&self, pixels: &[u32], rooms: &mut Rooms<S::Site>, trees: &mut Trees) {
        trees.clear();
        let (transport, scene) = (self.transport, self.transport.scene);
        let count = pixels.len().min(MAX_BATCH);
        if transport.max_depth == 0 || count == 0 {
            return;
        }
        let Rooms {
            paths,
            onward,
            shadows,
        } = rooms;
        shadows.count = 0;
        let mut ids = [SampleId::default(); MAX_BATCH];
        for (id, &pixel) in ids.iter_mut().zip(pixels) {
            let (x, y) = (pixel % self.width, pixel / self.width);
            *id = SampleId {
                x,
                y,
                index: self.frame,
            };
        }
        transport.lanes.run(Start {
            camera: scene.camera(),
            ids: &ids[..count],
            words: self.words,
            paths,
        });
        let taken = self.visible.map_or(0, |visible| visible.taken(&ids[..count]));
        let short = self.short.map_or(0, |short| short.taken(&ids[..count]));
        self.tally.add(RayKind::Camera, count);
        self.meet(&mut trees.first, paths, count);
        if transport.max_depth == 1 {
            for tree in 0..count {
                Vertices::<S, FIRST>::met(transport, (paths, taken), tree, trees);
            }
            trees.forget_own(short);
            return;
        }
        let survivors = transport.lanes.run(Vertices::<S, FIRST> {
            transport,
            words: self.words,
            paths,
            alive: count,
            taken,
            next: onward,
            survivors: 0,
            shadows,
            trees,
            apart: self.apart,
        });
        self.connect(shadows, trees);
        if transport.max_depth == 2 {
            // Only emission that the last edges hit counts.
            let mut last = LastEdges(self.words, self.tally, trees);
            follow(transport, onward, survivors, 2, &mut last);
            trees.forget_own(short);
            return;
        }
        let (starts, count) = (onward, survivors);
        self.tally.add(RayKind::Path, count);
        self.meet(&mut trees.second, starts, count);
        shadows.count = 0;
        let survivors = transport.lanes.run(Vertices::<S, SECOND> {
            transport,
            words: self.words,
            paths: starts,
            alive: count,
            taken: 0,
            next: paths,
            survivors: 0,
            shadows,
            trees,
            apart: self.apart,
        });
        // All that is the trees' own until here is the light of short paths.
        trees.forget_own(short);
        self.connect(shadows, trees);
        self.follow(paths, survivors, trees);
    }

    /// Traces the rays of paths to vertices.
    fn meet(&self, vertex: &mut Vertex, paths: &Paths<S::Site>, count: usize) {
        let scene = self.transport.scene;
        scene
            .accelerator()
            .intersect_batch(&paths.rays, count, &mut vertex.hits);
        scene.prefetch_hits(&vertex.hits, count);
        vertex.rays.clone_from(&paths.rays);
    }

    /// Traces rays to emitters: light for a tree's own pixel, or for all if its `x₂` is known.
    fn connect(&self, shadows: &Shadows, trees: &mut Trees) {
        let count = shadows.count;
        self.tally.add(RayKind::Emitter, count);
        let accelerator = self.transport.scene.accelerator();
        let mut free = !accelerator.occluded_batch(&shadows.rays, count);
        if count < MAX_BATCH {
            free &= (1 << count) - 1;
        }
        while free != 0 {
            let index = free.trailing_zeros() as usize;
            free &= free - 1;
            let tree = shadows.owner.get_word(index) as usize;
            match trees.second(tree) {
                Some(place) => trees.behind.lit |= 1 << place,
                None => trees.add_own(tree, vector(&shadows.radiance, index)),
            }
        }
    }

    /// Traces paths from `x₂` on to their ends.
    fn follow(&self, paths: &mut Paths<S::Site>, alive: usize, trees: &mut Trees) {
        let mut found = Found {
            words: self.words,
            tally: self.tally,
            is_apart: [false; MAX_BATCH],
            met: [None; MAX_BATCH],
            radiances: [Rgb::ZERO; MAX_BATCH],
        };
        for tree in 0..MAX_BATCH {
            let place = trees.second(tree);
            found.is_apart[tree] = place.is_some_and(|place| trees.behind.scattered >> place & 1 == 1);
        }
        follow(self.transport, paths, alive, BEHIND, &mut found);
        for tree in 0..MAX_BATCH {
            if found.is_apart[tree] {
                trees.behind.met[tree] = found.met[tree];
                trees.behind.beyond[tree] = found.radiances[tree];
            } else if found.radiances[tree] != Rgb::ZERO {
                trees.add_own(tree, found.radiances[tree]);
            }
        }
    }
}

/// Edges from `x₁` that are the last.
struct LastEdges<'a>(PathWords, &'a RayTally, &'a mut Trees);

impl Purpose for LastEdges<'_> {
    #[inline(always)]
    fn words<L: Lanes>(&self, names: [L::Words; 2], block: u32) -> [L::Words; 4] {
        self.0.vertex_lanes::<L>(names, block)
    }

    fn arrive<S: EmitterSampler, G: DirectionGuide>(
        &mut self,
        transport: &Transport<'_, S, G>,
        place: usize,
        _depth: u32,
        path: &PathState<S::Site>,
        ray: &Ray,
        point: Option<&SurfacePoint>,
    ) {
        let met = path.met(transport.scene, &transport.sampler, ray, point);
        self.2.add_own(place, path.throughput * met);
    }

    fn connect(&mut self, place: usize, _length: u32, radiance: Rgb) {
        self.2.add_own(place, radiance);
    }

    fn count(&mut self, path: usize, emitter: usize) {
        self.1.add(RayKind::Path, path);
        self.1.add(RayKind::Emitter, emitter);
    }
}

/// Number of the edge that leads away from `x₂`.
const BEHIND: u32 = 3;

/// Results of paths behind `x₂`, by tree.
struct Found<'a> {
    words: PathWords,
    tally: &'a RayTally,
    /// Whether the hit of the first edge is stored separately.
    is_apart: [bool; MAX_BATCH],
    /// Radiance that the first edge hit, without MIS weight, and the density with which emitter
    /// sampling would have found it, in the solid-angle measure.
    met: [Option<(Rgb, f32)>; MAX_BATCH],
    radiances: [Rgb; MAX_BATCH],
}

impl Purpose for Found<'_> {
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
        if let Some((radiance, by_emitters)) = path.met_and_pdf(scene, sampler, ray, point) {
            self.met[place] = Some((radiance, by_emitters.value()));
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
