//! Quadrature in `f64`.
//!
//! - [`integrate`]: globally adaptive Gauss–Kronrod (7, 15) on an interval.
//! - [`integrate_rectangle`]: the same rule as a tensor product on a rectangle, cells split along
//!   the axis whose error is larger.
//! - [`GaussLegendre`]: nodes and weights of any order.
//!
//! All three state an error estimate, so that a test can say how much of a difference is the
//! quadrature's.

use core::cmp::Ordering;
use std::collections::BinaryHeap;

/// Value of an integral with an estimate of its absolute error.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Integral {
    /// The integral.
    pub value: f64,
    /// Estimated absolute error; usually pessimistic by orders of magnitude.
    pub error: f64,
    /// Number of evaluations of the integrand.
    pub evaluations: u64,
    /// Whether the tolerance was met before the limit on the number of cells.
    pub converged: bool,
}

/// Kronrod nodes on [0, 1) in falling order; those at odd places are Gauss nodes.
const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
const KRONROD_WEIGHTS: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_83,
];
const GAUSS_WEIGHTS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_64,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];

/// Node, Kronrod weight and Gauss weight of the i-th of the 15 points on [−1, 1].
fn rule(i: usize) -> (f64, f64, f64) {
    let (k, sign) = if i < 8 { (i, 1.0) } else { (14 - i, -1.0) };
    let gauss = if k % 2 == 1 { GAUSS_WEIGHTS[k / 2] } else { 0.0 };
    (sign * NODES[k], KRONROD_WEIGHTS[k], gauss)
}

struct Cell {
    low: [f64; 2],
    high: [f64; 2],
    value: f64,
    error: f64,
    split_axis: usize,
}

impl PartialEq for Cell {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Cell {}
impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Cell {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error)
    }
}

/// Splits the cell of largest error until the sum of errors is below `tolerance` (absolute) or the
/// limit is reached.
fn refine(
    cells: Vec<Cell>,
    tolerance: f64,
    evaluations_per_cell: u64,
    maximum_cells: usize,
    mut evaluate: impl FnMut([f64; 2], [f64; 2]) -> Cell,
) -> Integral {
    let mut evaluations = evaluations_per_cell * cells.len() as u64;
    let mut heap: BinaryHeap<Cell> = cells.into();
    let mut error: f64 = heap.iter().map(|c| c.error).sum();
    while error > tolerance && heap.len() < maximum_cells {
        let Some(cell) = heap.pop() else { break };
        let axis = cell.split_axis;
        let middle = 0.5 * (cell.low[axis] + cell.high[axis]);
        if !(middle > cell.low[axis] && middle < cell.high[axis]) {
            heap.push(cell);
            break;
        }
        error -= cell.error;
        let (mut left_high, mut right_low) = (cell.high, cell.low);
        left_high[axis] = middle;
        right_low[axis] = middle;
        for half in [evaluate(cell.low, left_high), evaluate(right_low, cell.high)] {
            error += half.error;
            heap.push(half);
        }
        evaluations += 2 * evaluations_per_cell;
    }
    // Summed afresh, smallest error first: the running difference above has drifted.
    let cells = heap.into_sorted_vec();
    let error = cells.iter().map(|c| c.error).sum();
    Integral {
        value: cells.iter().map(|c| c.value).sum(),
        error,
        evaluations,
        converged: error <= tolerance,
    }
}

/// `∫_a^b f(x) dx` to an absolute error of about `tolerance`, by adaptive Gauss–Kronrod (7,
/// 15). Copes with integrable endpoint singularities and jumps, at more cells; at most 5,000 are
/// used.
pub fn integrate(f: impl Fn(f64) -> f64, a: f64, b: f64, tolerance: f64) -> Integral {
    let evaluate = |low: [f64; 2], high: [f64; 2]| {
        let (center, half) = (0.5 * (low[0] + high[0]), 0.5 * (high[0] - low[0]));
        let (mut kronrod, mut gauss) = (0.0, 0.0);
        for i in 0..15 {
            let (x, wk, wg) = rule(i);
            let value = f(center + half * x);
            kronrod += wk * value;
            gauss += wg * value;
        }
        Cell {
            low,
            high,
            value: kronrod * half,
            error: (kronrod - gauss).abs() * half.abs(),
            split_axis: 0,
        }
    };
    refine(vec![evaluate([a, 0.0], [b, 0.0])], tolerance, 15, 5_000, evaluate)
}

