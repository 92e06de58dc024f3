//! A device, and its memory.

use crate::GpuError;
use crate::buffer::Buffer;
use crate::kernel::KernelCache;
use crate::readback::{Readback, wait};
use bytemuck::Pod;
use wgpu::util::DeviceExt;

/// A GPU, or a processor that emulates one.
pub struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    kernels: KernelCache,
}

impl Gpu {
    /// The first adapter that can compute; a real GPU where there is one. Environment variables of
    /// wgpu (`WGPU_BACKEND`, `WGPU_ADAPTER_NAME`) are honoured.
    ///
    /// # Errors
    ///
    /// [`GpuError::NoAdapter`], [`GpuError::NoDevice`].
    pub fn new() -> Result<Self, GpuError> {
        pollster::block_on(Self::open())
    }

    async fn open() -> Result<Self, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let adapter = match wgpu::util::initialize_adapter_from_env(&instance, None).await {
            Ok(adapter) => adapter,
            Err(_) => instance
                .request_adapter(&wgpu::RequestAdapterOptions {
                    power_preference: wgpu::PowerPreference::HighPerformance,
                    ..Default::default()
                })
                .await
                .map_err(|error| GpuError::NoAdapter(error.to_string()))?,
        };
        let optional = wgpu::Features::TIMESTAMP_QUERY;
        let (device, queue) = adapter
            .request_device(&wgpu::DeviceDescriptor {
                label: Some("lightshed"),
                required_features: adapter.features() & optional,
                required_limits: adapter.limits(),
                ..Default::default()
            })
            .await
            .map_err(|error| GpuError::NoDevice(error.to_string()))?;
        Ok(Self {
            device,
            queue,
            info: adapter.get_info(),
            kernels: KernelCache::default(),
        })
    }

    /// The adapter's name.
    pub fn name(&self) -> &str {
        &self.info.name
    }

    /// The adapter's name, kind and interface, for tables.
    pub fn description(&self) -> String {
        format!(
            "{} ({:?}, {:?})",
            self.info.name, self.info.device_type, self.info.backend
        )
    }

    /// Whether it is the processor, on which programs are compiled for seconds.
    #[cfg(test)]
    pub(crate) fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Whether its `f32` arithmetic is that of IEEE 754, uncontracted, so that chains of operations
    /// have the same bits as on the host. This is known of lavapipe (llvmpipe); nothing is claimed
    /// of other devices.
    pub fn is_exact(&self) -> bool {
        self.info.driver == "llvmpipe"
    }

    /// Whether passes can be timed.
    pub fn has_timestamps(&self) -> bool {
        self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    pub(crate) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    pub(crate) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    fn check_size(&self, label: &str, bytes: u64) -> Result<(), GpuError> {
        let limits = self.device.limits();
        let limit = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size);
        if bytes > limit {
            return Err(GpuError::TooLarge {
                what: label.to_owned(),
                bytes,
                limit,
            });
        }
        Ok(())
    }

    /// A buffer with these values; without values, a buffer of zeros, as large as one value and at
    /// least sixteen bytes.
    ///
    /// # Errors
    ///
    /// [`GpuError::TooLarge`].
    pub fn buffer<T: Pod>(&self, label: &str, values: &[T]) -> Result<Buffer, GpuError> {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        if bytes.is_empty() {
            return self.zeros(label, size_of::<T>().max(16) as u64);
        }
        self.check_size(label, bytes.len() as u64)?;
        // Bindings are whole words.
        let mut padded;
        let contents = if bytes.len().is_multiple_of(4) {
            bytes
        } else {
            padded = bytes.to_vec();
            padded.resize(bytes.len().next_multiple_of(4), 0);
            &padded
        };
        Ok(Buffer {
            buffer: self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage: USAGE,
            }),
        })
    }

    /// A buffer with this number of zero bytes.
    ///
    /// # Errors
    ///
    /// [`GpuError::TooLarge`].
    pub fn zeros(&self, label: &str, bytes: u64) -> Result<Buffer, GpuError> {
        let bytes = bytes.max(16).next_multiple_of(4);
        self.check_size(label, bytes)?;
        Ok(Buffer {
            buffer: self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes,
                usage: USAGE,
                mapped_at_creation: false,
            }),
        })
    }

    /// Overwrites the start of a buffer. Panics if the values do not fit, which is a bug of the
    /// caller.
    pub fn write<T: Pod>(&self, buffer: &Buffer, values: &[T]) {
        self.queue
            .write_buffer(&buffer.buffer, 0, bytemuck::cast_slice(values));
    }

    /// The first `count` values of a buffer, after all submitted work.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`]; [`GpuError::Refused`] if the buffer holds fewer.
    pub fn read<T: Pod>(&self, buffer: &Buffer, count: usize) -> Result<Vec<T>, GpuError> {
        let bytes = (count * size_of::<T>()) as u64;
        if bytes > buffer.bytes() {
            return Err(GpuError::Refused {
                what: "a read".to_owned(),
                message: format!("{bytes} bytes of a buffer of {}", buffer.bytes()),
            });
        }
        if bytes == 0 {
            return Ok(Vec::new());
        }
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let values = Readback::record(&self.device, &mut encoder, buffer, bytes);
        let submission = self.queue.submit([encoder.finish()]);
        let values = values.ask();
        wait(&self.device, submission)?;
        values.values()
    }

    pub(crate) fn kernels(&self) -> &KernelCache {
        &self.kernels
    }
}

const USAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE
    .union(wgpu::BufferUsages::COPY_SRC)
    .union(wgpu::BufferUsages::COPY_DST);
