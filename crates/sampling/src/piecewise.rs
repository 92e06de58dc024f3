//! Piecewise-constant densities on the unit interval.
//!
//! `n` values `f_i ≥ 0` on bins of equal width define `p(x) = f_i / (Σf / n)` for `x` in
//! `[i/n, (i+1)/n)`, a density with respect to length on [0, 1). Its inverse distribution function
//! is kept in *fixed point*: bin `i` owns the 32-bit numbers from `start_i` up to `start_{i+1}`,
//! and a uniform word `u` belongs to the bin that owns it.
//!
//! # Precision
//!
//! The distribution function is summed in compensated `f64` and rounded once, down to 32 bits. The
//! density reported is the one those integers *realise*, `n (start_{i+1} − start_i) / 2³²`, so
//! it integrates to one exactly and dividing by it is unbiased. Each bin of positive value owns at
//! least one number and each bin of value zero none, so neither `u = 0` nor `u → 1` samples a
//! zero, and no positive bin is lost however small its share. Comparisons are between integers: a
//! shader chooses the same bin.

use crate::measure::{Density, PrimarySample};
use crate::sum::CompensatedSum;
use crate::uniform::{remap, u32_from_f32};
use crate::weights::{WeightsError, validate};

const TWO_POW_32: f64 = 4_294_967_296.0;

/// A sample of a [`PiecewiseConstant1d`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PiecewiseSample {
    /// The point sampled, in [0, 1) and within bin `index`.
    pub x: f32,
    /// Its density with respect to length on the unit interval; positive.
    pub pdf: Density<PrimarySample>,
    /// The bin.
    pub index: u32,
    /// Position within the bin, uniform in [0, 1), never 1. It can be reused as a random number or
    /// for interpolation.
    pub fraction: f32,
}

/// Which bin owns a word, and how many words it owns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot {
    pub index: u32,
    /// Words owned, `1..=2³²`.
    pub width: u64,
    /// Place among them in [0, 1).
    pub fraction: f32,
}

/// Fills `starts` with the fixed-point distribution function of `values`. Returns the last bin that
/// owns any number (`None` if all values are zero) and the sum of the values. The values are valid,
/// and `scale` brings them to at most 1.
pub(crate) fn accumulate(values: &[f32], scale: f64, starts: &mut [u32]) -> (Option<u32>, f64) {
    accumulate_with(values.len(), |i| f64::from(values[i]) * scale, starts)
}

/// [`accumulate`] of the values `value(0), …`.
pub(crate) fn accumulate_with(
    len: usize,
    value: impl Fn(usize) -> f64,
    starts: &mut [u32],
) -> (Option<u32>, f64) {
    let total: CompensatedSum<f64> = (0..len).map(&value).collect();
    let positive = (0..len).filter(|&i| value(i) > 0.0).count() as u64;
    // One word for every positive bin, the others in proportion.
    let shared = TWO_POW_32 - positive as f64;
    let scale = shared / total.value().max(f64::MIN_POSITIVE);
    let mut before = CompensatedSum::<f64>::new();
    let (mut proportional, mut bins_before, mut last) = (0u64, 0u64, None);
    for (i, start) in starts.iter_mut().enumerate() {
        // After the last positive bin this is 2³²; the search never goes there.
        *start = u32::try_from(proportional + bins_before).unwrap_or(u32::MAX);
        let value = value(i);
        if value > 0.0 {
            before.add(value);
            // Monotone and at most `shared`, whatever rounding does.
            proportional = ((before.value() * scale).min(shared) as u64).max(proportional);
            bins_before += 1;
            last = Some(i as u32);
        }
    }
    (last, total.value())
}

/// Number of guide entries of a distribution of `len` bins, without the closing one: a power of
/// two, a quarter of `len`. More entries save no step of the search on average; fewer add some.
pub(crate) fn guide_buckets(len: usize) -> usize {
    (len.next_power_of_two() / 4).max(1)
}

