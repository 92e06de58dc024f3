//! Suffix reuse on the device.

mod frames;
#[cfg(test)]
mod tests;

use crate::bindings::{SceneBindings, SuffixBindings, Table};
use crate::programs::{RESTIR_PREFIX, RESTIR_SUFFIX};
use crate::restir_pt::{Rules, depths_of, disk};
use crate::{BegunFrame, Gpu, GpuError, GpuMethod, GpuScene};
use bytemuck::{Pod, Zeroable};
use frames::SuffixFrames;
use lightshed_integrator::{MAX_PREFIXES, PathMapping, RestirSuffixOptions};
use lightshed_shift::Connectability;

/// Suffix reuse (Kettunen 2023): the estimator of `lightshed_integrator::RestirSuffix` for a camera
/// at rest, with the same prefixes, suffixes, shifts and MIS weights.
///
/// It has its own random numbers, and merges are in `f32`: images agree with the host's in
/// expectation. Integration prefixes borrow from the nearest supporting prefixes, always, by a tree
/// over these that the device builds each frame. Paths have at most 126 edges and confidences are
/// whole numbers up to 127, as for [`GpuRestirPt`](crate::GpuRestirPt).
pub struct GpuRestirSuffix<'a> {
    frames: SuffixFrames<'a>,
    /// Of every frame, with what the frame itself says left out.
    asked: Frame,
    temporal: bool,
    rounds: u32,
}

/// What the programs bind.
pub(crate) const TABLES: [Table; 2] = [SceneBindings::TABLE, SuffixBindings::TABLE];

/// What the programs know of a frame.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Frame {
    rules: Rules,
    ends: Rules,
    number: u32,
    candidates: u32,
    round: u32,
    least_length: u32,
    prefixes: u32,
    camera_rays: u32,
    canonical: u32,
    borrowed: u32,
    direct_samples: u32,
    neighbours: u32,
    radius: f32,
    confidence_cap: f32,
    prefix_cap: f32,
    within: f32,
    normal_scale: f32,
    beyond: f32,
    first: u32,
    count: u32,
    padding: [u32; 2],
}

/// Most suffixes that a prefix borrows, as the shader module `nearest_sites` has it.
const MOST_BORROWED: u32 = 8;
/// Sites that are none lie so many times the scene's size from the camera.
const BEYOND: f32 = 2.0;

impl<'a> GpuRestirSuffix<'a> {
    /// Bytes on the device for each pixel: two supporting prefixes and two reservoirs of suffixes,
    /// what is seen in this frame and in the one before, the image, and a site's box. The tree over
    /// sites and the integration prefixes in memory come on top.
    pub const BYTES_PER_PIXEL: u64 = frames::BYTES_PER_PIXEL;

