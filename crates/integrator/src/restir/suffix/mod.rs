//! Suffix reuse (Kettunen 2023 §§6–7): the parts of paths behind short prefixes are resampled,
//! and a final gather integrates over the prefixes.

mod emission;
mod gather;
mod options;
mod supports;
#[cfg(test)]
mod tests;

pub use options::{MAX_BORROWED, MAX_PREFIXES, MAX_SPACING, RestirSuffixError, RestirSuffixOptions};

use super::guiding::PathGuiding;
use super::pt::{DIRECT_EDGES, DirectLight};
use super::world::held_paths;
use crate::emitter_sampler::EmitterSampler;
use crate::restir::pt::MAX_ROUNDS;
use crate::reuse_frames::{Cells, FrameView, extent_of, trace_camera_rays};
use crate::visible_emission::VisibleEmission;
use crate::{CameraMotion, SceneWorld};
use emission::Emission;
use gather::Gather;
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_resampling::{
    Conditional, ConditionalShift, ContributionWeight, DomainReservoir, Extent, FinalGather, MergeRule, Mis,
    MixtureRis, PairedPattern, Pattern, Reservoir, Reuse, ReuseError, ShiftMapping, Topology,
};
use lightshed_sampling::{FramePasses, PathSeed, parallel};
use lightshed_scene::{Camera, EmittersByPower, Hit, Ray, Rgb};
use lightshed_shift::{
    Connectability, Finding, PathDomain, PathSample, PathShift, PrefixDomain, PrefixFinding, PrefixShift,
    PrefixStart, PrefixTracer, TreeTracer,
};
use lightshed_spatial::SiteMetric;
use std::sync::atomic::{AtomicBool, Ordering};
use supports::{BATCH, GROUP, History, Pass, Prefixes, SuffixReservoir, Supports};

/// Suffix reuse: estimates the light transport equation by short prefixes that belong to one pixel,
/// and suffixes behind them that pixels share within a frame and from frame to frame.
///
/// Each frame, every pixel has (or, of the first two, every square of `spacing` pixels a side)
///
/// 1. a *supporting prefix* ([`PrefixDomain`]): a new one merged with that of the previous frame,
///    by targets that do not depend on suffixes (eq. 19);
/// 2. a *suffix* behind it, in the domain that the supporting prefix defines: resampled from trees,
///    merged with the suffix of the previous frame and with those of neighbours (eq. 20), each in
///    the domain behind its own supporting prefix;
/// 3. `N` *integration prefixes*, sampled anew and never reused, each with its emitter samples.
///    Behind each, a final gather sums the suffixes of the nearest supporting prefixes, shifted,
///    and a suffix of its own; roulette leaves own suffixes to a few of the `N` (eq. 23).
///
/// So shared suffixes are seen through vertices that are not shared: frames and pixels are hardly
/// correlated, at the price of the noise of short prefixes.
///
/// Every frame is unbiased. The shift of suffixes is [`PathShift`] unless another is given.
pub struct RestirSuffix<'a, E: EmitterSampler = EmittersByPower<'a>, S = PathShift> {
    shift: S,
    world: &'a SceneWorld<'a, E>,
    /// What guides prefixes and suffixes, if anything does: each frame has the world of its guide.
    guiding: Option<PathGuiding<'a, E>>,
    options: RestirSuffixOptions,
    ends: Connectability,
    connectability: Connectability,
    gather: FinalGather,
    metric: SiteMetric,
    pattern: Option<Pattern>,
    pairs: Option<PairedPattern>,
    motion: CameraMotion,
    extent: Extent,
    /// Those of supporting prefixes.
    cells: Cells,
    history: History<'a, E>,
    /// Beside prefixes and suffixes.
    direct: DirectLight,
    #[cfg(test)]
    fault: Option<tests::Fault>,
}

const PASSES: FramePasses = match FramePasses::new(Pass::SuffixSpatial as u32 + 1, MAX_ROUNDS, 1) {
    Ok(passes) => passes,
    Err(_) => panic!("few passes"),
};