/// Fills `guide` (`guide_buckets(len) + 1` entries): entry `b` is the bin that owns the first word
/// of bucket `b`, the last entry is `last`.
pub(crate) fn fill_guide(starts: &[u32], last: u32, guide: &mut [u32]) {
    let buckets = guide.len() - 1;
    let words = (1u64 << 32) / buckets as u64;
    let mut bin = 0;
    for (bucket, entry) in guide[..buckets].iter_mut().enumerate() {
        let word = bucket as u64 * words;
        while bin < last && u64::from(starts[bin as usize + 1]) <= word {
            bin += 1;
        }
        *entry = bin;
    }
    guide[buckets] = last;
}

/// A distribution in fixed point, ready to be searched.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FixedPoint<'a> {
    /// First word of each bin.
    pub starts: &'a [u32],
    /// Chen and Asau 1974's table of where to begin; see [`fill_guide`].
    pub guide: &'a [u32],
    /// Last bin that owns a word.
    pub last: u32,
}

impl FixedPoint<'_> {
    /// Words owned by bin `index`; 0 from the bin after `last` on.
    #[inline(always)]
    pub fn width(&self, index: u32) -> u64 {
        if index > self.last {
            return 0;
        }
        let end = if index == self.last {
            1 << 32
        } else {
            u64::from(self.starts[index as usize + 1])
        };
        end - u64::from(self.starts[index as usize])
    }

    /// The bin that owns `u`: the last one, up to `last`, that starts at or before it. A bin that
    /// owns nothing starts where the next one does, so it is never the last.
    #[inline(always)]
    pub fn search(&self, u: u32) -> u32 {
        // The guide has one entry more than buckets; their number is a power of two.
        let buckets = self.guide.len() as u64 - 1;
        let bucket = ((u64::from(u) * buckets) >> 32) as usize;
        let mut base = self.guide[bucket] as usize;
        let mut size = self.guide[bucket + 1] as usize - base + 1;
        while size > 1 {
            let half = size / 2;
            base = core::hint::select_unpredictable(self.starts[base + half] <= u, base + half, base);
            size -= half;
        }
        base as u32
    }

    /// [`search`](Self::search) and the place within the bin.
    #[inline(always)]
    pub fn locate(&self, u: u32) -> Slot {
        let index = self.search(u);
        let width = self.width(index);
        let offset = u - self.starts[index as usize];
        Slot {
            index,
            width,
            fraction: remap(offset as f32, 0.0, width as f32),
        }
    }
}

/// The bin of `[0, 1)` cut into `n ≤ 2²²` that holds `x`; points outside count to the nearest.
/// Exact: the product of a 24-bit and a 22-bit number fits `f64`.
#[inline(always)]
pub(crate) fn bin_of(x: f32, n: u32) -> u32 {
    ((f64::from(x) * f64::from(n)) as u32).min(n - 1)
}

/// The point `(index + fraction) / n`, rounded to a number that [`bin_of`] puts into bin `index`
/// again.
#[inline(always)]
pub(crate) fn point_in_bin(index: u32, fraction: f32, n: u32) -> f32 {
    let x = ((f64::from(index) + f64::from(fraction)) / f64::from(n)) as f32;
    let scaled = f64::from(x) * f64::from(n);
    // A bin is at least four spacings of f32 wide, so one step leads back: of the bits, since no
    // point is negative, and zero is in the first bin.
    let (above, below) = (scaled >= f64::from(index + 1), scaled < f64::from(index));
    f32::from_bits(x.to_bits() + u32::from(below) - u32::from(above))
}

/// A piecewise-constant density on [0, 1).
///
/// # Performance
///
/// A guide table (Chen and Asau 1974) says for each of `n/4` equal shares of the words where the
/// search begins, so a sample takes about two steps whatever `n`, and at worst `log₂ n`. Monotone
/// in `u`, unlike an alias table: stratified numbers give stratified samples.
///
/// # Example
///
/// ```
/// use lightshed_sampling::PiecewiseConstant1d;
/// let density = PiecewiseConstant1d::new(&[0.0, 3.0, 0.0, 1.0])?;
/// let sample = density.sample(0.25);
/// assert_eq!(sample.index, 1);
/// assert!((sample.pdf.value() - 3.0).abs() < 1e-6 && sample.pdf == density.pdf(sample.x));
/// assert!(!density.pdf(0.6).is_positive());
/// # Ok::<(), lightshed_sampling::WeightsError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PiecewiseConstant1d {
    starts: Vec<u32>,
    guide: Vec<u32>,
    /// Last bin of positive value.
    last: u32,
    integral: f64,
}

