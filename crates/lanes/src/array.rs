//! Lanes in plain arrays.

use crate::{AnyLanes, LANES, LaneMask, LaneWords, Lanes};
use core::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

/// The specification of [`Lanes`], for any machine.
#[derive(Clone, Copy, Debug)]
pub struct ArrayLanes([f32; LANES]);

/// The specification of [`LaneWords`].
#[derive(Clone, Copy, Debug)]
pub struct ArrayWords([u32; LANES]);

/// The specification of [`LaneMask`]; masks of eight lanes in AVX-512 are the same.
#[derive(Clone, Copy, Debug)]
pub struct ArrayMask(pub(crate) u8);

#[inline(always)]
fn lanewise(a: ArrayLanes, b: ArrayLanes, f: impl Fn(f32, f32) -> f32) -> ArrayLanes {
    ArrayLanes(core::array::from_fn(|i| f(a.0[i], b.0[i])))
}

#[inline(always)]
fn wordwise(a: ArrayWords, b: ArrayWords, f: impl Fn(u32, u32) -> u32) -> ArrayWords {
    ArrayWords(core::array::from_fn(|i| f(a.0[i], b.0[i])))
}

#[inline(always)]
fn mask(a: ArrayLanes, b: ArrayLanes, f: impl Fn(f32, f32) -> bool) -> ArrayMask {
    ArrayMask((0..LANES).fold(0, |bits, i| bits | u8::from(f(a.0[i], b.0[i])) << i))
}

macro_rules! operators {
    ($($type:ident $each:ident: $($trait:ident $method:ident $f:expr),+;)+) => {$($(
        impl $trait for $type {
            type Output = Self;
            #[cfg_attr(target_arch = "x86_64", inline(never))]
            #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
            fn $method(self, other: Self) -> Self {
                $each(self, other, $f)
            }
        }
    )+)+};
}

operators! {
    ArrayLanes lanewise: Add add |a, b| a + b, Sub sub |a, b| a - b, Mul mul |a, b| a * b, Div div |a, b| a / b;
    ArrayWords wordwise: Add add u32::wrapping_add, Mul mul u32::wrapping_mul, BitAnd bitand |a, b| a & b, BitXor bitxor |a, b| a ^ b;
}

impl Neg for ArrayLanes {
    type Output = Self;
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn neg(self) -> Self {
        Self(self.0.map(|value| -value))
    }
}

impl BitAnd for ArrayMask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for ArrayMask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for ArrayMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl LaneMask for ArrayMask {
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.0)
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Self(bits as u8)
    }
}