/// `∫∫ f(x, y) dx dy` over `[a₀, b₀] × [a₁, b₁]` to an absolute error of about
/// `tolerance`, by an adaptive tensor product of Gauss–Kronrod (7, 15) rules; at most 4,000 cells
/// (900,000 evaluations) are used.
pub fn integrate_rectangle(
    f: impl Fn(f64, f64) -> f64,
    a: [f64; 2],
    b: [f64; 2],
    tolerance: f64,
) -> Integral {
    integrate_cells(&f, &[(a, b)], tolerance)
}

/// As [`integrate_rectangle`] over a union of rectangles that share one error budget.
pub(crate) fn integrate_cells(
    f: &impl Fn(f64, f64) -> f64,
    rectangles: &[([f64; 2], [f64; 2])],
    tolerance: f64,
) -> Integral {
    let evaluate = |low: [f64; 2], high: [f64; 2]| {
        let center = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
        let half = [0.5 * (high[0] - low[0]), 0.5 * (high[1] - low[1])];
        // First letter: rule along x, second: along y.
        let (mut kk, mut gk, mut kg) = (0.0, 0.0, 0.0);
        for i in 0..15 {
            let (x, xk, xg) = rule(i);
            let (mut row_k, mut row_g) = (0.0, 0.0);
            for j in 0..15 {
                let (y, yk, yg) = rule(j);
                let value = f(center[0] + half[0] * x, center[1] + half[1] * y);
                row_k += yk * value;
                row_g += yg * value;
            }
            kk += xk * row_k;
            gk += xg * row_k;
            kg += xk * row_g;
        }
        let area = (half[0] * half[1]).abs();
        let errors = [(kk - gk).abs(), (kk - kg).abs()];
        Cell {
            low,
            high,
            value: kk * area,
            error: (errors[0] + errors[1]) * area,
            split_axis: usize::from(errors[1] > errors[0]),
        }
    };
    let cells = rectangles
        .iter()
        .map(|&(low, high)| evaluate(low, high))
        .collect();
    refine(cells, tolerance, 225, 4_000 + rectangles.len(), evaluate)
}

/// Nodes and weights of the Gauss–Legendre rule of order `n`, exact for polynomials of degree
/// `2n − 1`.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussLegendre {
    nodes: Vec<f64>,
    weights: Vec<f64>,
}

impl GaussLegendre {
    /// The rule with `order` nodes (at least one), by Newton's method on the Legendre polynomial.
    pub fn new(order: usize) -> Self {
        let n = order.max(1);
        let mut nodes = vec![0.0; n];
        let mut weights = vec![0.0; n];
        for i in 0..n.div_ceil(2) {
            let mut x = (core::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut derivative = 1.0;
            for _ in 0..100 {
                // P_k by its three-term recurrence, and P_n' from P_n and P_{n−1}.
                let (mut previous, mut current) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (previous, current) = (
                        current,
                        ((2.0 * k - 1.0) * x * current - (k - 1.0) * previous) / k,
                    );
                }
                derivative = if n == 1 {
                    1.0
                } else {
                    n as f64 * (x * current - previous) / (x * x - 1.0)
                };
                let step = current / derivative;
                x -= step;
                if step.abs() < 1e-16 {
                    break;
                }
            }
            if n % 2 == 1 && i == n / 2 {
                x = 0.0;
            }
            let weight = 2.0 / ((1.0 - x * x) * derivative * derivative);
            (nodes[i], nodes[n - 1 - i]) = (-x, x);
            (weights[i], weights[n - 1 - i]) = (weight, weight);
        }
        Self { nodes, weights }
    }

    /// Nodes in (−1, 1), rising.
    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// Weights; they sum to 2.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// `∫_a^b f(x) dx` by this rule.
    pub fn integrate(&self, f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
        let (center, half) = (0.5 * (a + b), 0.5 * (b - a));
        let sum: f64 = self
            .nodes
            .iter()
            .zip(&self.weights)
            .map(|(x, w)| w * f(center + half * x))
            .sum();
        sum * half
    }

