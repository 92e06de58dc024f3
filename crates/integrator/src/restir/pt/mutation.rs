//! Steps of Markov chains among paths.

use super::{PathPixel, PathReservoir, TREES};
use crate::emitter_sampler::EmitterSampler;
use lightshed_sampling::{CounterRng, PassNumbers, parallel};
use lightshed_shift::PathMutator;

/// Mutates the pixels' paths by so many steps each, for trees with roulette from the second number
/// on.
pub(super) fn step<'a, E: EmitterSampler>(
    pixels: &[PathPixel<'a, E>],
    reservoirs: &mut [PathReservoir<'a, E>],
    (steps, roulette_from): (u32, u32),
    numbers: PassNumbers,
) {
    let chunks = pixels.chunks(TREES).zip(reservoirs.chunks_mut(TREES));
    parallel::for_each(chunks, |chunk, (pixels, reservoirs)| {
        let mut mutator = PathMutator::new(roulette_from);
        let mut streams: [CounterRng; TREES] =
            std::array::from_fn(|place| numbers.pixel(chunk * TREES + place));
        let (mut paths, mut owners) = (Vec::with_capacity(TREES), Vec::with_capacity(TREES));
        for _ in 0..steps {
            paths.clear();
            owners.clear();
            for (place, (pixel, reservoir)) in pixels.iter().zip(reservoirs.iter()).enumerate() {
                if let (Some(domain), Some(&path)) = (&pixel.domain, reservoir.sample()) {
                    let rng = &mut streams[place];
                    let ([u, v], size) = (rng.next_2d(), rng.next_f32());
                    paths.push((&domain.paths, path, [u, v, size]));
                    owners.push(place);
                }
            }
            mutator.propose(paths.iter().copied(), |number, mutation| {
                let (place, held) = (owners[number], paths[number].1.target());
                let rng = &mut streams[place];
                reservoirs[place] = reservoirs[place].mutated(held, mutation, rng);
            });
        }
    });
}
