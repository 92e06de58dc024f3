//! Trees of a guide that learn on the device.

use crate::bindings::{QuadtreeLearnBindings, Table};
use crate::buffer::Buffer;
use crate::device::Gpu;
use crate::kernel::Kernel;
use crate::programs::QUADTREE_LEARN;
use crate::radix_sort::{RadixSort, SortBuffers, groups};
use crate::{GpuError, Work};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::guiding::{DirectionalModel, QuadtreeGoal, QuadtreeModel, TrainingSample};
use lightshed_scene::glam::Vec3;
use lightshed_spatial::Bounds;
use std::f64::consts::FRAC_1_PI;

/// What the program binds.
pub(crate) const TABLES: [Table; 1] = [QuadtreeLearnBindings::TABLE];

/// Threads of a workgroup.
const GROUP: u32 = 256;
/// About as many steps a thread takes in a dispatch that moves leaves: devices interrupt long ones,
/// and lavapipe ends loops after 65,535 steps in all.
const STEPS: u32 = 1 << 15;
/// Bytes of a prepared sample, and of a node while a tree learns.
const ROW_BYTES: u64 = 16;

/// A region whose tree is to learn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadtreeRegion {
    /// Its box.
    pub bounds: Bounds,
    /// Number of its record.
    pub record: u32,
    /// Number of its samples.
    pub samples: u32,
}

/// Samples on the device, and all that trees need to learn from them.
pub struct QuadtreeTraining {
    settings: Buffer,
    regions: Buffer,
    training: Buffer,
    /// Samples in the order in which trees learn from them.
    pub(crate) rows: Buffer,
    nodes: Buffer,
    totals: Buffer,
    /// How many leaves each dispatch may move.
    moves: Vec<Buffer>,
    sort: SortBuffers,
    samples: u32,
    region_count: u32,
    /// Words of the records up to the last that learns.
    record_words: u64,
}

#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct Learning {
    samples: u32,
    regions: u32,
    tree_words: u32,
    stride: u32,
    least_samples: u32,
    eagerness: f32,
    by_variance: u32,
    of_scattering: f32,
    of_tree: f32,
    padding: [u32; 3],
    prior: f64,
    even_scattering: f64,
    even_tree: f64,
    more_padding: f64,
}

#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct LearningRegion {
    pivot: Vec3,
    side: f32,
    first: u32,
    samples: u32,
    record: u32,
    padding: u32,
}

// As in the shader; a test compares them.
const _: () = assert!(size_of::<Learning>() == 80 && size_of::<LearningRegion>() == 32);
const _: () = assert!(size_of::<TrainingSample>() == 32);

impl QuadtreeTraining {
    /// Copies the samples of an update: those of the first region, then those of the second, and so
    /// on.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] if the regions have more or fewer samples together;
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        model: &QuadtreeModel,
        regions: &[QuadtreeRegion],
        samples: &[TrainingSample],
    ) -> Result<Self, GpuError> {
        let mut first = 0u64;
        let mut rows = Vec::with_capacity(regions.len());
        for region in regions {
            let Bounds { min, max } = region.bounds;
            rows.push(LearningRegion {
                pivot: 0.5 * (min + max),
                side: (max - min).max_element(),
                first: first as u32,
                samples: region.samples,
                record: region.record,
                padding: 0,
            });
            first += u64::from(region.samples);
        }
        if first != samples.len() as u64 || first > u64::from(u32::MAX) {
            return Err(GpuError::Settings(
                "regions have other samples than there are".into(),
            ));
        }
        let options = model.options();
        let tree_words = options.bits / 32;
        let leaves = 24 * tree_words + 1;
        let share = match options.goal {
            QuadtreeGoal::EvenLoad => None,
            QuadtreeGoal::LeastVariance { share } => Some(share),
        };
        let of_scattering = share.map_or(0.0, |share| 1.0 - share);
        let of_tree = share.map_or(0.0, |share| share / leaves as f32);
        let learning = Learning {
            samples: samples.len() as u32,
            regions: regions.len() as u32,
            tree_words,
            stride: model.stride() as u32,
            least_samples: options.least_samples,
            eagerness: options.eagerness,
            by_variance: u32::from(share.is_some()),
            of_scattering,
            of_tree,
            prior: f64::from(options.prior_samples),
            even_scattering: f64::from(of_scattering) * 0.25 * FRAC_1_PI,
            even_tree: f64::from(of_tree) * 0.25 * FRAC_1_PI,
            ..Learning::default()
        };
        let last = regions.iter().map(|region| region.record).max().unwrap_or(0);
        let most = regions.iter().map(|region| region.samples).max().unwrap_or(0);
        let at_once = (STEPS / (5 * options.bits + most)).max(1);
        let mut moves = Vec::new();
        let mut left = options.migrations;
        while left > 0 {
            moves.push(gpu.buffer("quadtrees: moves", &[left.min(at_once)])?);
            left -= left.min(at_once);
        }
        let nodes = ROW_BYTES * u64::from(options.bits) * regions.len() as u64;
        Ok(Self {
            settings: gpu.buffer("quadtrees: learning", &[learning])?,
            regions: gpu.buffer("quadtrees: regions", &rows)?,
            training: gpu.buffer("quadtrees: samples", samples)?,
            rows: gpu.zeros("quadtrees: rows", ROW_BYTES * samples.len() as u64)?,
            nodes: gpu.zeros("quadtrees: nodes", nodes)?,
            totals: gpu.zeros("quadtrees: totals", 8 * regions.len() as u64)?,
            moves,
            sort: SortBuffers::new(gpu, samples.len() as u32, u64::BITS)?,
            samples: samples.len() as u32,
            region_count: regions.len() as u32,
            record_words: u64::from(learning.stride) * (u64::from(last) + 1),
        })
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let own = [
            &self.settings,
            &self.regions,
            &self.training,
            &self.rows,
            &self.nodes,
            &self.totals,
        ];
        let own = own.into_iter().chain(&self.moves).map(Buffer::bytes);
        own.sum::<u64>() + self.sort.bytes()
    }
}

