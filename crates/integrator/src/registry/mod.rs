//! All methods by name, with their capabilities, options, and constructors.

mod capabilities;
mod entry;
mod error;
mod idle;
mod method;
mod methods;
mod option;
mod options;
mod stage;
mod starts;
#[cfg(test)]
mod tests;

pub use capabilities::{MethodCapabilities, PathDepth};
pub use entry::{MethodEntry, StartMethod};
pub use error::MethodError;
pub use method::Method;
pub use methods::METHODS;
pub use option::{MethodOption, MethodValues};
pub use stage::{Motion, MovingMedia, Stage, Started};
