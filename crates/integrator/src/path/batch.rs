//! Paths in batches, coordinate by coordinate.

use super::purpose::{Pixels, Purpose};
use super::start::Start;
use super::{PathState, PathTracer};
use crate::path::next_event::{Bounce, SampleCounts, Shadow};
use lightshed_film::{MAX_BATCH, SampleId};
use lightshed_lanes::{Column, LANES};
use lightshed_sampling::Density;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{HitBatch, Ray, RayBatch, Rgb};

const _: () = assert!(MAX_BATCH == Column::CAPACITY && MAX_BATCH == u64::BITS as usize);

const ZEROS: Column = Column::splat(0.0);

/// Paths on their way, one column a number. Those that go on stand first.
#[derive(Clone)]
pub(super) struct Paths {
    /// The current rays.
    pub rays: RayBatch,
    pub throughput: [Column; 3],
    /// See [`PathState::eta_squared`].
    pub eta_squared: Column,
    /// [`Bounce::from`].
    pub from: [Column; 3],
    /// [`Bounce::pdf`], per steradian; infinite where [`Bounce::is_delta`].
    pub pdf: Column,
    /// Two words that name the path for its random numbers: pixel and sample, or the words of a seed.
    pub name: [Column; 2],
    /// Place of the path in the batch as it began, as a word.
    pub owner: Column,
}

impl Paths {
    pub const NONE: Self = Self {
        rays: RayBatch::NOWHERE,
        throughput: [ZEROS; 3],
        eta_squared: ZEROS,
        from: [ZEROS; 3],
        pdf: ZEROS,
        name: [ZEROS; 2],
        owner: ZEROS,
    };

    /// The state of a path whose current ray is its edge number `depth`.
    #[inline(always)]
    pub fn get(&self, index: usize, depth: u32) -> PathState {
        let vector = |columns: &[Column; 3]| {
            Vec3::new(
                columns[0].get(index),
                columns[1].get(index),
                columns[2].get(index),
            )
        };
        let pdf = self.pdf.get(index);
        PathState {
            throughput: vector(&self.throughput),
            eta_squared: self.eta_squared.get(index),
            bounce: (depth > 1).then(|| Bounce {
                from: vector(&self.from),
                pdf: Density::new(pdf),
                is_delta: !cfg!(lightshed_without = "specular") && pdf == f32::INFINITY,
                counts: SampleCounts::ONE_EACH,
            }),
        }
    }

    /// Sets a path's state and current ray, but for its names.
    #[inline(always)]
    pub fn set(&mut self, index: usize, state: &PathState, ray: &Ray) {
        self.rays.set(index, ray);
        let (from, pdf) = match &state.bounce {
            Some(bounce) if !cfg!(lightshed_without = "specular") && bounce.is_delta => {
                (bounce.from, f32::INFINITY)
            }
            Some(bounce) => (bounce.from, bounce.pdf.value()),
            None => (Vec3::ZERO, 0.0),
        };
        for axis in 0..3 {
            self.throughput[axis].set(index, state.throughput[axis]);
            self.from[axis].set(index, from[axis]);
        }
        self.eta_squared.set(index, state.eta_squared);
        self.pdf.set(index, pdf);
    }
}

/// Light on its way to paths, if nothing is in between, see [`Shadow`].
pub(super) struct Shadows {
    pub rays: RayBatch,
    /// What then arrives, throughput included.
    pub radiance: [Column; 3],
    /// Places of the results, as words.
    pub owner: Column,
    pub count: usize,
}

impl Shadows {
    const NONE: Self = Self {
        rays: RayBatch::NOWHERE,
        radiance: [ZEROS; 3],
        owner: ZEROS,
        count: 0,
    };

    #[inline(always)]
    pub fn push(&mut self, shadow: &Shadow, owner: u32) {
        self.rays.set(self.count, &shadow.ray);
        for axis in 0..3 {
            self.radiance[axis].set(self.count, shadow.radiance[axis]);
        }
        self.owner.set_word(self.count, owner);
        self.count += 1;
    }
}