/// Lets the quadtrees of regions learn on the device: [`QuadtreeModel`]'s `learn`, with its bits on
/// a device of IEEE arithmetic.
pub struct QuadtreeLearner {
    learn_parallax: Kernel,
    encode: Kernel,
    order_equal: Kernel,
    prepare: Kernel,
    load_nodes: Kernel,
    move_leaves: Kernel,
    sort: RadixSort,
}

impl QuadtreeLearner {
    /// The kernels.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`] if the device does not accept them.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Self::of_program(gpu, QUADTREE_LEARN)
    }

    /// The same out of this text, in which a test plants faults.
    pub(crate) fn of_program(gpu: &Gpu, program: &str) -> Result<Self, GpuError> {
        let kernel = |entry: &str| {
            let label = format!("quadtrees: {}", entry.replace('_', " "));
            gpu.kernel_of_tables(&label, program, entry, &TABLES, &[])
        };
        Ok(Self {
            learn_parallax: kernel("learn_parallax")?,
            encode: kernel("encode")?,
            order_equal: kernel("order_equal")?,
            prepare: kernel("prepare")?,
            load_nodes: kernel("load_nodes")?,
            move_leaves: kernel("move_leaves")?,
            sort: RadixSort::new(gpu)?,
        })
    }

    /// Records that the records of the regions, one after the other in `records`, learn from their
    /// samples. Those of other regions stay.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] if a region's record is not in `records`.
    pub fn learn(
        &self,
        work: &mut Work,
        training: &QuadtreeTraining,
        records: &Buffer,
    ) -> Result<(), GpuError> {
        if training.samples == 0 {
            return Ok(());
        }
        if records.bytes() < 4 * training.record_words {
            return Err(GpuError::Settings("there are regions without a record".into()));
        }
        let bindings = QuadtreeLearnBindings {
            learning: &training.settings,
            learning_regions: &training.regions,
            training: &training.training,
            codes: &training.sort.codes,
            indices: &training.sort.indices,
            learning_samples: &training.rows,
            learning_nodes: &training.nodes,
            records,
            totals: &training.totals,
            moves: &training.settings,
        };
        let bound = work.bind(&bindings);
        let of_regions = groups(training.region_count.div_ceil(GROUP));
        let of_samples = groups(training.samples.div_ceil(GROUP));
        work.dispatch_bound(&self.learn_parallax, &[&bound], of_regions);
        work.dispatch_bound(&self.encode, &[&bound], of_samples);
        self.sort.sort(work, &training.sort);
        work.dispatch_bound(&self.order_equal, &[&bound], of_samples);
        work.dispatch_bound(&self.prepare, &[&bound], of_samples);
        work.dispatch_bound(&self.load_nodes, &[&bound], of_regions);
        for moves in &training.moves {
            let bound = work.bind(&QuadtreeLearnBindings { moves, ..bindings });
            work.dispatch_bound(&self.move_leaves, &[&bound], of_regions);
        }
        Ok(())
    }
}
