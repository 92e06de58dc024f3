//! What takes the noise of weights out of an image: a control variate.

use lightshed_scene::Rgb;

/// Share of a tile's weight that is left after another tile.
const KEPT: f32 = 0.95;

/// The mean light of the trees of earlier tiles, the last ones most.
#[derive(Default)]
pub struct Control {
    sum: Rgb,
    count: f32,
}

impl Control {
    /// `c`; zero while nothing is known.
    pub fn value(&self) -> Rgb {
        match self.count > 0.0 {
            true => self.sum / self.count,
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
            self.sum += light;
            self.count += 1.0;
        }
    }
}
