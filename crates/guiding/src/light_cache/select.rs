//! Selection of a light by a cache (Algorithm 1).
//!
//! With `f` the region's share of exploration, `p_e` its probabilities and `p_c` those of the
//! cache, `p_c(l) = P(bucket) w_l / Σ_bucket w`, a light has the probability
//! `f p_e + (1 − f) p_c` if exploration is a table. If it is a tree, each light belongs to one
//! technique: `(1 − f) p_c` if `p_c > 0`, otherwise `f p_e`. If no cached light has a weight, `f`
//! is 1.

use super::block::Receiver;
use super::bucket_choice::Buckets;
use super::cache::LightCache;
use super::exploration::Explorer;
use super::lists::RegionHead;
use super::walk::{Walk, find};
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, Lanes};
use lightshed_lights::{LightChoice, LightSampler, ShadingPoint};

impl LightSampler for LightCache {
    fn light_count(&self) -> usize {
        self.units.light_count()
    }

    #[inline]
    fn sample(&self, at: &ShadingPoint, u: u64) -> Option<LightChoice> {
        LaneChoice::best().run(Sample { cache: self, at, u })
    }

    #[inline]
    fn pmf(&self, at: &ShadingPoint, light: u32) -> f32 {
        LaneChoice::best().run(Pmf {
            cache: self,
            at,
            light,
        })
    }

    fn sample_each(&self, at: &[ShadingPoint], u: &[u64], choices: &mut [Option<LightChoice>]) {
        LaneChoice::best().run(SampleEach {
            cache: self,
            at,
            u,
            choices,
        });
    }
}

struct Sample<'a> {
    cache: &'a LightCache,
    at: &'a ShadingPoint,
    u: u64,
}

impl LaneKernel for Sample<'_> {
    type Output = Option<LightChoice>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<LightChoice> {
        self.cache.choose::<L>(self.at, self.u)
    }
}

struct Pmf<'a> {
    cache: &'a LightCache,
    at: &'a ShadingPoint,
    light: u32,
}

impl LaneKernel for Pmf<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        self.cache.probability::<L>(self.at, self.light)
    }
}

struct SampleEach<'a> {
    cache: &'a LightCache,
    at: &'a [ShadingPoint],
    u: &'a [u64],
    choices: &'a mut [Option<LightChoice>],
}

impl LaneKernel for SampleEach<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for ((at, &u), choice) in self.at.iter().zip(self.u).zip(self.choices) {
            *choice = self.cache.choose::<L>(at, u);
        }
    }
}

impl LightCache {
    #[inline(always)]
    fn choose<L: Lanes>(&self, at: &ShadingPoint, u: u64) -> Option<LightChoice> {
        // NaN fails the comparison.
        if !(at.reflectance_bound > 0.0) {
            return None;
        }
        let head = self.head(at.position);
        if head.explores_always() {
            return self.explorer.sample(at, u);
        }
        let to = &Receiver::new(at, self.options.lobes);
        let buckets = Buckets::new::<L>(&self.lists, &self.units, head, to);
        if buckets.is_black() {
            return self.explorer.sample(at, u);
        }
        let explores = u < head.explore_below;
        // Both techniques know their bucket before the walk over it, which happens once.
        let (bucket, rest, explored) = if explores {
            let fresh = ((u128::from(u) << 64) / u128::from(head.explore_below)) as u64;
            let explored = self.explorer.sample(at, fresh);
            (
                explored.map_or(0, |choice| buckets.of(self.units.of(choice.light))),
                0.0,
                explored,
            )
        } else {
            let rest = (u - head.explore_below) as f64 / (u64::MAX - head.explore_below) as f64;
            let (bucket, rest) = buckets.choose::<L>(rest.min(1.0 - f64::EPSILON));
            (bucket, rest, None)
        };
        let blocks = buckets.blocks(bucket);
        let walk = Walk::new::<L>(blocks, to);
        if head.buckets == 1 && !(walk.total() > 0.0) {
            // No cached light contributes here.
            return self.explorer.sample(at, u);
        }
        let of_bucket = buckets.probability(bucket);
        if explores {
            let LightChoice { light, pmf } = explored?;
            let of_unit = of_bucket * find(blocks, self.units.of(light)).map_or(0.0, |i| walk.probability(i));
            let cached = if of_unit > 0.0 {
                of_unit * self.units.probability::<L>(to, light)
            } else {
                0.0
            };
            return self.mixed(head, light, cached, || pmf, true);
        }
        if !(walk.total() > 0.0) {
            return None;
        }
        let (i, rest) = walk.choose::<L>(rest);
        let unit = blocks[i / LANES].lights[i % LANES];
        let (light, within) = self.units.choose::<L>(to, unit, rest)?;
        let cached = of_bucket * walk.probability(i) * within;
        self.mixed(head, light, cached, || self.explorer.pmf(at, light), false)
    }

    /// A selection with its probability; `None` if the light belongs to the other technique.
    #[inline(always)]
    fn mixed(
        &self,
        head: &RegionHead,
        light: u32,
        cached: f32,
        explored: impl FnOnce() -> f32,
        explores: bool,
    ) -> Option<LightChoice> {
        if explores && cached > 0.0 && matches!(self.explorer, Explorer::Tree(_)) {
            return None;
        }
        let pmf = self.mixture(head, cached, explored);
        (pmf > 0.0).then_some(LightChoice { light, pmf })
    }

    #[inline(always)]
    fn mixture(&self, head: &RegionHead, cached: f32, explored: impl FnOnce() -> f32) -> f32 {
        let share = head.share();
        match self.explorer {
            Explorer::Table(_) => share * explored() + (1.0 - share) * cached,
            Explorer::Tree(_) if cached > 0.0 => (1.0 - share) * cached,
            Explorer::Tree(_) => share * explored(),
        }
    }

    #[inline(always)]
    fn probability<L: Lanes>(&self, at: &ShadingPoint, light: u32) -> f32 {
        if !(at.reflectance_bound > 0.0) || light as usize >= self.units.light_count() {
            return 0.0;
        }
        let head = self.head(at.position);
        if head.explores_always() {
            return self.explorer.pmf(at, light);
        }
        let to = &Receiver::new(at, self.options.lobes);
        let buckets = Buckets::new::<L>(&self.lists, &self.units, head, to);
        if buckets.is_black() {
            return self.explorer.pmf(at, light);
        }
        let (cached, any) = buckets.cached::<L>(to, light);
        if head.buckets == 1 && !any {
            return self.explorer.pmf(at, light);
        }
        self.mixture(head, cached, || self.explorer.pmf(at, light))
    }
}
