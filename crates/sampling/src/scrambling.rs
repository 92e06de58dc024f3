//! Owen's nested scrambling by a hash, on words with their bits reversed; and the hash of seeds.

use lightshed_lanes::LaneWords;

/// A permutation of the words in which bit `b` of the result depends only on bits `0..=b` of `x`
/// (Vegdahl 2021). Requires well-mixed seeds.
#[inline(always)]
pub(crate) fn permute_upwards(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// [`permute_upwards`] of eight words.
#[inline(always)]
pub(crate) fn permute_upwards_lanes<W: LaneWords>(mut x: W, seed: W) -> W {
    x = x ^ (x * W::splat(0x3d20_adea));
    x = x + seed;
    // An odd factor, by `| 1`: one of the operations that words have.
    x = x * ((seed.shift_right::<16>() & W::splat(!1)) + W::splat(1));
    x = x ^ (x * W::splat(0x0552_6c56));
    x ^ (x * W::splat(0x53a2_2864))
}

/// Final mix of MurmurHash3: makes one more seed from existing ones.
#[inline(always)]
pub(crate) const fn mix(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
    x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}

/// [`mix`] of eight words.
#[inline(always)]
pub(crate) fn mix_lanes<W: LaneWords>(x: W) -> W {
    let x = (x ^ x.shift_right::<16>()) * W::splat(0x85eb_ca6b);
    let x = (x ^ x.shift_right::<13>()) * W::splat(0xc2b2_ae35);
    x ^ x.shift_right::<16>()
}
