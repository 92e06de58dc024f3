//! The random numbers of a path through media.

use crate::path::numbers::{PathWords, VertexNumbers};
use crate::path::transport::VertexStream;
use core::convert::Infallible;
use lightshed_film::SampleId;
use lightshed_sampling::rand::TryRng;
use lightshed_sampling::{CounterRng, PointSet};

/// The block of four words that a path's first flight begins with.
const FLIGHT_BLOCK: u32 = 1;

/// The edge whose flight and vertex have stratified numbers. Later ones gain nothing.
const FIRST_EDGE: u32 = 1;

/// Where the numbers of one path come from: stratified over the samples of the pixel, or a stream.
///
/// A flight by null collisions and an estimate of transmittance draw as many numbers as they need,
/// so most are of the stream. Stratified are the numbers of the first vertex, and the first four of
/// the first flight: distances to its first three tentative collisions, and whether the first one
/// is real. A homogeneous medium needs one.
#[derive(Clone, Copy, Debug)]
pub(in crate::volume) struct SampleNumbers {
    words: PathWords,
    pixel: u32,
    sample: u32,
    /// Whether the first flight has had its stratified numbers.
    flown: bool,
}

impl SampleNumbers {
    /// All of the stream.
    pub const INDEPENDENT: Self = Self {
        words: PathWords {
            points: PointSet::Independent,
            seed: 0,
        },
        pixel: 0,
        sample: 0,
        flown: false,
    };

    /// Those of a sample under the point set and seed of `words`.
    #[inline(always)]
    pub fn new(words: PathWords, SampleId { x, y, index }: SampleId) -> Self {
        Self {
            words,
            pixel: y << 16 | x,
            sample: index,
            flown: false,
        }
    }

    /// Without stratified numbers for flights: the first one has had those of other pixels.
    #[inline(always)]
    pub fn without_flight(self) -> Self {
        Self { flown: true, ..self }
    }

    /// The numbers of a flight along the edge `depth`. Of the first flight of a path the first four
    /// are stratified; `stream` has the others.
    #[inline(always)]
    pub fn flight<'a>(&mut self, depth: u32, stream: &'a mut CounterRng) -> FlightNumbers<'a> {
        let PathWords { points, seed } = self.words;
        if points == PointSet::Independent || depth > FIRST_EDGE || self.flown {
            return FlightNumbers {
                own: [0; 4],
                left: 0,
                stream,
            };
        }
        self.flown = !is_planted();
        FlightNumbers {
            own: points.block(seed, self.pixel, self.sample, FLIGHT_BLOCK),
            left: 4,
            stream,
        }
    }

    /// The numbers of the vertex at the end of edge `depth`; `stream` has what is not stratified.
    #[inline(always)]
    pub fn vertex<'a>(&self, depth: u32, stream: &'a mut CounterRng) -> ScatteringNumbers<'a> {
        let is_stratified = self.words.points != PointSet::Independent && depth <= FIRST_EDGE;
        ScatteringNumbers {
            own: is_stratified.then(|| self.words.vertex(self.pixel, self.sample, depth)),
            stream,
        }
    }
}

/// Whether a test has planted the fault that every flight along the first edge begins with the
/// numbers of the first.
#[inline(always)]
fn is_planted() -> bool {
    #[cfg(test)]
    return REPEATED.get();
    #[cfg(not(test))]
    false
}

#[cfg(test)]
thread_local! {
    pub(super) static REPEATED: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}

/// The numbers of one flight.
pub(in crate::volume) struct FlightNumbers<'a> {
    own: [u32; 4],
    /// How many of `own` have not been drawn.
    left: u32,
    stream: &'a mut CounterRng,
}

impl TryRng for FlightNumbers<'_> {
    type Error = Infallible;

    #[inline(always)]
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        if self.left == 0 {
            return Ok(self.stream.next_u32());
        }
        self.left -= 1;
        // Drawn are distance, distance, choice, distance: the first two dimensions are best.
        Ok(self.own[3 - self.left as usize % 4])
    }

    #[inline]
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        self.stream.try_next_u64()
    }

    #[inline]
    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        self.stream.try_fill_bytes(bytes)
    }
}

/// The numbers of one vertex of a path through media.
pub(in crate::volume) struct ScatteringNumbers<'a> {
    own: Option<VertexNumbers>,
    stream: &'a mut CounterRng,
}

impl ScatteringNumbers<'_> {
    /// The stream of what draws as many numbers as it needs.
    #[inline(always)]
    pub fn flights(&mut self) -> &mut CounterRng {
        self.stream
    }
}

impl VertexStream for ScatteringNumbers<'_> {
    #[inline(always)]
    fn emitter(&mut self) -> (u64, [f32; 2]) {
        match &self.own {
            Some(own) => (own.u_emitter, own.u_on_emitter),
            None => self.stream.emitter(),
        }
    }

    #[inline(always)]
    fn lobe(&mut self) -> f32 {
        match &self.own {
            Some(own) => own.u_lobe,
            None => self.stream.lobe(),
        }
    }

    #[inline(always)]
    fn direction(&mut self) -> [f32; 2] {
        match &self.own {
            Some(own) => own.u_direction,
            None => self.stream.direction(),
        }
    }

    #[inline(always)]
    fn roulette(&mut self) -> f32 {
        match &self.own {
            Some(own) => own.u_roulette,
            None => self.stream.roulette(),
        }
    }
}