impl<'a, E: EmitterSampler> RestirSuffix<'a, E> {
    /// For images of the size of the scene's settings, with the lengths of its paths.
    ///
    /// # Errors
    /// [`RestirSuffixError`] for options out of range.
    pub fn new(
        world: &'a SceneWorld<'a, E>,
        options: RestirSuffixOptions,
        motion: CameraMotion,
    ) -> Result<Self, RestirSuffixError> {
        let scene = world.scene();
        let (ends, connectability, gather) = options.checked(scene)?;
        let metric = SiteMetric::new(options.normal_scale * scene.extent());
        Ok(Self {
            shift: PathShift::default(),
            world,
            guiding: None,
            options,
            ends,
            connectability,
            gather,
            metric: metric.ok_or(RestirSuffixError::Search(options.normal_scale))?,
            pattern: options.suffixes.pattern()?,
            pairs: options.suffixes.paired()?,
            motion,
            extent: extent_of(scene),
            cells: Cells::squares(extent_of(scene), options.spacing),
            history: History::default(),
            direct: DirectLight::default(),
            #[cfg(test)]
            fault: None,
        })
    }

    /// With directions of prefixes and suffixes from a guide, too, which is of the same scene.
    #[must_use]
    pub fn with_guiding(mut self, guiding: PathGuiding<'a, E>) -> Self {
        self.world = guiding.world();
        self.guiding = Some(guiding);
        self
    }

    /// With another shift among suffixes.
    pub fn with_shift<S>(self, shift: S) -> RestirSuffix<'a, E, S> {
        RestirSuffix {
            shift,
            world: self.world,
            guiding: self.guiding,
            options: self.options,
            ends: self.ends,
            connectability: self.connectability,
            gather: self.gather,
            metric: self.metric,
            pattern: self.pattern,
            pairs: self.pairs,
            motion: self.motion,
            extent: self.extent,
            cells: self.cells,
            history: self.history,
            direct: self.direct,
            #[cfg(test)]
            fault: self.fault,
        }
    }
}

