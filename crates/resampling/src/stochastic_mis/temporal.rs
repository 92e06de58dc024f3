//! Sets over the steps of a place (temporal SMIS, Dittebrandt 2025 eq. 6.2 and §6.3.2).

use super::scratch::TileScratch;
use super::tile::{ChainTile, Exchange, SetWeight};

/// Adds to each place an estimate by `steps` steps, `Σ_i f(x_i) / Σ_j p(x_i|t_j)` over the steps
/// of a set. After each step all states move on by one place, the last one to the first.
///
/// A set has at most one step for each place: after that, a state comes back to where it was. More
/// steps make several sets, and their estimates are weighted by their numbers of steps.
pub fn temporal_smis<T: ChainTile>(
    tile: &mut T,
    states: &mut [T::State],
    steps: usize,
    exchange: Exchange,
    scratch: &mut TileScratch<T>,
) {
    let places = states.len();
    if places == 0 {
        return;
    }
    let longest = match exchange {
        Exchange::Traded => places,
        Exchange::Kept => steps,
    };
    let mut first = 0;
    while first < steps {
        let count = longest.min(steps - first);
        scratch.clear();
        for step in first..first + count {
            tile.begin_step(step, states);
            scratch.step(tile, step, states);
            if exchange == Exchange::Traded {
                states.rotate_right(1);
            }
        }
        let share = count as f64 / steps as f64;
        for place in 0..places {
            scratch.others.clear();
            tile.draw_other(first, place, &mut scratch.others);
            let (techniques, samples) = (&scratch.techniques, &scratch.samples);
            let own = samples.iter().skip(place).step_by(places).flatten();
            for sample in own.chain(&scratch.others) {
                let set = techniques.iter().skip(place).step_by(places);
                let set = set.map(|technique| tile.density(place, technique, sample)).sum();
                let other = tile.other_density(place, sample);
                tile.add(place, sample, SetWeight { share, set, other });
            }
        }
        first += count;
    }
}
