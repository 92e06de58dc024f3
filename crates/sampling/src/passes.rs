//! Random numbers of the passes of a frame.
//!
//! A method that works in passes (candidates, temporal reuse, rounds of spatial reuse) draws
//! numbers in each of them, for each pixel. All numbers are words of the [`CounterRng`] stream of
//! (seed, pixel, frame). Each pass has its own part of the stream,
//!
//! > `word n of (pass, round, reservoir) = word 2²⁴ · (reservoir · P + pass + round) + n`,
//!
//! with `P` parts for each reservoir. Parts do not overlap as long as a pass draws at most 2²⁴
//! words for a pixel.

use core::fmt;

use crate::point_set::PointSet;
use crate::rng::CounterRng;

/// Words of one part.
const WORDS: u32 = 1 << 24;

/// Parts of a stream.
const PARTS: u32 = 256;

/// The pixel name for numbers that all pixels of the frame share. No pixel has it, because images
/// are at most 65,535 pixels wide.
const SHARED: u32 = u32::MAX;

/// The passes that a method makes in each frame, numbered from 0. Each pass has its own random
/// numbers.
///
/// ```
/// use lightshed_sampling::FramePasses;
/// // Candidates, reuse in time, and up to four rounds of reuse in space.
/// const PASSES: FramePasses = match FramePasses::new(3, 4, 1) {
///     Ok(passes) => passes,
///     Err(_) => panic!("few passes"),
/// };
/// let numbers = PASSES.frame(1, 0, 640);
/// let (mut in_time, mut second_round) = (numbers.pass(1u32).pixel(7), numbers.pass(2u32).round(1).pixel(7));
/// assert_ne!(in_time.next_u64(), second_round.next_u64());
/// // All pixels of a frame share some bits: for their neighbours in round 0, say.
/// assert_ne!(numbers.key(0), numbers.key(1));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FramePasses {
    per_reservoir: u32,
}

/// There are more passes than a stream has parts, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooManyPasses;

impl fmt::Display for TooManyPasses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("passes, rounds and reservoirs must come to between 1 and 256 parts")
    }
}

impl core::error::Error for TooManyPasses {}

impl FramePasses {
    /// `passes` passes for each of `reservoirs` reservoirs of a pixel. The last pass is made in
    /// `rounds` rounds.
    ///
    /// # Errors
    /// [`TooManyPasses`] unless `1 ≤ reservoirs · (passes − 1 + rounds) ≤ 256` and no factor
    /// is 0.
    pub const fn new(passes: u32, rounds: u32, reservoirs: u32) -> Result<Self, TooManyPasses> {
        if passes == 0 || rounds == 0 || reservoirs == 0 || passes > PARTS || rounds > PARTS {
            return Err(TooManyPasses);
        }
        let per_reservoir = passes - 1 + rounds;
        if reservoirs <= PARTS / per_reservoir {
            Ok(Self { per_reservoir })
        } else {
            Err(TooManyPasses)
        }
    }

    /// The numbers of frame number `frame` of images of `seed` that are `width` pixels wide.
    #[inline]
    pub fn frame(self, seed: u64, frame: u32, width: u32) -> FrameNumbers {
        FrameNumbers {
            seed,
            frame,
            width: width.max(1),
            per_reservoir: self.per_reservoir,
            points: PointSet::Independent,
        }
    }
}

/// The random numbers of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameNumbers {
    seed: u64,
    frame: u32,
    width: u32,
    per_reservoir: u32,
    points: PointSet,
}

impl FrameNumbers {
    /// With blocks ([`PassNumbers::block`]) of the given kind; the default is independent blocks.
    #[inline]
    #[must_use]
    pub fn with_points(self, points: PointSet) -> Self {
        Self { points, ..self }
    }

    /// The seed.
    #[inline]
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Number of the frame.
    #[inline]
    pub fn frame(&self) -> u32 {
        self.frame
    }

    /// How blocks of a pixel relate over the frames.
    #[inline]
    pub fn points(&self) -> PointSet {
        self.points
    }

    /// The numbers of pass number `pass`: of its first round, of the first reservoir.
    #[inline]
    pub fn pass(self, pass: impl Into<u32>) -> PassNumbers {
        PassNumbers {
            frame: self,
            part: pass.into(),
        }
    }

    /// Random bits number `number` of the bits that all pixels of the frame share.
    #[inline]
    pub fn key(self, number: u32) -> u32 {
        CounterRng::at(self.seed, SHARED, self.frame, number)
    }

