//! Image files: OpenEXR and PNG, written completely or not at all.

mod exr_file;
mod names;
mod png_file;
mod target;
mod unnamed;

pub use exr_file::{ExrError, read_exr, write_exr};
#[cfg(feature = "flip")]
pub(crate) use png_file::srgb_bytes;
pub use png_file::{linear_to_srgb, write_png};
pub use target::{ImageFormat, OutputError, OutputTarget};
