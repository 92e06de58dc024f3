//! The interface of all light samplers.

use crate::ShadingPoint;

/// A chosen light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightChoice {
    /// Index of the light, in the order in which the lights were given.
    pub light: u32,
    /// Probability of the choice, positive; the same bits as [`LightSampler::pmf`] gives.
    pub pmf: f32,
}

/// Selects one of many lights for a receiver, with probabilities `p(i | receiver)` in the counting
/// measure.
///
/// `Σ_i p(i | receiver) ≤ 1`: the difference to 1 is the probability of selecting none, which
/// counts as a sample of value zero. `p(i | receiver)` is zero only if light `i` sends nothing to
/// the receiver. So `Σ_i f(i) = E[f(i) / p(i | receiver)]` for every contribution `f`, without
/// bias.
///
/// Object-safe for each kind of receiver, [`ShadingPoint`] (the default) and
/// [`RaySegment`](crate::RaySegment).
pub trait LightSampler<R: ?Sized = ShadingPoint>: Sync {
    /// Number of lights.
    fn light_count(&self) -> usize;

    /// Selects a light by 64 uniform bits; `None` selects none. A tree maps ascending `u` to lights
    /// in the order of its leaves: stratified numbers give lights stratified by position.
    fn sample(&self, at: &R, u: u64) -> Option<LightChoice>;

    /// Probability with which [`sample`](Self::sample) selects `light` for this receiver; 0 out of
    /// range.
    fn pmf(&self, at: &R, light: u32) -> f32;

    /// Many selections for one receiver: `choices[i]` becomes what [`sample`](Self::sample) returns
    /// for `u[i]`, bit for bit. The length of the shorter slice counts. Trees share the work of
    /// numbers that follow the same path, most of it if `u` is ascending.
    fn sample_many(&self, at: &R, u: &[u64], choices: &mut [Option<LightChoice>]) {
        for (u, choice) in u.iter().zip(choices) {
            *choice = self.sample(at, *u);
        }
    }

    /// One selection for each of many receivers: `choices[i]` becomes what [`sample`](Self::sample)
    /// returns for `at[i]` and `u[i]`, bit for bit. The length of the shortest slice counts. Trees
    /// descend for all receivers together, so that none waits for its own nodes only.
    fn sample_each(&self, at: &[R], u: &[u64], choices: &mut [Option<LightChoice>])
    where
        R: Sized,
    {
        for ((at, u), choice) in at.iter().zip(u).zip(choices) {
            *choice = self.sample(at, *u);
        }
    }

    /// Selections for several receivers, some of which may have more than one: `choices[i]` becomes
    /// what [`sample`](Self::sample) returns for `at[of[i]]` and `u[i]`, bit for bit. The length of
    /// the shortest of the other slices counts. Trees descend for all together, and share the work
    /// of numbers that follow the same path one after the other for the same receiver.
    ///
    /// # Panics
    /// If one of `of` is no index of `at`.
    fn sample_for(&self, at: &[R], of: &[u8], u: &[u64], choices: &mut [Option<LightChoice>])
    where
        R: Copy,
    {
        for ((of, u), choices) in of
            .chunks(TOGETHER)
            .zip(u.chunks(TOGETHER))
            .zip(choices.chunks_mut(TOGETHER))
        {
            let each: [R; TOGETHER] = std::array::from_fn(|i| at[usize::from(of[i % of.len()])]);
            let count = of.len().min(u.len()).min(choices.len());
            self.sample_each(&each[..count], u, choices);
        }
    }
}

/// Receivers that are copied to be asked for together.
const TOGETHER: usize = 16;
