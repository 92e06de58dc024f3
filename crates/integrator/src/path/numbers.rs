//! The assignment of random numbers to the vertices of a path.

use super::transport::VertexStream;
use lightshed_lanes::{LANES, LaneWords, Lanes};
use lightshed_sampling::{CounterRng, PointSet, SobolScrambles, f32_from_u32, f32_from_u32_lanes};

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

/// The source of one path's random numbers.
pub(super) trait PathNumbers {
    /// Those of the vertex at the end of edge number `depth`, where `samples` emitter samples are
    /// taken, of which these are for the first.
    fn vertex(&mut self, depth: u32, samples: u32) -> VertexNumbers;

    /// Those of emitter sample `number` of `samples` at that vertex, from 1.
    fn further(&mut self, depth: u32, samples: u32, number: u32) -> (u64, [f32; 2]);
}

impl PathNumbers for CounterRng {
    #[inline(always)]
    fn vertex(&mut self, depth: u32, samples: u32) -> VertexNumbers {
        VertexNumbers::draw(self, depth).of_first(samples)
    }

    /// Words that belong to no vertex.
    #[inline(always)]
    fn further(&mut self, _depth: u32, samples: u32, number: u32) -> (u64, [f32; 2]) {
        self.set_dimension(1 << 31 | number.wrapping_mul(WORDS));
        (stratified(self.next_u64(), number, samples), self.next_2d())
    }
}

impl VertexNumbers {
    /// With the numbers of the first of a number of emitter samples.
    #[inline(always)]
    fn of_first(mut self, samples: u32) -> Self {
        self.u_emitter = stratified(self.u_emitter, 0, samples);
        self
    }

