//! Piecewise-constant densities on the unit square: the sampler of an environment map.
//!
//! `width × height` values `f_ij ≥ 0`, row by row, define `p(u, v) = f_ij / mean(f)` on cells of
//! equal size, a density with respect to *area on the unit square*. The marginal
//! `p(v) ∝ Σ_j f_ij` selects a row, then the conditional `p(u | v)` a column, both in the fixed
//! point of [`PiecewiseConstant1d`](crate::PiecewiseConstant1d), which documents what is exact.
//!
//! Two guided searches of contiguous words; 1¼ words of memory a cell.

mod lanes;

pub use lanes::PiecewiseLanes2d;

use crate::measure::{Density, PrimarySample};
use crate::piecewise::{
    FixedPoint, accumulate, accumulate_with, bin_of, fill_guide, guide_buckets, point_in_bin,
};
use crate::uniform::u32_from_f32;
use crate::weights::{WeightsError, validate};

/// A sample of a [`PiecewiseConstant2d`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PiecewiseSample2d {
    /// The point sampled, in [0, 1)² and within `cell`.
    pub uv: [f32; 2],
    /// Its density with respect to area on the unit square; positive.
    pub pdf: Density<PrimarySample>,
    /// Column and row.
    pub cell: [u32; 2],
}

/// A piecewise-constant density on [0, 1)².
///
/// # Example
///
/// ```
/// use lightshed_sampling::{CounterRng, PiecewiseConstant2d};
/// // Two rows of three; the first row is v < ½.
/// let density = PiecewiseConstant2d::new(&[0.0, 1.0, 1.0, 0.0, 0.0, 4.0], 3)?;
/// let sample = density.sample(CounterRng::new(0, 0, 0).next_2d());
/// assert!(sample.pdf.is_positive() && sample.pdf == density.pdf(sample.uv));
/// assert!(!density.pdf([0.1, 0.1]).is_positive());
/// # Ok::<(), lightshed_sampling::WeightsError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PiecewiseConstant2d {
    width: u32,
    /// Row distribution.
    marginal: Vec<u32>,
    marginal_guide: Vec<u32>,
    marginal_last: u32,
    /// Column distributions, row by row.
    conditional: Vec<u32>,
    conditional_guide: Vec<u32>,
    /// Last positive column of each row (0 in a row of zeros, which the marginal never chooses).
    conditional_last: Vec<u32>,
    integral: f64,
}

impl PiecewiseConstant2d {
    /// The most columns, and the most rows, of a density.
    pub const MAX_SIDE: usize = 1 << 22;

    /// The density proportional to `values`, given row by row in rows of `width`.
    ///
    /// # Errors
    ///
    /// No value, rows that are not full, too many rows or columns, a value that is negative or not
    /// finite, or all zero: see [`WeightsError`].
    pub fn new(values: &[f32], width: usize) -> Result<Self, WeightsError> {
        let largest = validate(values, usize::MAX)?;
        if width == 0 || !values.len().is_multiple_of(width) {
            return Err(WeightsError::RaggedRows {
                count: values.len(),
                width,
            });
        }
        let height = values.len() / width;
        if width.max(height) > Self::MAX_SIDE {
            return Err(WeightsError::TooMany {
                count: width.max(height),
                limit: Self::MAX_SIDE,
            });
        }
        let scale = 1.0 / largest;
        let mut conditional = vec![0; values.len()];
        let guide_len = guide_buckets(width) + 1;
        let mut conditional_guide = vec![0; height * guide_len];
        let (conditional_last, row_sums): (Vec<u32>, Vec<f64>) = values
            .chunks_exact(width)
            .zip(conditional.chunks_exact_mut(width))
            .zip(conditional_guide.chunks_exact_mut(guide_len))
            .map(|((row, starts), guide)| {
                let (last, sum) = accumulate(row, scale, starts);
                let last = last.unwrap_or(0);
                fill_guide(starts, last, guide);
                (last, sum)
            })
            .unzip();
        let mut marginal = vec![0; height];
        let (marginal_last, sum) = accumulate_with(height, |row| row_sums[row], &mut marginal);
        let marginal_last = marginal_last.ok_or(WeightsError::AllZero)?;
        let mut marginal_guide = vec![0; guide_buckets(height) + 1];
        fill_guide(&marginal, marginal_last, &mut marginal_guide);
        Ok(Self {
            width: width as u32,
            marginal,
            marginal_guide,
            marginal_last,
            conditional,
            conditional_guide,
            conditional_last,
            integral: sum / values.len() as f64 * largest,
        })
    }

