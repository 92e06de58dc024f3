//! Dividing a large group by all threads.

use super::BINS;
use super::bins::{Binning, Bins, Plane, Sides, Summary};
use super::partition::{halve, partition_chunks};
use crate::item::BoxItem;
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};
use lightshed_sampling::parallel::{for_each_chunk, reduce};

/// Groups are divided in chunks of so many.
const CHUNK: usize = 1 << 12;

struct Summarize<'a>(&'a [BoxItem]);

impl LaneKernel for Summarize<'_> {
    type Output = Summary;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Summary {
        Summary::of::<L>(self.0)
    }
}

struct Fill<'a>(&'a mut Bins, &'a Binning, &'a [BoxItem]);

impl LaneKernel for Fill<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.0.add::<L, BINS>(self.1, self.2);
    }
}

struct Best<'a>(&'a Bins, &'a Binning);

impl LaneKernel for Best<'_> {
    type Output = Option<Plane>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<Plane> {
        self.0.best_plane::<L, BINS>(self.1, &mut { Sides::NONE })
    }
}

/// Divides a group of two or more and moves it; `sides` gives the room for both parts by the number
/// of the first. Returns also that number.
pub fn divide_together<'a>(
    lanes: LaneChoice,
    from: &mut [BoxItem],
    by_half: bool,
    sides: impl FnOnce(usize) -> (&'a mut [BoxItem], &'a mut [BoxItem]),
) -> (Summary, usize) {
    let summary = reduce(
        from,
        CHUNK,
        |items| lanes.run(Summarize(items)),
        |a, b| a.union(&b),
    )
    .unwrap_or(Summary::NONE);
    if !by_half {
        let binning = Binning::new(&summary, BINS);
        let mut of_chunks = vec![Bins::EMPTY; from.len().div_ceil(CHUNK)];
        for_each_chunk(&mut of_chunks, 1, |index, bins| {
            let items = &from[index * CHUNK..((index + 1) * CHUNK).min(from.len())];
            lanes.run(Fill(&mut bins[0], &binning, items));
        });
        let mut bins = Bins::EMPTY;
        of_chunks.iter().for_each(|other| bins.merge(other));
        if let Some(plane) = lanes.run(Best(&bins, &binning)) {
            let counts: Vec<usize> = of_chunks.iter().map(|bins| bins.count_before(&plane)).collect();
            let low: usize = counts.iter().sum();
            if low > 0 && low < from.len() {
                partition_chunks(&plane, from, sides(low), &counts, CHUNK);
                return (summary, low);
            }
        }
    }
    let low = halve(&summary, from);
    let (low_side, high_side) = sides(low);
    low_side.copy_from_slice(&from[..low]);
    high_side.copy_from_slice(&from[low..]);
    (summary, low)
}