impl<'a, E: EmitterSampler, S> RestirSuffix<'a, E, S>
where
    S: ShiftMapping<PathDomain<'a, SceneWorld<'a, E>>> + Send + Sync,
{
    /// What separate rays see of emission, if direct light has none.
    fn visible(&self) -> Option<&VisibleEmission> {
        self.direct
            .visible
            .get()
            .filter(|_| self.options.suffixes.direct_samples == 0)
    }

    /// Light that is no part of prefixes and suffixes: direct light, or emission that separate rays
    /// see. Returns the number of rays.
    fn add_direct(&mut self, view: FrameView<'_>, image: &mut [Rgb], cancel: &AtomicBool) -> u64 {
        let (scene, options) = (self.world.scene(), &self.options.suffixes);
        let edges = scene.settings().max_depth.unwrap_or(u32::MAX);
        let wanted = options.visible_emission && edges > 0;
        self.direct
            .visible
            .prepare(wanted, scene, view.camera, self.motion.is_still(), edges);
        if options.direct_samples > 0 {
            self.direct
                .add(self.world, view, options.direct_samples, image, cancel);
            return 0;
        }
        let names = (view.numbers.points(), view.numbers.seed());
        self.visible().map_or(0, |visible| {
            visible.add_frame((scene, view.camera), names, view.numbers.frame(), image)
        })
    }

    fn visible_to_camera_rays(&self) -> Option<&VisibleEmission> {
        #[cfg(test)]
        if self.fault == Some(tests::Fault::EmissionTwice) {
            return None;
        }
        self.visible()
    }

    /// What camera rays add of emission.
    fn emission(&self) -> Emission<'_, 'a, E> {
        let edges = self.world.scene().settings().max_depth.unwrap_or(u32::MAX);
        Emission {
            world: self.world,
            visible: self.visible_to_camera_rays(),
            share: match self.least_length() <= 1 && edges >= 1 {
                true => 1.0 / self.options.camera_rays as f32,
                false => 0.0,
            },
        }
    }

    /// Least edges of the paths that prefixes and suffixes estimate.
    fn least_length(&self) -> u32 {
        #[cfg(test)]
        if self.fault == Some(tests::Fault::DirectTwice) {
            return 0;
        }
        match self.options.suffixes.direct_samples {
            0 => 0,
            _ => DIRECT_EDGES + 1,
        }
    }

    /// The prefixes that every pixel may have; adds the emission that their camera rays meet to
    /// `image`, if these are the pixels' own. False if cancelled.
    fn see(
        &self,
        view: FrameView<'_>,
        supports: &mut Supports<'a, E>,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> bool {
        let (world, scene) = (self.world, self.world.scene());
        let max_length = scene.settings().max_depth.unwrap_or(u32::MAX);
        let cells = self.cells;
        supports.prefixes.resize_with(cells.extent().len(), || None);
        let emission = self.emission();
        let see = |index: usize,
                   ray: &Ray,
                   hit: Option<&Hit>,
                   domain: &mut Option<Prefixes<'a, E>>,
                   value: &mut Rgb| {
            let vertex = hit.map(|hit| world.arrive(ray, hit));
            if cells.are_pixels() {
                *value += emission.seen(index, vertex.as_ref(), ray.direction);
            }
            *domain = vertex
                .map(|vertex| PrefixDomain::behind(world, vertex, -ray.direction, self.ends, max_length));
        };
        let numbers = view.numbers.pass(Pass::Camera);
        // There are no more cells than pixels.
        let pixels = (&mut supports.prefixes[..], image);
        trace_camera_rays((scene, view.camera, cells), numbers, pixels, cancel, see)
    }

    /// A fresh prefix for every pixel.
    fn draw_prefixes(
        &self,
        view: FrameView<'_>,
        supports: &Supports<'a, E>,
        reservoirs: &mut [DomainReservoir<Prefixes<'a, E>>],
        cancel: &AtomicBool,
    ) {
        let numbers = view.numbers.pass(Pass::Prefixes);
        let roulette_from = self.world.roulette_depth();
        parallel::for_each(reservoirs.chunks_mut(GROUP), |group, reservoirs| {
            let mut tracer = PrefixTracer::new(roulette_from);
            for (batch, reservoirs) in reservoirs.chunks_mut(BATCH).enumerate() {
                if cancel.load(Ordering::Relaxed) {
                    return;
                }
                let first = group * GROUP + batch * BATCH;
                reservoirs.fill(Reservoir::empty(1.0));
                let domains = supports.prefixes[first..first + reservoirs.len()]
                    .iter()
                    .enumerate();
                let (places, starts): (Vec<usize>, Vec<_>) = domains
                    .filter_map(|(place, domain)| {
                        let seed = PathSeed::draw(&mut numbers.pixel(first + place));
                        Some((place, PrefixStart::new(domain.as_ref()?, seed)))
                    })
                    .unzip();
                tracer.trace(&starts, false, |number, finding| {
                    if let PrefixFinding::Prefix(prefix, _, weight) = finding
                        && let Ok(weight) = ContributionWeight::new(weight.value() as f32)
                        && let Ok(reservoir) = Reservoir::new(*prefix, weight, 1.0)
                    {
                        reservoirs[places[number]] = reservoir;
                    }
                });
            }
        });
    }

    /// The suffixes behind the supporting prefixes.
    fn fix_prefixes(&self, prefixes: &[DomainReservoir<Prefixes<'a, E>>], supports: &mut Supports<'a, E>) {
        let Supports {
            prefixes: domains,
            suffixes,
            ..
        } = supports;
        suffixes.resize_with(prefixes.len(), || None);
        let groups = suffixes.chunks_mut(GROUP);
        parallel::for_each(groups, |group, suffixes| {
            for (place, suffix) in suffixes.iter_mut().enumerate() {
                let pixel = group * GROUP + place;
                let prefix = domains[pixel].as_ref().zip(prefixes[pixel].sample());
                *suffix = prefix
                    .map(|(domain, prefix)| Conditional::new(domain.suffixes(prefix, self.connectability)));
            }
        });
    }

    /// Fresh suffixes from trees.
    fn draw_suffixes(
        &self,
        view: FrameView<'_>,
        supports: &Supports<'a, E>,
        reservoirs: &mut [SuffixReservoir<'a, E>],
        cancel: &AtomicBool,
    ) {
        let numbers = view.numbers.pass(Pass::Suffixes);
        let trees = self.options.suffixes.candidates as usize;
        let share = 1.0 / trees as f64;
        let roulette_from = self.world.roulette_depth();
        let in_batch = (BATCH / trees).max(1);
        parallel::for_each(reservoirs.chunks_mut(GROUP), |group, reservoirs| {
            let mut tracer = TreeTracer::new(roulette_from.saturating_sub(1).max(1));
            for (batch, reservoirs) in reservoirs.chunks_mut(in_batch).enumerate() {
                if cancel.load(Ordering::Relaxed) {
                    return;
                }
                let first = group * GROUP + batch * in_batch;
                let mut streams: Vec<_> = (0..reservoirs.len())
                    .map(|place| (numbers.pixel(first + place), MixtureRis::<PathSample, _>::new()))
                    .collect();
                let (mut owners, mut starts) = (Vec::new(), Vec::new());
                for (place, (rng, _)) in streams.iter_mut().enumerate() {
                    if let Some(domain) = &supports.suffixes[first + place] {
                        owners.extend((0..trees).map(|_| place));
                        starts.extend((0..trees).map(|_| (domain.domain(), PathSeed::draw(rng))));
                    }
                }
                tracer.trace(&starts, |tree, finding| {
                    // Suffixes that cannot be shifted are useless to all integration prefixes.
                    if let Finding::Path(sample, weight) = finding
                        && starts[tree].0.can_leave(sample)
                    {
                        let (rng, mixture) = &mut streams[owners[tree]];
                        mixture.candidate(*sample, sample.target(), share, weight, rng);
                    }
                });
                for (place, (reservoir, (_, mixture))) in reservoirs.iter_mut().zip(streams).enumerate() {
                    let is_there = supports.suffixes[first + place].is_some();
                    *reservoir = mixture.finish(if is_there { 1.0 } else { 0.0 }).given();
                }
            }
        });
    }

    /// The cells of the frame before that saw what those of this frame see.
    fn sources(
        &self,
        before_frame: u32,
        now: &Supports<'a, E>,
        before: &Supports<'a, E>,
    ) -> Vec<Option<u32>> {
        let camera = self.motion.camera(self.world.scene(), before_frame);
        let mut sources = vec![None; self.cells.extent().len()];
        parallel::fill(&mut sources, |index| {
            let (first, _) = now.prefixes[index].as_ref()?.first()?;
            let source = match self.motion.is_still() {
                true => index,
                false => self.cells.seeing(&camera, first.point().position)?,
            };
            now.sees_alike(index, before, source).then_some(source as u32)
        });
        sources
    }

    /// Supporting prefixes and their suffixes, reused in time and space.
    fn reuse(
        &self,
        view: FrameView<'_>,
        history: &mut History<'a, E>,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Result<bool, ReuseError> {
        let (frame, extent, options) = (view.number, self.cells.extent(), &self.options.suffixes);
        let mut supports = std::mem::take(history.supports.of_mut(self.options.suffixes.kept_frame(frame)));
        let seen = self.see(view, &mut supports, image, cancel);
        history.prefixes.begin(extent.len());
        history.suffixes.begin(extent.len());
        self.draw_prefixes(view, &supports, &mut history.prefixes.now, cancel);
        if !seen || cancel.load(Ordering::Relaxed) {
            *history.supports.of_mut(self.options.suffixes.kept_frame(frame)) = supports;
            return Ok(false);
        }
        let in_time = options.temporal_cap.filter(|_| frame > 0);
        let before_frame = frame.saturating_sub(1);
        let sources = match in_time {
            Some(_) => self.sources(before_frame, &supports, history.supports.of(before_frame)),
            None => Vec::new(),
        };
        let source = |index: usize| sources[index].map(|source| source as usize);
        if in_time.is_some() {
            let before = history.supports.of(before_frame);
            let rule = MergeRule::new(PrefixShift)
                .with_mis(Mis::Balance)
                .with_confidence_cap(self.options.prefix_cap);
            let reuse = Reuse::new(&supports.prefixes, rule);
            let numbers = view.numbers.pass(Pass::PrefixTemporal);
            history.prefixes.in_time(
                &reuse,
                &before.prefixes,
                |index, _| source(index),
                |pixel| numbers.pixel(pixel),
            )?;
        }
        self.fix_prefixes(&history.prefixes.now, &mut supports);
        self.draw_suffixes(view, &supports, &mut history.suffixes.now, cancel);
        let cap = options.temporal_cap.unwrap_or(f32::INFINITY);
        let rule = MergeRule::new(ConditionalShift(&self.shift)).with_confidence_cap(cap);
        if in_time.is_some() {
            let before = history.supports.of(before_frame);
            let reuse = Reuse::new(&supports.suffixes, rule.with_mis(Mis::Balance));
            let numbers = view.numbers.pass(Pass::SuffixTemporal);
            history.suffixes.in_time(
                &reuse,
                &before.suffixes,
                |index, _| source(index),
                |pixel| numbers.pixel(pixel),
            )?;
        }
        let reuse = Reuse::new(&supports.suffixes, rule);
        let numbers = view.numbers.pass(Pass::SuffixSpatial);
        let choose = |round, pixel| numbers.round(round).pixel(pixel);
        let alike = |own, other| supports.ends_alike(own, other);
        if let Some(pairs) = self.pairs {
            let pairs = |round| pairs.over(extent, view.numbers.key(round)).filtered(alike);
            history
                .suffixes
                .in_pairs(&reuse, options.rounds, pairs, choose, cancel)?;
        } else if let Some(pattern) = self.pattern {
            let neighbours = |round| pattern.over(extent, view.numbers.key(round)).filtered(alike);
            history
                .suffixes
                .in_space(&reuse, options.rounds, neighbours, choose, cancel)?;
        }
        *history.supports.of_mut(self.options.suffixes.kept_frame(frame)) = supports;
        Ok(!cancel.load(Ordering::Relaxed))
    }
}

impl<'a, E: EmitterSampler, S> FrameMethod for RestirSuffix<'a, E, S>
where
    S: ShiftMapping<PathDomain<'a, SceneWorld<'a, E>>> + Send + Sync,
{
    fn size(&self) -> [u32; 2] {
        [self.extent.width, self.extent.height]
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let camera: Camera = self.motion.camera(self.world.scene(), frame);
        let view = FrameView::new(
            &camera,
            PASSES,
            (frame, seed),
            (self.extent.width, self.options.suffixes.points),
        );
        image.fill(Rgb::ZERO);
        if let Some(guiding) = &self.guiding {
            self.world = guiding.world();
        }
        let mut camera_rays = self.add_direct(view, image, cancel);
        let mut history = std::mem::take(&mut self.history);
        let lengths = self.world.scene().settings().max_depth.unwrap_or(u32::MAX);
        let done = match lengths < self.least_length() {
            true => !cancel.load(Ordering::Relaxed),
            // Fails for slices of other lengths only.
            false => {
                camera_rays += self.cells.extent().len() as u64;
                self.reuse(view, &mut history, image, cancel).unwrap_or(false)
            }
        };
        if done && lengths >= self.least_length() {
            let gather = Gather {
                world: self.world,
                shift: &self.shift,
                gather: self.gather,
                camera_rays: self.options.camera_rays,
                shared_rays: u32::from(self.cells.are_pixels()),
                least_length: self.least_length(),
                emission: self.emission(),
                borrowed: self.options.borrowed as usize,
                within: self.options.search_radius * self.world.scene().extent(),
                search_leaves: self.options.search_leaves,
                metric: self.metric,
                ends: self.ends,
                connectability: self.connectability,
                supports: history.supports.of(self.options.suffixes.kept_frame(frame)),
                reservoirs: &history.suffixes.now,
                extent: self.extent,
                #[cfg(test)]
                fault: self.fault,
            };
            gather.run(view, image, cancel);
        }
        history.prefixes.keep();
        history.suffixes.keep();
        self.history = history;
        if !done || cancel.load(Ordering::Relaxed) {
            return None;
        }
        let mut counts = self.direct.take_counts(self.world, camera_rays);
        if let Some(guiding) = &mut self.guiding {
            counts += guiding.finish_frame(view, cancel)?.rays;
        }
        Some(counts)
    }

    fn is_still(&self) -> bool {
        self.motion.is_still()
    }

    /// How many different suffixes supporting prefixes hold after the last frame.
    fn figures(&self) -> Vec<(&'static str, f64)> {
        let held = self.history.suffixes.held.iter();
        held_paths(held.filter_map(|held| held.sample()))
    }
}
