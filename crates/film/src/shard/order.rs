//! The order in which shards are merged, and reasons against merging them.

use super::Shard;
use super::error::{MissingSamples, ShardError};
use super::header::ShardHeader;
use super::part::ShardPart;
use crate::Film;
use std::ops::Range;

/// Merges shards that are in memory, in the order of their samples: the same bits for any order of
/// the input.
///
/// # Errors
///
/// [`ShardError::None`], [`ShardError::Foreign`], [`ShardError::Overlap`], [`ShardError::Missing`].
pub fn merge_shards(shards: Vec<Shard>) -> Result<Film, ShardError> {
    let named: Vec<_> = shards
        .iter()
        .map(|shard| (shard.header().name(), shard.header()))
        .collect();
    let order = order(&named)?;
    if let Some(missing) = missing(shards.iter().map(Shard::header)) {
        return Err(ShardError::Missing(missing));
    }
    let [width, height] = shards[0].header().image().size;
    let mut film = Film::new(width, height)?;
    for place in order {
        let shard = shards[place].film();
        // All shards have the image's size.
        film.merge(shard).map_err(|size| ShardError::Size {
            found: size.from,
            expected: size.into,
        })?;
    }
    Ok(film)
}

/// Indices of the shards in the order of their samples, or why they are no shards of one image.
/// Each error names them; those without samples are left out.
pub fn order(shards: &[(String, &ShardHeader)]) -> Result<Vec<usize>, ShardError> {
    let (first_name, first) = shards.first().ok_or(ShardError::None)?;
    for (name, header) in shards {
        if let Some(difference) = first.image().difference(header.image()) {
            return Err(ShardError::Foreign {
                shard: name.clone(),
                first: first_name.clone(),
                difference,
            });
        }
    }
    let mut order: Vec<usize> = (0..shards.len()).collect();
    order.retain(|&place| shards[place].1.first() < shards[place].1.end());
    order.sort_by_key(|&place| (shards[place].1.first(), shards[place].1.end()));
    for pair in order.windows(2) {
        let [(first, before), (second, after)] = [&shards[pair[0]], &shards[pair[1]]];
        if after.first() < before.end() {
            return Err(ShardError::Overlap {
                first: first.clone(),
                second: second.clone(),
                samples: after.first()..before.end().min(after.end()),
            });
        }
    }
    Ok(order)
}

/// Samples of the image that no shard has, and the parts that would contain them; `None` if there
/// are none.
///
/// Shards need not be of one partition. The parts named are those of the partition of which there
/// are most shards.
pub fn missing<'a>(shards: impl Iterator<Item = &'a ShardHeader>) -> Option<MissingSamples> {
    let mut headers: Vec<&ShardHeader> = shards.collect();
    let total = headers.first()?.image().samples;
    headers.sort_by_key(|header| (header.first(), header.end()));
    let (mut samples, mut next) = (Vec::new(), 0);
    for header in &headers {
        if header.first() > next {
            samples.push(next..header.first());
        }
        next = next.max(header.end());
    }
    if next < total {
        samples.push(next..total);
    }
    if samples.is_empty() {
        return None;
    }
    let meets = |share: &Range<u32>| {
        samples
            .iter()
            .any(|gap| share.start < gap.end && gap.start < share.end)
    };
    let parts = ShardPart::all(usual_count(&headers))
        .filter(|part| meets(&part.of(total)))
        .collect();
    Some(MissingSamples { samples, parts })
}

/// The number of parts that most shards name; of two that equally many name, the larger.
fn usual_count(headers: &[&ShardHeader]) -> u32 {
    let mut counts: Vec<u32> = headers.iter().map(|header| header.part().count()).collect();
    counts.sort_unstable();
    let runs = counts.chunk_by(|a, b| a == b);
    runs.max_by_key(|run| run.len()).map_or(1, |run| run[0])
}