    /// `∫∫ f(x, y) dx dy` over `[a₀, b₀] × [a₁, b₁]` by the tensor product of this
    /// rule with itself.
    pub fn integrate_rectangle(&self, f: impl Fn(f64, f64) -> f64, a: [f64; 2], b: [f64; 2]) -> f64 {
        self.integrate(|x| self.integrate(|y| f(x, y), a[1], b[1]), a[0], b[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check_faults;
    use core::f64::consts::PI;

    #[test]
    fn known_integrals() {
        type Case = (fn(f64) -> f64, f64, f64, f64);
        let cases: [Case; 5] = [
            (|x| x.sin(), 0.0, PI, 2.0),
            (|x| x.powi(20), -1.0, 1.0, 2.0 / 21.0),
            (|x| x.sqrt(), 0.0, 1.0, 2.0 / 3.0),
            (|x| 1e-3 / (x * x + 1e-6), -1.0, 1.0, 2.0 * 1e3f64.atan()),
            (|x| if x < 0.3 { 1.0 } else { 0.0 }, 0.0, 1.0, 0.3),
        ];
        for (index, (f, a, b, expected)) in cases.into_iter().enumerate() {
            let result = integrate(f, a, b, 1e-10);
            assert!(result.converged, "{index}: {result:?}");
            assert!((result.value - expected).abs() < 1e-9, "{index}: {result:?}");
            assert!(
                (result.value - expected).abs() <= result.error + 1e-14,
                "{index}: {result:?}"
            );
        }
        assert_eq!(integrate(|x| x, 1.0, 1.0, 1e-9).value, 0.0);
        assert!((integrate(|x| x, 1.0, 0.0, 1e-9).value + 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_density_that_misses_one_is_seen() {
        check_faults(&[1.0 + 1e-8], |scale: Option<f64>| {
            let f = |x: f64| scale.unwrap_or(1.0) * (-0.5 * x * x).exp() / (2.0 * PI).sqrt();
            let result = integrate(f, -12.0, 12.0, 1e-12);
            if (result.value - 1.0).abs() < 1e-11 {
                Ok(())
            } else {
                Err(result)
            }
        })
        .unwrap();
    }

    #[test]
    fn rectangle_resolves_a_narrow_peak_and_a_discontinuity() {
        let w = 1e-3;
        let peak = |x: f64, y: f64| (-((x - 0.3).powi(2) + (y - 0.7).powi(2)) / (2.0 * w * w)).exp();
        let result = integrate_rectangle(peak, [0.0, 0.0], [1.0, 1.0], 1e-12);
        // The peak can hide between the first nodes only if no node comes near it; here it is
        // found.
        assert!(
            (result.value / (2.0 * PI * w * w) - 1.0).abs() < 1e-5,
            "{result:?}"
        );
        let disk = |x: f64, y: f64| if x * x + y * y < 1.0 { 1.0 } else { 0.0 };
        let result = integrate_rectangle(disk, [0.0, 0.0], [1.0, 1.0], 1e-5);
        assert!((result.value - PI / 4.0).abs() < 2e-4, "{result:?}");
    }

    #[test]
    fn gauss_legendre_is_exact_to_its_degree_and_no_further() {
        for order in [1usize, 2, 3, 8, 33] {
            let rule = GaussLegendre::new(order);
            assert!((rule.weights().iter().sum::<f64>() - 2.0).abs() < 1e-13);
            assert!(rule.nodes().windows(2).all(|w| w[0] < w[1]));
            let even = 2 * order - 2;
            let error = rule.integrate(|x| x.powi(even as i32), 0.0, 1.0) - 1.0 / (even + 1) as f64;
            assert!(error.abs() < 1e-14, "{order}: {error}");
        }
        let error = GaussLegendre::new(3).integrate(|x| x.powi(6), 0.0, 1.0) - 1.0 / 7.0;
        assert!(error.abs() > 1e-5);
        let value = GaussLegendre::new(20).integrate_rectangle(|x, y| (x * y).exp(), [0.0, 0.0], [1.0, 1.0]);
        assert!((value - 1.317_902_151_454_403_8).abs() < 1e-14, "{value}");
        assert_eq!(GaussLegendre::new(0).nodes(), [0.0]);
    }
}
