//! Weights of the paths that pixels share.

use super::{Block, Group, Lit, Scattering};
use crate::path::scattered_lanes::{is_black, load_rows};
use lightshed_lanes::{LANES, LaneMask, Lanes};

/// `m_i / p_i = 1 / Σ_j p_j` for the two continuations from `x₂`, by an emitter sample there and by
/// the sampled direction, without the density of the emitter sample, which is the same for all
/// pixels; 0 if the tree's own pixel cannot have made it.
#[inline(always)]
pub(super) fn weights<L: Lanes>(blocks: &[Block], groups: &[Group], lit: &Lit) -> [f32; 2] {
    let (zero, huge) = (L::splat(0.0), L::splat(f32::MAX));
    let (mut by_emitter, mut by_wi, mut least) = (zero, zero, huge);
    let mut own = [0.0; 2];
    let mut used = 0;
    for (block, group) in blocks.iter().zip(groups) {
        if block.valid == 0 {
            continue;
        }
        let (rows, valid) = (&block.rows, L::Mask::from_bits(block.valid));
        // A pixel that would not use a continuation does not make it.
        let uses_emitter = valid & !is_black(load_rows::<L>(&rows.emitter.value));
        let uses_wi = valid & !is_black(load_rows::<L>(&rows.wi.value));
        let second = L::load(&rows.pdf) * L::load(&rows.geometry);
        let (emitter, wi) = (
            second.select(uses_emitter, zero),
            (second * L::load(&rows.wi.pdf)).select(uses_wi, zero),
        );
        (by_emitter, by_wi) = (by_emitter + emitter, by_wi + wi);
        least = least.min(second.select(valid, huge));
        used |= uses_emitter.bits() | uses_wi.bits() << LANES;
        if let Some(lane) = lit.own_lane(group) {
            own = [emitter.store()[lane], wi.store()[lane]];
        }
    }
    let totals = [by_emitter.store(), by_wi.store()];
    let [by_emitter, by_wi] = [totals[0].iter().sum(), totals[1].iter().sum()];
    let is_sound = |total: f32, is_used: bool| match is_used {
        true => total > SMALL && total < 1.0 / SMALL,
        false => true,
    };
    if least.less(L::splat(SMALL)).bits() != 0
        || !is_sound(by_emitter, used & ((1 << LANES) - 1) != 0)
        || !is_sound(by_wi, used >> LANES != 0)
    {
        return weights_of_all_sizes(blocks, groups, lit);
    }
    let weight = |own: f32, total: f32| if own > 0.0 { 1.0 / total } else { 0.0 };
    [weight(own[0], by_emitter), weight(own[1], by_wi)]
}

/// Densities, and sums of them, that are no less and no more than the inverse can be summed as
/// `f32`.
const SMALL: f32 = 1e-25;

/// [`weights`] where `f32` has no room for densities.
#[inline(never)]
fn weights_of_all_sizes(blocks: &[Block], groups: &[Group], lit: &Lit) -> [f32; 2] {
    let (mut totals, mut own) = ([0.0f64; 2], [0.0f64; 2]);
    for (block, group) in blocks.iter().zip(groups) {
        let (connections, own_lane) = (&block.rows, lit.own_lane(group));
        let mut left = block.valid;
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            let second = f64::from(connections.pdf[lane]) * f64::from(connections.geometry[lane]);
            let is_black = |scattering: &Scattering| scattering.value.iter().all(|row| row[lane] == 0.0);
            // A pixel that would not use a continuation does not make it.
            let densities = [
                match is_black(&connections.emitter) {
                    true => 0.0,
                    false => second,
                },
                match is_black(&connections.wi) {
                    true => 0.0,
                    false => second * f64::from(connections.wi.pdf[lane]),
                },
            ];
            for (total, density) in totals.iter_mut().zip(densities) {
                *total += if density.is_finite() {
                    density.max(0.0)
                } else {
                    0.0
                };
            }
            if own_lane == Some(lane) {
                own = densities;
            }
        }
    }
    std::array::from_fn(|way| {
        let share = (sound(own[way]) / totals[way].min(f64::MAX)).min(1.0);
        let weight = share / own[way];
        if weight.is_finite() { weight as f32 } else { 0.0 }
    })
}

/// A density, or 0 for what is none.
fn sound(density: f64) -> f64 {
    match density > 0.0 {
        true => density.min(f64::MAX),
        false => 0.0,
    }
}
