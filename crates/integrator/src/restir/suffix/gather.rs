//! The final gather (Kettunen 2023 §7): many short prefixes, each with suffixes of its neighbours.

use super::supports::{BATCH, GROUP, Pass, Prefixes, SuffixReservoir, Suffixes, Supports};
use crate::emitter_sampler::EmitterSampler;
use crate::restir::frames::FrameView;
use crate::{PixelSensor, SceneVertex, SceneWorld};
use lightshed_resampling::{
    Conditional, ConditionalShift, ConditionallyIndependent, ContributionWeight, FinalGather, Input, Mis,
    MixtureRis, PrefixWeight, Reservoir, ShiftMapping,
};
use lightshed_sampling::{CounterRng, PathSeed, PrimarySample, parallel};
use lightshed_scene::{Camera, Rgb};
use lightshed_shift::{
    Connectability, Finding, PathDomain, PathSample, PrefixDomain, PrefixFinding, PrefixSample, PrefixTracer,
    TreeTracer,
};
use lightshed_spatial::{Nearest, NearestSites, SiteMetric, SiteTree, SurfaceSite};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What the gather of a frame reads.
pub(super) struct Gather<'b, 'a, E: EmitterSampler, S> {
    pub world: &'a SceneWorld<'a, E>,
    pub shift: &'b S,
    pub gather: FinalGather,
    pub borrowed: usize,
    pub within: f32,
    pub metric: SiteMetric,
    /// Where prefixes end.
    pub ends: Connectability,
    /// How suffixes are shifted.
    pub connectability: Connectability,
    pub supports: &'b Supports<'a, E>,
    pub reservoirs: &'b [SuffixReservoir<'a, E>],
    pub size: [u32; 2],
    #[cfg(test)]
    pub fault: Option<super::tests::Fault>,
}

/// The last vertices of supporting prefixes, and whose they are.
pub(super) struct Ends {
    tree: SiteTree,
    pixels: Vec<u32>,
}

impl Ends {
    /// Of all supporting prefixes of a frame.
    pub fn new<E: EmitterSampler>(supports: &Supports<'_, E>) -> Self {
        let (mut sites, mut pixels) = (Vec::new(), Vec::new());
        for (pixel, domain) in (0..).zip(&supports.suffixes) {
            let first = domain.as_ref().and_then(|domain| domain.domain().first());
            if let Some(site) = first.map(|(vertex, _)| site(vertex))
                && site.position.is_finite()
            {
                sites.push(site);
                pixels.push(pixel);
            }
        }
        Self {
            // Fails for positions that are not finite, and there is none.
            tree: SiteTree::new(&sites).unwrap_or_default(),
            pixels,
        }
    }
}

fn site(vertex: &SceneVertex) -> SurfaceSite {
    let point = vertex.point();
    SurfaceSite::new(point.position, point.geometric_normal)
}

/// An integration prefix.
struct Integration<'a, E: EmitterSampler> {
    /// Of the batch.
    place: usize,
    prefix: PrefixSample,
    weight: ContributionWeight<PrimarySample, f64>,
    suffixes: Suffixes<'a, E>,
    own: SuffixReservoir<'a, E>,
    is_canonical: bool,
}

/// The memory of a thread.
struct Scratch<'a, E: EmitterSampler> {
    prefixes: PrefixTracer<SceneWorld<'a, E>>,
    trees: TreeTracer<SceneWorld<'a, E>>,
    nearest: Nearest,
}

/// Contribution and count of one technique without regard to samples: what roulette leaves.
const CANONICAL_CONFIDENCE: f32 = 1.0;

