//! Adapts methods on the device to the common render loop.

use crate::{Buffer, Gpu, GpuError, PassTime};
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_scene::Rgb;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

/// A method that renders whole frames on the device.
pub trait GpuMethod {
    /// Width and height of the frames.
    fn size(&self) -> [u32; 2];

    /// Estimates frame number `frame`, row by row, and returns its ray counts; called with 0, 1, 2,
    /// … in order.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`].
    fn frame(&mut self, frame: u32, seed: u64) -> Result<(Vec<[f32; 3]>, RayCounts), GpuError>;

    /// Run time of each dispatch of the last frame; empty if the device has no clock.
    fn times(&self) -> &[PassTime];
}

impl<M: GpuMethod + ?Sized> GpuMethod for Box<M> {
    fn size(&self) -> [u32; 2] {
        (**self).size()
    }

    fn frame(&mut self, frame: u32, seed: u64) -> Result<(Vec<[f32; 3]>, RayCounts), GpuError> {
        (**self).frame(frame, seed)
    }

    fn times(&self) -> &[PassTime] {
        (**self).times()
    }
}

/// The contents of `image` after a frame, for methods that trace a camera ray for each pixel and
/// count no others.
pub(crate) fn finished_frame(
    gpu: &Gpu,
    image: &Buffer,
    [width, height]: [u32; 2],
) -> Result<(Vec<[f32; 3]>, RayCounts), GpuError> {
    let values: Vec<[f32; 4]> = gpu.read(image, (width * height) as usize)?;
    let rays = RayCounts {
        camera: u64::from(width * height),
        ..RayCounts::default()
    };
    Ok((values.iter().map(|&[r, g, b, _]| [r, g, b]).collect(), rays))
}

/// A [`GpuMethod`] as a [`FrameMethod`]. It stores failures and times, which that trait cannot
/// return.
pub struct GpuFrames<M> {
    method: M,
    failure: Option<GpuError>,
    seconds: BTreeMap<String, f64>,
}

impl<M: GpuMethod> GpuFrames<M> {
    /// Frames of `method`.
    pub fn new(method: M) -> Self {
        Self {
            method,
            failure: None,
            seconds: BTreeMap::new(),
        }
    }

    /// The error, if any: then the last frame was not rendered, and rendering ended as if it had
    /// been cancelled.
    pub fn failure(&self) -> Option<&GpuError> {
        self.failure.as_ref()
    }

    /// Seconds by the device's clock that the kernels of each name ran, over all frames; empty if
    /// there is no clock.
    pub fn pass_seconds(&self) -> &BTreeMap<String, f64> {
        &self.seconds
    }
}

impl<M: GpuMethod + Send> FrameMethod for GpuFrames<M> {
    fn size(&self) -> [u32; 2] {
        self.method.size()
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        match self.method.frame(frame, seed) {
            Ok((values, rays)) => {
                for (pixel, value) in image.iter_mut().zip(values) {
                    *pixel = value.into();
                }
                for PassTime { label, seconds } in self.method.times() {
                    match self.seconds.get_mut(label) {
                        Some(sum) => *sum += seconds,
                        None => drop(self.seconds.insert(label.clone(), *seconds)),
                    }
                }
                Some(rays)
            }
            Err(failure) => {
                self.failure = Some(failure);
                cancel.store(true, Ordering::Relaxed);
                None
            }
        }
    }
}
