//! Any partition, any order.

use super::*;
use crate::PixelStatistics;
use lightshed_testkit::check_faults;
use proptest::prelude::*;

/// A partition of samples by its inner bounds, and an order of its parts.
fn partitions() -> impl Strategy<Value = (u32, Vec<u32>, Vec<usize>)> {
    (1u32..300).prop_flat_map(|samples| {
        let bounds = prop::collection::btree_set(0..=samples, 0..12);
        bounds.prop_flat_map(move |bounds| {
            let bounds: Vec<u32> = bounds.into_iter().collect();
            let places: Vec<usize> = (0..=bounds.len()).collect();
            (Just(samples), Just(bounds), Just(places).prop_shuffle())
        })
    })
}

fn shards(image: &ImageKey, bounds: &[u32]) -> Vec<Shard> {
    let starts = std::iter::once(0).chain(bounds.iter().copied());
    let ends = bounds.iter().copied().chain([image.samples]);
    let count = bounds.len() as u32 + 1;
    let ranges = starts.zip(ends).zip(ShardPart::all(count));
    ranges
        .map(|((start, end), part)| shard(image, part, start..end))
        .collect()
}

/// Largest relative difference of a mean or variance of two films.
fn distance(a: &Film, b: &Film) -> f64 {
    let mut worst: f64 = 0.0;
    for y in 0..a.height() {
        for x in 0..a.width() {
            let [a, b] = [a, b].map(|film| film.get(x, y).unwrap());
            assert_eq!((a.count(), a.non_finite()), (b.count(), b.non_finite()));
            let moments = |p: &PixelStatistics| [p.mean(), p.variance().unwrap_or_default()];
            for (a, b) in moments(a).iter().flatten().zip(moments(b).iter().flatten()) {
                worst = worst.max((a - b).abs() / b.abs().max(f64::MIN_POSITIVE));
            }
        }
    }
    worst
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_partition_merges_to_the_same_bits_in_any_order((samples, bounds, order) in partitions(), seed in 0u64..1000) {
        let image = ImageKey { seed, ..key([3, 9], samples) };
        let shards = shards(&image, &bounds);
        let merged = merge_shards(shards.clone()).unwrap();
        let shuffled = order.iter().map(|&place| shards[place].clone()).collect();
        prop_assert_eq!(&merge_shards(shuffled).unwrap(), &merged);
        // One run of all samples.
        let whole = film(&image, 0..samples);
        prop_assert!(distance(&merged, &whole) <= 1e-12, "{}", distance(&merged, &whole));
        prop_assert_eq!(merged.non_finite(), whole.non_finite());
        // One part is the run itself.
        let one = merge_shards(vec![shard(&image, ShardPart::WHOLE, 0..samples)]).unwrap();
        prop_assert_eq!(one, whole);
    }
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    /// A mean of variances, weighted by the numbers of samples, as renderers do that keep no
    /// counts.
    WithinOnly,
    /// Every part counts alike.
    Unweighted,
    /// The order of arrival.
    Arrival,
}

/// Merging that goes wrong in each of these ways is found by what the property asks.
#[test]
fn faults_of_merging_are_found() {
    let image = key([5, 4], 100);
    let shards = shards(&image, &[10, 15, 80]);
    let whole = film(&image, 0..100);
    check_faults(&[Fault::WithinOnly, Fault::Unweighted, Fault::Arrival], |fault| {
        let merge = |shards: Vec<Shard>| match fault {
            None => merge_shards(shards).unwrap(),
            Some(Fault::Arrival) => {
                let mut film = Film::new(5, 4).unwrap();
                shards.iter().for_each(|shard| film.merge(shard.film()).unwrap());
                film
            }
            Some(fault) => wrong(&shards, fault),
        };
        let merged = merge(shards.clone());
        let reversed = merge(shards.iter().rev().cloned().collect());
        let distance = distance(&merged, &whole);
        match merged == reversed && distance <= 1e-12 {
            true => Ok(()),
            false => Err(format!("{distance:e}")),
        }
    })
    .unwrap();
}

