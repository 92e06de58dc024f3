//! The renderer's own scene: a floor under two thousand lamps, a wall that hides some of them.

use lightshed_lights::glam::Vec3;
use lightshed_sampling::CounterRng;

/// A small lamp that shines all around.
pub struct Lamp {
    pub position: Vec3,
    pub intensity: f32,
}

pub struct Scene {
    pub lamps: Vec<Lamp>,
}

impl Scene {
    pub fn new() -> Self {
        let mut rng = CounterRng::new(1, 0, 0);
        let mut lamp = || {
            let ([x, z], [y, i]) = (rng.next_2d(), rng.next_2d());
            Lamp {
                position: Vec3::new(20.0 * x - 10.0, 0.3 + 2.0 * y, 20.0 * z - 10.0),
                intensity: 0.01 + i * i * i * i,
            }
        };
        Self {
            lamps: (0..2_000).map(|_| lamp()).collect(),
        }
    }

    /// The floor's point that a pixel of a `width × width` image shows; the uppermost row shows
    /// the sky.
    pub fn floor(&self, pixel: usize, width: usize) -> Option<Vec3> {
        let (x, y) = (pixel % width, pixel / width);
        let at = |k: usize| (k as f32 + 0.5) * 16.0 / width as f32 - 8.0;
        (y > 0).then(|| Vec3::new(at(x), 0.0, at(y)))
    }

    /// Light of a lamp at a point of the floor if nothing is between.
    pub fn unshadowed(&self, lamp: u32, at: Vec3) -> f64 {
        let lamp = &self.lamps[lamp as usize];
        let d = lamp.position - at;
        f64::from(lamp.intensity * d.y / (d.length_squared() * d.length()))
    }

    /// Whether a wall along the plane `x = 0`, one unit high, is not between.
    pub fn visible(&self, lamp: u32, at: Vec3) -> bool {
        let to = self.lamps[lamp as usize].position;
        if at.x * to.x > 0.0 {
            return true;
        }
        at.lerp(to, at.x / (at.x - to.x)).y > 1.0
    }

    /// The sum over all lamps.
    #[cfg(test)]
    pub fn light(&self, at: Vec3) -> f64 {
        let visible = (0..self.lamps.len() as u32).filter(|&lamp| self.visible(lamp, at));
        visible.map(|lamp| self.unshadowed(lamp, at)).sum()
    }
}
