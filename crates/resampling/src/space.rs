//! What a contribution weight is measured in.

use core::marker::PhantomData;
use lightshed_sampling::Measure;

/// A space with a measure: the unit of a contribution weight is that of the measure (a weight
/// estimates `1/p`).
///
/// Every [`Measure`] is one (solid angle, area, primary sample space). A renderer states its own by
/// an empty type:
///
/// ```
/// use lightshed_resampling::Space;
/// /// Product area measure over the vertices of a path.
/// #[derive(Clone, Copy, Debug, Default, PartialEq)]
/// struct PathSpace;
/// impl Space for PathSpace {}
/// ```
///
/// Reservoirs of different spaces do not merge, and a conditional space ([`Given`]) is not its
/// unconditional one.
pub trait Space: Copy + Default + PartialEq + core::fmt::Debug + Send + Sync + 'static {}

impl<M: Measure + PartialEq + Send + Sync> Space for M {}

/// The counting measure of a finite or countable set: a "density" is a probability, an integral is
/// a sum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counting;
impl Space for Counting {}

/// The space `S` *given* a variable of space `Z`: the suffix space behind a prefix (Kettunen 2023
/// def. 4.1). A weight in it is a conditional one, `W_{X|Z}`, and its expectations hold for each
/// fixed `Z`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Given<S, Z>(PhantomData<(S, Z)>);
impl<S: Space, Z: Space> Space for Given<S, Z> {}

/// The product space of pairs `(z, x)` with `z` of space `Z` and `x` of space `S`: whole paths as
/// prefix and suffix.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Joint<Z, S>(PhantomData<(Z, S)>);
impl<Z: Space, S: Space> Space for Joint<Z, S> {}