impl LaneWords for ArrayWords {
    #[inline(always)]
    fn splat(word: u32) -> Self {
        Self([word; LANES])
    }
    #[inline(always)]
    fn load(words: &[u32; LANES]) -> Self {
        Self(*words)
    }
    #[inline(always)]
    fn store(self) -> [u32; LANES] {
        self.0
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn rotate<const LEFT: i32, const RIGHT: i32>(self) -> Self {
        const { assert!(LEFT + RIGHT == 32) };
        Self(self.0.map(|word| word.rotate_left(LEFT as u32)))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn shift_right<const BITS: i32>(self) -> Self {
        Self(self.0.map(|word| word >> BITS))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn reverse_bits(self) -> Self {
        Self(self.0.map(u32::reverse_bits))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn lookup(table: &[u32; LANES], index: Self) -> Self {
        Self(index.0.map(|index| table[index as usize % LANES]))
    }
}

impl AnyLanes for ArrayLanes {
    const COUNT: usize = LANES;
    type Mask = ArrayMask;

    #[inline(always)]
    fn read(bits: &[u32]) -> Self {
        Self(core::array::from_fn(|i| f32::from_bits(bits[..LANES][i])))
    }
    #[inline(always)]
    fn write(self, bits: &mut [u32]) {
        bits[..LANES].copy_from_slice(&self.0.map(f32::to_bits));
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; LANES])
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn pick(table: &[f32; 4], index: Self) -> Self {
        Self(index.0.map(|index| table[index.to_bits() as usize % 4]))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn min(self, other: Self) -> Self {
        lanewise(self, other, |a, b| if a < b { a } else { b })
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn max(self, other: Self) -> Self {
        lanewise(self, other, |a, b| if a > b { a } else { b })
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn times_sign(self, sign: Self) -> Self {
        lanewise(
            self,
            sign,
            |value, sign| if sign.is_sign_negative() { -value } else { value },
        )
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn select(self, mask: ArrayMask, other: Self) -> Self {
        Self(core::array::from_fn(|i| {
            if mask.0 >> i & 1 == 1 {
                self.0[i]
            } else {
                other.0[i]
            }
        }))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn equal(self, other: Self) -> ArrayMask {
        mask(self, other, |a, b| a == b)
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn less(self, other: Self) -> ArrayMask {
        mask(self, other, |a, b| a < b)
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn less_equal(self, other: Self) -> ArrayMask {
        mask(self, other, |a, b| a <= b)
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn flipped(self, flip: u32) -> Self {
        Self(core::array::from_fn(|i| self.0[(i ^ flip as usize) % LANES]))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn compress(self, mask: u32) -> Self {
        Self(crate::tables::COMPRESS[mask as usize & 255].map(|lane| self.0[lane as usize % LANES]))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn least_of(self, mask: u32) -> Self {
        let chosen = (0..LANES)
            .filter(|lane| mask >> lane & 1 == 1)
            .map(|lane| self.0[lane]);
        Self(
            [chosen.fold(
                f32::INFINITY,
                |least, value| if value < least { value } else { least },
            ); LANES],
        )
    }
}

impl Lanes for ArrayLanes {
    const IN_REGISTERS: bool = false;
    type Words = ArrayWords;
    type Long = Self;

    #[inline(always)]
    fn load(values: &[f32; LANES]) -> Self {
        Self(*values)
    }
    #[inline(always)]
    fn store(self) -> [f32; LANES] {
        self.0
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn load_transposed(rows: [&[f32; LANES]; LANES]) -> [Self; LANES] {
        core::array::from_fn(|j| Self(core::array::from_fn(|i| rows[i][j])))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn load_pairs(pairs: [&[f32; 2]; LANES]) -> [Self; 2] {
        core::array::from_fn(|j| Self(pairs.map(|pair| pair[j])))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn copysign(self, sign: Self) -> Self {
        lanewise(self, sign, f32::copysign)
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn to_bits(self) -> ArrayWords {
        ArrayWords(self.0.map(f32::to_bits))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn from_bits(bits: ArrayWords) -> Self {
        Self(bits.0.map(f32::from_bits))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn from_integers(words: ArrayWords) -> Self {
        Self(words.0.map(|word| word as f32))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn to_integers(self) -> ArrayWords {
        ArrayWords(self.0.map(|value| value as u32))
    }
    #[inline(always)]
    fn first(self) -> f32 {
        self.0[0]
    }
    #[inline(always)]
    fn lane(self, index: usize) -> f32 {
        self.0[index % LANES]
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn delayed(self) -> Self {
        Self(core::array::from_fn(|i| if i == 0 { 0.0 } else { self.0[i - 1] }))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn evens_and_odds(self, next: Self) -> [Self; 2] {
        let at = |i: usize| if i < LANES { self.0[i] } else { next.0[i - LANES] };
        [0, 1].map(|odd| Self(core::array::from_fn(|i| at(2 * i + odd))))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn total(self) -> Self {
        let v = self.0;
        Self([((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7])); LANES])
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn running_sums(self) -> Self {
        // Each step adds to all lanes, and adds zero to some: that matters only for −0.
        let v = self.0;
        let pairs: [f32; LANES] = core::array::from_fn(|i| v[i] + if i % 2 == 1 { v[i - 1] } else { 0.0 });
        let fours: [f32; LANES] =
            core::array::from_fn(|i| pairs[i] + if i % 4 >= 2 { pairs[i / 4 * 4 + 1] } else { 0.0 });
        let v = core::array::from_fn(|i| fours[i] + if i >= 4 { fours[3] } else { 0.0 });
        Self(v)
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn count_at_most(self, bound: f64) -> usize {
        self.0
            .into_iter()
            .filter(|&value| f64::from(value) <= bound)
            .count()
    }
}
