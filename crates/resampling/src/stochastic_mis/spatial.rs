//! Sets over the places of a tile (spatial SMIS, Dittebrandt 2025 eq. 6.3 and §6.3.2).

use super::scratch::TileScratch;
use super::tile::{ChainTile, Exchange, SetWeight};

/// Adds to each place an estimate by `steps` steps, the mean over steps of
/// `f(x) / ((1/n) Σ_j p(x|t_j))` with the techniques of all `n` places of the tile. Before each
/// step the states are permuted, by `below(n)`, which returns a uniform index below `n`.
pub fn spatial_smis<T: ChainTile>(
    tile: &mut T,
    states: &mut [T::State],
    steps: usize,
    exchange: Exchange,
    mut below: impl FnMut(usize) -> usize,
    scratch: &mut TileScratch<T>,
) {
    let places = states.len();
    if places == 0 {
        return;
    }
    let (each, share) = (1.0 / places as f64, 1.0 / steps as f64);
    for step in 0..steps {
        tile.begin_step(step, states);
        if exchange == Exchange::Traded {
            permute(states, &mut below);
        }
        scratch.clear();
        scratch.step(tile, step, states);
        for place in 0..places {
            scratch.others.clear();
            tile.draw_other(step, place, &mut scratch.others);
            for sample in scratch.samples[place].iter().chain(&scratch.others) {
                let set = scratch.techniques.iter();
                let density: f64 = set.map(|technique| tile.density(place, technique, sample)).sum();
                let (set, other) = (each * density, tile.other_density(place, sample));
                tile.add(place, sample, SetWeight { share, set, other });
            }
        }
    }
}

/// Permutes `items`, each order with the same probability (Fisher and Yates). `below(n)` returns a
/// uniform index below `n`; an index that is not below `n` counts as the last.
pub fn permute<T>(items: &mut [T], mut below: impl FnMut(usize) -> usize) {
    for rest in (2..=items.len()).rev() {
        items.swap(rest - 1, below(rest).min(rest - 1));
    }
}
