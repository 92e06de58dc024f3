//! Frames of a camera that moves, for programs that judge them: where it is, what a filter is told
//! of each frame, and methods as chains of frames of equal time.

mod camera_path;
mod chains;
mod denoiser;
mod guides;

pub use camera_path::CameraPath;
pub use chains::{Moving, started};
pub use denoiser::{Denoiser, DenoiserKind};
pub use guides::{View, views};
use lightshed::film::RgbImage;
use lightshed::scene::Rgb;

pub type Failure = Box<dyn std::error::Error>;

/// A frame as an image.
pub fn image([width, height]: [u32; 2], frame: &[Rgb]) -> Result<RgbImage, Failure> {
    let pixels = frame.iter().map(|value| value.to_array()).collect();
    Ok(RgbImage::new(width, height, pixels)?)
}
