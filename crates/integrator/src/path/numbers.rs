//! The assignment of random numbers to the vertices of a path.

use super::transport::VertexStream;
use lightshed_lanes::{LANES, LaneWords, Lanes};
use lightshed_sampling::{CounterRng, PointSet, f32_from_u32, f32_from_u32_lanes};

/// Words reserved for each vertex; the camera has the first ones.
const WORDS: u32 = 8;

/// Random numbers of one vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VertexNumbers {
    pub u_emitter: u64,
    pub u_on_emitter: [f32; 2],
    pub u_lobe: f32,
    pub u_direction: [f32; 2],
    pub u_roulette: f32,
}

impl VertexNumbers {
    /// Those of the vertex at the end of edge `depth` (from 1): words `8 · depth` to
    /// `8 · depth + 7` of the stream.
    #[inline(always)]
    pub fn draw(rng: &mut CounterRng, depth: u32) -> Self {
        rng.set_dimension(depth.wrapping_mul(WORDS));
        Self {
            u_emitter: rng.next_u64(),
            u_on_emitter: rng.next_2d(),
            u_lobe: rng.next_f32(),
            u_direction: rng.next_2d(),
            u_roulette: rng.next_f32(),
        }
    }
}

impl VertexNumbers {
    /// From the vertex's two blocks of words.
    #[inline(always)]
    fn from_blocks([[low, high, a, b], [c, d, e, f]]: [[u32; 4]; 2]) -> Self {
        Self {
            u_emitter: u64::from(high) << 32 | u64::from(low),
            u_on_emitter: [f32_from_u32(a), f32_from_u32(b)],
            u_lobe: f32_from_u32(c),
            u_direction: [f32_from_u32(d), f32_from_u32(e)],
            u_roulette: f32_from_u32(f),
        }
    }
}

impl VertexStream for &VertexNumbers {
    #[inline(always)]
    fn emitter(&mut self) -> (u64, [f32; 2]) {
        (self.u_emitter, self.u_on_emitter)
    }

    #[inline(always)]
    fn lobe(&mut self) -> f32 {
        self.u_lobe
    }

    #[inline(always)]
    fn direction(&mut self) -> [f32; 2] {
        self.u_direction
    }

    #[inline(always)]
    fn roulette(&mut self) -> f32 {
        self.u_roulette
    }
}

/// A vertex's numbers in sequence: if flights draw as many as they need, fixed places have no
/// meaning.
impl VertexStream for CounterRng {
    #[inline(always)]
    fn emitter(&mut self) -> (u64, [f32; 2]) {
        (self.next_u64(), self.next_2d())
    }

    #[inline(always)]
    fn lobe(&mut self) -> f32 {
        self.next_f32()
    }

    #[inline(always)]
    fn direction(&mut self) -> [f32; 2] {
        self.next_2d()
    }

    #[inline(always)]
    fn roulette(&mut self) -> f32 {
        self.next_f32()
    }
}

/// Random numbers of eight vertices.
#[derive(Clone, Copy, Debug)]
pub(super) struct VertexLanes<L: Lanes> {
    words: [[L::Words; 4]; 2],
}

impl<L: Lanes> VertexLanes<L> {
    /// Number of the first of the two blocks of four words that belong to the vertex at the end of
    /// edge `depth`. It wraps with the words.
    #[inline(always)]
    pub fn first_block(depth: u32) -> u32 {
        depth.wrapping_mul(WORDS) / 4
    }

    /// [`VertexNumbers::draw`] for eight paths, out of their two blocks.
    #[inline(always)]
    pub fn from_blocks(words: [[L::Words; 4]; 2]) -> Self {
        Self { words }
    }

    #[inline(always)]
    pub fn u_emitter(&self) -> [L::Words; 2] {
        [self.words[0][0], self.words[0][1]]
    }

    #[inline(always)]
    pub fn u_on_emitter(&self) -> [L; 2] {
        [
            f32_from_u32_lanes::<L>(self.words[0][2]),
            f32_from_u32_lanes::<L>(self.words[0][3]),
        ]
    }

    #[inline(always)]
    pub fn u_lobe(&self) -> L {
        f32_from_u32_lanes::<L>(self.words[1][0])
    }

    #[inline(always)]
    pub fn u_direction(&self) -> [L; 2] {
        [
            f32_from_u32_lanes::<L>(self.words[1][1]),
            f32_from_u32_lanes::<L>(self.words[1][2]),
        ]
    }

    #[inline(always)]
    pub fn u_roulette(&self) -> L {
        f32_from_u32_lanes::<L>(self.words[1][3])
    }

    /// To memory.
    #[inline(always)]
    pub fn store(&self) -> StoredVertices {
        let [[a, b, c, d], [e, f, g, h]] = self.words;
        StoredVertices([
            a.store(),
            b.store(),
            c.store(),
            d.store(),
            e.store(),
            f.store(),
            g.store(),
            h.store(),
        ])
    }
}

/// The source of words for paths from the camera: a point set under a seed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathWords {
    pub points: PointSet,
    pub seed: u64,
}

impl PathWords {
    /// The camera's words of eight paths: two for the place in the pixel, two for the lens if there
    /// is one.
    #[inline(always)]
    pub fn camera_lanes<L: Lanes>(self, pixel: L::Words, sample: L::Words) -> [L::Words; 4] {
        self.points.block_lanes::<L>(self.seed, pixel, sample, 0)
    }

    /// A block of a vertex's words of eight paths.
    #[inline(always)]
    pub fn vertex_lanes<L: Lanes>(self, [pixel, sample]: [L::Words; 2], block: u32) -> [L::Words; 4] {
        let words = self.points.block_lanes::<L>(self.seed, pixel, sample, block);
        arrange(self.points, block, words)
    }

    /// The camera's words of one path.
    #[inline(always)]
    pub fn camera(self, pixel: u32, sample: u32) -> [u32; 4] {
        self.points.block(self.seed, pixel, sample, 0)
    }

    /// The numbers of one path's vertex at the end of edge `depth`.
    #[inline(always)]
    pub fn vertex(self, pixel: u32, sample: u32, depth: u32) -> VertexNumbers {
        let first = depth.wrapping_mul(WORDS) / 4;
        VertexNumbers::from_blocks([first, first.wrapping_add(1)].map(|block| {
            let words = self.points.block(self.seed, pixel, sample, block);
            arrange(self.points, block, words)
        }))
    }
}

/// The use of the dimensions of a block at a vertex. The first two of a stratified block are so
/// best: they are the position on an emitter, and the direction. The third selects the emitter (the
/// high half of its number), or the lobe.
#[inline(always)]
fn arrange<W: Copy>(points: PointSet, block: u32, [a, b, c, d]: [W; 4]) -> [W; 4] {
    match points {
        PointSet::Independent => [a, b, c, d],
        PointSet::Sobol | PointSet::BlueNoise if block.is_multiple_of(2) => [d, c, a, b],
        PointSet::Sobol | PointSet::BlueNoise => [c, a, b, d],
    }
}

/// Random words of eight vertices in memory.
pub(super) struct StoredVertices([[u32; LANES]; WORDS as usize]);

impl StoredVertices {
    /// The numbers of one vertex.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> VertexNumbers {
        let [low, high, a, b, c, d, e, f] = self.0.map(|words| words[lane % LANES]);
        VertexNumbers::from_blocks([[low, high, a, b], [c, d, e, f]])
    }
}
