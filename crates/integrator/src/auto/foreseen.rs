//! What several samples of short paths make of a candidate's cost and error.
//!
//! Pilots are too small for them, so their images do without. What a candidate's image would do
//! with them is foreseen from the variance of short paths in the pilot's blocks.

use crate::path::short::Foreseen;

/// What several samples of short paths make of a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortGain {
    /// A factor of what a frame costs.
    pub cost: f64,
    /// A factor of the error of a frame.
    pub error: f64,
}

impl ShortGain {
    /// Nothing.
    pub const NONE: Self = Self {
        cost: 1.0,
        error: 1.0,
    };

    /// By the errors of a frame, squared and with the weights of pixels.
    pub(super) fn of(foreseen: &Foreseen, errors: [f64; 2], weights: &[f64]) -> Self {
        let pixels = foreseen.variances.len().max(1) as f64;
        let sums = |weight: &dyn Fn(usize) -> f64| {
            let pixels_of = foreseen.variances.iter().enumerate();
            let sum = pixels_of.fold([0.0; 2], |[one, left], (pixel, &[a, b])| {
                let weight = weight(pixel);
                [one + weight * f64::from(a), left + weight * f64::from(b)]
            });
            sum.map(|sum| sum / pixels)
        };
        let factor = |error: f64, [one, left]: [f64; 2]| {
            let rest = (error - one).max(f64::from(foreseen.least_long) * one);
            let factor = (rest + left) / (rest + one);
            if factor.is_finite() { factor } else { 1.0 }
        };
        let own = factor(errors[0], sums(&|_| 1.0));
        let weighed = factor(errors[1], sums(&|pixel| weights[pixel]));
        Self {
            cost: f64::from(foreseen.cost),
            error: (own * weighed).sqrt(),
        }
    }

    /// A factor of cost times error.
    pub fn both(&self) -> f64 {
        self.cost * self.error
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auto::pilot::{Images, images, weights};
    use crate::registry::{Method, Stage};
    use lightshed_scene::{Scene, builtin};
    use std::sync::atomic::AtomicBool;

    fn foreseen(least_long: f32) -> Foreseen {
        Foreseen {
            variances: vec![[1.0, 1.0], [7.0, 1.0]],
            cost: 1.5,
            least_long,
        }
    }

    /// Short paths take away what they leave less of; the rest stays.
    /// Planted faults: weights left out, the rest counted with several samples.
    #[test]
    fn the_rest_of_the_error_stays() {
        let of = |least_long: f32, errors: [f64; 2]| {
            let gain = ShortGain::of(&foreseen(least_long), errors, &[1.0, 1.0 / 7.0]);
            assert_eq!(gain.cost, 1.5);
            gain.error
        };
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        // 4 of 8 become 1; with weights 1 of 3 becomes 4 / 7.
        close(
            of(0.5, [8.0, 3.0]),
            (5.0 / 8.0 * (2.0 + 4.0 / 7.0) / 3.0_f64).sqrt(),
        );
        // The pilot's own images may have less error than short paths alone.
        close(
            of(0.5, [1.0, 0.1]),
            (3.0 / 6.0 * (0.5 + 4.0 / 7.0) / 1.5_f64).sqrt(),
        );
        close(of(0.0, [4.0, 1.0]), (1.0 / 4.0 * 4.0 / 7.0_f64).sqrt());
        let nothing = Foreseen {
            variances: vec![[0.0; 2]; 2],
            ..foreseen(0.5)
        };
        assert_eq!(ShortGain::of(&nothing, [0.0; 2], &[1.0; 2]).error, 1.0);
    }

    /// Images gain what is foreseen, and up to twice as much: samples that are stratified together
    /// have less variance than as many apart. Errors are those of eight frames, with and without
    /// several short paths.
    /// Planted faults: short paths' variance in the sum over colours, before or after; a factor of
    /// cost for that of error.
    #[test]
    fn images_show_what_is_foreseen() {
        const SAMPLES: u32 = 512;
        for (name, text) in [
            ("warehouse", "path-reuse:bvh"),
            ("candles", "path-reuse:bvh"),
            ("candles", "path:bvh"),
        ] {
            let mut description = builtin::by_name(name).unwrap();
            (description.settings.width, description.settings.height) = (64, 48);
            let scene = Scene::new(&description).unwrap();
            let (one, several) = (Stage::new(&scene), Stage::new(&scene).for_samples(SAMPLES));
            let method: Method = text.parse().unwrap();
            let [one, several] = [&one, &several].map(|stage| {
                let images = images(stage, &method, 8, 1, &AtomicBool::new(false));
                images.unwrap().unwrap()
            });
            let weights = weights([&one].into_iter(), 64);
            let errors = |images: &Images| [images.error, images.weighed(&weights)];
            let own = errors(&one).map(|error| 8.0 * error);
            let stage = Stage::new(&scene);
            let foreseen = method.foreseen_short_paths(&stage, SAMPLES).unwrap().unwrap();
            let gain = ShortGain::of(&foreseen, own, &weights);
            let [[a, b], [c, d]] = [errors(&several), errors(&one)];
            let measured = (a / c * b / d).sqrt();
            assert!(gain.both() < 1.0, "{name} {text}: {gain:?}");
            let ratio = gain.error / measured;
            assert!((0.95..2.0).contains(&ratio), "{name} {text}: {gain:?} {measured}");
            // Without them, or for few samples, nothing is foreseen.
            let mut without = method.clone();
            without.set("short-paths", "one").unwrap();
            assert!(without.foreseen_short_paths(&stage, SAMPLES).unwrap().is_none());
            assert!(method.foreseen_short_paths(&stage, 16).unwrap().is_none());
        }
    }
}
