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
    /// Sum of the vertices' means of the squared deferred bias, weighted as the moments are.
    deferred: DVec3,
    passes: u32,
}

impl Window {
    fn push(&mut self, vertex: &VertexMoments, deferred: DVec3) {
        let before = self.moments.weight();
        self.moments.push(vertex);
        // Samples that the moments refuse are ignored here, too.
        if self.moments.weight() > before && deferred.is_finite() {
            self.deferred += deferred;
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

    /// The vertex of a pass: each is equally likely.
    pub fn vertex(&self, slot: u32, pass: u32) -> Option<&(SurfaceSite, V)> {
        let count = self.vertices.iter().flatten().count() as u32;
        if count == 0 {
            return None;
        }
        let turn = CounterRng::at(TURN_SEED, slot, pass, 0);
        self.vertices.iter().flatten().nth((turn % count) as usize)
    }

    /// Learns from samples of a vertex.
    pub fn learn(&mut self, vertex: &VertexMoments, deferred: DVec3, history: History) {
        self.passes += 1;
        match history {
            History::Exponential { keep } => {
                self.current.moments.fade(keep);
                self.current.deferred *= keep;
                self.current.push(vertex, deferred);
            }
            History::Windows { longest } => {
                if self.current.passes >= self.length {
                    self.last = std::mem::take(&mut self.current);
                    self.length = (2 * self.length).min(longest);
                }
                self.current.push(vertex, deferred);
            }
        }
    }

    /// The record's published values, once it is based on this number of passes.
    pub fn publish(&self, min_passes: u32) -> CachedRadiance {
        let moments = self.last.moments.merged(&self.current.moments);
        if self.passes < min_passes || !(moments.weight() > 0.0) {
            return CachedRadiance::default();
        }
        let deferred = (self.last.deferred + self.current.deferred) / moments.weight();
        CachedRadiance::new(&moments, deferred)
    }
}

/// Seed of whose turn it is.
const TURN_SEED: u64 = 0x6361_6368_655f_7475;