/// Traces up to [`MAX_BATCH`] paths from the camera.
pub(super) fn trace(tracer: &PathTracer<'_>, ids: &[SampleId], seed: u64, values: &mut [Rgb]) {
    let count = ids.len().min(MAX_BATCH);
    if count == 0 || tracer.max_depth == 0 {
        values.fill(Rgb::ZERO);
        return;
    }
    let mut paths = Paths::NONE;
    tracer.lanes.run(Start {
        camera: tracer.scene.camera(),
        ids,
        seed,
        paths: &mut paths,
    });
    let radiances = [Rgb::ZERO; MAX_BATCH];
    let mut pixels = Pixels { seed, radiances };
    follow(tracer, &mut paths, count, 1, &mut pixels);
    values[..count].copy_from_slice(&pixels.radiances[..count]);
}

/// Traces the first `alive` of `paths` to their ends, all at the same depth. Their rays are edges number `depth`, of which
/// there are no more than the tracer's.
pub(super) fn follow(
    tracer: &PathTracer<'_>,
    paths: &mut Paths,
    mut alive: usize,
    mut depth: u32,
    purpose: &mut impl Purpose,
) {
    let scene = tracer.scene;
    let mut other = Paths::NONE;
    let (mut paths, mut next) = (paths, &mut other);
    let mut hits = HitBatch::NONE;
    let mut shadows = Shadows::NONE;
    while alive > 0 {
        if depth == tracer.max_depth {
            end(tracer, paths, alive, depth, purpose);
            break;
        }
        scene.accelerator().intersect_batch(&paths.rays, alive, &mut hits);
        for index in 0..alive {
            scene.prefetch_primitive(hits.primitive.get_word(index));
        }
        shadows.count = 0;
        let arrived = alive;
        alive = super::shade::shade(
            tracer,
            depth,
            (&*paths, alive),
            &hits,
            &mut *next,
            &mut shadows,
            purpose,
        );
        purpose.count(arrived, shadows.count);
        let mut free = !scene.accelerator().occluded_batch(&shadows.rays, shadows.count);
        if shadows.count < MAX_BATCH {
            free &= (1 << shadows.count) - 1;
        }
        depth += 1;
        while free != 0 {
            let index = free.trailing_zeros() as usize;
            free &= free - 1;
            let [red, green, blue] = &shadows.radiance;
            let radiance = Rgb::new(red.get(index), green.get(index), blue.get(index));
            purpose.connect(shadows.owner.get_word(index) as usize, depth, radiance);
        }
        std::mem::swap(&mut paths, &mut next);
    }
}

/// The last edge of each path: nothing but emission counts, so it is traced against what emits, and further only if
/// there is light to be blocked.
#[inline(never)]
fn end(tracer: &PathTracer<'_>, paths: &Paths, alive: usize, depth: u32, purpose: &mut impl Purpose) {
    let scene = tracer.scene;
    let mut hits = HitBatch::NONE;
    scene.intersect_emitting_batch(&paths.rays, alive, &mut hits);
    let everywhere = scene.emitters().environment().is_some();
    // Rays that are still of interest, as far as they matter, and where they come from.
    let mut rays = RayBatch::NOWHERE;
    let mut places = [0u8; MAX_BATCH];
    let mut count = 0;
    for index in 0..alive {
        let hit = hits.get(index);
        if everywhere || hit.is_some() {
            let mut ray = paths.rays.get(index);
            ray.t_max = hit.map_or(ray.t_max, |hit| hit.t);
            rays.set(count, &ray);
            places[count % MAX_BATCH] = index as u8;
            count += 1;
        }
    }
    purpose.count(alive, 0);
    let occluded = scene.accelerator().occluded_batch(&rays, count);
    for (number, &place) in places.iter().enumerate().take(count) {
        if occluded >> number & 1 == 0 {
            let index = place as usize;
            let ray = rays.get(number);
            let point = hits.get(index).map(|hit| scene.surface(&ray, &hit));
            let (owner, path) = (paths.owner.get_word(index) as usize, paths.get(index, depth));
            purpose.arrive(scene, owner, depth, &path, &ray, point.as_ref());
        }
    }
}

/// Lanes from `place` on that are among the first `count`.
#[inline(always)]
pub(super) fn lanes_within(place: usize, count: usize) -> u32 {
    let left = count.saturating_sub(place).min(LANES);
    (1 << left) - 1
}