impl<'a, E: EmitterSampler, S> Gather<'_, 'a, E, S>
where
    S: ShiftMapping<PathDomain<'a, SceneWorld<'a, E>>> + Sync,
{
    /// Adds the radiance of every pixel to `image`.
    pub fn run(&self, view: FrameView<'_>, image: &mut [Rgb], cancel: &AtomicBool) {
        let settings = self.world.scene().settings();
        let max_length = settings.max_depth.unwrap_or(u32::MAX);
        let ends = if self.borrowed > 0 {
            Some(Ends::new(self.supports))
        } else {
            None
        };
        let camera = Arc::new(view.camera.clone());
        let numbers = view.numbers.pass(Pass::Gather);
        let in_batch = (BATCH / self.gather.prefixes() as usize).max(1);
        parallel::for_each(image.chunks_mut(GROUP), |group, image| {
            let mut scratch = Scratch {
                prefixes: PrefixTracer::new(settings.roulette_depth),
                trees: TreeTracer::new(settings.roulette_depth.saturating_sub(1).max(1)),
                nearest: Nearest::new(self.borrowed, self.within),
            };
            for (batch, image) in image.chunks_mut(in_batch).enumerate() {
                if cancel.load(Ordering::Relaxed) {
                    return;
                }
                let first = group * GROUP + batch * in_batch;
                let pixels: Vec<(Prefixes<'a, E>, CounterRng)> = (first..first + image.len())
                    .map(|index| (self.prefixes_of(&camera, index, max_length), numbers.pixel(index)))
                    .collect();
                self.batch(pixels, ends.as_ref(), &mut scratch, image);
            }
        });
    }

    fn prefixes_of(&self, camera: &Arc<Camera>, index: usize, max_length: u32) -> Prefixes<'a, E> {
        let width = self.size[0] as usize;
        let sensor = PixelSensor {
            camera: Arc::clone(camera),
            pixel: [(index % width) as u32, (index / width) as u32],
        };
        PrefixDomain::of_sensor(self.world, sensor, self.ends, max_length)
    }

    /// The prefixes of some pixels, all of them together.
    fn batch(
        &self,
        mut pixels: Vec<(Prefixes<'a, E>, CounterRng)>,
        ends: Option<&Ends>,
        scratch: &mut Scratch<'a, E>,
        image: &mut [Rgb],
    ) {
        let count = self.gather.prefixes();
        let share = 1.0 / count as f32;
        let mut seeds = Vec::with_capacity(pixels.len() * count as usize);
        for (_, rng) in pixels.iter_mut() {
            seeds.extend((0..count).map(|_| PathSeed::draw(rng)));
        }
        let count = count as usize;
        let starts: Vec<_> = seeds
            .iter()
            .enumerate()
            .map(|(number, &seed)| (&pixels[number / count].0, seed))
            .collect();
        let mut found: Vec<Option<Integration<'a, E>>> = (0..starts.len()).map(|_| None).collect();
        scratch
            .prefixes
            .trace(&starts, true, |number, finding| match finding {
                PrefixFinding::Light(light) => image[number / count] += light * share,
                PrefixFinding::Prefix(prefix, last, weight) => {
                    let domain = starts[number].0;
                    let suffixes = domain.suffixes_from(last.clone(), prefix, self.connectability);
                    found[number] = Some(Integration {
                        place: number / count,
                        prefix: *prefix,
                        weight,
                        suffixes: Conditional::new(suffixes),
                        own: Reservoir::empty(CANONICAL_CONFIDENCE),
                        is_canonical: number % count < self.gather.canonical() as usize,
                    });
                }
            });
        drop(starts);
        let mut found: Vec<Integration<'a, E>> = found.into_iter().flatten().collect();
        self.canonical(&mut found, &mut pixels, scratch, image);
        for integration in &found {
            self.borrow(
                integration,
                ends,
                &mut scratch.nearest,
                &mut image[integration.place],
            );
        }
    }

    /// The canonical suffixes, of those prefixes that roulette leaves one.
    fn canonical(
        &self,
        found: &mut [Integration<'a, E>],
        pixels: &mut [(Prefixes<'a, E>, CounterRng)],
        scratch: &mut Scratch<'a, E>,
        image: &mut [Rgb],
    ) {
        let share = 1.0 / self.gather.canonical() as f32;
        let owners: Vec<usize> = (0..found.len())
            .filter(|&number| found[number].is_canonical)
            .collect();
        let mut mixtures: Vec<MixtureRis<PathSample, PrimarySample>> =
            owners.iter().map(|_| MixtureRis::new()).collect();
        let trees: Vec<_> = owners
            .iter()
            .map(|&owner| {
                let seed = PathSeed::draw(&mut pixels[found[owner].place].1);
                (found[owner].suffixes.domain(), seed)
            })
            .collect();
        scratch.trees.trace(&trees, |tree, finding| {
            // Prefixes start their suffixes at surfaces: nothing is seen from a sensor.
            let Finding::Path(sample, weight) = finding else {
                return;
            };
            let integration = &found[owners[tree]];
            if trees[tree].0.can_leave(sample) {
                let rng = &mut pixels[integration.place].1;
                mixtures[tree].candidate(*sample, sample.target(), 1.0, weight, rng);
            } else {
                // No supporting prefix can have it: the canonical technique alone.
                let weight = (weight.value() * integration.weight.value()) as f32 * share;
                image[integration.place] += integration.prefix.throughput() * sample.contribution() * weight;
            }
        });
        drop(trees);
        for (&owner, mixture) in owners.iter().zip(mixtures) {
            found[owner].own = mixture.finish(CANONICAL_CONFIDENCE).given();
        }
    }

    /// What a prefix contributes: by its own suffix, if it has one, and by those that it borrows.
    fn borrow(
        &self,
        integration: &Integration<'a, E>,
        ends: Option<&Ends>,
        nearest: &mut Nearest,
        value: &mut Rgb,
    ) {
        let mut inputs = Vec::with_capacity(self.borrowed + 1);
        inputs.push(Input::canonical(&integration.suffixes, &integration.own));
        if let (Some(ends), Some((last, _))) = (ends, integration.suffixes.domain().first()) {
            ends.tree.nearest(&site(last), self.metric, nearest);
            for neighbour in nearest.found() {
                let pixel = ends.pixels[neighbour.index as usize] as usize;
                if let Some(domain) = &self.supports.suffixes[pixel] {
                    inputs.push(Input::neighbour(domain, &self.reservoirs[pixel]));
                }
            }
        }
        // The suffixes' random numbers are none of the prefix's.
        let prefix = PrefixWeight::resampled(integration.weight, ConditionallyIndependent::PROMISED);
        let throughput = self.throughput(&integration.prefix);
        let shift = ConditionalShift(self.shift);
        // Fails for pairwise families alone.
        let _ = self.gather.integrate(
            prefix,
            &integration.suffixes,
            &shift,
            &inputs,
            Mis::Balance,
            |part| {
                let weight = part.weight.value() as f32 * self.share(part.is_canonical);
                *value += throughput * part.sample.contribution() * weight;
            },
        );
    }

    #[cfg(not(test))]
    fn throughput(&self, prefix: &PrefixSample) -> Rgb {
        prefix.throughput()
    }

    #[cfg(not(test))]
    fn share(&self, _: bool) -> f32 {
        1.0
    }
}

/// With planted faults.
#[cfg(test)]
impl<E: EmitterSampler, S> Gather<'_, '_, E, S> {
    fn throughput(&self, prefix: &PrefixSample) -> Rgb {
        match self.fault {
            Some(super::tests::Fault::NoThroughput) => Rgb::ONE,
            Some(super::tests::Fault::ThroughputTwice) => prefix.throughput() * prefix.throughput(),
            _ => prefix.throughput(),
        }
    }

    fn share(&self, is_canonical: bool) -> f32 {
        match self.fault {
            Some(super::tests::Fault::CanonicalDivided) if is_canonical => {
                1.0 / self.gather.prefixes() as f32
            }
            _ => 1.0,
        }
    }
}
