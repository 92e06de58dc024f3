//! Uniformity and independence of the counter-based generator along each of its coordinates.

use lightshed_sampling::{CounterRng, PathSeed, f32_from_u32, f64_from_u64, threefry4x32};
use lightshed_testkit::{check_faults, chi_squared_test, family_significance};

/// Chance that a whole test here rejects a perfect generator.
const FALSE_POSITIVES: f64 = 1e-6;

/// What can be planted in the generator.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// A fifth of the rounds.
    TooFewRounds,
    /// The pixel does not enter the key.
    PixelForgotten,
    /// The sample is added to the pixel: neighbours share streams.
    SampleAddedToPixel,
    /// All words of a block are its first.
    BlockNotAdvanced,
}

/// `CounterRng::at` with a fault.
fn word(fault: Option<Fault>, seed: u64, pixel: u32, sample: u32, dimension: u32) -> u32 {
    match fault {
        None => CounterRng::at(seed, pixel, sample, dimension),
        Some(Fault::TooFewRounds) => {
            let key = [seed as u32, (seed >> 32) as u32, pixel, sample];
            threefry4x32::<2>([dimension / 4, 0, 0, 0], key)[dimension as usize % 4]
        }
        Some(Fault::PixelForgotten) => CounterRng::at(seed, 0, sample, dimension),
        Some(Fault::SampleAddedToPixel) => CounterRng::at(seed, pixel + sample, 0, dimension),
        Some(Fault::BlockNotAdvanced) => CounterRng::at(seed, pixel, sample, dimension / 4 * 4),
    }
}

/// Top bits of two words that should be independent: χ² on a 16 × 16 table.
fn pair_test(pairs: impl Iterator<Item = (u32, u32)>, significance: f64) -> Result<(), String> {
    let mut observed = vec![0u64; 256];
    let mut count = 0u64;
    for (a, b) in pairs {
        observed[(a >> 28 << 4 | b >> 28) as usize] += 1;
        count += 1;
    }
    let expected = vec![count as f64 / 256.0; 256];
    chi_squared_test(&observed, &expected, significance)
        .map(drop)
        .map_err(|error| error.to_string())
}

/// Pairs of words at neighbouring places along each coordinate, and across two coordinates at once.
#[test]
fn neighbours_are_independent() {
    let faults = [
        Fault::TooFewRounds,
        Fault::PixelForgotten,
        Fault::SampleAddedToPixel,
        Fault::BlockNotAdvanced,
    ];
    check_faults(&faults, |fault| {
        let word = |pixel, sample, dimension| word(fault, 0x5eed, pixel, sample, dimension);
        let significance = family_significance(FALSE_POSITIVES, 6);
        const N: u32 = 1 << 16;
        pair_test((0..N).map(|i| (word(3, 5, i), word(3, 5, i + 1))), significance)?;
        pair_test((0..N).map(|i| (word(i, 5, 2), word(i + 1, 5, 2))), significance)?;
        pair_test((0..N).map(|i| (word(3, i, 2), word(3, i + 1, 2))), significance)?;
        pair_test((0..N).map(|i| (word(i, 5, 2), word(i, 6, 2))), significance)?;
        pair_test((0..N).map(|i| (word(i, 5, 2), word(i + 1, 4, 2))), significance)?;
        pair_test((0..N).map(|i| (word(i, 5, 6), word(i, 5, 7))), significance)
    })
    .unwrap();
}

/// Flipping any one of the 160 bits of seed, pixel, sample and dimension flips each of the word's
/// 32 bits with probability ½: χ² of flips against stays for each of the 5120 pairs.
#[test]
fn every_input_bit_reaches_every_output_bit() {
    check_faults(&[Fault::TooFewRounds, Fault::PixelForgotten], |fault| {
        const TRIALS: u32 = 400;
        let evaluate = |p: [u32; 5]| word(fault, u64::from(p[0]) | u64::from(p[1]) << 32, p[2], p[3], p[4]);
        for input in 0..160 {
            let mut flips = [0u64; 32];
            for trial in 0..TRIALS {
                let mut place: [u32; 5] = core::array::from_fn(|i| CounterRng::at(77, trial, i as u32, 0));
                let before = evaluate(place);
                place[input / 32] ^= 1 << (input % 32);
                let difference = before ^ evaluate(place);
                for (bit, flips) in flips.iter_mut().enumerate() {
                    *flips += u64::from(difference >> bit & 1);
                }
            }
            for (output, flips) in flips.into_iter().enumerate() {
                let half = f64::from(TRIALS) / 2.0;
                let observed = [flips, u64::from(TRIALS) - flips];
                chi_squared_test(
                    &observed,
                    &[half; 2],
                    family_significance(FALSE_POSITIVES, 160 * 32),
                )
                .map_err(|error| format!("input bit {input}, output bit {output}: {error}"))?;
            }
        }
        Ok::<(), String>(())
    })
    .unwrap();
}

/// All 256 values of every byte of the word, over a grid of places.
#[test]
fn bytes_are_uniform() {
    for byte in 0..4 {
        let mut observed = vec![0u64; 256];
        for pixel in 0..64 {
            for sample in 0..64 {
                let mut rng = CounterRng::new(1, pixel, sample);
                for _ in 0..32 {
                    observed[(rng.next_u32() >> (8 * byte) & 255) as usize] += 1;
                }
            }
        }
        let expected = vec![(64 * 64 * 32) as f64 / 256.0; 256];
        chi_squared_test(&observed, &expected, FALSE_POSITIVES / 4.0).unwrap();
    }
}

/// The streams of path seeds neither repeat each other nor a pixel's stream: among 2¹⁶ × 4
/// words of 64 bits a repetition has probability 2⁻²⁹.
#[test]
fn path_streams_are_distinct() {
    let mut seen = Vec::new();
    for i in 0..1u64 << 15 {
        for mut rng in [PathSeed::new(i).stream(), CounterRng::new(i, 0, 0)] {
            seen.extend([(); 4].map(|()| rng.next_u64()));
        }
    }
    let count = seen.len();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), count);
}

#[test]
fn path_seed_replays_and_keeps_its_bits() {
    for bits in [0, 1, u64::MAX, 0x0123_4567_89ab_cdef] {
        let seed = PathSeed::new(bits);
        assert_eq!(seed.bits(), bits);
        assert_eq!(bytemuck::bytes_of(&seed), bits.to_le_bytes());
        let [mut a, mut b] = [seed.stream(), seed.stream()];
        for _ in 0..100 {
            assert_eq!(a.next_u32(), b.next_u32());
        }
    }
}

#[test]
fn uniform_numbers_stay_below_one_and_reach_zero() {
    assert_eq!(f32_from_u32(0), 0.0);
    assert_eq!(f32_from_u32(u32::MAX), 1.0f32.next_down());
    assert_eq!(f64_from_u64(0), 0.0);
    assert_eq!(f64_from_u64(u64::MAX), 1.0f64.next_down());
    // Every 24-bit number is met, by exactly 2⁸ words each: the map is the top 24 bits.
    for top in (0..1 << 24).step_by(4099) {
        let exact = f64::from(top) / f64::from(1 << 24);
        assert_eq!(f64::from(f32_from_u32(top << 8)), exact);
        assert_eq!(f64::from(f32_from_u32(top << 8 | 255)), exact);
    }
}
