//! Mixtures of von Mises–Fisher lobes, and fitting them to weighted directions.

mod cosine;
mod exponential;
mod fit;
mod lobe;
mod mixture;
mod model;
mod statistics;

pub use fit::{VmfFit, VmfFitOptions, VmfSample};
pub(crate) use lobe::peak_density;
pub use lobe::{MAX_CONCENTRATION, VmfLobe, concentration_of};
pub use mixture::{MAX_LOBES, VmfMixture};
pub use model::VmfModel;
