//! Eight samples and densities of a [`PiecewiseConstant2d`] at a time.
//!
//! Searches of eight go step by step together. One after the other, each waits for its words in
//! memory and for branches that cannot be predicted.

use super::PiecewiseConstant2d;
use crate::piecewise::{bin_of, guide_buckets, point_in_bin};
use crate::uniform::{ONE_MINUS_EPSILON, u32_from_f32};
use lightshed_lanes::{LANES, Lanes};

/// Eight samples of a [`PiecewiseConstant2d`].
#[derive(Clone, Copy, Debug)]
pub struct PiecewiseLanes2d<L> {
    /// [`PiecewiseSample2d::uv`](super::PiecewiseSample2d::uv).
    pub uv: [L; 2],
    /// Their densities with respect to area on the unit square; positive.
    pub pdf: L,
}

/// Distributions in fixed point, one after the other, of as many bins each.
struct Rows<'a> {
    starts: &'a [u32],
    guide: &'a [u32],
    bins: usize,
}

/// A number for each lane.
type Row<T> = [T; LANES];

impl Rows<'_> {
    /// [`search`](crate::piecewise::FixedPoint::search) of the words `u` in the distributions
    /// number `row`.
    #[inline(always)]
    fn search(&self, row: &Row<u32>, u: &Row<u32>) -> Row<u32> {
        let buckets = guide_buckets(self.bins);
        let (mut base, mut size, mut longest) = ([0; LANES], [0; LANES], 0);
        for lane in 0..LANES {
            let bucket = (u64::from(u[lane]) * buckets as u64) >> 32;
            let entry = row[lane] as usize * (buckets + 1) + bucket as usize;
            base[lane] = self.guide[entry];
            size[lane] = self.guide[entry + 1] - base[lane] + 1;
            longest = longest.max(size[lane]);
        }
        while longest > 1 {
            for lane in 0..LANES {
                // Nothing moves where one bin is left.
                let half = size[lane] / 2;
                let start = self.starts[row[lane] as usize * self.bins + (base[lane] + half) as usize];
                base[lane] += core::hint::select_unpredictable(start <= u[lane], half, 0);
                size[lane] -= half;
            }
            longest -= longest / 2;
        }
        base
    }

    /// First word of these bins, and how many words they own; `last` are the last bins of the
    /// distributions.
    #[inline(always)]
    fn owned(&self, row: &Row<u32>, last: &Row<u32>, bin: &Row<u32>) -> (Row<u32>, Row<f64>) {
        let (mut starts, mut widths) = ([0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let place = row[lane] as usize * self.bins + bin[lane] as usize;
            starts[lane] = self.starts[place];
            let next = self.starts[(place + 1).min(self.starts.len() - 1)];
            let end = if bin[lane] < last[lane] {
                i64::from(next)
            } else {
                1 << 32
            };
            let width = end - i64::from(starts[lane]);
            widths[lane] = if bin[lane] <= last[lane] {
                width as f64
            } else {
                0.0
            };
        }
        (starts, widths)
    }
}

/// The places `(index + fraction) / count`.
#[inline(always)]
fn points_in_bins<L: Lanes>(index: &Row<u32>, fraction: L, count: u32) -> L {
    let (fraction, mut points) = (fraction.store(), [0.0; LANES]);
    for lane in 0..LANES {
        points[lane] = point_in_bin(index[lane], fraction[lane], count);
    }
    L::load(&points)
}

