//! Eight places side by side, and looks at all places of a region at once.

use super::place::{FARTHEST, NEAR, Place, WIDTH};
use crate::vmf::MAX_CONCENTRATION;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, LaneMask, Lanes, Vec3Lanes};

/// Eight places of a region in 256 bytes, number by number, so that lanes read them as they are.
/// All zeros are empty ones.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PlaceBlock {
    mean: [[f32; LANES]; 3],
    spread: [f32; LANES],
    weight: [f32; LANES],
    count: [f32; LANES],
    scatter: [f32; LANES],
    cumulative: [f32; LANES],
}

/// Blocks that hold so many places.
pub(super) const fn blocks_of(places: usize) -> usize {
    places.div_ceil(LANES)
}

/// Most blocks of a region.
const MOST: usize = blocks_of(super::options::MAX_PLACES as usize);

/// The place of this number.
#[inline(always)]
pub(super) fn place(blocks: &[PlaceBlock], number: usize) -> Place {
    let (block, lane) = (&blocks[number / LANES], number % LANES);
    Place {
        mean: [block.mean[0][lane], block.mean[1][lane], block.mean[2][lane]],
        spread: block.spread[lane],
        weight: block.weight[lane],
        count: block.count[lane],
        scatter: block.scatter[lane],
        cumulative: block.cumulative[lane],
    }
}

/// Replaces the place of this number.
pub(super) fn set_place(blocks: &mut [PlaceBlock], number: usize, place: Place) {
    let (block, lane) = (&mut blocks[number / LANES], number % LANES);
    for (axis, mean) in block.mean.iter_mut().zip(place.mean) {
        axis[lane] = mean;
    }
    block.spread[lane] = place.spread;
    block.weight[lane] = place.weight;
    block.count[lane] = place.count;
    block.scatter[lane] = place.scatter;
    block.cumulative[lane] = place.cumulative;
}

/// All places, those without light among them.
pub(super) fn places(blocks: &[PlaceBlock]) -> impl ExactSizeIterator<Item = Place> {
    (0..blocks.len() * LANES).map(|number| place(blocks, number))
}

/// `Σ w`.
pub(super) fn total_weight(blocks: &[PlaceBlock]) -> f32 {
    blocks.iter().flat_map(|block| block.weight).sum()
}

/// The place among the first `count` that has least weight, where `more` adds to a place's weight.
pub(super) fn lightest(blocks: &[PlaceBlock], count: usize, more: impl Fn(usize) -> f64) -> (usize, f64) {
    let weights = blocks.iter().flat_map(|block| block.weight).take(count);
    let weights = weights.enumerate().map(|(k, w)| (k, f64::from(w) + more(k)));
    weights
        .min_by(|(_, a), (_, b)| a.total_cmp(b))
        .unwrap_or((0, f64::INFINITY))
}

/// The place whose share of directions has the number `u`, and that share's begin; `None` if there
/// is none.
#[inline]
pub(super) fn selected(blocks: &[PlaceBlock], u: f32) -> Option<(Place, f32)> {
    let block = blocks.partition_point(|block| block.cumulative[LANES - 1] <= u);
    let cumulative = &blocks.get(block)?.cumulative;
    let lane = cumulative.iter().filter(|&&end| end <= u).count();
    let number = block * LANES + lane;
    let before = number
        .checked_sub(1)
        .map_or(0.0, |before| cumulative_of(blocks, before));
    Some((place(blocks, number), before))
}

#[inline(always)]
fn cumulative_of(blocks: &[PlaceBlock], number: usize) -> f32 {
    blocks[number / LANES].cumulative[number % LANES]
}

/// The sum of share times density in a direction over all places, as seen from a position; in the
/// order of the places.
#[inline]
pub(super) fn density(lanes: LaneChoice, blocks: &[PlaceBlock], position: Vec3, direction: Vec3) -> f32 {
    let near = lanes.run(Near {
        blocks,
        position,
        direction,
    });
    let mut density = 0.0;
    for (k, mut lanes) in near[..blocks.len().min(MOST)].iter().copied().enumerate() {
        while lanes != 0 {
            let number = k * LANES + lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let place = place(blocks, number);
            let before = number
                .checked_sub(1)
                .map_or(0.0, |before| cumulative_of(blocks, before));
            let share = place.cumulative - before;
            if share > 0.0 {
                density += share * place.density(place.mean() - position, direction);
            }
        }
    }
    density
}

