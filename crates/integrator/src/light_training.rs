//! Paths that train a light cache.

use crate::light_choosing::LightChoosing;
use crate::light_selection::LightSelection;
use crate::path::PathTracer;
use crate::path::observer::{ObservedPath, PathObserver};
use lightshed_film::{MAX_BATCH, PixelEstimator, SampleId};
use lightshed_guiding::{CacheMoments, CacheUse, LightRecord};
use lightshed_lights::LightError;
use lightshed_sampling::parallel;
use lightshed_scene::{Rgb, Scene, luminance};
use std::sync::{Mutex, PoisonError};

/// Seed of the paths. No image has it unless a user sets it.
const SEED: u64 = 0x766c_6320_7472_6169;

/// Longest paths that train, in edges: farther points are lit by what was learnt from nearer ones.
const MAX_DEPTH: u32 = 6;

/// Records which emitters were sampled and the result.
pub(crate) struct LightRecorder<'a> {
    selection: &'a LightSelection<'a>,
    records: Mutex<Vec<LightRecord>>,
}

impl<'a> LightRecorder<'a> {
    /// Of paths whose emitters `selection` chooses.
    pub fn new(selection: &'a LightSelection<'a>) -> Self {
        Self {
            selection,
            records: Mutex::default(),
        }
    }

    /// What was kept, in the order in which it was told.
    pub fn into_records(self) -> Vec<LightRecord> {
        self.records.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl PathObserver for LightRecorder<'_> {
    fn observe(&self, path: &ObservedPath<'_>) {
        let mut records = self.records.lock().unwrap_or_else(PoisonError::into_inner);
        for (index, vertex) in path.vertices.iter().enumerate() {
            let Some(light) = vertex.emitter_index else {
                continue;
            };
            let pmf = self.selection.probability(&vertex.lit, light);
            // Emitters at infinity have none.
            if pmf > 0.0 {
                let found = path.from_sampled_emitter(index);
                records.push(LightRecord {
                    at: vertex.lit,
                    light,
                    pmf,
                    contribution: luminance(found.unwrap_or(Rgb::ZERO)) * pmf,
                    visible: found.is_some(),
                });
            }
        }
    }
}

/// One in this number of pixels has a path in each pass.
const PASSES: [usize; 10] = [4, 4, 2, 2, 1, 1, 1, 1, 1, 1];
/// The pass after which a useless cache is dropped.
const EARLIEST_END: usize = 6;
/// The first pass whose paths judge the cache; before, it has too little knowledge.
const FIRST_JUDGED: usize = 4;
/// Most paths of a pass.
const MAX_PATHS: usize = 1 << 17;

impl<'a> LightSelection<'a> {
    /// A selection among the scene's emitters that has learnt visibility from paths, if it can
    /// learn; others equal those of [`new`](Self::new). The paths are those of the scene's own
    /// image and length. If the cache turns out to be useless, it is left out: its light BVH then
    /// selects emitters, with its learnt factors or without. The same for any number of threads.
    ///
    /// # Errors
    ///
    /// See [`new`](Self::new).
    pub fn trained(scene: &'a Scene, choosing: LightChoosing) -> Result<Self, LightError> {
        let mut selection = Self::new(scene, choosing)?;
        if choosing.learns() {
            train(scene, &mut selection);
        }
        Ok(selection)
    }
}

/// Traces paths through the scene's image, in passes; each pass learns from the ones before. Paths
/// that the cache has not learnt from judge its value.
fn train(scene: &Scene, selection: &mut LightSelection<'_>) {
    let settings = scene.settings();
    let depth = settings.max_depth.map_or(MAX_DEPTH, |depth| depth.min(MAX_DEPTH));
    let pixels = settings.width as usize * settings.height as usize;
    let mut moments = CacheMoments::default();
    for (pass, every) in PASSES.into_iter().enumerate() {
        let every = every * pixels.div_ceil(MAX_PATHS);
        let shown = &*selection;
        let rows: Vec<Vec<LightRecord>> = parallel::map(0..settings.height, |_, y| {
            let is_wanted = |x: &u32| (*x as usize + 3 * y as usize) % every == pass % every;
            let index = pass as u32;
            let ids = (0..settings.width).filter(is_wanted);
            let ids: Vec<SampleId> = ids.map(|x| SampleId { x, y, index }).collect();
            traced(scene, shown, depth, &ids)
        });
        let records = rows.concat();
        let Some(cache) = selection.cache_mut() else {
            return;
        };
        if pass >= FIRST_JUDGED {
            moments = moments.plus(&cache.moments(&records));
        }
        cache.update(&records);
        if pass >= EARLIEST_END && moments.use_of() == CacheUse::Nothing {
            break;
        }
    }
    selection.keep(moments.use_of());
}

/// What some paths asked, in their order.
fn traced(scene: &Scene, selection: &LightSelection<'_>, depth: u32, ids: &[SampleId]) -> Vec<LightRecord> {
    let recorder = LightRecorder::new(selection);
    let tracer = PathTracer::new(scene, selection)
        .with_depths(Some(depth), scene.settings().roulette_depth)
        .with_observer(&recorder);
    let mut values = [Rgb::ZERO; MAX_BATCH];
    for ids in ids.chunks(MAX_BATCH) {
        tracer.sample_many(ids, SEED, &mut values[..ids.len()]);
    }
    recorder.into_records()
}
