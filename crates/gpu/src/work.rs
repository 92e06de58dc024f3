//! Work for a device: dispatches, one after the other, each of which sees what those before it
//! wrote.

use crate::GpuError;
use crate::bindings::{Bindings, BoundGroup};
use crate::buffer::Buffer;
use crate::device::Gpu;
use crate::kernel::Kernel;
use crate::readback::{AskedReadback, Readback, wait};

/// Dispatches that have been recorded and not yet submitted.
pub struct Work<'a> {
    gpu: &'a Gpu,
    encoder: wgpu::CommandEncoder,
    clock: Option<Clock>,
    labels: Vec<String>,
}

/// Where passes write when they began and ended.
struct Clock {
    queries: wgpu::QuerySet,
    capacity: u32,
}

/// How long one dispatch ran.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// The kernel's name.
    pub label: String,
    /// Seconds by the device's clock.
    pub seconds: f64,
}

/// Most dispatches that are timed in one submission; the others run untimed.
const MAX_TIMED: u32 = 1024;

impl Gpu {
    /// Begins to record work.
    pub fn work(&self) -> Work<'_> {
        Work {
            gpu: self,
            encoder: self.device().create_command_encoder(&Default::default()),
            clock: None,
            labels: Vec::new(),
        }
    }

    /// Begins to record work whose dispatches are timed, if the device can do that.
    pub fn timed_work(&self) -> Work<'_> {
        let clock = self.has_timestamps().then(|| Clock {
            queries: self.device().create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MAX_TIMED,
            }),
            capacity: MAX_TIMED,
        });
        Work { clock, ..self.work() }
    }
}

impl Work<'_> {
    /// The device that it is for.
    pub(crate) fn gpu(&self) -> &Gpu {
        self.gpu
    }

    /// Records a dispatch of so many workgroups with `buffers` at bindings 0, 1, … of group 0.
    pub fn dispatch(&mut self, kernel: &Kernel, buffers: &[&Buffer], groups: [u32; 3]) {
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.buffer.as_entire_binding(),
            })
            .collect();
        let bind_group = self.gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(&kernel.label),
            layout: &kernel.pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        self.dispatch_bound(kernel, &[&BoundGroup { group: 0, bind_group }], groups);
    }

    /// Binds the buffers of a group.
    pub(crate) fn bind(&self, of: &dyn Bindings) -> BoundGroup {
        self.gpu.bind(&[of])
    }

    /// Binds the buffers of a group that has several tables.
    pub(crate) fn bind_all(&self, of: &[&dyn Bindings]) -> BoundGroup {
        self.gpu.bind(of)
    }

    /// The same with buffers that are bound already.
    pub(crate) fn dispatch_bound(&mut self, kernel: &Kernel, bound: &[&BoundGroup], groups: [u32; 3]) {
        if groups.contains(&0) {
            return;
        }
        let index = self.labels.len() as u32;
        let timestamp_writes = self
            .clock
            .as_ref()
            .filter(|clock| index < clock.capacity)
            .map(|clock| wgpu::ComputePassTimestampWrites {
                query_set: &clock.queries,
                beginning_of_pass_write_index: Some(2 * index),
                end_of_pass_write_index: Some(2 * index + 1),
            });
        self.labels.push(kernel.label.clone());
        let mut pass = self.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(&kernel.label),
            timestamp_writes,
        });
        pass.set_pipeline(&kernel.pipeline);
        for bound in bound {
            pass.set_bind_group(bound.group, &bound.bind_group, &[]);
        }
        let [x, y, z] = groups;
        pass.dispatch_workgroups(x, y, z);
    }

    /// Sets the first `bytes` of a buffer to zero.
    pub fn clear(&mut self, buffer: &Buffer, bytes: u64) {
        self.encoder.clear_buffer(&buffer.buffer, 0, Some(bytes));
    }

    /// Hands the work to the device without waiting for it.
    pub fn submit(self) {
        self.gpu.queue().submit([self.encoder.finish()]);
    }

    /// Hands the work to the device, waits for it, and says how long each dispatch ran: nothing
    /// where the device has no clock or the work was not to be timed.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`].
    pub fn finish(self) -> Result<Vec<PassTime>, GpuError> {
        self.begin().wait()
    }

    /// Records a copy of the start of a buffer for the host.
    pub(crate) fn read_back(&mut self, buffer: &Buffer, bytes: u64) -> Readback {
        Readback::record(self.gpu.device(), &mut self.encoder, buffer, bytes)
    }

    /// Hands the work to the device without waiting for it, and keeps what tells how long it ran.
    pub(crate) fn begin(mut self) -> BegunWork {
        let labels = std::mem::take(&mut self.labels);
        let ticks = self.clock.as_ref().map(|clock| {
            let timed = (labels.len() as u32).min(clock.capacity);
            let words = Buffer {
                buffer: self.gpu.device().create_buffer(&wgpu::BufferDescriptor {
                    label: Some("times"),
                    size: u64::from(16 * timed.max(1)),
                    usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                    mapped_at_creation: false,
                }),
            };
            self.encoder
                .resolve_query_set(&clock.queries, 0..2 * timed, &words.buffer, 0);
            Readback::record(
                self.gpu.device(),
                &mut self.encoder,
                &words,
                u64::from(16 * timed),
            )
        });
        let submission = self.gpu.queue().submit([self.encoder.finish()]);
        BegunWork {
            device: self.gpu.device().clone(),
            submission,
            labels,
            ticks: ticks.map(Readback::ask),
            period: f64::from(self.gpu.queue().get_timestamp_period()) * 1e-9,
        }
    }
}

/// Work that the device has been given.
pub(crate) struct BegunWork {
    device: wgpu::Device,
    submission: wgpu::SubmissionIndex,
    labels: Vec<String>,
    /// When each dispatch began and ended, where there is a clock.
    ticks: Option<AskedReadback>,
    /// Seconds of a tick.
    period: f64,
}

impl BegunWork {
    /// Waits for it and all work before it, and says how long each dispatch ran.
    pub fn wait(self) -> Result<Vec<PassTime>, GpuError> {
        wait(&self.device, self.submission)?;
        let Some(ticks) = self.ticks else {
            return Ok(Vec::new());
        };
        let ticks: Vec<[u64; 2]> = ticks.values()?;
        Ok(self
            .labels
            .into_iter()
            .zip(ticks)
            .map(|(label, [start, end])| PassTime {
                label,
                seconds: end.saturating_sub(start) as f64 * self.period,
            })
            .collect())
    }
}
