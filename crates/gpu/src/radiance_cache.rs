//! A cache of radiance on the device.

use crate::bindings::RadianceCacheBindings;
use crate::{Buffer, Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::CacheEnding;
use lightshed_integrator::caching::{CachedRadiance, Termination};
use lightshed_integrator::spatial::LevelGrid;
use lightshed_scene::glam::Vec3;

/// The struct of the shader module `hash_grid`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct LevelGridRow {
    per_length: [u32; 2],
    cell: f32,
    per_distance: f32,
    faces: u32,
    last_line: u32,
    padding: [u32; 2],
}

impl LevelGridRow {
    /// Of a grid with a table of so many slots.
    pub fn new(grid: &LevelGrid, slots: usize) -> Self {
        let options = grid.options();
        let per_length = (1.0 / f64::from(options.cell)).to_bits();
        Self {
            per_length: [per_length as u32, (per_length >> 32) as u32],
            cell: options.cell,
            per_distance: options.growth / options.cell,
            faces: u32::from(options.faces),
            last_line: (slots / 8).max(1) as u32 - 1,
            padding: [0; 2],
        }
    }
}

/// The struct of the shader module `path_budget`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TerminationRow {
    rule: u32,
    depth: u32,
    number: f32,
    margin: f32,
    most_deferred: f32,
    padding: [u32; 3],
}

impl TryFrom<&Termination> for TerminationRow {
    type Error = GpuError;

    fn try_from(rule: &Termination) -> Result<Self, GpuError> {
        let row = |rule, number| Self {
            rule,
            number,
            ..Self::default()
        };
        Ok(match *rule {
            Termination::Fixed { depth } => Self { depth, ..row(0, 0.0) },
            Termination::Spread { share } => row(1, share),
            Termination::Variance { threshold, relative } => row(2 + u32::from(relative), threshold),
            Termination::Mse { target, margin } => Self {
                margin,
                most_deferred: 0.9 * margin,
                ..row(4, target)
            },
            _ => {
                return Err(GpuError::Settings(
                    "the device does not know the cache's rule".into(),
                ));
            }
        })
    }
}

/// The struct of the shader module `memory::radiance_cache`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct SettingsRow {
    grid: LevelGridRow,
    rule: TerminationRow,
    eye: Vec3,
    survival: f32,
    jitter: u32,
    padding: [u32; 3],
}

// As in the shaders; held to it by a test.
const _: () = assert!(size_of::<SettingsRow>() == 96);

/// A cache in buffers, and how paths end in it.
pub(crate) struct CacheMemory {
    settings: Buffer,
    words: Buffer,
    records: Buffer,
    is_used: bool,
}

impl CacheMemory {
    /// What a cache answers now.
    pub fn new(gpu: &Gpu, ending: &CacheEnding<'_>) -> Result<Self, GpuError> {
        let (words, records) = answers(ending);
        let settings = SettingsRow {
            grid: LevelGridRow::new(ending.cache.cells(), words.len()),
            rule: TerminationRow::try_from(&ending.rule)?,
            eye: ending.eye,
            survival: ending.survival,
            jitter: u32::from(ending.jitter),
            padding: [0; 3],
        };
        Ok(Self {
            settings: gpu.buffer("cache settings", &[settings])?,
            words: gpu.buffer("cell words", &words)?,
            records: gpu.buffer("cache records", &records)?,
            is_used: true,
        })
    }

    /// What a cache with as many slots answers now, in place of what this one did.
    pub fn write(&self, gpu: &Gpu, ending: &CacheEnding<'_>) {
        let (words, records) = answers(ending);
        gpu.write(&self.words, &words);
        gpu.write(&self.records, &records);
    }

    /// Memory in place of a cache, for paths that end in none.
    pub fn none(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            settings: gpu.buffer("cache settings", &[SettingsRow::default()])?,
            words: gpu.buffer("cell words", &[0u64])?,
            records: gpu.buffer("cache records", &[[0.0f32; 16]])?,
            is_used: false,
        })
    }

    /// Whether paths end in it.
    pub fn is_used(&self) -> bool {
        self.is_used
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let Self {
            settings,
            words,
            records,
            is_used: _,
        } = self;
        [settings, words, records].map(Buffer::bytes).iter().sum()
    }

    pub fn bindings(&self) -> RadianceCacheBindings<'_> {
        RadianceCacheBindings {
            cache_settings: &self.settings,
            cell_words: &self.words,
            cache_records: &self.records,
        }
    }
}

/// The words of a cache's slots, and its records in the layout of shaders.
fn answers(ending: &CacheEnding<'_>) -> (Vec<u64>, Vec<[f32; 16]>) {
    let records = ending.cache.records().iter().map(record_row);
    (ending.cache.words().collect(), records.collect())
}

/// A record in the layout of shaders.
fn record_row(record: &CachedRadiance) -> [f32; 16] {
    let CachedRadiance {
        radiance,
        deviation,
        bias,
        deferred_bias,
        interpolation,
        passes,
    } = record;
    let vectors = [radiance, deviation, bias, deferred_bias, interpolation].map(|v| v.to_array());
    let mut row = [*passes; 16];
    row[..15].copy_from_slice(vectors.as_flattened());
    row
}
