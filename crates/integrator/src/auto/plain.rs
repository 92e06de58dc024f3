//! What frames that share paths say about plain ones.

use super::pilot::Images;

/// Errors of an image of one plain path a pixel.
///
/// A frame that shares paths knows both errors: its own, and that of plain paths, which is greater
/// by what its account of second moments says. Both hang on the same rare bright paths, so their
/// ratio is known from frames that are too few to know either. Images of plain paths have outliers
/// of their own, and tell less. Plain paths may have less error than this, half of it at the least,
/// where they gain by stratification.
#[derive(Clone, Copy)]
pub(super) struct PlainErrors {
    /// The mean squared error.
    pub error: f64,
    /// With the weights of pixels.
    pub relative: f64,
    /// Which part of the first sharing takes away.
    pub shared: f64,
}

impl Images {
    /// Whether these images share paths, and found light to share.
    pub fn tells_plain_errors(&self) -> bool {
        self.gains.is_some() && self.is_lit()
    }

    /// What these images, if they share paths, say about plain ones.
    pub fn plain_errors(&self, weights: &[f64]) -> Option<PlainErrors> {
        let gains = self.gains.as_ref()?;
        let frames = f64::from(self.frames);
        let (gain, own) = (gains.mean(|_| 1.0), frames * self.error);
        let relative = frames * self.weighed(weights) + gains.mean(|pixel| weights[pixel]);
        let shared = gain / (own + gain);
        Some(PlainErrors {
            error: own + gain,
            relative,
            shared: if shared.is_finite() { shared } else { 0.0 },
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::auto::pilot::{images, weights};
    use crate::registry::Stage;
    use lightshed_scene::{Scene, builtin};
    use std::sync::atomic::AtomicBool;

    /// Errors of plain paths by their own images and by what frames that share paths say, and the
    /// part that sharing takes away.
    fn errors(name: &str, frames: u32) -> [[f64; 2]; 2] {
        let mut description = builtin::by_name(name).unwrap();
        (description.settings.width, description.settings.height) = (32, 32);
        let scene = Scene::new(&description).unwrap();
        let stage = Stage::new(&scene);
        let of = |text: &str| {
            let method = text.parse().unwrap();
            images(&stage, &method, frames, 1, &AtomicBool::new(false))
                .unwrap()
                .unwrap()
        };
        let [plain, sharing] = ["path", "path-reuse"].map(of);
        assert!(plain.plain_errors(&[]).is_none());
        let weights = weights([(&plain, 1.0), (&sharing, 1.0)].into_iter(), 32);
        let said = sharing.plain_errors(&weights).unwrap();
        let measured = f64::from(frames) * plain.error;
        let relative = f64::from(frames) * plain.weighed(&weights);
        [[measured, relative], [said.error, said.relative]]
    }

    /// What frames that share paths say about plain paths is what those show: where nearly all of
    /// the error is taken away, and where little is.
    /// Planted faults: the square of the mean left in, gains of one of the two ways to continue
    /// from a path's second vertex alone.
    #[test]
    fn shared_paths_know_the_error_of_plain_ones() {
        for (name, frames) in [("cornell", 48), ("glossy-bounce", 48), ("warehouse", 32)] {
            let [measured, said] = errors(name, frames);
            for (measured, said) in measured.into_iter().zip(said) {
                let ratio = said / measured;
                assert!((0.9..1.3).contains(&ratio), "{name}: {said} for {measured}");
            }
        }
    }
}
