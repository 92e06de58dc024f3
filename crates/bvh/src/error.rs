//! What cannot be built.

/// Why there is no tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// The primitive of this index has no box: a corner is not finite, or least and greatest corner
    /// are exchanged.
    #[error("the box of primitive {0} is not finite, or its corners are exchanged")]
    Bounds(u32),
    /// More than [`MAX_PRIMITIVES`](crate::MAX_PRIMITIVES).
    #[error("{0} primitives are more than a tree can hold")]
    TooMany(usize),
    /// A refit needs one box for each primitive of the tree, and got another number.
    #[error("a tree over {primitives} primitives cannot take {boxes} boxes")]
    Count {
        /// Primitives of the tree.
        primitives: usize,
        /// Boxes given.
        boxes: usize,
    },
    /// An instance names an object that does not exist.
    #[error("instance {instance} names object {object}, which there is not")]
    Object {
        /// Index of the instance.
        instance: usize,
        /// The object that it names.
        object: u32,
    },
    /// An option of the build lies outside its range.
    #[error("{0}")]
    Option(&'static str),
}
