//! Records as they are learnt.

use super::cell::CellMoments;
use super::moments::VertexMoments;
use super::options::History;
use super::published::CachedRadiance;
use glam::DVec3;
use lightshed_sampling::CounterRng;
use lightshed_spatial::SurfaceSite;

/// Number of vertices that a record keeps for sampling (§7.4).
pub const RECORD_VERTICES: usize = 4;

/// Moments of a window of passes.
#[derive(Clone, Copy, Debug, Default)]
struct Window {
    moments: CellMoments,
    /// Sums of the vertices' means of the squared deferred bias, and of the variance over moved
    /// look-ups, weighted as the moments are.
    others: [DVec3; 2],
    passes: u32,
}

impl Window {
    fn push(&mut self, vertex: &VertexMoments, others: [DVec3; 2]) {
        let before = self.moments.weight();
        self.moments.push(vertex);
        // Samples that the moments refuse are ignored here, too.
        if self.moments.weight() > before {
            for (sum, value) in self.others.iter_mut().zip(others) {
                if value.is_finite() {
                    *sum += value;
                }
            }
        }
        self.passes += 1;
    }
}

/// What is known of a cell.
#[derive(Clone, Debug)]
pub(crate) struct Record<V> {
    vertices: [Option<(SurfaceSite, V)>; RECORD_VERTICES],
    current: Window,
    last: Window,
    /// Length of the current window.
    length: u32,
    /// Passes since the record was opened.
    passes: u32,
}

impl<V: Copy> Record<V> {
    /// A record that knows nothing.
    pub fn new() -> Self {
        Self {
            vertices: [None; RECORD_VERTICES],
            current: Window::default(),
            last: Window::default(),
            length: 1,
            passes: 0,
        }
    }

    /// Keeps a vertex: in a free place, otherwise in the place of another.
    pub fn keep(&mut self, vertex: (SurfaceSite, V), number: u32) {
        let free = self.vertices.iter().position(Option::is_none);
        let place = free.unwrap_or(number as usize % RECORD_VERTICES);
        self.vertices[place] = Some(vertex);
    }

    /// All its vertices.
    pub fn vertices(&self) -> impl Iterator<Item = &(SurfaceSite, V)> {
        self.vertices.iter().flatten()
    }

    /// Whether the squared bias of the last two windows is certain and at least a share of the
    /// squared radiance, in luminance.
    pub fn is_biased(&self, least: f64) -> bool {
        self.last.moments.merged(&self.current.moments).is_biased(least)
    }

    /// Where the first vertex is.
    pub fn first_site(&self) -> Option<&SurfaceSite> {
        self.vertices.iter().flatten().next().map(|(site, _)| site)
    }

    /// The vertex of a pass: each is equally likely.
    pub fn vertex(&self, slot: u32, pass: u32) -> Option<&(SurfaceSite, V)> {
        let count = self.vertices.iter().flatten().count() as u32;
        if count == 0 {
            return None;
        }
        let turn = CounterRng::at(TURN_SEED, slot, pass, 0);
        self.vertices.iter().flatten().nth((turn % count) as usize)
    }

    /// Learns from samples of a vertex: their moments, their squared deferred bias, and the
    /// variance over moved look-ups of the vertex.
    pub fn learn(&mut self, vertex: &VertexMoments, others: [DVec3; 2], history: History) {
        self.passes += 1;
        match history {
            History::Exponential { keep } => {
                self.current.moments.fade(keep);
                self.current.others = self.current.others.map(|sum| sum * keep);
                self.current.push(vertex, others);
            }
            History::Windows { longest } => {
                if self.current.passes >= self.length {
                    self.last = std::mem::take(&mut self.current);
                    self.length = (2 * self.length).min(longest);
                }
                self.current.push(vertex, others);
            }
        }
    }

    /// The record's published values, once it is based on this number of passes.
    pub fn publish(&self, min_passes: u32) -> CachedRadiance {
        let moments = self.last.moments.merged(&self.current.moments);
        if self.passes < min_passes || !(moments.weight() > 0.0) {
            return CachedRadiance::default();
        }
        let of = |index: usize| (self.last.others[index] + self.current.others[index]) / moments.weight();
        CachedRadiance::new(&moments, [of(0), of(1)])
    }
}

/// Seed of whose turn it is.
const TURN_SEED: u64 = 0x6361_6368_655f_7475;
