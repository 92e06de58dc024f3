//! The paths of a batch, coordinate by coordinate.

use super::transport::{Bounce, PathState, Shadow};
use lightshed_film::MAX_BATCH;
use lightshed_lanes::{Column, LANES};
use lightshed_sampling::Density;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Ray, RayBatch};

const _: () = assert!(MAX_BATCH == Column::CAPACITY && MAX_BATCH == u64::BITS as usize);

const ZEROS: Column = Column::splat(0.0);

/// Active paths, one column a number. Those that continue come first. `K` is the data of a vertex
/// that the selection of emitters uses.
#[derive(Clone)]
pub(crate) struct Paths<K> {
    /// The current rays.
    pub rays: RayBatch,
    pub throughput: [Column; 3],
    /// See [`PathState::eta_squared`].
    pub eta_squared: Column,
    /// [`Bounce::from`].
    pub from: [Column; 3],
    /// [`Bounce::pdf`], per steradian; infinite where [`Bounce::is_delta`].
    pub pdf: Column,
    /// [`Bounce::site`].
    pub sites: [K; MAX_BATCH],
    /// Two words that identify the path for its random numbers: pixel and sample, or the words of a
    /// seed.
    pub name: [Column; 2],
    /// Place of the path in the batch as it began, as a word.
    pub owner: Column,
}

impl<K: Copy + Default> Paths<K> {
    /// Room for a batch.
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            rays: RayBatch::NOWHERE,
            throughput: [ZEROS; 3],
            eta_squared: ZEROS,
            from: [ZEROS; 3],
            pdf: ZEROS,
            sites: [K::default(); MAX_BATCH],
            name: [ZEROS; 2],
            owner: ZEROS,
        }
    }

    /// Starts a path at a place of the batch, by its state, ray and names.
    pub fn begin(&mut self, index: usize, state: &PathState<K>, ray: &Ray, names: [u32; 2], owner: usize) {
        self.set(index, state, ray);
        for (name, word) in self.name.iter_mut().zip(names) {
            name.set_word(index, word);
        }
        self.owner.set_word(index, owner as u32);
    }

    /// The state of a path whose current ray is its edge number `depth`.
    #[inline(always)]
    pub fn get(&self, index: usize, depth: u32) -> PathState<K> {
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
                site: self.sites[index % MAX_BATCH],
                pdf: Density::new(pdf),
                is_delta: !cfg!(lightshed_without = "specular") && pdf == f32::INFINITY,
            }),
        }
    }

    /// Sets a path's state and current ray, but for its names.
    #[inline(always)]
    pub fn set(&mut self, index: usize, state: &PathState<K>, ray: &Ray) {
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
        if let Some(bounce) = &state.bounce {
            self.sites[index % MAX_BATCH] = bounce.site;
        }
    }
}

/// Light on its way to paths, if nothing blocks it, see [`Shadow`].
pub(super) struct Shadows {
    pub rays: RayBatch,
    /// Its contribution if it arrives, throughput included.
    pub radiance: [Column; 3],
    /// Places of the results, as words.
    pub owner: Column,
    pub count: usize,
}

impl Shadows {
    pub const NONE: Self = Self {
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

/// Lanes from `place` on that are among the first `count`.
#[inline(always)]
pub(super) fn lanes_within(place: usize, count: usize) -> u32 {
    let left = count.saturating_sub(place).min(LANES);
    (1 << left) - 1
}
