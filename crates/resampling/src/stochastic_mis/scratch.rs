//! Memory that the estimators use again.

use super::tile::ChainTile;

/// Memory for [`temporal_smis`](super::temporal_smis) and [`spatial_smis`](super::spatial_smis):
/// after the first tile they allocate nothing.
pub struct TileScratch<T: ChainTile> {
    /// Techniques and samples of the steps of a set, one step after the other.
    pub(super) techniques: Vec<T::Technique>,
    pub(super) samples: Vec<Option<T::Sample>>,
    /// Samples of one step.
    pub(super) drawn: Vec<Option<T::Sample>>,
    /// Samples of other techniques.
    pub(super) others: Vec<T::Sample>,
}

// Not derived: a derive would ask for `T: Default`.
impl<T: ChainTile> Default for TileScratch<T> {
    fn default() -> Self {
        Self {
            techniques: Vec::new(),
            samples: Vec::new(),
            drawn: Vec::new(),
            others: Vec::new(),
        }
    }
}

impl<T: ChainTile> TileScratch<T> {
    /// Makes the techniques of a step from its states, draws from them and lets the chains advance.
    pub(super) fn step(&mut self, tile: &mut T, step: usize, states: &mut [T::State]) {
        let first = self.techniques.len();
        self.techniques
            .extend(states.iter().map(|state| tile.technique(state)));
        let techniques = &self.techniques[first..];
        self.drawn.clear();
        tile.draw(step, techniques, &mut self.drawn);
        self.drawn.resize_with(states.len(), || None);
        for (place, state) in states.iter_mut().enumerate() {
            tile.advance(step, place, state, &techniques[place], self.drawn[place].as_ref());
        }
        self.samples.append(&mut self.drawn);
    }

    /// Forgets the set.
    pub(super) fn clear(&mut self) {
        self.techniques.clear();
        self.samples.clear();
    }
}