/// The place that light from `from` belongs to: of those whose standard deviation it is within
/// three of, the nearest.
pub(super) fn nearest(lanes: LaneChoice, blocks: &[PlaceBlock], from: Vec3) -> Option<usize> {
    let (number, squared) = lanes.run(Nearest { blocks, from });
    squared.is_finite().then_some(number)
}

/// Whether the middle of a place lies within a squared distance of `from`.
pub(super) fn known_near(lanes: LaneChoice, blocks: &[PlaceBlock], from: Vec3, squared: f32) -> bool {
    lanes.run(KnownNear {
        blocks,
        from,
        squared,
    })
}

#[inline(always)]
fn means<L: Lanes>(block: &PlaceBlock) -> Vec3Lanes<L> {
    let [x, y, z] = &block.mean;
    Vec3Lanes::new(L::load(x), L::load(y), L::load(z))
}

/// Which places of each block may have a density in a direction.
struct Near<'a> {
    blocks: &'a [PlaceBlock],
    position: Vec3,
    direction: Vec3,
}

impl LaneKernel for Near<'_> {
    type Output = [u8; MOST];
    /// As [`Place::concentration`] and [`Place::density`] have it, operation by operation.
    #[inline(always)]
    fn run<L: Lanes>(self) -> [u8; MOST] {
        let mut near = [0; MOST];
        let position = Vec3Lanes::<L>::splat(self.position.to_array());
        let d = Vec3Lanes::<L>::splat(self.direction.to_array());
        let (zero, far) = (L::splat(0.0), L::splat(2.0 * FARTHEST));
        for (near, block) in near.iter_mut().zip(self.blocks) {
            let to = means::<L>(block) - position;
            let spread = L::load(&block.spread);
            let squared = to.dot(to);
            // NaN where an empty place is at the position itself: not known, and left out.
            let concentration = (L::splat(WIDTH) * squared / spread).min(L::splat(MAX_CONCENTRATION));
            let across = Vec3Lanes::new(
                to.y * d.z - d.y * to.z,
                to.z * d.x - d.z * to.x,
                to.x * d.y - d.x * to.y,
            );
            let is_far = (far * squared).less(across.dot(across) * concentration);
            *near = (zero.less(spread).bits() & !is_far.bits()) as u8;
        }
        near
    }
}

/// The least squared distance among the places that light from `from` may belong to, and whose it
/// is.
struct Nearest<'a> {
    blocks: &'a [PlaceBlock],
    from: Vec3,
}

impl LaneKernel for Nearest<'_> {
    type Output = (usize, f32);
    #[inline(always)]
    fn run<L: Lanes>(self) -> (usize, f32) {
        let from = Vec3Lanes::<L>::splat(self.from.to_array());
        let (mut least, mut of) = (L::splat(f32::INFINITY), L::splat(0.0));
        let mut number = 0.0;
        for block in self.blocks {
            let to = from - means::<L>(block);
            let squared = to.dot(to);
            // Nothing is near an empty place.
            let is_near = squared.less(L::splat(NEAR) * L::load(&block.spread));
            let is_less = squared.less(least) & is_near;
            least = squared.select(is_less, least);
            of = L::splat(number).select(is_less, of);
            number += 1.0;
        }
        let (least, of) = (least.store(), of.store());
        let mut found = (0, f32::INFINITY);
        for lane in 0..LANES {
            let number = of[lane] as usize * LANES + lane;
            if least[lane] < found.1 || (least[lane] == found.1 && number < found.0) {
                found = (number, least[lane]);
            }
        }
        found
    }
}

/// Whether a place's middle is nearer than a distance.
struct KnownNear<'a> {
    blocks: &'a [PlaceBlock],
    from: Vec3,
    squared: f32,
}

