//! Path tracing whose directions are guided by what earlier frames found.

mod combination;
mod field;
mod frames;
mod need;
mod options;
mod recorder;

pub use field::{FieldDirections, SceneField};
pub use frames::GuidedPaths;
pub use need::guide_need;
pub use options::{GuideError, GuideKind, GuidedPathsOptions, UnknownGuide};
pub use recorder::FieldRecorder;
