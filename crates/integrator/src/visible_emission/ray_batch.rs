//! The names and random numbers of several rays.

use lightshed_film::{MAX_BATCH, SampleId};
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, LaneWords, Lanes};
use lightshed_sampling::{PointSet, f32_from_u32_lanes};

/// The block of a sample's random numbers that its rays use; nothing else uses it.
const BLOCK: u32 = 1;

/// Up to [`MAX_BATCH`] rays by name.
pub struct RayBatch {
    /// The place of each ray's sample among those asked for.
    pub owner: [usize; MAX_BATCH],
    pub count: usize,
    /// Pixels and indices: the names of their numbers.
    names: [[u32; MAX_BATCH]; 2],
}

impl Default for RayBatch {
    fn default() -> Self {
        Self {
            owner: [0; MAX_BATCH],
            count: 0,
            names: [[0; MAX_BATCH]; 2],
        }
    }
}

impl RayBatch {
    /// Adds ray number `index` of the pixel of `id`, the sample at `owner`. There must be room.
    #[inline(always)]
    pub fn push(&mut self, owner: usize, id: &SampleId, index: u32) {
        self.owner[self.count] = owner;
        self.names[0][self.count] = id.y << 16 | id.x;
        self.names[1][self.count] = index;
        self.count += 1;
    }

    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.count == MAX_BATCH
    }

    /// Two numbers in `[0, 1)` of each ray.
    pub fn numbers(&self, points: PointSet, seed: u64) -> [[f32; MAX_BATCH]; 2] {
        LaneChoice::best().run(Numbers {
            rays: self,
            points,
            seed,
        })
    }
}

struct Numbers<'a> {
    rays: &'a RayBatch,
    points: PointSet,
    seed: u64,
}

impl LaneKernel for Numbers<'_> {
    type Output = [[f32; MAX_BATCH]; 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let mut numbers = [[0.0; MAX_BATCH]; 2];
        for place in (0..self.rays.count).step_by(LANES) {
            let (mut pixel, mut index) = ([0; LANES], [0; LANES]);
            pixel.copy_from_slice(&self.rays.names[0][place..place + LANES]);
            index.copy_from_slice(&self.rays.names[1][place..place + LANES]);
            let (pixel, index) = (L::Words::load(&pixel), L::Words::load(&index));
            let words = self.points.block_lanes::<L>(self.seed, pixel, index, BLOCK);
            for (row, word) in numbers.iter_mut().zip(words) {
                row[place..place + LANES].copy_from_slice(&f32_from_u32_lanes::<L>(word).store());
            }
        }
        numbers
    }
}

const _: () = assert!(MAX_BATCH.is_multiple_of(LANES));
