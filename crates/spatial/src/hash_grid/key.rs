//! Names of cells.

/// The name of a cell of a [`LevelGrid`](crate::LevelGrid), in 62 bits: its level, its position and
/// the direction that the surface faces. Different cells have different keys.
///
/// | bits | what |
/// |---|---|
/// | 0–17, 18–35, 36–53 | cell along x, y and z, in two's complement |
/// | 54–58 | level: cells are 2^level times as large as the finest |
/// | 59–61 | which way the normal points: ±x, ±y, ±z, or 6 without |
///
/// In a grid with facets the highest three bits of each coordinate, which are copies of the sign
/// within its reach, are instead those bits and three of the facet combined by exclusive or.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct CellKey(u64);

/// Bits of a coordinate.
const COORDINATE_BITS: u32 = 18;
/// Cells along an axis on each side of the origin.
pub(super) const REACH: f64 = (1u32 << (COORDINATE_BITS - 1)) as f64;
/// Bits of a facet in each coordinate.
const FACET_BITS: u32 = 3;
/// Cells along an axis on each side of the origin in a grid with facets.
pub(super) const FACET_REACH: f64 = (1u32 << (COORDINATE_BITS - 1 - FACET_BITS)) as f64;
/// Levels that have a number.
pub(super) const LEVELS: u32 = 32;
/// Number of directions of a normal, including none.
pub(super) const FACES: u32 = 7;

impl CellKey {
    /// Of coordinates within [`REACH`].
    #[inline(always)]
    pub(super) fn new([x, y, z]: [i32; 3], level: u32, face: u32) -> Self {
        let bits = |c: i32| (c as u32 & ((1 << COORDINATE_BITS) - 1)) as u64;
        let place = bits(x) | bits(y) << COORDINATE_BITS | bits(z) << (2 * COORDINATE_BITS);
        let rest = (level % LEVELS) | (face % (FACES + 1)) << 5;
        Self(place | u64::from(rest) << (3 * COORDINATE_BITS))
    }

    /// The key of the same cell for a facet, of which the lowest nine bits count. One to one for
    /// coordinates within [`FACET_REACH`].
    #[inline(always)]
    pub(super) fn with_facet(self, facet: u16) -> Self {
        let bits = |axis: u32| u64::from(facet) >> (FACET_BITS * axis) & ((1 << FACET_BITS) - 1);
        let place = |axis| bits(axis) << (COORDINATE_BITS * (axis + 1) - FACET_BITS);
        Self(self.0 ^ place(0) ^ place(1) ^ place(2))
    }

    /// The bits.
    #[inline(always)]
    pub fn bits(self) -> u64 {
        self.0
    }

    /// The level of the cell.
    #[inline(always)]
    pub fn level(self) -> u32 {
        (self.0 >> (3 * COORDINATE_BITS)) as u32 % LEVELS
    }

    /// Cell numbers along the axes, in cells of its level. Of a key without a facet.
    pub fn coordinates(self) -> [i32; 3] {
        [0, 1, 2].map(|axis| {
            let bits = (self.0 >> (axis * COORDINATE_BITS)) as u32;
            (bits << (32 - COORDINATE_BITS)) as i32 >> (32 - COORDINATE_BITS)
        })
    }

    /// The direction that the surface faces: 2·axis, plus one if the normal is negative; 6 without
    /// a normal.
    #[inline(always)]
    pub fn face(self) -> u32 {
        (self.0 >> (3 * COORDINATE_BITS + 5)) as u32 & 7
    }

    /// The cell of the next level, twice as large, that this one lies in; of the last level itself.
    /// Of a key without a facet.
    #[inline]
    #[must_use]
    pub fn parent(self) -> Self {
        match self.level() + 1 {
            LEVELS => self,
            level => Self::new(self.coordinates().map(|c| c >> 1), level, self.face()),
        }
    }

    /// The key mixed to 63 bits, one to one, and never 0: equal words are equal keys.
    #[inline(always)]
    pub(super) fn word(self) -> u64 {
        // Odd factors modulo 2^63 and downward shifts are invertible.
        let mut x = self.0 | 1 << 62;
        x ^= x >> 32;
        x = x.wrapping_mul(FACTORS[0]) & LOW;
        x ^= x >> 32;
        x = x.wrapping_mul(FACTORS[1]) & LOW;
        x ^ x >> 32
    }

    /// The key of a word; `None` of what is the word of no key.
    pub(super) fn of_word(word: u64) -> Option<Self> {
        let mut x = word & LOW;
        x ^= x >> 32;
        x = x.wrapping_mul(const { inverse(FACTORS[1]) }) & LOW;
        x ^= x >> 32;
        x = x.wrapping_mul(const { inverse(FACTORS[0]) }) & LOW;
        x ^= x >> 32;
        (x >> 62 == 1).then_some(Self(x & !(1 << 62)))
    }
}

/// Bits of a word.
const LOW: u64 = (1 << 63) - 1;
/// Odd factors of the mixing.
const FACTORS: [u64; 2] = [0xd6e8_feb8_6659_fd93, 0xa076_1d64_78bd_642f];

/// The inverse of an odd number modulo 2^64: each of Newton's steps doubles the number of bits.
const fn inverse(odd: u64) -> u64 {
    let mut x = odd;
    let mut step = 0;
    while step < 6 {
        x = x.wrapping_mul(2u64.wrapping_sub(odd.wrapping_mul(x)));
        step += 1;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;
    use std::collections::HashSet;

    #[test]
    fn keys_hold_what_they_are_made_of() {
        let mut words = HashSet::new();
        let mut keys = HashSet::new();
        let (mut faceted, mut names) = (HashSet::new(), HashSet::new());
        for i in 0..100_000 {
            let mut rng = CounterRng::new(1, i, 0);
            let reach = REACH as i32;
            let mut coordinate = || match rng.next_u32() % 4 {
                0 => -reach,
                1 => reach - 1,
                _ => (rng.next_u32() % 64) as i32 - 32,
            };
            let coordinates = [coordinate(), coordinate(), coordinate()];
            let (level, face) = (rng.next_u32() % LEVELS, rng.next_u32() % FACES);
            let key = CellKey::new(coordinates, level, face);
            assert_eq!(
                (key.coordinates(), key.level(), key.face()),
                (coordinates, level, face)
            );
            assert!(key.word() != 0 && key.word() >> 63 == 0);
            assert_eq!(CellKey::of_word(key.word()), Some(key));
            let parent = key.parent();
            let halves = coordinates.map(|c| c.div_euclid(2));
            if level + 1 < LEVELS {
                assert_eq!((parent.coordinates(), parent.level()), (halves, level + 1));
            }
            assert_eq!(parent.face(), face);
            // Within the reach of facets, no two facets of any cells share a key.
            let near = coordinates.map(|c| c >> FACET_BITS);
            assert!(near.iter().all(|c| f64::from(c.abs()) <= FACET_REACH));
            let facet = (rng.next_u32() % 512) as u16;
            let whole = CellKey::new(near, level, face);
            if faceted.insert(whole.with_facet(facet)) {
                names.insert((near, level, face, facet));
            }
            assert!(names.contains(&(near, level, face, facet)));
            assert_eq!(whole.with_facet(0), whole);
            words.insert(key.word());
            keys.insert(key);
        }
        assert_eq!(words.len(), keys.len());
        assert_eq!(faceted.len(), names.len());
    }
}
