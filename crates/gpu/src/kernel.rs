//! Entry points of shaders, ready to run.

use crate::buffer::Access;
use std::collections::HashMap;
use std::sync::Mutex;

/// An entry point of a shader, ready to run. Copies share it.
#[derive(Clone)]
pub struct Kernel {
    pub(crate) pipeline: wgpu::ComputePipeline,
    pub(crate) label: String,
}

/// Programs and kernels that a device has compiled: the same program with the same constants is
/// compiled once.
#[derive(Default)]
pub(crate) struct KernelCache {
    pub programs: Mutex<HashMap<String, Program>>,
}

/// A program's module, and its kernels.
pub(crate) struct Program {
    pub module: wgpu::ShaderModule,
    pub kernels: HashMap<KernelKey, Kernel>,
}

/// The key of a program's kernels.
#[derive(PartialEq, Eq, Hash)]
pub(crate) struct KernelKey {
    pub entry: String,
    /// Bindings of each group.
    pub groups: Vec<Vec<(u32, Access)>>,
    /// Overridable constants, by their bits.
    pub constants: Vec<(String, u64)>,
}
