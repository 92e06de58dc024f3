//! Path tracing with guides that learn from earlier frames.

mod combination;
mod field;
mod frames;
mod guide;
mod need;
mod options;
mod recorder;
mod together;

pub use field::{FieldDirections, SceneField};
pub use frames::{GuidedHalf, GuidedPaths};
pub(crate) use guide::FieldGuide;
pub use need::guide_need;
pub use options::{GuideError, GuideKind, GuidedPathsOptions, UnknownGuide};
pub use recorder::FieldRecorder;
pub(crate) use recorder::NOTHING;
pub(crate) use together::Together;
