//! Values on their way from the device to the host.

use crate::GpuError;
use crate::buffer::Buffer;
use bytemuck::Pod;
use std::fmt::Display;
use std::sync::mpsc::{Receiver, channel};

/// The start of a buffer as it is when the device comes to where this was recorded.
pub(crate) struct Readback {
    staging: wgpu::Buffer,
    bytes: usize,
}

impl Readback {
    /// Records a copy of the first `bytes` of a buffer.
    pub fn record(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        buffer: &Buffer,
        bytes: u64,
    ) -> Self {
        let size = bytes.next_multiple_of(4);
        let staging = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        encoder.copy_buffer_to_buffer(&buffer.buffer, 0, &staging, 0, size);
        Self {
            staging,
            bytes: bytes as usize,
        }
    }

    /// Asks for the values. To be called after what was recorded has been submitted.
    pub fn ask(self) -> AskedReadback {
        let (sender, answer) = channel();
        self.staging
            .slice(..)
            .map_async(wgpu::MapMode::Read, move |result| {
                // Nobody listens any more only if the values are no longer wanted.
                let _ = sender.send(result);
            });
        AskedReadback {
            staging: self.staging,
            bytes: self.bytes,
            answer,
        }
    }
}

/// Values that were asked for.
pub(crate) struct AskedReadback {
    staging: wgpu::Buffer,
    bytes: usize,
    answer: Receiver<Result<(), wgpu::BufferAsyncError>>,
}

impl AskedReadback {
    /// The values, after their submission has been [waited](wait) for.
    pub fn values<T: Pod>(self) -> Result<Vec<T>, GpuError> {
        self.bytes(bytemuck::pod_collect_to_vec)
    }

    /// What `of` makes of the bytes where the driver has them.
    pub fn bytes<V>(self, of: impl FnOnce(&[u8]) -> V) -> Result<V, GpuError> {
        self.answer
            .recv()
            .map_err(|error| lost(&error))?
            .map_err(|error| lost(&error))?;
        let view = self
            .staging
            .slice(..)
            .get_mapped_range()
            .map_err(|error| lost(&error))?;
        Ok(of(&view[..self.bytes]))
    }
}

/// Waits until the device has done everything up to a submission.
pub(crate) fn wait(device: &wgpu::Device, submission: wgpu::SubmissionIndex) -> Result<(), GpuError> {
    device
        .poll(wgpu::PollType::Wait {
            submission_index: Some(submission),
            timeout: None,
        })
        .map(|_| ())
        .map_err(|error| lost(&error))
}

fn lost(error: &dyn Display) -> GpuError {
    GpuError::Lost(error.to_string())
}
