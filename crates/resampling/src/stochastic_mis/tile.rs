//! What the estimators ask of a tile of chains.

/// Whether chains trade places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Exchange {
    /// They do: unbiased.
    #[default]
    Traded,
    /// They stay. **Biased**: a place's techniques depend on its own samples.
    Kept,
}

/// A tile of places, each with the state of a chain, and an integral `I_place = ∫ f dx` to be
/// estimated at each.
///
/// An implementation keeps to the following; that is all that the estimators' unbiasedness needs.
///
/// - [`technique`](Self::technique) takes what it needs out of the state: it is not changed by a
///   later [`advance`](Self::advance).
/// - Sample `i` of [`draw`](Self::draw) has the density `density(i, techniques[i], ·)` given the
///   techniques, with random numbers that nothing else uses.
/// - [`begin_step`](Self::begin_step) reads no sample of the current set: of earlier frames, say.
/// - Wherever `f > 0` at a place, the densities of each set do not all vanish. A defensive part in
///   every technique sees to that.
///
/// Densities are in any one measure, the same for all techniques.
pub trait ChainTile {
    /// What moves from place to place.
    type State;
    /// What a state samples by.
    type Technique;
    /// A sample with all that `f` and the chain need of it.
    type Sample;

    /// Before each step, in place: states may be changed or replaced.
    fn begin_step(&mut self, step: usize, states: &mut [Self::State]);

    /// The technique of a state.
    fn technique(&self, state: &Self::State) -> Self::Technique;

    /// Pushes one sample for each place, by the technique of the same index, onto `samples`, which
    /// is empty. `None` is a sample of value zero.
    fn draw(&mut self, step: usize, techniques: &[Self::Technique], samples: &mut Vec<Option<Self::Sample>>);

    /// `p(x|t)` at a place.
    fn density(&self, place: usize, technique: &Self::Technique, sample: &Self::Sample) -> f64;

    /// The chain's transition, by its own sample; `None` is one of value zero. `state` is what the
    /// technique was made of.
    fn advance(
        &mut self,
        step: usize,
        place: usize,
        state: &mut Self::State,
        technique: &Self::Technique,
        sample: Option<&Self::Sample>,
    );

    /// `m q(x)`: the density at `sample` of what [`draw_other`](Self::draw_other) draws, times the
    /// number of its samples. Zero where there is nothing else.
    fn other_density(&self, _place: usize, _sample: &Self::Sample) -> f64 {
        0.0
    }

    /// Pushes the samples of other techniques for a place and a set that begins with step `first`.
    fn draw_other(&mut self, _first: usize, _place: usize, _samples: &mut Vec<Self::Sample>) {}

    /// Adds `f(x)` times its weight to the estimate of a place.
    fn add(&mut self, place: usize, sample: &Self::Sample, weight: SetWeight);
}

/// What `f` of a sample counts in an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetWeight {
    /// Share of the set in the estimate.
    pub(super) share: f64,
    /// `Σ_j c p(x|t_j)`: densities of the set, times the numbers of samples that are expected.
    pub(super) set: f64,
    /// `m q(x)`.
    pub(super) other: f64,
}

impl SetWeight {
    /// The balance heuristic over all techniques; zero if no technique can produce the sample.
    #[inline]
    pub fn merged(&self) -> f64 {
        self.share * reciprocal(self.set + self.other)
    }

    /// The same for a part of `f` that the set alone can find, and other techniques never count.
    #[inline]
    pub fn of_set(&self) -> f64 {
        self.share * reciprocal(self.set)
    }
}

/// `1/d`, and zero where no technique has the sample.
fn reciprocal(density: f64) -> f64 {
    // NaN fails the comparison. An infinite density has weight zero.
    if density > 0.0 { 1.0 / density } else { 0.0 }
}
