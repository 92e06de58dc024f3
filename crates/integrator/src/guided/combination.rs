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
}

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
        }
    }

    /// Adds a frame, given by its two halves.
    pub fn add(&mut self, [first, second]: [&[Rgb]; 2]) {
        self.last = 0.0;
        for (pixel, ((sum, a), b)) in self.current.iter_mut().zip(first).zip(second).enumerate() {
            *sum += 0.5 * (a.as_dvec3() + b.as_dvec3());
            let difference = (a.as_dvec3() - b.as_dvec3()).length_squared();
            if difference.is_finite() {
                self.variances[colour(self.width, pixel)] += 0.25 * difference;
                self.squares += (0.25 * difference).powi(2);
                self.last += 0.25 * difference;
            }
        }
        self.frames += 1;
    }

    /// Variance of a frame of the current iteration, summed over the image.
    pub fn variance(&self) -> f64 {
        (self.variances[0] + self.variances[1]) / f64::from(self.frames.max(1))
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
