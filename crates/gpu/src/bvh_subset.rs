//! Trees over boxes that are built on the device by a stochastic subset.

use crate::bindings::{BvhSourceBindings, BvhSubsetBindings, Table};
use crate::buffer::Buffer;
use crate::bvh::{BvhBuilder, GROUP, GpuBvh, Parts, Settings};
use crate::device::Gpu;
use crate::kernel::Kernel;
use crate::programs::BVH_SUBSET;
use crate::radix_sort::{RadixSort, SortBuffers, groups};
use crate::{GpuError, Work};
use bytemuck::{Pod, Zeroable};
use lightshed_bvh::{
    Insertion, Interior, Node, Sampling, SubsetOptions, WeightHistogram, stratum_beside_uniform,
};

/// What the program binds.
pub(crate) const TABLES: [Table; 2] = [BvhSourceBindings::TABLE, BvhSubsetBindings::TABLE];

/// Boxes whose weights one thread sums.
const CHUNK: u32 = 8192;
const BINS: usize = 128;

const _: () = assert!(CHUNK as usize == Sampling::CHUNK);

/// Builds binary trees over boxes by a stochastic subset (Dittebrandt 2025 ch. 8): the trees of
/// [`Method::Subset`](lightshed_bvh::Method::Subset) with [`Interior::Curve`] and
/// [`Insertion::Window`], node for node and bit for bit on a device of IEEE arithmetic.
///
/// Two things are the host's alone. A tree of more levels than
/// [`MAX_DEPTH`](lightshed_bvh::MAX_DEPTH) is built in another way there; here it stays. And where
/// squared diagonals or areas underflow, a device may take small numbers for zero, and draw or
/// insert other boxes.
pub struct BvhSubsetBuilder {
    trees: BvhBuilder,
    sort: RadixSort,
    weigh: Kernel,
    choose_clamp: Kernel,
    sum_chunks: Kernel,
    sum_all: Kernel,
    choose: Kernel,
    count_drawn: Kernel,
    gather: Kernel,
    find_clusters: Kernel,
    number_clusters: Kernel,
    link_parents: Kernel,
    insert: Kernel,
    take_clusters: Kernel,
    place_upper: Kernel,
}

/// Memory on the device for builds of a [`GpuBvh`] by a subset of its boxes.
pub struct GpuBvhSubset {
    count: u32,
    /// The most boxes in the subset.
    strata: u32,
    chunks: u32,
    drawing: Buffer,
    drawn: Buffer,
    subset_settings: Buffer,
    clustered_settings: Buffer,
    weights: Buffer,
    bins: Buffer,
    sums: Buffer,
    picked: Buffer,
    places: Buffer,
    codes: Buffer,
    indices: Buffer,
    nodes: Buffer,
    order: Buffer,
    parents: Buffer,
    clusters: Buffer,
    clustered: Buffer,
    sort: SortBuffers,
}

/// Doubles are their bits.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Drawing {
    strata: u32,
    cluster: u32,
    window: u32,
    chunks: u32,
    stratum: f64,
    all_uniform: f64,
    uniform: f64,
    by_weight: f64,
    offset: f64,
    padding: f64,
    ends: [f64; BINS],
}

/// What was drawn.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Drawn {
    clamp: f64,
    uniform: f64,
    by_weight: f64,
    clusters: u32,
    padding: u32,
}

// As in the shader; a test compares them.
const _: () = assert!(size_of::<Drawing>() == 1088 && size_of::<Drawn>() == 32);

