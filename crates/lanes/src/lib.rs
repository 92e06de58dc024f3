//! Eight `f32` lanes for code that treats eight rays, boxes, triangles or paths at once in the same
//! way.
//!
//! [`Lanes`] has three implementations: plain arrays ([`ArrayLanes`]), which are the specification
//! and run on any machine, AVX2, and AVX-512 for kernels that ask for it ([`LaneKernel::HOT`]),
//! chosen at run time. All give the same bits: no operation is contracted, approximate or
//! reordered, so tests can compare code in lanes with scalar code bit for bit. Loops over many
//! things can take the longest lanes there are ([`Lanes::Long`]).
//!
//! ```
//! use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};
//!
//! struct Hypotenuse<'a>(&'a [f32; 8], &'a [f32; 8]);
//! impl LaneKernel for Hypotenuse<'_> {
//!     type Output = [f32; 8];
//!     #[inline(always)]
//!     fn run<L: Lanes>(self) -> [f32; 8] {
//!         let (a, b) = (L::load(self.0), L::load(self.1));
//!         (a * a + b * b).sqrt().store()
//!     }
//! }
//! assert_eq!(LaneChoice::best().run(Hypotenuse(&[3.0; 8], &[4.0; 8])), [5.0; 8]);
//! ```
//!
//! # Writing a kernel
//!
//! Everything a kernel calls on lanes must be `#[inline(always)]`: code that is not inlined into
//! the function that runs the kernel is compiled without its instructions. That rules out closures
//! and iterator adaptors, because they are separate functions, and the compiler does not inline
//! them across such a boundary. Loops over lanes are plain `for` loops.
//!
//! # `unsafe`
//!
//! Two private modules have `unsafe` code. Intrinsics chosen at run time need it
//! (`docs/performance-rays.md` says how much they gain), and so does the call that asks the system
//! for huge pages ([`use_huge_pages`], `docs/performance.md`).

mod array;
mod choice;
mod column;
mod kernel;
#[cfg(target_os = "linux")]
#[allow(unsafe_code)]
mod pages;
mod prefetch;
mod tables;
mod vector;
#[cfg(target_arch = "x86_64")]
mod x86;

#[cfg(test)]
mod tests;

pub use array::{ArrayLanes, ArrayMask, ArrayWords};
pub use choice::LaneChoice;
pub use column::Column;
pub use kernel::LaneKernel;
pub use prefetch::{prefetch, prefetch_line};
pub use vector::Vec3Lanes;

use core::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

/// Asks the system to hold a list in huge pages, because it is long and is read at random: fewer
/// reads then wait for the address of their page. Values and addresses stay the same.
///
/// Returns how many bytes lie in huge pages now: at most those of the list, 0 if it is shorter than
/// a huge page of 2 MiB or if the system has none to give. Costs about a copy of the list, once.
/// Linux 6.1 or later; nothing is done elsewhere.
///
/// ```
/// let nodes = vec![[0.5f32; 16]; 1 << 17];
/// let bytes = lightshed_lanes::use_huge_pages(&nodes);
/// assert!(bytes <= size_of_val(&nodes[..]) && nodes[99] == [0.5; 16]);
/// ```
pub fn use_huge_pages<T>(list: &[T]) -> usize {
    #[cfg(target_os = "linux")]
    return pages::move_to_huge_pages(list);
    #[cfg(not(target_os = "linux"))]
    {
        let _ = list;
        0
    }
}

/// Resizes a list as [`Vec::resize`] does. If it needs other memory for that, the memory comes in
/// huge pages where the system has them: it is then faster to fill and to read at random.
///
/// Unlike [`use_huge_pages`] it copies nothing, so it is for lists of a moment too.
///
/// ```
/// let mut order = Vec::new();
/// lightshed_lanes::resize_in_huge_pages(&mut order, 1 << 20, 7u32);
/// assert!(order.len() == 1 << 20 && order.iter().all(|&place| place == 7));
/// ```
pub fn resize_in_huge_pages<T: Clone>(list: &mut Vec<T>, count: usize, value: T) {
    if count > list.capacity() {
        list.reserve_exact(count - list.len());
        #[cfg(target_os = "linux")]
        pages::come_in_huge_pages(list.spare_capacity_mut());
    }
    list.resize(count, value);
}

/// Number of lanes of [`Lanes`].
pub const LANES: usize = 8;

/// The greatest number of lanes of any kind.
pub const MOST_LANES: usize = 16;

/// Truth values, as many as there are lanes.
pub trait LaneMask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// Bit `i` is set where lane `i` is true; no other bits are.
    fn bits(self) -> u32;
    /// The mask whose lane `i` is bit `i`; other bits are ignored.
    fn from_bits(bits: u32) -> Self;
}

/// Eight 32-bit words; arithmetic wraps.
pub trait LaneWords:
    Copy + Add<Output = Self> + Mul<Output = Self> + BitAnd<Output = Self> + BitXor<Output = Self>
{
    /// The same word in all lanes.
    fn splat(word: u32) -> Self;
    /// From memory.
    fn load(words: &[u32; LANES]) -> Self;
    /// To memory.
    fn store(self) -> [u32; LANES];
    /// Rotated left by `LEFT` bits; `RIGHT` must be `32 − LEFT`, and `LEFT` between 1 and 31.
    fn rotate<const LEFT: i32, const RIGHT: i32>(self) -> Self;
    /// Shifted right by `BITS < 32`, zeros moving in.
    fn shift_right<const BITS: i32>(self) -> Self;
    /// With the bits of each word in the opposite order.
    fn reverse_bits(self) -> Self;
    /// Lane `i` is `table[index[i]]`, with indices taken modulo eight.
    fn lookup(table: &[u32; LANES], index: Self) -> Self;
}