impl PiecewiseConstant1d {
    /// The most bins a density has: each must hold several `f32`.
    pub const MAX_LEN: usize = 1 << 22;

    /// The density proportional to `values` on bins of equal width.
    ///
    /// # Errors
    ///
    /// No value, too many, one negative or not finite, or all zero: see [`WeightsError`].
    pub fn new(values: &[f32]) -> Result<Self, WeightsError> {
        let largest = validate(values, Self::MAX_LEN)?;
        let mut starts = vec![0; values.len()];
        let (last, sum) = accumulate(values, 1.0 / largest, &mut starts);
        let last = last.ok_or(WeightsError::AllZero)?;
        let mut guide = vec![0; guide_buckets(values.len()) + 1];
        fill_guide(&starts, last, &mut guide);
        Ok(Self {
            last,
            integral: sum / values.len() as f64 * largest,
            starts,
            guide,
        })
    }

    #[inline(always)]
    fn fixed_point(&self) -> FixedPoint<'_> {
        FixedPoint {
            starts: &self.starts,
            guide: &self.guide,
            last: self.last,
        }
    }

    /// Samples by a uniform `u` in [0, 1) (anything outside counts as the nearest inside).
    ///
    /// An `f32` from random bits has 24 of them, so a bin is hit in multiples of 2⁻²⁴ where
    /// its density is known to 2⁻³²; with thousands of bins prefer
    /// [`sample_word`](Self::sample_word).
    #[inline(always)]
    pub fn sample(&self, u: f32) -> PiecewiseSample {
        self.sample_word(u32_from_f32(u))
    }

    /// Samples by 32 uniform bits: the finest the density resolves.
    #[inline(always)]
    pub fn sample_word(&self, u: u32) -> PiecewiseSample {
        let slot = self.fixed_point().locate(u);
        let n = self.starts.len() as u32;
        PiecewiseSample {
            x: point_in_bin(slot.index, slot.fraction, n),
            pdf: self.density(slot.width),
            index: slot.index,
            fraction: slot.fraction,
        }
    }

    #[inline(always)]
    fn density(&self, width: u64) -> Density<PrimarySample> {
        Density::new((width as f64 * (self.starts.len() as f64 / TWO_POW_32)) as f32)
    }

    /// The density at `x`, with respect to length on the unit interval; outside [0, 1) that of the
    /// nearest bin.
    #[inline]
    pub fn pdf(&self, x: f32) -> Density<PrimarySample> {
        self.density(self.fixed_point().width(bin_of(x, self.starts.len() as u32)))
    }

    /// Probability of bin `index`, `pdf / n`; 0 out of range.
    #[inline]
    pub fn pmf(&self, index: u32) -> f32 {
        (self.fixed_point().width(index) as f64 / TWO_POW_32) as f32
    }

    /// The number of the 2³² words that select bin `index`: exactly the realised distribution. 0
    /// out of range.
    #[inline]
    pub fn exact_count(&self, index: u32) -> u64 {
        self.fixed_point().width(index)
    }

    /// `∫ f = Σf / n` over the unit interval.
    #[inline]
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// Number of bins; at least 1.
    #[inline]
    #[expect(clippy::len_without_is_empty, reason = "a density is never empty")]
    pub fn len(&self) -> usize {
        self.starts.len()
    }

    /// First word owned by each bin, as a shader reads it. Search only up to [`last`](Self::last).
    #[inline]
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Start of a search, as a shader reads it: with `g` the number of entries minus one, the bin
    /// of word `u` is between entries `⌊u g / 2³²⌋` and the next.
    #[inline]
    pub fn guide(&self) -> &[u32] {
        &self.guide
    }

    /// The last bin of positive value. It owns all words from its start up to 2³² − 1.
    #[inline]
    pub fn last(&self) -> u32 {
        self.last
    }
}