impl GpuBvhSubset {
    /// Memory for trees over as many boxes as `tree` has room for.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for options that are out of range, or of another interior builder or
    /// insertion than [`BvhSubsetBuilder`] has; [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, tree: &GpuBvh, options: &SubsetOptions) -> Result<Self, GpuError> {
        options
            .validate()
            .map_err(|error| GpuError::Settings(error.to_string().into()))?;
        if options.interior != Interior::Curve || options.insertion != Insertion::Window {
            let reason = "a device builds subsets along the curve, and inserts by windows";
            return Err(GpuError::Settings(reason.into()));
        }
        let count = tree.boxes();
        let sampling = options.sampling();
        let strata = sampling.strata(count as usize);
        let chunks = count.div_ceil(CHUNK);
        let drawing = Drawing {
            strata: strata as u32,
            cluster: options.cluster,
            window: options.window.min(count),
            chunks,
            stratum: stratum_beside_uniform(1.0 / strata, sampling.uniform, count as usize),
            all_uniform: strata / f64::from(count),
            uniform: sampling.uniform * strata / f64::from(count),
            by_weight: (1.0 - sampling.uniform) * strata,
            offset: sampling.offset,
            padding: 0.0,
            ends: WeightHistogram::ends(),
        };
        let clustered_settings = Settings {
            clustered: 1,
            ..Settings::of(count)
        };
        let (boxes, drawn) = (u64::from(count), u64::from(drawing.strata));
        let node = size_of::<Node>() as u64;
        let cluster_bits = u32::BITS - drawing.strata.leading_zeros();
        let zeros = |label: &str, bytes| gpu.zeros(&format!("bvh subset: {label}"), bytes);
        Ok(Self {
            count,
            strata: drawing.strata,
            chunks,
            drawing: gpu.buffer("bvh subset: drawing", &[drawing])?,
            drawn: zeros("drawn", size_of::<Drawn>() as u64)?,
            subset_settings: zeros("settings", size_of::<Settings>() as u64)?,
            clustered_settings: gpu.buffer("bvh subset: clusters' settings", &[clustered_settings])?,
            weights: zeros("weights", 4 * boxes)?,
            bins: zeros("bins", 4 * BINS as u64)?,
            sums: zeros("sums", 8 * u64::from(chunks))?,
            picked: zeros("picked", 4 * boxes + 8 * u64::from(chunks))?,
            places: zeros("places", 4 * drawn)?,
            codes: zeros("codes", 8 * drawn)?,
            indices: zeros("indices", 4 * drawn)?,
            nodes: zeros("nodes", node * (2 * drawn - 1))?,
            order: zeros("order", 4 * drawn)?,
            parents: zeros("parents", 4 * (2 * drawn - 1))?,
            clusters: zeros("clusters", 4 * (4 * drawn + 1))?,
            clustered: zeros("clustered", 4 * (boxes + drawn))?,
            sort: SortBuffers::new(gpu, count, cluster_bits)?,
        })
    }

    /// How many boxes the subset of the last build has, and how many clusters.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`].
    pub fn drawn(&self, gpu: &Gpu) -> Result<[u32; 2], GpuError> {
        let settings: Vec<Settings> = gpu.read(&self.subset_settings, 1)?;
        let drawn: Vec<Drawn> = gpu.read(&self.drawn, 1)?;
        Ok([
            settings.first().map_or(0, |settings| settings.count),
            drawn.first().map_or(0, |drawn| drawn.clusters),
        ])
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let own = [
            &self.drawing,
            &self.drawn,
            &self.subset_settings,
            &self.clustered_settings,
            &self.weights,
            &self.bins,
            &self.sums,
            &self.picked,
            &self.places,
            &self.codes,
            &self.indices,
            &self.nodes,
            &self.order,
            &self.parents,
            &self.clusters,
            &self.clustered,
        ];
        own.map(Buffer::bytes).iter().sum::<u64>() + self.sort.bytes()
    }

    fn bindings<'a>(&'a self, tree: &'a GpuBvh) -> BvhSubsetBindings<'a> {
        BvhSubsetBindings {
            drawing: &self.drawing,
            drawn: &self.drawn,
            subset_settings: &self.subset_settings,
            weights: &self.weights,
            bins: &self.bins,
            sums: &self.sums,
            picked: &self.picked,
            places: &self.places,
            subset_codes: &self.codes,
            subset_indices: &self.indices,
            subset_nodes: &self.nodes,
            subset_order: &self.order,
            subset_parents: &self.parents,
            clusters: &self.clusters,
            keys: &self.sort.codes,
            key_places: &self.sort.indices,
            cluster_codes: &tree.sort.spare_codes,
            cluster_boxes: &tree.sort.spare_indices,
            clustered: &self.clustered,
            tree_nodes: &tree.nodes,
        }
    }
}