/// Some number of `f32` values on which arithmetic is done lane by lane: eight ([`Lanes`]) or
/// sixteen ([`Lanes::Long`]). Loops that treat many things alike have the same bits with any
/// number.
///
/// `min` and `max` return their *second* argument if the first is NaN. Slab tests rely on it:
/// `0 · ∞`, from a ray that lies in a slab's plane, must not change the interval. (If the second
/// is NaN, they return the second as well.)
pub trait AnyLanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// How many there are: a divisor of [`MOST_LANES`].
    const COUNT: usize;

    /// What comparisons give.
    type Mask: LaneMask;

    /// The same value in all lanes.
    fn splat(value: f32) -> Self;
    /// The first [`COUNT`](Self::COUNT) values, given as bits.
    ///
    /// # Panics
    /// If there are fewer.
    fn read(bits: &[u32]) -> Self;
    /// Writes [`COUNT`](Self::COUNT) values, as bits.
    ///
    /// # Panics
    /// If there is room for fewer.
    fn write(self, bits: &mut [u32]);
    /// Lane `i` is `table[index[i]]`, where indices are the values' bits, taken modulo four.
    fn pick(table: &[f32; 4], index: Self) -> Self;
    /// The lesser; `other` where `self` is NaN.
    fn min(self, other: Self) -> Self;
    /// The greater; `other` where `self` is NaN.
    fn max(self, other: Self) -> Self;
    /// Square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// Without the sign.
    fn abs(self) -> Self;
    /// `self`, negated where the sign bit of `sign` is set.
    fn times_sign(self, sign: Self) -> Self;
    /// `self` where `mask` is true, else `other`.
    fn select(self, mask: Self::Mask, other: Self) -> Self;
    /// Where `self` equals `other` (false for NaN).
    fn equal(self, other: Self) -> Self::Mask;
    /// Where `self` is less than `other` (false for NaN).
    fn less(self, other: Self) -> Self::Mask;
    /// Where `self` is at most `other` (false for NaN).
    fn less_equal(self, other: Self) -> Self::Mask;
    /// Lane `i` is lane `i ^ flip`, `flip` less than [`COUNT`](Self::COUNT).
    fn flipped(self, flip: u32) -> Self;
    /// The lanes of the set bits of `mask`, moved to the front in their order. What follows them is
    /// unspecified.
    fn compress(self, mask: u32) -> Self;
    /// The least of the lanes of the set bits of `mask` (none of which may be NaN), in all lanes;
    /// ∞ if there is none.
    fn least_of(self, mask: u32) -> Self;
}

/// Eight `f32` values, and what can be done with eight of them beyond arithmetic.
pub trait Lanes: AnyLanes {
    /// Whether all lanes lie in one register and an operation is one or a few instructions. If not,
    /// an operation is eight times the code of one lane, and a kernel may put a large part into a
    /// function of its own.
    const IN_REGISTERS: bool;

    /// Bits of as many lanes.
    type Words: LaneWords;
    /// The longest lanes that the same instructions have.
    type Long: AnyLanes;

    /// From memory.
    fn load(values: &[f32; LANES]) -> Self;
    /// To memory.
    fn store(self) -> [f32; LANES];
    /// The transpose of eight rows: lane `i` of value `j` is `rows[i][j]`.
    fn load_transposed(rows: [&[f32; LANES]; LANES]) -> [Self; LANES];
    /// The transpose of eight pairs: lane `i` of value `j` is `pairs[i][j]`.
    fn load_pairs(pairs: [&[f32; 2]; LANES]) -> [Self; 2];
    /// The magnitude of `self` with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// The values' bits.
    fn to_bits(self) -> Self::Words;
    /// The values with these bits.
    fn from_bits(bits: Self::Words) -> Self;
    /// The words as integers below 2²⁴, converted exactly; unspecified for larger ones.
    fn from_integers(words: Self::Words) -> Self;
    /// Values from 0 up to, but not including, 2³¹, rounded toward zero; unspecified for other
    /// values.
    fn to_integers(self) -> Self::Words;
    /// Lane 0.
    fn first(self) -> f32;
    /// Lane `index`, modulo 8.
    fn lane(self, index: usize) -> f32;
    /// Zero, and then lanes `0 ..= 6`.
    fn delayed(self) -> Self;
    /// Lanes `0, 2, 4, …` of `self` and then of `next`, and lanes `1, 3, 5, …` of both.
    fn evens_and_odds(self, next: Self) -> [Self; 2];
    /// The sum of all lanes in each of them: `((0 + 1) + (2 + 3)) + ((4 + 5) + (6 + 7))`.
    fn total(self) -> Self;
    /// Lane `i` is the sum of lanes `0 ..= i`, added as halves of halves (Sklansky 1960). If no
    /// lane is negative or NaN, no sum is less than the one before it, and the two are equal if the
    /// lane is zero.
    fn running_sums(self) -> Self;
    /// In how many lanes `self` is at most `bound`, compared exactly (NaN is not).
    fn count_at_most(self, bound: f64) -> usize;
}

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/lanes.md")]
struct Guide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
