//! What short paths do in an image, of which a pilot shows too little.
//!
//! A pilot has few frames. In an image, short paths are stratified over many more of them, and
//! several of them belong to a frame where that pays. Both take away error of short paths alone:
//! longer ones have too many dimensions. So what a candidate's image would do is foreseen from the
//! variance of short paths in the pilot's blocks.

use super::pilot::certain;
use crate::path::short::Foreseen;

/// What short paths in an image make of a candidate's cost and error in the pilot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortGain {
    /// The cost of a frame is multiplied by this.
    pub cost: f64,
    /// The error of a frame is multiplied by this.
    pub error: f64,
}

/// The power of the number of samples by which the variance of one of them falls, as they are
/// stratified: from 2 to 64 samples it falls to 0.3 to 0.35 in `warehouse` and `candles`, with one
/// emitter sample and with four, and to 0.13 to 0.18 in `many_lights_1000`.
const STRATIFIED: f64 = 0.3;

/// The variance of one sample among `frames` of them, relative to that of one among `others`.
pub(super) fn stratified(frames: f64, others: f64) -> f64 {
    (others.max(1.0) / frames.max(1.0)).powf(STRATIFIED)
}

/// Errors of a frame: squared, and with the weights of pixels.
pub(super) type Errors = [f64; 2];

impl ShortGain {
    /// Nothing.
    pub const NONE: Self = Self {
        cost: 1.0,
        error: 1.0,
    };

    /// Where all error is of short paths, one of each frame: what more frames bring.
    pub(super) fn by_strata(frames: [f64; 2], known: u32) -> Self {
        let [then, now] = frames.map(|frames| stratified(frames, f64::from(known)));
        let error = now / then;
        Self { cost: 1.0, error }
    }

    /// The gain in an image of `frames` frames. `errors` are those of one frame, measured by images
    /// of `tried` frames.
    pub(super) fn of(
        foreseen: &Foreseen,
        errors: Errors,
        [tried, frames]: [f64; 2],
        weights: &[f64],
    ) -> Self {
        let known = f64::from(foreseen.stratified);
        let [then, now] = [tried, frames].map(|frames| stratified(frames, known));
        let short = means(foreseen, weights);
        let error = |after: [f64; 2]| {
            let factors: Errors =
                std::array::from_fn(|n| replaced(foreseen, errors[n], [then * short[n][0], now * after[n]]));
            (factors[0] * factors[1]).sqrt()
        };
        let [one, several] = [0, 1].map(|place| error(short.map(|means| means[place])));
        let cost = f64::from(foreseen.cost);
        // An image has several where they pay, as all of its pixels show. Where they do not pay
        // here, outliers hold the error of the pilot's few frames.
        let error = several.min(one / cost);
        Self { cost, error }
    }

    /// A factor of cost times error.
    pub fn both(&self) -> f64 {
        self.cost * self.error
    }
}

/// A factor of an error where other short paths take the place of those in it.
pub(super) fn replaced(foreseen: &Foreseen, error: f64, [before, after]: [f64; 2]) -> f64 {
    let rest = match foreseen.are_all {
        true => 0.0,
        false => (error - before).max(f64::from(foreseen.least_long) * before),
    };
    let factor = (rest + after) / (rest + before);
    if factor.is_finite() { factor } else { 1.0 }
}

/// Mean variances by one short path and by what pixels get, without weights and with them.
fn means(foreseen: &Foreseen, weights: &[f64]) -> [[f64; 2]; 2] {
    let pixels = foreseen.variances.len().max(1) as f64;
    let mean = |weight: &dyn Fn(usize) -> f64| {
        let pixels_of = foreseen.variances.iter().enumerate();
        let sum = pixels_of.fold([0.0; 2], |[one, left], (pixel, &[a, b])| {
            let weight = weight(pixel);
            [one + weight * f64::from(a), left + weight * f64::from(b)]
        });
        sum.map(|sum| sum / pixels)
    };
    [mean(&|_| 1.0), mean(&|pixel| weights[pixel])]
}

/// Mean variances by one short path, without weights and with them, as far as they are certain: one
/// outlier is easily all of such a variance.
pub(super) fn certain_means(foreseen: &Foreseen, weights: &[f64]) -> Errors {
    let mean = |weight: &dyn Fn(usize) -> f64| {
        let pixels = foreseen.variances.iter().enumerate();
        let values: Vec<f64> = pixels
            .map(|(pixel, &[one, _])| weight(pixel) * f64::from(one))
            .collect();
        certain(&values) * values.iter().sum::<f64>() / values.len().max(1) as f64
    };
    [mean(&|_| 1.0), mean(&|pixel| weights[pixel])]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn foreseen(least_long: f32) -> Foreseen {
        Foreseen {
            variances: vec![[4.0, 1.0]; 2],
            cost: 1.5,
            least_long,
            are_all: false,
            stratified: 4,
        }
    }

    /// Short paths take away what they leave less of; the rest stays.
    /// Planted faults: weights left out, the rest counted with several samples.
    #[test]
    fn the_rest_of_the_error_stays() {
        let of = |least_long: f32, errors: Errors| {
            let gain = ShortGain::of(&foreseen(least_long), errors, [4.0; 2], &[0.5; 2]);
            assert_eq!(gain.cost, 1.5);
            gain.error
        };
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        // 4 of 6 become 1; with weights 2 of 5 become 1 / 2.
        close(of(0.5, [6.0, 5.0]), (3.0 / 6.0 * 3.5 / 5.0_f64).sqrt());
        // The pilot's own images may have less error than short paths alone.
        close(of(0.5, [1.0, 0.1]), 0.5);
        close(of(0.0, [4.0, 2.0]), 1.0 / 4.0);
        let nothing = Foreseen {
            variances: vec![[0.0; 2]; 2],
            cost: 1.0,
            ..foreseen(0.5)
        };
        assert_eq!(ShortGain::of(&nothing, [0.0; 2], [4.0; 2], &[1.0; 2]).error, 1.0);
        // Nothing but short paths.
        let all = Foreseen {
            are_all: true,
            ..foreseen(0.0)
        };
        close(
            ShortGain::of(&all, [80.0; 2], [4.0; 2], &[0.5; 2]).error,
            1.0 / 4.0,
        );
        // Several that do not pay beside so much other error pay for themselves in an image.
        close(of(0.5, [100.0; 2]), 1.0 / 1.5);
        // More frames stratify short paths, and nothing else.
        let same = Foreseen {
            variances: vec![[4.0; 2]; 2],
            cost: 1.0,
            ..foreseen(0.5)
        };
        let more = ShortGain::of(&same, [8.0; 2], [4.0, 128.0], &[1.0; 2]);
        close(more.error, (4.0 + 4.0 * 32f64.powf(-STRATIFIED)) / 8.0);
    }
}
