//! The final gather (Kettunen 2023 §7): many short prefixes, each with suffixes of its neighbours.

use super::emission::Emission;
use super::supports::{GROUP, Pass, Prefixes, SuffixReservoir, Suffixes, Supports};
use crate::camera_ray::PixelRay;
use crate::emitter_sampler::EmitterSampler;
use crate::reuse_frames::{FrameView, corner_of};
use crate::{SceneVertex, SceneWorld};
use lightshed_resampling::{
    Conditional, ConditionalShift, ConditionallyIndependent, ContributionWeight, Extent, FinalGather, Input,
    Mis, MixtureRis, PrefixWeight, Reservoir, ShiftMapping,
};
use lightshed_sampling::{CounterRng, PathSeed, PrimarySample, f32_from_u32, luminance, parallel};
use lightshed_scene::{Ray, Rgb};
use lightshed_shift::{
    Connectability, Finding, PathDomain, PathSample, PrefixDomain, PrefixFinding, PrefixSample, PrefixStart,
    PrefixTracer, RayKind, TreeTracer, WorldGeometry,
};
use lightshed_spatial::{Nearest, SiteMetric, SiteTree, SurfaceSite};
use std::sync::atomic::{AtomicBool, Ordering};

/// What the gather of a frame reads.
pub(super) struct Gather<'b, 'a, E: EmitterSampler, S> {
    pub world: &'a SceneWorld<'a, E>,
    pub shift: &'b S,
    pub gather: FinalGather,
    /// Of a pixel.
    pub camera_rays: u32,
    /// How many of them are that of its supporting prefix: 1, or 0 if it has none of its own.
    pub shared_rays: u32,
    /// Edges of the shortest paths that count.
    pub least_length: u32,
    pub emission: Emission<'b, 'a, E>,
    pub borrowed: usize,
    pub within: f32,
    pub search_leaves: u32,
    pub metric: SiteMetric,
    /// Where prefixes end.
    pub ends: Connectability,
    /// How suffixes are shifted.
    pub connectability: Connectability,
    pub supports: &'b Supports<'a, E>,
    pub reservoirs: &'b [SuffixReservoir<'a, E>],
    pub extent: Extent,
    #[cfg(test)]
    pub fault: Option<super::tests::Fault>,
}

/// The last vertices of supporting prefixes, and the suffixes behind them.
pub(super) struct Ends<'b, 'a, E: EmitterSampler> {
    tree: SiteTree,
    /// Of each site.
    suffixes: Vec<(&'b Suffixes<'a, E>, &'b SuffixReservoir<'a, E>)>,
}

impl<'b, 'a, E: EmitterSampler> Ends<'b, 'a, E> {
    /// Of all supporting prefixes of a frame.
    pub fn new(supports: &'b Supports<'a, E>, reservoirs: &'b [SuffixReservoir<'a, E>]) -> Self {
        let pixels = supports.suffixes.chunks(GROUP).zip(reservoirs.chunks(GROUP));
        let parts = parallel::map(pixels, |_, (domains, reservoirs)| {
            let (mut sites, mut suffixes) = (Vec::new(), Vec::new());
            for (domain, reservoir) in domains.iter().zip(reservoirs) {
                if let Some(domain) = domain
                    && let Some((vertex, _)) = domain.domain().first()
                    && vertex.point().position.is_finite()
                {
                    sites.push(site(vertex));
                    suffixes.push((domain, reservoir));
                }
            }
            (sites, suffixes)
        });
        let (sites, suffixes): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        let (sites, suffixes) = (sites.concat(), suffixes.concat());
        Self {
            // Fails for positions that are not finite, and there is none.
            tree: SiteTree::new(&sites).unwrap_or_default(),
            suffixes,
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
    /// With its own probability of bringing a suffix.
    gather: FinalGather,
    is_canonical: bool,
    /// Where what it borrows ends, among that of the batch.
    borrowed_end: usize,
}

/// The memory of a thread.
struct Scratch<'a, E: EmitterSampler> {
    prefixes: PrefixTracer<SceneWorld<'a, E>>,
    trees: TreeTracer<SceneWorld<'a, E>>,
    nearest: Nearest,
    /// Sites whose suffixes the prefixes of a batch borrow.
    borrowed: Vec<usize>,
    /// Of further camera rays.
    rays: Vec<Ray>,
    vertices: Vec<Option<SceneVertex>>,
}