impl LaneKernel for KnownNear<'_> {
    type Output = bool;
    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let from = Vec3Lanes::<L>::splat(self.from.to_array());
        let (zero, squared) = (L::splat(0.0), L::splat(self.squared));
        self.blocks.iter().any(|block| {
            let to = from - means::<L>(block);
            let is_known = zero.less(L::load(&block.spread));
            to.dot(to).less(squared).bits() & is_known.bits() != 0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::{CounterRng, UniformSphere};

    /// Blocks of places at random, a third of them unknown; shares of those with light.
    fn random(rng: &mut CounterRng, count: usize) -> Vec<PlaceBlock> {
        let mut blocks = vec![PlaceBlock::default(); blocks_of(count)];
        let mut sum = 0.0;
        for number in 0..blocks.len() * LANES {
            let known = number < count && rng.next_f32() < 0.67;
            if known {
                sum = (sum + rng.next_f32() / count as f32).min(1.0);
            }
            let spread = match known {
                true => 10f32.powf(-6.0 * rng.next_f32()),
                false => 0.0,
            };
            let mean = if known {
                UniformSphere::sample(rng.next_2d()) * rng.next_f32()
            } else {
                Vec3::ZERO
            };
            let place = Place {
                mean: mean.to_array(),
                spread,
                weight: rng.next_f32(),
                cumulative: sum,
                ..Place::default()
            };
            set_place(&mut blocks, number, place);
        }
        blocks
    }

    /// Both kinds of lanes have the bits of a plain loop over all places; a place that is left out
    /// is noticed.
    #[test]
    fn lanes_have_the_bits_of_a_loop() {
        let mut rng = CounterRng::new(1, 2, 3);
        let mut positive = 0;
        for case in 0..400 {
            let blocks = random(&mut rng, 1 + case % 256);
            for query in 0..20 {
                let position = match query {
                    0 => Vec3::ZERO,
                    1 => place(&blocks, 0).mean(),
                    _ => UniformSphere::sample(rng.next_2d()) * rng.next_f32(),
                };
                let aim = place(&blocks, (rng.next_f32() * (blocks.len() * LANES) as f32) as usize);
                let direction = match query % 2 {
                    0 => UniformSphere::sample(rng.next_2d()),
                    _ => (aim.mean() - position + 0.01 * UniformSphere::sample(rng.next_2d()))
                        .normalize_or(Vec3::X),
                };
                let (mut before, mut expected) = (0.0, 0.0);
                for place in places(&blocks) {
                    let share = place.cumulative - before;
                    before = place.cumulative;
                    if share > 0.0 {
                        expected += share * place.density(place.mean() - position, direction);
                    }
                }
                positive += u32::from(expected > 0.0);
                let by_distance = places(&blocks).enumerate().filter(|(_, place)| place.is_known());
                let closest = by_distance
                    .map(|(k, place)| (k, (position - place.mean()).length_squared(), place.spread))
                    .filter(|(_, squared, spread)| *squared < NEAR * spread)
                    .min_by(|(_, a, _), (_, b, _)| a.total_cmp(b))
                    .map(|(k, ..)| k);
                for lanes in [LaneChoice::best(), LaneChoice::ARRAY] {
                    let found = density(lanes, &blocks, position, direction);
                    assert_eq!(found.to_bits(), expected.to_bits(), "{found} {expected}");
                    assert_eq!(nearest(lanes, &blocks, position), closest);
                }
            }
        }
        assert!(positive > 1000, "{positive}");
    }

    /// A number selects the place whose share it lies in.
    #[test]
    fn numbers_select_places_by_their_shares() {
        let mut rng = CounterRng::new(4, 5, 6);
        for case in 0..100 {
            let blocks = random(&mut rng, 1 + case);
            for _ in 0..50 {
                let u = rng.next_f32();
                let found = selected(&blocks, u);
                let expected = places(&blocks).find(|place| place.cumulative > u);
                assert_eq!(found.map(|(place, _)| place), expected);
                if let Some((place, before)) = found {
                    assert!((before..place.cumulative).contains(&u));
                }
            }
        }
    }
}
