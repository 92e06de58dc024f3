//! Sobol points whose groups of four dimensions belong together.
//!
//! Each group has the points of the first four dimensions of Sobol's sequence, the best ones. Group
//! `g` has them in an order of its own: coordinate `d` of sample `s` is, over GF(2),
//!
//! > `x_{g,d} = S_d M_g s`,
//!
//! with `S_d` the generator matrix of Sobol dimension `d` and `M_g` upper triangular with ones on
//! its diagonal. `M_g` permutes each aligned block of `2^m` samples within itself, for all `m`, so
//! a group alone is the same net as Sobol's. Together the groups are one digital sequence, and how
//! evenly it fills pairs and triples of groups depends on the matrices. They are chosen by search
//! (`search.rs`), column by column, for the least errors of integrands that depend on the group and
//! on one or two earlier groups, over up to 8,192 samples. Groups in random orders (Burley 2020,
//! §5) are to each other as independent numbers are.

mod matrices;
#[cfg(test)]
mod search;

use self::matrices::{COLUMNS, SEARCHED};
use crate::scrambling::{mix, permute_upwards, permute_upwards_lanes};
use crate::sobol_directions::{GROUP, REVERSED_DIRECTIONS};
use lightshed_lanes::{LANES, LaneWords};

/// Groups that belong together: the camera's, and those of fifteen vertices of a path.
const LINKED: usize = 32;

/// Groups from this on are copies of linked groups.
const COPIES: u32 = 1 << 29;

/// The group that is copy `number` of a linked group.
pub(crate) const fn copy_of(group: u32, number: u32) -> u32 {
    let own = number.wrapping_mul(LINKED as u32) % COPIES;
    COPIES + own + group % LINKED as u32
}

/// [`mix`] of a seed and a number.
const fn hash(seed: u32, number: u32) -> u32 {
    mix(seed ^ number.wrapping_mul(0x9e37_79b9))
}

/// The columns of the matrix of a group: bit `c` of column `c` is set, those below are of the
/// table, or hashed where that ends; those above are zero. The identity for group 0.
const fn columns(group: usize) -> [u32; 32] {
    let mut columns = [0; 32];
    let mut c = 0;
    while c < 32 {
        let below = match group {
            0 => 0,
            _ if c < SEARCHED => COLUMNS[group][c] as u32,
            _ => hash(group as u32, c as u32) & ((1 << c) - 1),
        };
        columns[c] = 1 << c | below;
        c += 1;
    }
    columns
}

/// Bits of an index that are looked up together.
const TOGETHER: usize = LANES.ilog2() as usize;

/// The coordinates, bits reversed, of indices that have one, two or three bits in a row:
/// `[g][row of bits][d][bits]`, 44 KiB. They are sums of columns of `S_d M_g`; `n` samples read the
/// first `log₂ n / 3` rows of each group.
static REVERSED: [[[[u32; LANES]; GROUP]; 32usize.div_ceil(TOGETHER)]; LINKED] = {
    let mut table = [[[[0; LANES]; GROUP]; 32usize.div_ceil(TOGETHER)]; LINKED];
    let mut group = 0;
    while group < LINKED {
        let columns = columns(group);
        let mut bit = 0;
        while bit < 32 {
            let (row, own) = (bit / TOGETHER, bit % TOGETHER);
            let mut dimension = 0;
            while dimension < GROUP {
                let mut column = 0;
                let mut from = 0;
                while from <= bit {
                    if columns[bit] >> from & 1 == 1 {
                        column ^= REVERSED_DIRECTIONS[from][dimension];
                    }
                    from += 1;
                }
                let mut bits = 0;
                while bits < LANES {
                    if bits >> own & 1 == 1 {
                        table[group][row][dimension][bits] ^= column;
                    }
                    bits += 1;
                }
                dimension += 1;
            }
            bit += 1;
        }
        group += 1;
    }
    table
};

/// The four coordinates of sample `sample` in group `group`, bits reversed. Groups that are not
/// [linked](is_linked) have the matrices of those that are, so they take samples in the random
/// order that `order` is the seed of.
#[inline(always)]
pub(crate) fn ordered_point(group: u32, sample: u32, order: impl FnOnce() -> u32) -> [u32; GROUP] {
    let index = if is_linked(group) {
        sample
    } else {
        permute_upwards(sample.reverse_bits(), order()).reverse_bits()
    };
    reversed_point(group, index)
}

/// Whether a group belongs together with others: one of the first, or a copy of one.
#[inline(always)]
pub(crate) fn is_linked(group: u32) -> bool {
    group < LINKED as u32 || group >= COPIES
}

/// The numbers of eight samples in the random order that `order` is the seed of.
#[inline(always)]
pub(crate) fn reorder_lanes<W: LaneWords>(sample: W, order: W) -> W {
    permute_upwards_lanes(sample.reverse_bits(), order).reverse_bits()
}

#[inline(always)]
fn rows(group: u32) -> &'static [[[u32; LANES]; GROUP]; 32usize.div_ceil(TOGETHER)] {
    &REVERSED[group as usize % LINKED]
}

/// The four coordinates of point `index` of group `group`, bits reversed.
#[inline(always)]
pub(crate) fn reversed_point(group: u32, mut index: u32) -> [u32; GROUP] {
    let mut point = [0; GROUP];
    for row in rows(group) {
        if index == 0 {
            break;
        }
        let bits = index as usize % LANES;
        index >>= TOGETHER;
        for dimension in 0..GROUP {
            point[dimension] ^= row[dimension][bits];
        }
    }
    point
}

/// [`reversed_point`] of eight indices.
#[inline(always)]
pub(crate) fn reversed_point_lanes<W: LaneWords>(group: u32, index: W) -> [W; GROUP] {
    let mut point = [W::splat(0); GROUP];
    let mut bits = index.store().iter().fold(0, |all, one| all | one);
    let mut rest = index;
    for row in rows(group) {
        if bits == 0 {
            break;
        }
        for dimension in 0..GROUP {
            point[dimension] = point[dimension] ^ W::lookup(&row[dimension], rest);
        }
        (bits, rest) = (bits >> TOGETHER, rest.shift_right::<{ TOGETHER as i32 }>());
    }
    point
}