/// Some pixels in a row.
struct Batch<'n, 'i> {
    view: FrameView<'n>,
    /// Number of the first.
    first: usize,
    /// Their random numbers.
    numbers: Vec<CounterRng>,
    image: &'i mut [Rgb],
}

/// Contribution and count of one technique without regard to samples: what roulette leaves.
const CANONICAL_CONFIDENCE: f32 = 1.0;

/// Prefixes that are traced together.
const PREFIXES: usize = 256;

/// A seed of its own, so that prefixes and all else in other frames share no numbers.
const OTHER_SEED: u64 = 0x7072_6566_6978_2e2e;

/// Steps between a pixel's camera rays: the powers of the inverse plastic number in four
/// dimensions (Roberts 2018), by which any number of them is stratified.
const STEPS: [f32; 4] = [0.856_674_9, 0.733_891_85, 0.628_706_7, 0.538_597_3];

impl<'a, E: EmitterSampler, S> Gather<'_, 'a, E, S>
where
    S: ShiftMapping<PathDomain<'a, SceneWorld<'a, E>>> + Sync,
{
    /// Adds the radiance of every pixel to `image`.
    pub fn run(&self, view: FrameView<'_>, image: &mut [Rgb], cancel: &AtomicBool) {
        let roulette_from = self.world.roulette_depth();
        let ends = if self.borrowed > 0 {
            Some(Ends::new(self.supports, self.reservoirs))
        } else {
            None
        };
        let numbers = view.numbers.pass(Pass::Gather);
        let in_batch = (PREFIXES / self.gather.prefixes() as usize).max(1);
        parallel::for_each(image.chunks_mut(GROUP), |group, image| {
            let mut scratch = Scratch {
                prefixes: PrefixTracer::new(roulette_from).with_least_length(self.least_length),
                trees: TreeTracer::new(roulette_from.saturating_sub(1).max(1)),
                nearest: Nearest::new(self.borrowed, self.within),
                borrowed: Vec::new(),
                rays: Vec::new(),
                vertices: Vec::new(),
            };
            for (batch, image) in image.chunks_mut(in_batch).enumerate() {
                if cancel.load(Ordering::Relaxed) {
                    return;
                }
                let first = group * GROUP + batch * in_batch;
                let batch = Batch {
                    view,
                    first,
                    numbers: (first..first + image.len())
                        .map(|index| numbers.pixel(index))
                        .collect(),
                    image,
                };
                self.batch(batch, ends.as_ref(), &mut scratch);
            }
        });
    }

    /// What the pixels of a batch see along their further camera rays. A pixel's rays are that of
    /// its supporting prefix, moved by equal steps on the torus of its film and lens: each of them
    /// is uniform, and together they are stratified.
    fn see(&self, batch: &mut Batch<'_, '_>, scratch: &mut Scratch<'a, E>) -> Vec<Option<Prefixes<'a, E>>> {
        let Scratch { rays, vertices, .. } = scratch;
        let max_length = self.world.scene().settings().max_depth.unwrap_or(u32::MAX);
        let numbers = batch.view.numbers.pass(Pass::Camera);
        rays.clear();
        for index in (batch.first..).take(batch.image.len()) {
            let own = numbers.block(index).map(f32_from_u32);
            for step in self.shared_rays..self.camera_rays {
                let place = std::array::from_fn(|axis| (own[axis] + step as f32 * STEPS[axis]).fract());
                let corner = corner_of(self.extent, index);
                rays.push(PixelRay::through(batch.view.camera, corner, place).ray);
            }
        }
        vertices.clear();
        vertices.resize(rays.len(), None);
        self.world.trace_many(rays, RayKind::Sensor, vertices);
        let further = self.further_rays();
        let seen = rays.iter().zip(vertices.drain(..)).enumerate();
        seen.map(|(number, (ray, vertex))| {
            let place = number / further;
            batch.image[place] += self
                .emission
                .seen(batch.first + place, vertex.as_ref(), ray.direction);
            Some(PrefixDomain::behind(
                self.world,
                vertex?,
                -ray.direction,
                self.ends,
                max_length,
            ))
        })
        .collect()
    }

    /// Camera rays of a pixel beside that of its supporting prefix.
    fn further_rays(&self) -> usize {
        (self.camera_rays - self.shared_rays) as usize
    }

    /// The prefixes of some pixels, all of them together.
    fn batch(&self, mut batch: Batch<'_, '_>, ends: Option<&Ends<'_, 'a, E>>, scratch: &mut Scratch<'a, E>) {
        let further = self.see(&mut batch, scratch);
        let count = self.gather.prefixes();
        let share = 1.0 / count as f32;
        // Of each start, the pixel's place in the batch.
        let (mut owners, mut starts) = (Vec::new(), Vec::new());
        for place in 0..batch.image.len() {
            for number in 0..count {
                let seed = PathSeed::draw(&mut batch.numbers[place]);
                let domain = match (number % self.camera_rays).checked_sub(self.shared_rays) {
                    None => self.supports.prefixes[batch.first + place].as_ref(),
                    Some(ray) => further[place * self.further_rays() + ray as usize].as_ref(),
                };
                if let Some(domain) = domain {
                    owners.push(place);
                    starts.push(PrefixStart {
                        domain,
                        seed,
                        first: Some(self.first_numbers(batch.view, batch.first + place, number)),
                    });
                }
            }
        }
        let mut found: Vec<Integration<'a, E>> = Vec::with_capacity(starts.len());
        let image = &mut *batch.image;
        scratch
            .prefixes
            .trace(&starts, true, |start, finding| match finding {
                PrefixFinding::Light(light) => image[owners[start]] += light * share,
                PrefixFinding::Prefix(prefix, last, weight) => {
                    let suffixes =
                        starts[start]
                            .domain
                            .suffixes_from(last.clone(), prefix, self.connectability);
                    let place = owners[start];
                    found.push(Integration {
                        place,
                        prefix: *prefix,
                        weight,
                        suffixes: Conditional::new(suffixes),
                        own: Reservoir::empty(CANONICAL_CONFIDENCE),
                        gather: self.gather,
                        is_canonical: false,
                        borrowed_end: 0,
                    });
                }
            });
        self.choose(&mut found, &mut batch);
        self.canonical(&mut found, &mut batch, scratch);
        let Scratch {
            nearest, borrowed, ..
        } = scratch;
        borrowed.clear();
        for integration in &mut found {
            if let (Some(ends), Some((last, _))) = (ends, integration.suffixes.domain().first()) {
                ends.tree
                    .near(&site(last), self.metric, self.search_leaves, nearest);
                borrowed.extend(nearest.found().iter().map(|neighbour| neighbour.index as usize));
            }
            integration.borrowed_end = borrowed.len();
        }
        // They lie all over memory. Copied in one go, a read does not wait for that before it.
        let lenders: Vec<_> = ends.map_or_else(Vec::new, |ends| {
            let lend = |&site: &usize| (ends.suffixes[site].0, *ends.suffixes[site].1);
            borrowed.iter().map(lend).collect()
        });
        let mut inputs = Vec::with_capacity(self.borrowed + 1);
        let mut first = 0;
        for integration in &found {
            inputs.clear();
            inputs.push(Input::canonical(&integration.suffixes, &integration.own));
            let lenders = &lenders[first..integration.borrowed_end];
            inputs.extend(
                lenders
                    .iter()
                    .map(|&(domain, ref own)| Input::neighbour(domain, own)),
            );
            first = integration.borrowed_end;
            self.integrate(integration, &inputs, &mut batch.image[integration.place]);
        }
    }

    /// Chooses the prefixes that bring a suffix: by their throughput, which their suffixes are
    /// multiplied by, as many of a pixel as there are to be, or one fewer.
    fn choose(&self, found: &mut [Integration<'a, E>], batch: &mut Batch<'_, '_>) {
        if self.gather.canonical() == self.gather.prefixes() {
            found
                .iter_mut()
                .for_each(|integration| integration.is_canonical = true);
            return;
        }
        let importance = |integration: &Integration<'a, E>| {
            f64::from(luminance(integration.prefix.throughput())) * integration.weight.value()
        };
        let mut sums = vec![0.0; batch.image.len()];
        for integration in found.iter() {
            sums[integration.place] += importance(integration);
        }
        let draw = |rng: &mut CounterRng| f64::from(rng.next_f32());
        let mut steps: Vec<f64> = batch.numbers.iter_mut().map(draw).collect();
        for integration in found {
            let q = self
                .gather
                .survival(importance(integration), sums[integration.place]);
            // Systematic sampling: equal steps along the sum of the probabilities.
            let step = &mut steps[integration.place];
            let before = step.floor();
            *step += q;
            integration.is_canonical = step.floor() > before;
            integration.gather = self.surviving(q);
        }
    }

    /// Numbers of the lobe and the direction at a prefix's first vertex, stratified over the
    /// prefixes of a pixel, and over its frames, if the frame's points are.
    fn first_numbers(&self, view: FrameView<'_>, index: usize, number: u32) -> [f32; 3] {
        let width = self.extent.width as usize;
        let name = ((index / width) as u32) << 16 | (index % width) as u32;
        let sample = view
            .number
            .wrapping_mul(self.gather.prefixes())
            .wrapping_add(number);
        let numbers = view.numbers;
        let words = numbers
            .points()
            .block(numbers.seed() ^ OTHER_SEED, name, sample, 0);
        [words[2], words[0], words[1]].map(f32_from_u32)
    }

    /// The canonical suffixes, of those prefixes that roulette leaves one.
    fn canonical(
        &self,
        found: &mut [Integration<'a, E>],
        batch: &mut Batch<'_, '_>,
        scratch: &mut Scratch<'a, E>,
    ) {
        let owners: Vec<usize> = (0..found.len())
            .filter(|&number| found[number].is_canonical)
            .collect();
        let mut mixtures: Vec<MixtureRis<PathSample, PrimarySample>> =
            owners.iter().map(|_| MixtureRis::new()).collect();
        let trees: Vec<_> = owners
            .iter()
            .map(|&owner| {
                let seed = PathSeed::draw(&mut batch.numbers[found[owner].place]);
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
                let rng = &mut batch.numbers[integration.place];
                mixtures[tree].candidate(*sample, sample.target(), 1.0, weight, rng);
            } else {
                // No supporting prefix can have it: the canonical technique alone.
                let share = integration.gather.own_share() as f32;
                let weight = (weight.value() * integration.weight.value()) as f32 * share;
                batch.image[integration.place] +=
                    integration.prefix.throughput() * sample.contribution() * weight;
            }
        });
        drop(trees);
        for (&owner, mixture) in owners.iter().zip(mixtures) {
            found[owner].own = mixture.finish(CANONICAL_CONFIDENCE).given();
        }
    }

    /// What a prefix contributes: by its own suffix, if it has one, and by those that it borrows.
    fn integrate(
        &self,
        integration: &Integration<'a, E>,
        inputs: &[Input<'_, Suffixes<'a, E>>],
        value: &mut Rgb,
    ) {
        // The suffixes' random numbers are none of the prefix's.
        let prefix = PrefixWeight::resampled(integration.weight, ConditionallyIndependent::PROMISED);
        let throughput = self.throughput(&integration.prefix);
        let shift = ConditionalShift(self.shift);
        // Fails for pairwise families alone.
        let _ = integration.gather.integrate(
            prefix,
            &integration.suffixes,
            &shift,
            inputs,
            Mis::Balance,
            |part| {
                let weight = part.weight.value() as f32 * self.share(part.is_canonical);
                *value += throughput * part.sample.contribution() * weight;
            },
        );
    }

    #[cfg(not(test))]
    fn surviving(&self, q: f64) -> FinalGather {
        self.gather.surviving(q)
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

    fn surviving(&self, q: f64) -> FinalGather {
        match self.fault {
            Some(super::tests::Fault::ChancesIgnored) => self.gather,
            _ => self.gather.surviving(q),
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