/// Places among the words that bins own, in [0, 1).
#[inline(always)]
fn fractions<L: Lanes>(u: &Row<u32>, starts: &Row<u32>, widths: &Row<f64>) -> L {
    let (mut offset, mut width) = ([0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        offset[lane] = (u[lane] - starts[lane]) as f32;
        width[lane] = widths[lane] as f32;
    }
    (L::load(&offset) / L::load(&width)).min(L::splat(ONE_MINUS_EPSILON))
}

impl PiecewiseConstant2d {
    #[inline(always)]
    fn all_rows(&self) -> Rows<'_> {
        Rows {
            starts: &self.marginal,
            guide: &self.marginal_guide,
            bins: self.marginal.len(),
        }
    }

    #[inline(always)]
    fn all_columns(&self) -> Rows<'_> {
        Rows {
            starts: &self.conditional,
            guide: &self.conditional_guide,
            bins: self.width as usize,
        }
    }

    /// Last columns of these rows.
    #[inline(always)]
    fn last_of(&self, row: &Row<u32>) -> Row<u32> {
        let mut last = [0; LANES];
        for lane in 0..LANES {
            last[lane] = self.conditional_last[row[lane] as usize];
        }
        last
    }

    /// The densities of cells, from the words that rows and columns own.
    #[inline(always)]
    fn densities<L: Lanes>(&self, of_rows: &Row<f64>, of_columns: &Row<f64>) -> L {
        let (scale, mut pdf) = (self.density_of_words(), [0.0; LANES]);
        for lane in 0..LANES {
            pdf[lane] = (of_rows[lane] * of_columns[lane] * scale) as f32;
        }
        L::load(&pdf)
    }

    /// [`sample`](Self::sample) by eight points, bit for bit.
    #[inline(always)]
    pub fn sample_lanes<L: Lanes>(&self, u: [L; 2]) -> PiecewiseLanes2d<L> {
        let (u, v) = (u[0].store(), u[1].store());
        let (mut of_column, mut of_row) = ([0; LANES], [0; LANES]);
        for lane in 0..LANES {
            (of_column[lane], of_row[lane]) = (u32_from_f32(u[lane]), u32_from_f32(v[lane]));
        }
        let (rows, columns) = (self.all_rows(), self.all_columns());
        let row = rows.search(&[0; LANES], &of_row);
        let column = columns.search(&row, &of_column);
        let (row_starts, row_widths) = rows.owned(&[0; LANES], &[self.marginal_last; LANES], &row);
        let (column_starts, column_widths) = columns.owned(&row, &self.last_of(&row), &column);
        let x = fractions::<L>(&of_column, &column_starts, &column_widths);
        let y = fractions::<L>(&of_row, &row_starts, &row_widths);
        PiecewiseLanes2d {
            uv: [
                points_in_bins(&column, x, self.width),
                points_in_bins(&row, y, self.marginal.len() as u32),
            ],
            pdf: self.densities(&row_widths, &column_widths),
        }
    }

    /// [`pdf`](Self::pdf) at eight points, bit for bit: with respect to area on the unit square.
    #[inline(always)]
    pub fn pdf_lanes<L: Lanes>(&self, uv: [L; 2]) -> L {
        let (u, v) = (uv[0].store(), uv[1].store());
        let (mut column, mut row) = ([0; LANES], [0; LANES]);
        for lane in 0..LANES {
            column[lane] = bin_of(u[lane], self.width);
            row[lane] = bin_of(v[lane], self.marginal.len() as u32);
        }
        let (_, row_widths) = self
            .all_rows()
            .owned(&[0; LANES], &[self.marginal_last; LANES], &row);
        let (_, column_widths) = self.all_columns().owned(&row, &self.last_of(&row), &column);
        self.densities(&row_widths, &column_widths)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CounterRng, f32_from_u32};
    use lightshed_lanes::{LaneChoice, LaneKernel};

    /// Samples by eight points, and densities at them.
    struct Eight<'a>(&'a PiecewiseConstant2d, [Row<f32>; 2]);

    impl LaneKernel for Eight<'_> {
        type Output = [Row<f32>; 4];

        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let u = [L::load(&self.1[0]), L::load(&self.1[1])];
            let samples = self.0.sample_lanes(u);
            let [x, y] = samples.uv;
            [x, y, samples.pdf, self.0.pdf_lanes(u)].map(L::store)
        }
    }

    /// Densities of all shapes: few and many cells, rows of zeros, one positive cell, a bright one.
    fn densities() -> Vec<PiecewiseConstant2d> {
        let mut rng = CounterRng::new(3, 0, 0);
        let mut densities = Vec::new();
        for (width, height) in [(1, 1), (1, 9), (7, 1), (5, 3), (64, 32), (100, 41)] {
            for zeros in [0.0, 0.6] {
                let value = |u: [f32; 2]| if u[0] < zeros { 0.0 } else { 0.01 + u[1].powi(6) };
                let mut values: Vec<f32> = (0..width * height).map(|_| value(rng.next_2d())).collect();
                values[0] = 0.0;
                values[width * height / 2] = 1e4;
                densities.push(PiecewiseConstant2d::new(&values, width).unwrap());
            }
            let mut single = vec![0.0; width * height];
            single[width * height - 1] = 2.0;
            densities.push(PiecewiseConstant2d::new(&single, width).unwrap());
        }
        densities
    }

    /// Samples and densities are those of one point after the other, at random points and at the
    /// ends of the square.
    #[test]
    fn eight_have_the_bits_of_each() {
        let mut rng = CounterRng::new(4, 0, 0);
        let ends = [0.0, ONE_MINUS_EPSILON, f32::MIN_POSITIVE, 0.5];
        for density in densities() {
            for lanes in LaneChoice::all() {
                for round in 0..40 {
                    let mut u = [[0.0; LANES]; 2];
                    for (axis, row) in u.iter_mut().enumerate() {
                        for (lane, u) in row.iter_mut().enumerate() {
                            *u = match round {
                                0 => ends[(lane >> (2 * axis)) % 4],
                                // The last word before a column, as near as 24 bits come.
                                1..5 => {
                                    let starts = density.column_starts();
                                    let start = starts[(round * LANES + lane) % starts.len()];
                                    f32_from_u32(start.saturating_sub(1))
                                }
                                _ => rng.next_f32(),
                            };
                        }
                    }
                    let [x, y, pdf, at] = lanes.run(Eight(&density, u));
                    for lane in 0..LANES {
                        let point = [u[0][lane], u[1][lane]];
                        let alone = density.sample(point);
                        assert_eq!(([x[lane], y[lane]], pdf[lane]), (alone.uv, alone.pdf.value()));
                        assert_eq!(at[lane], density.pdf(point).value(), "{point:?}");
                    }
                }
            }
        }
    }
}
