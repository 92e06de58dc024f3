//! Owen's nested scrambling of words whose bits are reversed: one for points, a hash for orders.
//! And a hash of seeds.

use lightshed_lanes::LaneWords;

/// Scrambles a coordinate of points: `x ↦ q (x + p)` modulo 2³². `p` is the seed, and `q` is its
/// upper half made odd. Bit `b` of the result depends only on bits `0..=b` of `x`.
///
/// Of two coordinates that agree in exactly the low `k` bits, the images are a uniform pair of
/// those that agree in exactly the low `k` bits: the difference is `2ᵏ` times an odd number, and
/// `q` times it is uniform among these (in the low 16 bits of the words); `p` makes the place
/// uniform. So two points are distributed as by Owen's scrambling, in which each bit is flipped at
/// random for each value of the bits below, and so is the variance of a mean over points: it
/// depends on pairs only. One multiplication does what a hash does with four.
#[inline(always)]
pub(crate) fn scramble(x: u32, seed: u32) -> u32 {
    x.wrapping_add(seed).wrapping_mul(seed >> 16 | 1)
}

/// [`scramble`] of eight words.
#[inline(always)]
pub(crate) fn scramble_lanes<W: LaneWords>(x: W, seed: W) -> W {
    // An odd factor, by `| 1`: one of the operations that words have.
    (x + seed) * ((seed.shift_right::<16>() & W::splat(!1)) + W::splat(1))
}

/// A permutation of the words in which bit `b` of the result depends only on bits `0..=b` of `x`
/// (Vegdahl 2021). Requires well-mixed seeds.
#[inline(always)]
pub(crate) fn permute_upwards(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = scramble(x, seed);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// [`permute_upwards`] of eight words.
#[inline(always)]
pub(crate) fn permute_upwards_lanes<W: LaneWords>(mut x: W, seed: W) -> W {
    x = x ^ (x * W::splat(0x3d20_adea));
    x = scramble_lanes(x, seed);
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

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_testkit::check_faults;
    use proptest::prelude::*;

    /// What can take the place of [`scramble`].
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// Exclusive-or with the seed: a digital shift.
        Shift,
        /// The seed is added, and nothing multiplied.
        Sum,
        /// The factor is that of another coordinate: the same for all seeds here.
        OneFactor,
    }

    /// By enumeration: over all seeds the low four bits of two words that agree in exactly `k` of
    /// them become each such pair equally often. Those bits depend on four bits of each half of the
    /// seed.
    #[test]
    fn pairs_are_those_of_owens_scrambling() {
        let scrambled = |fault, x: u32, seed: u32| match fault {
            None => scramble(x, seed),
            Some(Fault::Shift) => x ^ seed,
            Some(Fault::Sum) => x.wrapping_add(seed),
            Some(Fault::OneFactor) => x.wrapping_add(seed).wrapping_mul(11),
        };
        check_faults(&[Fault::Shift, Fault::Sum, Fault::OneFactor], |fault| {
            for (x, y) in (0..16u32).flat_map(|x| (0..x).map(move |y| (x, y))) {
                let agree = (x ^ y).trailing_zeros();
                let mut counts = [[0u32; 16]; 16];
                for seed in (0..256).map(|bits| bits & 15 | bits >> 4 << 16) {
                    let [a, b] = [x, y].map(|word| scrambled(fault, word, seed) as usize % 16);
                    counts[a][b] += 1;
                }
                for (a, b) in (0..256u32).map(|pair| (pair % 16, pair / 16)) {
                    let expected = match (a ^ b).trailing_zeros() == agree {
                        true => 2 << agree,
                        false => 0,
                    };
                    let count = counts[a as usize][b as usize];
                    if count != expected {
                        return Err(format!("{x}, {y} to {a}, {b}: {count} for {expected}"));
                    }
                }
            }
            Ok(())
        })
        .unwrap();
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            rng_seed: proptest::test_runner::RngSeed::Fixed(0x11948),
            failure_persistence: None,
            ..Default::default()
        })]

        /// The property that defines nested scrambling: words that agree in exactly the low `k`
        /// bits map to words that agree in exactly the low `k` bits.
        #[test]
        fn scramblings_are_nested(x: u32, y: u32, shared in 0u32..32, seed: u32) {
            let y = x ^ (y << shared);
            for scrambled in [scramble, permute_upwards] {
                let images = scrambled(x, seed) ^ scrambled(y, seed);
                prop_assert_eq!(images.trailing_zeros(), (x ^ y).trailing_zeros());
            }
        }
    }
}
