//! The best mean of frames of unequal noise.

use lightshed_scene::Rgb;
use lightshed_scene::glam::DVec3;

/// Combines frames by the inverse of their variance.
///
/// Frames come in iterations: those of one have the same guide and count alike. Iteration `i` of
/// `n_i` frames has the mean `x̄_i` and the variance `V_i` of a frame; the combination is
/// `Σ (n_i/V_i) x̄_i / Σ n_i/V_i`, the least variance that fixed weights can give (Vorba 2019,
/// §5.3 of *Path guiding in production*).
///
/// A weight that is estimated from the same samples as the mean is biased: dark frames look
/// certain. So each pixel is weighted by the variance of pixels of the other colour of a
/// checkerboard, whose samples are independent of its own.
#[derive(Clone, Debug)]
pub(super) struct Combination {
    width: usize,
    /// Weighted sums of the iterations that are complete, and the sums of their weights for both
    /// colours.
    done: Vec<DVec3>,
    weights: [f64; 2],
    /// Sum of the frames of the current iteration, and of their variances over the pixels of each
    /// colour.
    current: Vec<DVec3>,
    variances: [f64; 2],
    frames: u32,
    /// Sum of the squares of what `variances` is the sum of.
    squares: f64,
    /// Variance of the last frame, summed over the image.
    last: f64,
    /// Sum of the frames' variances without the noisiest pixels of each, see
    /// [`usual_variance`](Self::usual_variance).
    usual: f64,
    /// Kept for its memory.
    differences: Vec<f64>,
}

/// One pixel in so many does not count as usual.
const UNUSUAL: usize = 1000;

/// Colour of a pixel's square.
fn colour(width: usize, pixel: usize) -> usize {
    (pixel % width + pixel / width) % 2
}

impl Combination {
    /// Of images of so many pixels.
    pub fn new([width, height]: [u32; 2]) -> Self {
        let pixels = width as usize * height as usize;
        Self {
            width: width as usize,
            done: vec![DVec3::ZERO; pixels],
            weights: [0.0; 2],
            current: vec![DVec3::ZERO; pixels],
            variances: [0.0; 2],
            frames: 0,
            squares: 0.0,
            last: 0.0,
            usual: 0.0,
            differences: Vec::with_capacity(pixels),
        }
    }

    /// Adds a frame, given by its two halves.
    pub fn add(&mut self, [first, second]: [&[Rgb]; 2]) {
        self.last = 0.0;
        self.differences.clear();
        for (pixel, ((sum, a), b)) in self.current.iter_mut().zip(first).zip(second).enumerate() {
            *sum += 0.5 * (a.as_dvec3() + b.as_dvec3());
            let difference = (a.as_dvec3() - b.as_dvec3()).length_squared();
            if difference.is_finite() {
                self.variances[colour(self.width, pixel)] += 0.25 * difference;
                self.squares += (0.25 * difference).powi(2);
                self.last += 0.25 * difference;
                self.differences.push(0.25 * difference);
            }
        }
        self.usual += without_largest(&mut self.differences);
        self.frames += 1;
    }

    /// Variance of a frame of the current iteration, summed over the image.
    pub fn variance(&self) -> f64 {
        (self.variances[0] + self.variances[1]) / f64::from(self.frames.max(1))
    }

    /// Variance of a frame of the current iteration, summed over the image: without the thousandth
    /// of its pixels that is the noisiest, if that holds nine tenths of it. It then depends on
    /// the rare samples that happened to come, and says little of the rest of the image.
    pub fn usual_variance(&self) -> f64 {
        let usual = self.usual / f64::from(self.frames.max(1));
        let variance = self.variance();
        if usual < 0.1 * variance { usual } else { variance }
    }

    /// Standard error of [`variance`](Self::variance), of pixels and frames that are independent.
    pub fn variance_error(&self) -> f64 {
        self.squares.sqrt() / f64::from(self.frames.max(1))
    }

    /// Variance of the last frame, summed over the image.
    pub fn last_variance(&self) -> f64 {
        self.last
    }

    /// Weights of the current iteration for both colours: `n²/Σ V` of the other.
    fn current_weights(&self) -> [f64; 2] {
        let frames = f64::from(self.frames);
        let of = |variance: f64| {
            if variance > 0.0 {
                frames * frames / variance
            } else {
                0.0
            }
        };
        [of(self.variances[1]), of(self.variances[0])]
    }

    /// Closes the current iteration.
    pub fn next_iteration(&mut self) {
        let weights = self.current_weights();
        let frames = f64::from(self.frames.max(1));
        for (pixel, (done, sum)) in self.done.iter_mut().zip(&mut self.current).enumerate() {
            *done += weights[colour(self.width, pixel)] / frames * *sum;
            *sum = DVec3::ZERO;
        }
        self.weights = [0, 1].map(|c| self.weights[c] + weights[c]);
        (self.variances, self.frames, self.squares) = ([0.0; 2], 0, 0.0);
        self.usual = 0.0;
    }

    /// The combination so far. Where no iteration has a variance, the mean of the current one.
    pub fn image(&self, mut pixel: impl FnMut(usize, Rgb)) {
        let mut weights = self.current_weights();
        for (weight, done) in weights.iter_mut().zip(self.weights) {
            if !(done + *weight > 0.0) {
                *weight = 1.0;
            }
        }
        let frames = f64::from(self.frames.max(1));
        for (index, (done, sum)) in self.done.iter().zip(&self.current).enumerate() {
            let c = colour(self.width, index);
            let total = self.weights[c] + weights[c];
            let value = (*done + weights[c] / frames * *sum) / total;
            pixel(index, value.as_vec3());
        }
    }
}

/// Sum without the thousandth of the numbers that is the largest; changes their order.
fn without_largest(numbers: &mut [f64]) -> f64 {
    let kept = numbers.len() - numbers.len() / UNUSUAL;
    if kept < numbers.len() {
        numbers.select_nth_unstable_by(kept, f64::total_cmp);
    }
    numbers[..kept].iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 2,000 pixels, two do not count if they are noisy enough; the variance itself has them.
    #[test]
    fn the_usual_variance_is_without_the_noisiest_pixels() {
        let mut combination = Combination::new([50, 40]);
        let second = vec![Rgb::ZERO; 2000];
        for noisy in [[3, 150], [0, 1999]] {
            let mut first = vec![Rgb::new(2.0, 0.0, 0.0); 2000];
            first[noisy[0]] = Rgb::splat(1e6);
            first[noisy[1]] = Rgb::splat(1e5);
            first[77] = Rgb::splat(1e4);
            combination.add([&first, &second]);
        }
        let usual = 1997.0 + 0.25 * 3e8;
        assert!((combination.usual_variance() / usual - 1.0).abs() < 1e-9);
        let variance = usual + 0.25 * (3e12 + 3e10);
        assert!((combination.variance() / variance - 1.0).abs() < 1e-9);
        combination.next_iteration();
        assert_eq!(combination.usual_variance(), 0.0);
        // Two pixels that hold less do count.
        let mut first = vec![Rgb::new(2.0, 0.0, 0.0); 2000];
        first[9] = Rgb::new(200.0, 0.0, 0.0);
        combination.add([&first, &second]);
        assert!((combination.usual_variance() / (1999.0 + 1e4) - 1.0).abs() < 1e-9);
    }
}
