//! Apparent position of light that was reflected or refracted.

/// The apparent distance of what a ray found behind smooth surfaces, along the direction in which
/// it left (after Ruppert, Herholz and Lensch 2020, eq. 35).
///
/// At a plane between indices of refraction `η₁`, where the eye is, and `η₂`, rays that meet
/// at a distance `d` behind it seem to meet at `d (η₁ cos²θ₁)/(η₂ cos²θ₂)` in the
/// plane of incidence, and at `d η₁/η₂` across it (Coddington). A lobe that is round has the
/// geometric mean, `d (η₁ cosθ₁)/(η₂ cosθ₂)`; a mirror changes nothing. Several
/// surfaces are folded from the light to the eye.
///
/// ```
/// use lightshed_guiding::ApparentDistance;
/// // A metre of air, straight down into two metres of water: it seems one and a half.
/// let mut seen = ApparentDistance::new();
/// seen.pass(1.0, 4.0 / 3.0, 1.0, 1.0);
/// assert!((seen.end(2.0) - 2.5).abs() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ApparentDistance {
    /// Up to the last surface.
    so_far: f32,
    /// Factor of a length behind it.
    scale: f32,
}

impl Default for ApparentDistance {
    fn default() -> Self {
        Self::new()
    }
}

impl ApparentDistance {
    /// At the point from which the ray leaves.
    pub fn new() -> Self {
        Self {
            so_far: 0.0,
            scale: 1.0,
        }
    }

    /// After `distance` the ray passed or was reflected at a surface; `eta` is the index of
    /// refraction behind it over that before (1 if it was reflected), `cos_before` and `cos_behind`
    /// are the cosines of its directions with the normal, of any sign.
    pub fn pass(&mut self, distance: f32, eta: f32, cos_before: f32, cos_behind: f32) {
        self.so_far += self.scale * distance;
        let ratio = cos_before.abs() / (eta * cos_behind.abs());
        // A grazing ray has no image; NaN fails the comparison.
        if ratio > 0.0 && ratio < 1e3 {
            self.scale *= ratio;
        }
    }

    /// The apparent distance of a point at `distance` behind the last surface.
    pub fn end(&self, distance: f32) -> f32 {
        self.so_far + self.scale * distance
    }
}