    /// From the vertex's two blocks of words.
    #[inline(always)]
    fn from_blocks([of_emitter, [c, d, e, f]]: [[u32; 4]; 2]) -> Self {
        let (u_emitter, u_on_emitter) = emitter_numbers(of_emitter);
        Self {
            u_emitter,
            u_on_emitter,
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
    /// [`VertexNumbers::draw`] for eight paths, out of their two blocks, with those of the first of
    /// a number of emitter samples.
    #[inline(always)]
    pub fn from_blocks(mut words: [[L::Words; 4]; 2], samples: u32) -> Self {
        let [low, high, _, _] = &mut words[0];
        [*low, *high] = stratified_lanes::<L>([*low, *high], 0, samples);
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

    /// What a block's words have in common for pixels whose names are `first` to `first + 7`.
    #[inline(always)]
    pub fn common_lanes<L: Lanes>(self, first: u32, block: u32) -> Option<SobolScrambles> {
        self.points.common_lanes::<L>(self.seed, first, block)
    }

    /// [`vertex_lanes`](Self::vertex_lanes), with what the words have in common if it is known.
    #[inline(always)]
    pub fn vertex_lanes_by<L: Lanes>(
        self,
        common: Option<&SobolScrambles>,
        names: [L::Words; 2],
        block: u32,
    ) -> [L::Words; 4] {
        let words = self.points.block_lanes_by::<L>(common, self.seed, names, block);
        arrange(self.points, block, words)
    }

    /// The camera's words of one path.
    #[inline(always)]
    pub fn camera(self, pixel: u32, sample: u32) -> [u32; 4] {
        self.points.block(self.seed, pixel, sample, 0)
    }

    /// A block of a vertex's words of one path.
    #[inline(always)]
    pub fn vertex_block(self, [pixel, sample]: [u32; 2], block: u32) -> [u32; 4] {
        let words = self.points.block(self.seed, pixel, sample, block);
        arrange(self.points, block, words)
    }

    /// The numbers of one path's vertex at the end of edge `depth`.
    #[inline(always)]
    pub fn vertex(self, pixel: u32, sample: u32, depth: u32) -> VertexNumbers {
        self.of(pixel, sample).vertex(depth, 1)
    }

    /// The numbers of the path of a sample of a pixel.
    #[inline(always)]
    pub(super) fn of(self, pixel: u32, sample: u32) -> SampleNumbers {
        let words = self;
        SampleNumbers { words, pixel, sample }
    }
}

/// The random numbers of the path of one sample of a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct SampleNumbers {
    words: PathWords,
    pixel: u32,
    sample: u32,
}

impl PathNumbers for SampleNumbers {
    #[inline(always)]
    fn vertex(&mut self, depth: u32, samples: u32) -> VertexNumbers {
        let Self { words, pixel, sample } = *self;
        let first = emitter_block(depth, 0);
        let blocks = [first, first.wrapping_add(1)];
        VertexNumbers::from_blocks(blocks.map(|block| words.vertex_block([pixel, sample], block)))
            .of_first(samples)
    }

    #[inline(always)]
    fn further(&mut self, depth: u32, samples: u32, number: u32) -> (u64, [f32; 2]) {
        let block = emitter_block(depth, number);
        let words = self.words.vertex_block([self.pixel, self.sample], block);
        let (u_select, u) = emitter_numbers(words);
        (stratified(u_select, number, samples), u)
    }
}

/// The block of words for emitter sample `number` at the vertex at the end of edge `depth`. Those
/// of further samples are copies of the first one's block: stratified points of far blocks had up
/// to ten times the variance that one sample has.
#[inline(always)]
pub(super) fn emitter_block(depth: u32, number: u32) -> u32 {
    let first = depth.wrapping_mul(WORDS) / 4;
    match number {
        0 => first,
        _ => PointSet::copy_of(first, number),
    }
}

/// `u` in part `number` of `samples` equal parts of the unit interval.
#[inline(always)]
pub(super) fn stratified(u: u64, number: u32, samples: u32) -> u64 {
    if samples == 1 {
        return u;
    }
    let part = u64::MAX / u64::from(samples);
    let within = (u128::from(u) * u128::from(part)) >> 64;
    part * u64::from(number) + within as u64
}

/// [`stratified`] in lanes, of the low and high halves.
#[inline(always)]
pub(super) fn stratified_lanes<L: Lanes>(u: [L::Words; 2], number: u32, samples: u32) -> [L::Words; 2] {
    if samples == 1 {
        return u;
    }
    let [mut low, mut high] = u.map(LaneWords::store);
    for (low, high) in low.iter_mut().zip(&mut high) {
        let u = stratified(u64::from(*high) << 32 | u64::from(*low), number, samples);
        (*low, *high) = (u as u32, (u >> 32) as u32);
    }
    [L::Words::load(&low), L::Words::load(&high)]
}

/// The numbers for an emitter from the first block of a vertex's words.
#[inline(always)]
pub(super) fn emitter_numbers([low, high, a, b]: [u32; 4]) -> (u64, [f32; 2]) {
    let u_select = u64::from(high) << 32 | u64::from(low);
    (u_select, [f32_from_u32(a), f32_from_u32(b)])
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

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_lanes::ArrayLanes;

    /// Each number is in its part, in order, alone and in lanes. Planted faults: parts counted from
    /// one; the low halves forgotten.
    #[test]
    fn numbers_are_in_their_parts() {
        let words = [0, 1, 0x1234_5678, 1 << 31, u32::MAX];
        for samples in [1, 2, 3, 4, 8, 65_536] {
            for number in [0, samples / 2, samples - 1] {
                let mut least = 0;
                for high in words {
                    for low in words {
                        let u = stratified(u64::from(high) << 32 | u64::from(low), number, samples);
                        let part = (u128::from(u) * u128::from(samples)) >> 64;
                        // Parts are rounded down.
                        let begins = u64::MAX / u64::from(samples) * u64::from(number);
                        assert!(u >= begins && part as u32 + 1 >= number && part as u32 <= number);
                        assert!(u >= least, "not in order");
                        least = u;
                        type Words = <ArrayLanes as Lanes>::Words;
                        let lanes = [low, high].map(Words::splat);
                        let lanes = stratified_lanes::<ArrayLanes>(lanes, number, samples);
                        assert_eq!(lanes.map(|half| half.store()[3]), [u as u32, (u >> 32) as u32]);
                    }
                }
            }
        }
    }

    /// The emitter samples of one vertex have words of their own.
    #[test]
    fn blocks_of_a_vertex_differ() {
        let mut blocks: Vec<u32> = (0..100).map(|number| emitter_block(1, number)).collect();
        // The camera, and directions at the vertex.
        blocks.extend([0, 3]);
        blocks.sort_unstable();
        blocks.dedup();
        assert_eq!(blocks.len(), 102);
    }
}
