//! A place from which light came, and its lobe.

use super::options::PlaceOptions;
use crate::vmf::{MAX_CONCENTRATION, peak_density};
use glam::{DVec3, Vec3};

/// A place from which light came to a region; a copy of one lane of a
/// [`PlaceBlock`](super::PlaceBlock). All zeros is an empty one.
///
/// Light lies around the mean `ȳ` with the mean squared distance `s²`. From a position at the
/// distance `d` it is a lobe of concentration `κ = 3 d²/s²`: of a spread that is the same in
/// all directions, two thirds lie across the line of sight, and a lobe of small angles has
/// `E[θ²] = 2/κ`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Place {
    pub mean: [f32; 3],
    /// `s²`.
    pub spread: f32,
    /// `Σ w`, fading.
    pub weight: f32,
    /// Number of samples, fading.
    pub count: f32,
    /// Mean of `|y − ȳ|²` over the samples alone.
    pub scatter: f32,
    /// `Σ π` of the region's places up to this one.
    pub cumulative: f32,
}

/// What the samples of an update say about a place.
#[derive(Clone, Copy, Default)]
pub(super) struct Batch {
    weight: f64,
    count: f64,
    mean: DVec3,
    /// `Σ w |y − ȳ|²`.
    squares: f64,
    /// `Σ w d²` of distances from the samples' positions.
    distances: f64,
}

impl Batch {
    /// `Σ w`.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Adds a sample of weight `w > 0` that came from `place`, `distance` away.
    pub fn add(&mut self, w: f64, place: Vec3, distance: f64) {
        self.weight += w;
        self.count += 1.0;
        let place = place.as_dvec3();
        let before = place - self.mean;
        self.mean += before * (w / self.weight);
        self.squares += w * before.dot(place - self.mean);
        self.distances += w * distance * distance;
    }
}

impl Place {
    /// `ȳ`.
    #[inline(always)]
    pub(super) fn mean(&self) -> Vec3 {
        self.mean.into()
    }

    /// `Σ w` of the samples that came from there; those of earlier updates fade.
    #[inline(always)]
    pub(super) fn weight(&self) -> f32 {
        self.weight
    }

    /// Whether there is a place.
    #[inline(always)]
    pub(super) fn is_known(&self) -> bool {
        self.spread > 0.0
    }

    /// A place that a sample found, `distance` away. Its weight comes with its update.
    pub(super) fn found(place: Vec3, distance: f32, options: &PlaceOptions) -> Self {
        Self {
            mean: place.to_array(),
            spread: (options.prior_angle * distance).powi(2).max(f32::MIN_POSITIVE),
            weight: 0.0,
            count: 0.0,
            scatter: 0.0,
            cumulative: 0.0,
        }
    }

    /// The same place, for a region that has not tried it yet.
    pub(super) fn tried(&self, weight: f32) -> Self {
        Self {
            weight,
            count: 0.0,
            ..*self
        }
    }

    /// What was found fades, and the samples of an update are added. What is old counts no more
    /// than what is new, where that is more than a few samples: the weight of the sample that found
    /// the place is that of all that were missed.
    pub(super) fn update(&mut self, batch: &Batch, options: &PlaceOptions) {
        let decay = f64::from(options.decay);
        let kept = decay * f64::from(self.weight);
        let total = kept + batch.weight;
        if batch.count > 0.0 {
            let known = (decay * f64::from(self.count)).min(batch.count.max(4.0));
            let share = batch.count / (known + batch.count);
            let to = batch.mean - self.mean().as_dvec3();
            let old = f64::from(self.scatter);
            let new = batch.squares / batch.weight;
            let scatter = (1.0 - share) * old + share * new + share * (1.0 - share) * to.length_squared();
            self.mean = (self.mean().as_dvec3() + share * to).as_vec3().to_array();
            let count = known + batch.count;
            let prior = f64::from(options.prior_angle).powi(2) * batch.distances / batch.weight;
            let prior_count = f64::from(options.prior_count);
            let spread = (count * scatter + prior_count * prior) / (count + prior_count);
            self.scatter = scatter.min(f64::from(f32::MAX)) as f32;
            self.spread = (spread as f32).clamp(f32::MIN_POSITIVE, f32::MAX);
            self.count = count as f32;
        }
        self.weight = total.min(f64::from(f32::MAX)) as f32;
    }

    /// Whether its numbers are valid, wherever they come from.
    pub(super) fn is_sound(&self) -> bool {
        let sizes = [self.spread, self.weight, self.count, self.scatter];
        let sound = sizes.iter().all(|x| *x >= 0.0 && x.is_finite());
        sound && self.mean().is_finite() && (0.0..=1.0).contains(&self.cumulative)
    }

    /// Concentration `κ` as seen from a position whose vector to the place is `to`.
    #[inline(always)]
    pub(super) fn concentration(&self, to: Vec3) -> f32 {
        // A place at the position itself is seen in all directions.
        (WIDTH * to.length_squared() / self.spread).min(MAX_CONCENTRATION)
    }

    /// The density of its lobe in a unit direction, per steradian; `to` is the vector to the
    /// place.
    #[inline(always)]
    pub(super) fn density(&self, to: Vec3, direction: Vec3) -> f32 {
        let concentration = self.concentration(to);
        // Most places are elsewhere: 1 − cos θ is at least half the squared sine.
        let across = to.cross(direction).length_squared();
        if across * concentration > 2.0 * FARTHEST * to.length_squared() {
            return 0.0;
        }
        let mean = to.normalize_or(Vec3::Z);
        let exponent = 0.5 * concentration * (direction - mean).length_squared();
        peak_density(concentration) * (-exponent).exp()
    }
}

/// `κ s²/d²`.
pub(super) const WIDTH: f32 = 3.0;
/// Light further from a place than this, as a squared distance by `s²`, belongs to another.
pub(super) const NEAR: f32 = 9.0;
/// From this exponent on a lobe counts as zero: `e^{−87}` is the least normal number.
pub(super) const FARTHEST: f32 = 87.0;