impl BvhSubsetBuilder {
    /// The kernels.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`] if the device does not accept them.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Self::of_program(gpu, BVH_SUBSET)
    }

    /// The same out of this text, in which a test plants faults.
    pub(crate) fn of_program(gpu: &Gpu, program: &str) -> Result<Self, GpuError> {
        let kernel = |entry: &str| {
            let label = format!("bvh subset: {}", entry.replace('_', " "));
            gpu.kernel_of_tables(&label, program, entry, &TABLES, &[])
        };
        Ok(Self {
            trees: BvhBuilder::new(gpu)?,
            sort: RadixSort::new(gpu)?,
            weigh: kernel("weigh")?,
            choose_clamp: kernel("choose_clamp")?,
            sum_chunks: kernel("sum_chunks")?,
            sum_all: kernel("sum_all")?,
            choose: kernel("choose")?,
            count_drawn: kernel("count_drawn")?,
            gather: kernel("gather")?,
            find_clusters: kernel("find_clusters")?,
            number_clusters: kernel("number_clusters")?,
            link_parents: kernel("link_parents")?,
            insert: kernel("insert")?,
            take_clusters: kernel("take_clusters")?,
            place_upper: kernel("place_upper")?,
        })
    }

    /// Records the build of `tree` over the [`Bounds`](lightshed_bvh::Bounds) in `boxes`, as many
    /// as it has room for, in the memory of `subset`, which was made for it. The same boxes give
    /// the same tree, whatever these held before. [`GpuBvh::wrong`] says whether they are boxes.
    /// The tree may be refitted by a [`BvhBuilder`].
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] if `subset` was made for another number of boxes.
    pub fn build(
        &self,
        work: &mut Work,
        boxes: &Buffer,
        tree: &GpuBvh,
        subset: &GpuBvhSubset,
    ) -> Result<(), GpuError> {
        if tree.boxes() != subset.count {
            return Err(GpuError::Settings(
                "a subset's memory is for one number of boxes".into(),
            ));
        }
        self.trees.sort_along_curve(work, boxes, tree);
        work.clear(&subset.bins, subset.bins.bytes());
        let whole = Parts::of(boxes, tree);
        let source = work.bind(&whole.source);
        let own = work.bind(&subset.bindings(tree));
        let bound = [&source, &own];
        let of_boxes = groups(subset.count.div_ceil(GROUP));
        let of_chunks = groups(subset.chunks);
        let of_leaves = groups(subset.strata.div_ceil(GROUP));
        let of_nodes = groups((2 * subset.strata - 1).div_ceil(GROUP));
        let one = [1, 1, 1];
        work.dispatch_bound(&self.weigh, &bound, of_boxes);
        work.dispatch_bound(&self.choose_clamp, &bound, one);
        work.dispatch_bound(&self.sum_chunks, &bound, of_chunks);
        work.dispatch_bound(&self.sum_all, &bound, one);
        work.dispatch_bound(&self.choose, &bound, of_chunks);
        work.dispatch_bound(&self.count_drawn, &bound, one);
        work.dispatch_bound(&self.gather, &bound, of_boxes);

        let of_subset = Parts {
            source: BvhSourceBindings {
                codes: &subset.codes,
                indices: &subset.indices,
                ..whole.source
            },
            settings: &subset.subset_settings,
            nodes: &subset.nodes,
            order: &subset.order,
            ..whole
        };
        self.trees.shape(work, &of_subset, subset.strata);
        self.trees.fit(work, &of_subset, subset.strata);
        work.dispatch_bound(&self.find_clusters, &bound, of_leaves);
        work.dispatch_bound(&self.number_clusters, &bound, one);
        work.dispatch_bound(&self.link_parents, &bound, of_nodes);

        work.dispatch_bound(&self.insert, &bound, of_boxes);
        self.sort.sort(work, &subset.sort);
        work.dispatch_bound(&self.take_clusters, &bound, of_boxes);
        work.dispatch_bound(&self.place_upper, &bound, of_nodes);
        let of_clusters = Parts {
            source: BvhSourceBindings {
                codes: &tree.sort.spare_codes,
                indices: &tree.sort.spare_indices,
                ..whole.source
            },
            settings: &subset.clustered_settings,
            grouping: &subset.clustered,
            ..whole
        };
        self.trees.shape(work, &of_clusters, subset.count);
        self.trees.fit(work, &whole, subset.count);
        Ok(())
    }
}
