//! What takes the noise of weights out of an image: a control variate.

use lightshed_scene::Rgb;

/// Share of a tile's weight that is left after another tile.
const KEPT: f32 = 0.95;

/// The light of the trees of earlier tiles, the last ones most: the square of the mean of its
/// square root. Rare bright paths would make a plain mean, and with it many tiles, far too bright.
#[derive(Default)]
pub struct Control {
    /// Of square roots.
    sum: Rgb,
    count: f32,
}

impl Control {
    /// `c`; zero while nothing is known.
    pub fn value(&self) -> Rgb {
        match self.count > 0.0 {
            true => {
                let root = self.sum / self.count;
                root * root
            }
            false => Rgb::ZERO,
        }
    }

    /// One more tile begins.
    pub fn begin(&mut self) {
        self.sum *= KEPT;
        self.count *= KEPT;
    }

    /// The light of one more tree, as its own pixel sees it.
    pub fn add(&mut self, light: Rgb) {
        if light.is_finite() {
            self.sum += light.max(Rgb::ZERO).map(f32::sqrt);
            self.count += 1.0;
        }
    }
}