    /// With [`GpuRestirSuffix::real_time`] by the hybrid shift.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn new(gpu: &'a Gpu, scene: &'a GpuScene) -> Result<Self, GpuError> {
        Self::with_options(gpu, scene, Self::real_time(PathMapping::Hybrid))
    }

    /// [`RestirSuffixOptions::real_time`] as the device has them: with the nearest supporting
    /// prefixes, not with near ones.
    pub fn real_time(mapping: PathMapping) -> RestirSuffixOptions {
        RestirSuffixOptions {
            search_leaves: u32::MAX,
            ..RestirSuffixOptions::real_time(mapping)
        }
    }

    /// With other options: a supporting prefix for each pixel, a search without end, at most 8
    /// borrowed suffixes, and at most 8 neighbours in a disk. Numbers are independent, and paths
    /// find visible emission, whatever the options say.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for others; [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn with_options(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        options: RestirSuffixOptions,
    ) -> Result<Self, GpuError> {
        Self::of_programs(gpu, scene, options, [RESTIR_PREFIX, RESTIR_SUFFIX])
    }

    fn of_programs(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        options: RestirSuffixOptions,
        programs: [&str; 2],
    ) -> Result<Self, GpuError> {
        scene.refuse_media()?;
        scene.refuse_part_of_a_sky("restir-suffix")?;
        scene.refuse_deltas("restir-suffix")?;
        scene.refuse_dielectrics("restir-suffix")?;
        check(&options)?;
        let suffixes = &options.suffixes;
        let settings = |error: &dyn std::fmt::Display| GpuError::Settings(error.to_string().into());
        let rules = suffixes
            .thresholds(scene.extent(), scene.is_diffuse())
            .map_err(|error| settings(&error))?;
        // Unlike paths, prefixes that could not be reconnected at the second vertex continue to a
        // vertex where they can.
        let ends = Connectability::hybrid(suffixes.min_roughness, rules.min_distance())
            .map_err(|error| settings(&error))?;
        let (neighbours, radius) = disk(suffixes.neighbourhood)?;
        let asked = Frame {
            rules: rules.into(),
            ends: ends.into(),
            number: 0,
            candidates: suffixes.candidates,
            round: 0,
            least_length: if suffixes.direct_samples > 0 { 3 } else { 0 },
            prefixes: options.prefixes,
            camera_rays: options.camera_rays,
            canonical: options.canonical,
            borrowed: options.borrowed,
            direct_samples: suffixes.direct_samples,
            neighbours,
            radius,
            confidence_cap: suffixes.temporal_cap.unwrap_or(f32::MAX),
            prefix_cap: options.prefix_cap,
            within: options.search_radius * scene.extent(),
            normal_scale: options.normal_scale * scene.extent(),
            beyond: BEYOND * scene.extent(),
            first: 0,
            count: 0,
            padding: [0; 2],
        };
        Ok(Self {
            frames: SuffixFrames::new(gpu, scene, programs, options.prefixes, depths_of(scene))?,
            asked,
            temporal: suffixes.temporal_cap.is_some(),
            rounds: if neighbours > 0 { suffixes.rounds } else { 0 },
        })
    }

    /// Bytes on the device, the scene's apart.
    pub fn bytes(&self) -> u64 {
        self.frames.bytes()
    }
}

/// What of the host's options the device knows, neighbours apart.
pub(crate) fn check(options: &RestirSuffixOptions) -> Result<(), GpuError> {
    let refused = |why: &'static str| Err(GpuError::Settings(why.into()));
    let suffixes = &options.suffixes;
    if suffixes.pairs.is_some() || suffixes.footprint.is_some() || suffixes.mutations > 0 {
        return refused("the device knows neither pairs, nor footprints, nor steps of Markov chains");
    }
    if suffixes.world.is_some() {
        return refused("suffixes are not reused from cells of space");
    }
    if options.spacing != 1 {
        return refused("on the device every pixel has a supporting prefix: spacing has to be 1");
    }
    if options.search_leaves != u32::MAX {
        return refused("the device finds the nearest supporting prefixes: its search takes all leaves");
    }
    if options.borrowed > MOST_BORROWED {
        return refused("on the device a prefix borrows at most 8 suffixes");
    }
    if !(1..=MAX_PREFIXES).contains(&options.prefixes) {
        return refused("a pixel has 1 to 1024 prefixes");
    }
    let of_prefixes = 1..=options.prefixes;
    if !of_prefixes.contains(&options.canonical) || !of_prefixes.contains(&options.camera_rays) {
        return refused(
            "camera rays and canonical suffixes are as many as prefixes at most, and one at least",
        );
    }
    let shares = [options.search_radius, options.normal_scale];
    if !(options.prefix_cap >= 1.0) || shares.iter().any(|share| !(*share >= 0.0 && share.is_finite())) {
        return refused("the cap of prefixes is at least 1, and the search has finite lengths");
    }
    Ok(())
}

impl GpuMethod for GpuRestirSuffix<'_> {
    fn size(&self) -> [u32; 2] {
        self.frames.size()
    }

    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        let asked = Frame {
            number: frame,
            ..self.asked
        };
        let temporal = self.temporal && frame > 0;
        self.frames.begin(asked, seed, temporal, self.rounds)
    }
}
