//! Morton codes against bit-by-bit oracles.

use lightshed_sampling::CounterRng;
use lightshed_spatial::{morton30_decode, morton30_encode, morton63_decode, morton63_encode};

/// Interleaves one bit after the other.
fn interleave(cell: [u32; 3], bits: u32) -> u64 {
    (0..bits)
        .flat_map(|bit| (0..3).map(move |axis| (bit, axis)))
        .fold(0, |code, (bit, axis)| {
            code | u64::from(cell[axis] >> bit & 1) << (3 * bit + axis as u32)
        })
}

#[test]
fn encode_is_interleaving() {
    for i in 0..10_000 {
        let mut rng = CounterRng::new(1, i, 0);
        let cell = [rng.next_u32(), rng.next_u32(), rng.next_u32()];
        assert_eq!(u64::from(morton30_encode(cell)), interleave(cell, 10));
        assert_eq!(morton63_encode(cell), interleave(cell, 21));
    }
}

#[test]
fn decode_inverts() {
    for i in 0..10_000 {
        let code = CounterRng::new(2, i, 0).next_u64();
        let (low, code) = (code as u32 & (u32::MAX >> 2), code & (u64::MAX >> 1));
        assert_eq!(morton30_encode(morton30_decode(low)), low);
        assert_eq!(morton63_encode(morton63_decode(code)), code);
        assert_eq!(morton30_decode(low | 3 << 30), morton30_decode(low));
        assert_eq!(morton63_decode(code | 1 << 63), morton63_decode(code));
    }
}

#[test]
fn exhaustive_axes() {
    for i in 0..1 << 10 {
        assert_eq!(
            morton30_decode(morton30_encode([i, 1023 - i, i ^ 0x155])),
            [i, 1023 - i, i ^ 0x155]
        );
    }
    for i in (0..1 << 21).step_by(17) {
        let cell = [i, (1 << 21) - 1 - i, i ^ 0x15_5555];
        assert_eq!(morton63_decode(morton63_encode(cell)), cell);
    }
    assert_eq!(morton63_encode([(1 << 21) - 1; 3]), u64::MAX >> 1);
    assert_eq!(morton30_encode([1023; 3]), u32::MAX >> 2);
}
