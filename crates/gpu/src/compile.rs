//! Kernels from programs, and buffers bound for them.

use crate::GpuError;
use crate::bindings::{Bindings, BoundGroup, Table};
use crate::buffer::Access;
use crate::device::Gpu;
use crate::kernel::{Kernel, KernelKey};
use lightshed_integrator::sampling::parallel;

impl Gpu {
    /// Prepares the entry point `entry` of `wgsl`, with its overridable constants set. Bindings are
    /// those of group 0, in order.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`] with what the validator says.
    pub fn kernel(
        &self,
        label: &str,
        wgsl: &str,
        entry: &str,
        bindings: &[Access],
        constants: &[(&str, f64)],
    ) -> Result<Kernel, GpuError> {
        let group = (0..).zip(bindings.iter().copied()).collect();
        let constants = constants.iter().map(|&(name, value)| (name.to_owned(), value));
        self.kernel_of_groups(label, wgsl, entry, vec![group], constants.collect())
    }

    /// The same, for buffers bound by [`Gpu::bind`] to these tables.
    pub(crate) fn kernel_of_tables(
        &self,
        label: &str,
        wgsl: &str,
        entry: &str,
        tables: &[Table],
        constants: &[(String, f64)],
    ) -> Result<Kernel, GpuError> {
        let mut groups = Vec::new();
        for table in tables {
            let group = table.group as usize;
            groups.resize_with(groups.len().max(group + 1), Vec::new);
            groups[group].extend(table.numbered().map(|(number, _, access)| (number, access)));
        }
        self.kernel_of_groups(label, wgsl, entry, groups, constants.to_vec())
    }

    /// Several kernels by their entry points, compiled at the same time on the current pool's
    /// threads.
    pub(crate) fn at_once<const N: usize>(
        entries: [&str; N],
        kernel: impl Fn(&str) -> Result<Kernel, GpuError> + Sync,
    ) -> Result<[Kernel; N], GpuError> {
        let kernels = parallel::map(entries.into_iter(), |_, entry| kernel(entry));
        let kernels: Vec<Kernel> = kernels.into_iter().collect::<Result<_, _>>()?;
        Ok(kernels
            .try_into()
            .unwrap_or_else(|_| unreachable!("one for each entry point")))
    }

    fn kernel_of_groups(
        &self,
        label: &str,
        wgsl: &str,
        entry: &str,
        groups: Vec<Vec<(u32, Access)>>,
        constants: Vec<(String, f64)>,
    ) -> Result<Kernel, GpuError> {
        let key = KernelKey {
            entry: entry.to_owned(),
            groups,
            constants: constants
                .into_iter()
                .map(|(name, value)| (name, value.to_bits()))
                .collect(),
        };
        let program = self.kernels().program(wgsl);
        let kernel = program.kernel(&key).or_make(|| {
            let module = program
                .module
                .or_make(|| self.checked(label, || self.module(label, wgsl)))?;
            let pipeline = self.checked(label, || self.pipeline(label, &module, &key))?;
            Ok(Kernel {
                pipeline,
                label: label.to_owned(),
            })
        })?;
        Ok(Kernel {
            label: label.to_owned(),
            ..kernel
        })
    }

    /// What `make` makes of the device, or what the validator says.
    fn checked<T>(&self, label: &str, make: impl FnOnce() -> T) -> Result<T, GpuError> {
        let scope = self.device().push_error_scope(wgpu::ErrorFilter::Validation);
        let made = make();
        match pollster::block_on(scope.pop()) {
            None => Ok(made),
            Some(error) => Err(GpuError::Refused {
                what: label.to_owned(),
                message: error.to_string(),
            }),
        }
    }

    fn module(&self, label: &str, wgsl: &str) -> wgpu::ShaderModule {
        self.device().create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(wgsl.into()),
        })
    }

    fn pipeline(&self, label: &str, module: &wgpu::ShaderModule, key: &KernelKey) -> wgpu::ComputePipeline {
        let constants: Vec<(&str, f64)> = key
            .constants
            .iter()
            .map(|(name, bits)| (name.as_str(), f64::from_bits(*bits)))
            .collect();
        let layouts: Vec<Option<wgpu::BindGroupLayout>> = key
            .groups
            .iter()
            .map(|group| (!group.is_empty()).then(|| self.group_layout(group)))
            .collect();
        let layouts: Vec<_> = layouts.iter().map(Option::as_ref).collect();
        let layout = self
            .device()
            .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(label),
                bind_group_layouts: &layouts,
                immediate_size: 0,
            });
        self.device()
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(label),
                layout: Some(&layout),
                module,
                entry_point: Some(&key.entry),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &constants,
                    ..Default::default()
                },
                cache: None,
            })
    }

    /// Binds buffers, all of one group, for any kernel with the same tables for that group.
    pub(crate) fn bind(&self, of: &[&dyn Bindings]) -> BoundGroup {
        let tables: Vec<Table> = of.iter().map(|bindings| bindings.table()).collect();
        let group = tables.first().map_or(0, |table| table.group);
        debug_assert!(tables.iter().all(|table| table.group == group));
        let numbered = || tables.iter().flat_map(Table::numbered);
        let layout: Vec<(u32, Access)> = numbered().map(|(number, _, access)| (number, access)).collect();
        let buffers = of.iter().flat_map(|bindings| bindings.buffers());
        let entries: Vec<_> = numbered()
            .zip(buffers)
            .map(|((binding, ..), buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.buffer.as_entire_binding(),
            })
            .collect();
        BoundGroup {
            group,
            bind_group: self.device().create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &self.group_layout(&layout),
                entries: &entries,
            }),
        }
    }

    /// The layout of a group of storage buffers. Equal ones are interchangeable.
    pub(crate) fn group_layout(&self, bindings: &[(u32, Access)]) -> wgpu::BindGroupLayout {
        let entries: Vec<_> = bindings
            .iter()
            .map(|&(binding, access)| layout_entry(binding, access))
            .collect();
        self.device()
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: None,
                entries: &entries,
            })
    }
}

/// A storage buffer of a compute shader.
fn layout_entry(binding: u32, access: Access) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage {
                read_only: access == Access::Read,
            },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}