    #[inline(always)]
    fn rows(&self) -> FixedPoint<'_> {
        FixedPoint {
            starts: &self.marginal,
            guide: &self.marginal_guide,
            last: self.marginal_last,
        }
    }

    #[inline(always)]
    fn columns(&self, row: u32) -> FixedPoint<'_> {
        let (row, width) = (row as usize, self.width as usize);
        let guide_len = guide_buckets(width) + 1;
        FixedPoint {
            starts: &self.conditional[row * width..(row + 1) * width],
            guide: &self.conditional_guide[row * guide_len..(row + 1) * guide_len],
            last: self.conditional_last[row],
        }
    }

    /// `p = p(v) p(u|v)` from the words owned by the row and by the column.
    #[inline(always)]
    fn density(&self, row_width: u64, column_width: u64) -> Density<PrimarySample> {
        Density::new((row_width as f64 * column_width as f64 * self.density_of_words()) as f32)
    }

    /// The density of a cell whose row owns one word, and whose column does.
    #[inline(always)]
    fn density_of_words(&self) -> f64 {
        const TWO_POW_MINUS_64: f64 = 1.0 / 18_446_744_073_709_551_616.0;
        f64::from(self.width) * self.marginal.len() as f64 * TWO_POW_MINUS_64
    }

    /// Samples by a uniform point of [0, 1)²: `u[0]` chooses the column and `u[1]` the row. For
    /// large maps prefer [`sample_words`](Self::sample_words).
    #[inline(always)]
    pub fn sample(&self, u: [f32; 2]) -> PiecewiseSample2d {
        self.sample_words(u.map(u32_from_f32))
    }

    /// Samples by two uniform words: the finest the density resolves. With a map of 4096 × 2048
    /// the 24 bits of an `f32` leave 12 for the place within a cell, and hit a cell in steps of
    /// about 2⁻¹² of its share; these leave 20.
    #[inline(always)]
    pub fn sample_words(&self, u: [u32; 2]) -> PiecewiseSample2d {
        let row = self.rows().locate(u[1]);
        let column = self.columns(row.index).locate(u[0]);
        PiecewiseSample2d {
            uv: [
                point_in_bin(column.index, column.fraction, self.width),
                point_in_bin(row.index, row.fraction, self.marginal.len() as u32),
            ],
            pdf: self.density(row.width, column.width),
            cell: [column.index, row.index],
        }
    }

    /// The density at `uv`, with respect to area on the unit square; outside [0, 1)² that of the
    /// nearest cell.
    #[inline]
    pub fn pdf(&self, uv: [f32; 2]) -> Density<PrimarySample> {
        self.cell_pdf([
            bin_of(uv[0], self.width),
            bin_of(uv[1], self.marginal.len() as u32),
        ])
    }

    /// The density on a cell (column, row), with respect to area on the unit square; 0 out of
    /// range.
    #[inline]
    pub fn cell_pdf(&self, cell: [u32; 2]) -> Density<PrimarySample> {
        let [column, row] = cell;
        if column >= self.width || row as usize >= self.marginal.len() {
            return Density::ZERO;
        }
        self.density(self.rows().width(row), self.columns(row).width(column))
    }

    /// The number of the 2⁶⁴ pairs of words that select a cell (column, row): exactly the
    /// realised distribution.
    pub fn exact_count(&self, cell: [u32; 2]) -> u128 {
        let [column, row] = cell;
        if column >= self.width || row as usize >= self.marginal.len() {
            return 0;
        }
        u128::from(self.rows().width(row)) * u128::from(self.columns(row).width(column))
    }

    /// `∫∫ f`, the mean of the values.
    #[inline]
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// Columns and rows.
    #[inline]
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.marginal.len() as u32]
    }

    /// First word owned by each row, as a shader reads it. Search only up to
    /// [`last_row`](Self::last_row).
    #[inline]
    pub fn row_starts(&self) -> &[u32] {
        &self.marginal
    }

    /// The last row with a positive value. It owns all words from its start up to 2³² − 1.
    #[inline]
    pub fn last_row(&self) -> u32 {
        self.marginal_last
    }

    /// First word owned by each column, row by row. Search only up to a row's [last
    /// column](Self::last_columns).
    #[inline]
    pub fn column_starts(&self) -> &[u32] {
        &self.conditional
    }

    /// The last column of positive value in each row, 0 in a row of zeros. It corresponds to
    /// [`last_row`](Self::last_row).
    #[inline]
    pub fn last_columns(&self) -> &[u32] {
        &self.conditional_last
    }
}