    /// The same passes in another frame.
    #[inline]
    #[must_use]
    pub fn of_frame(self, frame: u32) -> Self {
        Self { frame, ..self }
    }
}

/// The random numbers of one pass (and round, and reservoir) of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PassNumbers {
    frame: FrameNumbers,
    part: u32,
}

impl PassNumbers {
    /// The numbers of a later round of the last pass.
    #[inline]
    #[must_use]
    pub fn round(self, round: u32) -> Self {
        Self {
            part: self.part + round,
            ..self
        }
    }

    /// Of another reservoir.
    #[inline]
    #[must_use]
    pub fn reservoir(self, reservoir: u32) -> Self {
        Self {
            part: self.part + reservoir * self.frame.per_reservoir,
            ..self
        }
    }

    /// Number of the first block of four words of the pass, in the stream of every pixel.
    #[inline]
    pub fn first_block(&self) -> u32 {
        self.part.wrapping_mul(WORDS / 4)
    }

    /// The first four words of the pass in the pixel with index `y · width + x`. They are
    /// stratified over the frames if the frame's points are. If points are independent, they equal
    /// those of [`pixel`](Self::pixel).
    #[inline]
    pub fn block(&self, index: usize) -> [u32; 4] {
        let FrameNumbers {
            seed, frame, width, ..
        } = self.frame;
        let (x, y) = (index as u32 % width, index as u32 / width);
        self.frame
            .points
            .block(seed, y << 16 | x, frame, self.first_block())
    }

    /// The numbers of the pixel with index `y · width + x`: its stream, at the first word of the
    /// pass.
    #[inline]
    pub fn pixel(&self, index: usize) -> CounterRng {
        let FrameNumbers {
            seed, frame, width, ..
        } = self.frame;
        let (x, y) = (index as u32 % width, index as u32 / width);
        let mut rng = CounterRng::new(seed, y << 16 | x, frame);
        rng.set_dimension(self.part.wrapping_mul(WORDS));
        rng
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every pass, round and reservoir begins at words of its own, far enough from all others, and
    /// all fit into a stream.
    #[test]
    fn parts_do_not_overlap() {
        for [passes, rounds, reservoirs] in [
            [1, 1, 1],
            [9, 64, 1],
            [8, 1, 16],
            [4, 64, 1],
            [3, 2, 64],
            [1, 256, 1],
        ] {
            let layout = FramePasses::new(passes, rounds, reservoirs).unwrap();
            let numbers = layout.frame(7, 3, 100);
            let mut starts = Vec::new();
            for reservoir in 0..reservoirs {
                for pass in 0..passes {
                    let rounds = if pass + 1 == passes { rounds } else { 1 };
                    for round in 0..rounds {
                        let rng = numbers.pass(pass).round(round).reservoir(reservoir).pixel(205);
                        starts.push(rng.dimension());
                    }
                }
            }
            starts.sort_unstable();
            let apart = starts.windows(2).all(|pair| pair[1] - pair[0] >= WORDS);
            assert!(apart, "{passes} passes, {rounds} rounds, {reservoirs} reservoirs");
            assert!(starts.last().is_some_and(|&last| last <= u32::MAX - (WORDS - 1)));
        }
    }

    #[test]
    fn more_than_a_stream_holds_is_refused() {
        for [passes, rounds, reservoirs] in [
            [0, 1, 1],
            [1, 0, 1],
            [1, 1, 0],
            [1, 257, 1],
            [9, 64, 4],
            [8, 1, 33],
        ] {
            let refused = FramePasses::new(passes, rounds, reservoirs);
            assert_eq!(refused, Err(TooManyPasses), "{passes}, {rounds}, {reservoirs}");
        }
        assert!(FramePasses::new(u32::MAX, u32::MAX, u32::MAX).is_err());
    }

    /// The names are frozen: a pixel by its place, a frame by its number, what is shared by a name
    /// of its own.
    #[test]
    fn value_stability() {
        let numbers = FramePasses::new(8, 1, 16)
            .unwrap()
            .frame(0x0123_4567_89ab_cdef, 11, 40);
        let mut rng = numbers.pass(5u32).reservoir(2).pixel(3 * 40 + 7);
        let word = CounterRng::at(0x0123_4567_89ab_cdef, 3 << 16 | 7, 11, (2 * 8 + 5) << 24);
        assert_eq!(rng.next_u32(), word);
        assert_eq!(
            numbers.of_frame(4).key(9),
            CounterRng::at(0x0123_4567_89ab_cdef, u32::MAX, 4, 9)
        );
    }
}
