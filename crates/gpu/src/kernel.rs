//! Entry points of shaders, ready to run.

use crate::buffer::Access;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// An entry point of a shader, ready to run. Copies share it.
#[derive(Clone)]
pub struct Kernel {
    pub(crate) pipeline: wgpu::ComputePipeline,
    pub(crate) label: String,
}

/// Programs and kernels that a device has compiled: the same program with the same constants is
/// compiled once, and different ones at the same time.
#[derive(Default)]
pub(crate) struct KernelCache {
    programs: Mutex<HashMap<String, Arc<Program>>>,
}

/// A program's module, and its kernels.
#[derive(Default)]
pub(crate) struct Program {
    pub module: Once<wgpu::ShaderModule>,
    kernels: Mutex<HashMap<KernelKey, Arc<Once<Kernel>>>>,
}

/// Something that is compiled by the first thread that needs it; others wait.
pub(crate) struct Once<T>(Mutex<Option<T>>);

impl KernelCache {
    /// A program.
    pub fn program(&self, wgsl: &str) -> Arc<Program> {
        let mut programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        match programs.get(wgsl) {
            Some(program) => program.clone(),
            None => programs.entry(wgsl.to_owned()).or_default().clone(),
        }
    }
}

impl Program {
    /// A kernel of it.
    pub fn kernel(&self, key: &KernelKey) -> Arc<Once<Kernel>> {
        let mut kernels = self.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        match kernels.get(key) {
            Some(kernel) => kernel.clone(),
            None => kernels.entry(key.clone()).or_default().clone(),
        }
    }
}

impl<T: Clone> Once<T> {
    /// It, or what `make` makes, which is kept unless it fails.
    pub fn or_make<E>(&self, make: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        // A thread that panicked has stored nothing.
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match &*kept {
            Some(value) => Ok(value.clone()),
            None => Ok(kept.insert(make()?).clone()),
        }
    }
}

impl<T> Default for Once<T> {
    fn default() -> Self {
        Self(Mutex::new(None))
    }
}

/// The key of a program's kernels.
#[derive(Clone, PartialEq, Eq, Hash)]
pub(crate) struct KernelKey {
    pub entry: String,
    /// Bindings of each group.
    pub groups: Vec<Vec<(u32, Access)>>,
    /// Overridable constants, by their bits.
    pub constants: Vec<(String, u64)>,
}