/// Moments put together in a wrong way.
fn wrong(shards: &[Shard], fault: Fault) -> Film {
    let [width, height] = shards[0].header().image().size;
    let mut film = Film::new(width, height).unwrap();
    let columns = width as usize;
    for (band, pixels) in film.bands_mut().enumerate() {
        let rows = pixels.len() / columns;
        for y in 0..rows {
            for x in 0..columns {
                let own = |shard: &Shard| *shard.film().get(x as u32, (8 * band + y) as u32).unwrap();
                let parts: Vec<PixelStatistics> = shards.iter().map(own).collect();
                let count: u64 = parts.iter().map(PixelStatistics::count).sum();
                let non_finite = parts.iter().map(PixelStatistics::non_finite).sum();
                let weight = |part: &PixelStatistics| match fault {
                    Fault::Unweighted => 1.0 / parts.len() as f64,
                    _ => part.count() as f64 / count as f64,
                };
                let mean =
                    std::array::from_fn(|c| parts.iter().map(|part| weight(part) * part.mean()[c]).sum());
                let squares = |part: &PixelStatistics, c: usize| part.squared_deviations()[c];
                let deviations = std::array::from_fn(|c| parts.iter().map(|part| squares(part, c)).sum());
                let place = crate::film::index_in_band(columns, rows, x, y);
                pixels[place] = PixelStatistics::from_parts(count, non_finite, mean, deviations).unwrap();
            }
        }
    }
    film
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let image = key([4, 3], 60);
    let sound = parts(&image, 3);
    let refused = |shards: Vec<Shard>| merge_shards(shards).unwrap_err();
    assert!(matches!(refused(Vec::new()), ShardError::None));
    let missing = refused(vec![sound[2].clone(), sound[0].clone()]);
    assert_eq!(missing.to_string(), "missing: shards 1/3 (samples 20..40)");
    let twice = refused([&sound[..], &sound[1..2]].concat());
    assert!(
        matches!(&twice, ShardError::Overlap { samples, .. } if *samples == (20..40)),
        "{twice}"
    );
    let other = shard(&image, ShardPart::new(1, 2).unwrap(), 39..60);
    let overlap = refused(vec![sound[0].clone(), sound[1].clone(), other]);
    assert_eq!(
        overlap.to_string(),
        "shard 1/2 (samples 39..60) and shard 1/3 (samples 20..40) have samples 39 to 39 both"
    );
    // Parts of different partitions that fit are an image, too.
    let rest = shard(&image, ShardPart::new(1, 2).unwrap(), 40..60);
    let mixed = merge_shards(vec![rest, sound[1].clone(), sound[0].clone()]).unwrap();
    assert_eq!(mixed, merge_shards(sound.clone()).unwrap());
    let foreign = parts(
        &ImageKey {
            seed: 8,
            ..image.clone()
        },
        3,
    );
    let error = refused(vec![sound[0].clone(), foreign[1].clone(), sound[2].clone()]);
    assert!(error.to_string().contains("seed 8 instead of 7"), "{error}");
    // More parts than samples: empty ones are no part of anything.
    let few = key([2, 2], 2);
    assert_eq!(merge_shards(parts(&few, 5)).unwrap(), film(&few, 0..2));
}

#[test]
fn a_film_has_what_its_header_says() {
    let image = key([4, 3], 60);
    let header = ShardHeader::of_part(image.clone(), ShardPart::new(0, 3).unwrap());
    let error = Shard::new(header.clone(), film(&image, 0..19)).unwrap_err();
    assert!(
        matches!(
            error,
            ShardError::Counts {
                found: 19,
                expected: 20,
                ..
            }
        ),
        "{error}"
    );
    let other = Film::new(3, 4).unwrap();
    assert!(matches!(Shard::new(header, other), Err(ShardError::Size { .. })));
}
