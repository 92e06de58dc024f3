//! Memory on a device.

/// Memory on the device, which shaders read and write.
#[derive(Clone, Debug)]
pub struct Buffer {
    pub(crate) buffer: wgpu::Buffer,
}

impl Buffer {
    /// Its size in bytes.
    pub fn bytes(&self) -> u64 {
        self.buffer.size()
    }
}

/// How a kernel uses the buffer at one of its bindings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// `var<storage, read>`.
    Read,
    /// `var<storage, read_write>`.
    Write,
}
