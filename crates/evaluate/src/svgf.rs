//! A spatiotemporal variance-guided filter: the effect of a real-time denoiser on frames.

use lightshed_sampling::glam::{Vec2, Vec3};
use lightshed_sampling::{Rgb, luminance};

/// Data of a pixel for the filter, besides its light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelGuide {
    /// Unit normal; zero where no surface is seen: such a pixel has nothing to do with others.
    pub normal: Vec3,
    /// Distance from the camera.
    pub distance: f32,
    /// Change of the distance from a pixel to the next, `(|∂/∂x|, |∂/∂y|)`.
    pub slope: Vec2,
    /// Reflectance that is divided out before filtering.
    pub albedo: Rgb,
    /// Position of the surface in the previous frame, in pixels (the middle of the first is at ½);
    /// `None` if it was not visible there.
    pub seen_at: Option<Vec2>,
}

/// Parameters of [`Svgf`], by Schied et al. 2017.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SvgfOptions {
    /// Least share of a new frame in the mean over frames (`α`, 0.2).
    pub share: f32,
    /// Rounds of the à-trous filter (5).
    pub rounds: u32,
    /// `σ_l`: range of similar luminance in standard deviations (4).
    pub luminance_scale: f32,
    /// `σ_n`: power of the cosine between normals (128).
    pub normal_power: i32,
    /// `σ_z`: range of similar depth, relative to the distance's slope (1).
    pub distance_scale: f32,
}

impl Default for SvgfOptions {
    fn default() -> Self {
        Self {
            share: 0.2,
            rounds: 5,
            luminance_scale: 4.0,
            normal_power: 128,
            distance_scale: 1.0,
        }
    }
}

/// Spatiotemporal variance-guided filtering (Schied et al. 2017): frames are averaged over time
/// along the motion of the surfaces, their variance is estimated from the moments of that mean, and
/// an edge-stopping à-trous filter smooths as much as the variance requires.
///
/// A measuring instrument: it shows the effect of a denoiser on a method's frames. Its images are
/// biased on purpose; compare them by perceptual errors, not by tests of means. Unlike the
/// published filter it works on all light at once, without separate specular parts.
#[derive(Clone, Debug)]
pub struct Svgf {
    size: [usize; 2],
    options: SvgfOptions,
    /// Of the frame before.
    held: Vec<Held>,
}

/// What is kept of a pixel.
#[derive(Clone, Copy, Debug)]
struct Held {
    light: Rgb,
    /// Of the luminance.
    moments: Vec2,
    /// Number of frames in which it was visible.
    age: f32,
    normal: Vec3,
    distance: f32,
}

/// Light and the variance of its luminance.
#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    light: Rgb,
    variance: f32,
}

/// Weights of the à-trous filter along an axis.
const KERNEL: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];

/// Frames before the variance is estimated from the moments over time.
const YOUNG: f32 = 4.0;

/// Least albedo in the division.
const LEAST_ALBEDO: f32 = 0.01;

impl Svgf {
    /// For frames of this size, none of them seen yet.
    pub fn new([width, height]: [u32; 2], options: SvgfOptions) -> Self {
        Self {
            size: [width as usize, height as usize],
            options,
            held: Vec::new(),
        }
    }

    /// Filters the next frame; `None` if `frame` or `guides` are of another size. What is not
    /// finite in it counts as black.
    pub fn filter(&mut self, frame: &[Rgb], guides: &[PixelGuide]) -> Option<Vec<Rgb>> {
        let count = self.size[0] * self.size[1];
        if frame.len() != count || guides.len() != count {
            return None;
        }
        let taken_off = |guide: &PixelGuide| guide.albedo.max(Rgb::splat(LEAST_ALBEDO));
        let now: Vec<Held> = (0..count)
            .map(|index| {
                let guide = &guides[index];
                let light = frame[index] / taken_off(guide);
                let light = if light.is_finite() { light } else { Rgb::ZERO };
                self.accumulated(light, guide)
            })
            .collect();
        let mut estimates: Vec<Estimate> = (0..count)
            .map(|index| Estimate {
                light: now[index].light,
                variance: self.variance(&now, guides, index),
            })
            .collect();
        let mut first = None;
        for round in 0..self.options.rounds {
            estimates = self.smoothed(&estimates, guides, 1 << round.min(16));
            first.get_or_insert_with(|| {
                estimates
                    .iter()
                    .map(|estimate| estimate.light)
                    .collect::<Vec<_>>()
            });
        }
        // The mean over frames continues from the first round, as published.
        self.held = now;
        if let Some(first) = first {
            for (held, light) in self.held.iter_mut().zip(first) {
                held.light = light;
            }
        }
        let shaded = estimates.iter().zip(guides);
        Some(
            shaded
                .map(|(estimate, guide)| estimate.light * taken_off(guide))
                .collect(),
        )
    }

    /// For how many frames each pixel's surface has been visible, including the last one: 1 if it
    /// has just come into view. Fractional if several pixels of the previous frame see it.
    pub fn ages(&self) -> impl ExactSizeIterator<Item = f32> {
        self.held.iter().map(|held| held.age)
    }

    /// The mean over frames at a pixel.
    fn accumulated(&self, light: Rgb, guide: &PixelGuide) -> Held {
        let value = luminance(light);
        let fresh = Held {
            light,
            moments: Vec2::new(value, value * value),
            age: 1.0,
            normal: guide.normal,
            distance: guide.distance,
        };
        let Some(before) = guide.seen_at.and_then(|at| self.before(at, guide)) else {
            return fresh;
        };
        let age = before.age + 1.0;
        let share = (1.0 / age).max(self.options.share);
        Held {
            light: before.light.lerp(light, share),
            moments: before.moments.lerp(fresh.moments, share),
            age,
            ..fresh
        }
    }

    /// The previous frame's values at a place, from those of its four pixels that show the same
    /// surface.
    fn before(&self, at: Vec2, guide: &PixelGuide) -> Option<Held> {
        if self.held.is_empty() || !at.is_finite() {
            return None;
        }
        let corner = (at - 0.5).floor();
        let part = at - 0.5 - corner;
        let (mut light, mut moments, mut age, mut total) = (Rgb::ZERO, Vec2::ZERO, 0.0, 0.0);
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let Some(index) = self.index(corner.x as i64 + dx, corner.y as i64 + dy) else {
                continue;
            };
            let held = &self.held[index];
            let along = |part: f32, step: i64| if step == 1 { part } else { 1.0 - part };
            let alike =
                held.normal.dot(guide.normal) > 0.9 && (held.distance / guide.distance - 1.0).abs() < 0.1;
            let nothing = held.normal == Vec3::ZERO && guide.normal == Vec3::ZERO;
            if alike || nothing {
                let weight = along(part.x, dx) * along(part.y, dy);
                light += held.light * weight;
                moments += held.moments * weight;
                age += held.age * weight;
                total += weight;
            }
        }
        (total > 0.01).then(|| Held {
            light: light / total,
            moments: moments / total,
            age: age / total,
            normal: guide.normal,
            distance: guide.distance,
        })
    }

    fn index(&self, x: i64, y: i64) -> Option<usize> {
        let [width, height] = self.size.map(|side| side as i64);
        ((0..width).contains(&x) && (0..height).contains(&y)).then_some((y * width + x) as usize)
    }

    /// The pixels at most `radius` steps away along both axes.
    fn around(&self, index: usize, radius: i64, step: i64) -> impl Iterator<Item = (i64, i64, usize)> + '_ {
        let (x, y) = ((index % self.size[0]) as i64, (index / self.size[0]) as i64);
        let offsets = (-radius..=radius).flat_map(move |dy| (-radius..=radius).map(move |dx| (dx, dy)));
        offsets.filter_map(move |(dx, dy)| Some((dx, dy, self.index(x + dx * step, y + dy * step)?)))
    }

    /// How similar the surfaces of two pixels are, `w_z w_n`.
    fn alike(&self, own: &PixelGuide, other: &PixelGuide, offset: Vec2) -> f32 {
        // Light beside surfaces, at their edges, is no light of others who see none.
        if own.normal == Vec3::ZERO || other.normal == Vec3::ZERO {
            return 0.0;
        }
        let slope = own.slope.dot(offset.abs()) * self.options.distance_scale;
        let off = (own.distance - other.distance).abs();
        let turned = own
            .normal
            .dot(other.normal)
            .max(0.0)
            .powi(self.options.normal_power);
        turned * (-off / (slope + 1e-4 * own.distance.abs() + f32::MIN_POSITIVE)).exp()
    }

    /// Variance of the mean's luminance: from the moments over time, or of young pixels from those
    /// around them.
    fn variance(&self, now: &[Held], guides: &[PixelGuide], index: usize) -> f32 {
        let held = &now[index];
        if held.age >= YOUNG {
            return (held.moments.y - held.moments.x * held.moments.x).max(0.0);
        }
        let (mut moments, mut total) = (Vec2::ZERO, 0.0);
        for (dx, dy, other) in self.around(index, 3, 1) {
            let weight = self.alike(&guides[index], &guides[other], Vec2::new(dx as f32, dy as f32));
            moments += now[other].moments * weight;
            total += weight;
        }
        let moments = moments / total.max(f32::MIN_POSITIVE);
        // Young pixels are smoothed more.
        (moments.y - moments.x * moments.x).max(0.0) * YOUNG / held.age.max(1.0)
    }

    /// A round of the à-trous filter.
    fn smoothed(&self, estimates: &[Estimate], guides: &[PixelGuide], step: i64) -> Vec<Estimate> {
        let smooth = |index: usize| {
            let own = &estimates[index];
            let (mut blurred, mut weights) = (0.0, 0.0);
            for (dx, dy, other) in self.around(index, 1, 1) {
                let weight =
                    [0.5, 0.25][dx.unsigned_abs() as usize] * [0.5, 0.25][dy.unsigned_abs() as usize];
                blurred += estimates[other].variance * weight;
                weights += weight;
            }
            let deviation = (blurred / weights).max(0.0).sqrt() * self.options.luminance_scale + 1e-6;
            let (mut light, mut variance, mut total) = (Rgb::ZERO, 0.0, 0.0);
            for (dx, dy, other) in self.around(index, 2, step) {
                let there = &estimates[other];
                let kernel = KERNEL[dx.unsigned_abs() as usize] * KERNEL[dy.unsigned_abs() as usize];
                let offset = Vec2::new((dx * step) as f32, (dy * step) as f32);
                let off = (luminance(own.light) - luminance(there.light)).abs();
                let weight =
                    kernel * self.alike(&guides[index], &guides[other], offset) * (-off / deviation).exp();
                light += there.light * weight;
                variance += there.variance * weight * weight;
                total += weight;
            }
            // The pixel's own weight is positive, unless numbers are extreme.
            if !(total > f32::MIN_POSITIVE && light.is_finite()) {
                return *own;
            }
            Estimate {
                light: light / total,
                variance: variance / (total * total),
            }
        };
        (0..estimates.len()).map(smooth).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;

    const SIZE: [u32; 2] = [48, 32];

    fn place(index: usize) -> Vec2 {
        Vec2::new((index % 48) as f32 + 0.5, (index / 48) as f32 + 0.5)
    }

    /// Two planes side by side, the right one of another albedo, seen by a camera that has moved by
    /// `motion` pixels.
    fn guides(motion: Vec2) -> Vec<PixelGuide> {
        let guide = |index: usize| {
            let right = index % 48 >= 24;
            PixelGuide {
                normal: if right { Vec3::X } else { Vec3::Z },
                distance: 2.0,
                slope: Vec2::ZERO,
                albedo: Rgb::splat(if right { 0.2 } else { 0.8 }),
                seen_at: Some(place(index) + motion),
            }
        };
        (0..48 * 32).map(guide).collect()
    }

    fn noise(index: usize, frame: u32) -> f32 {
        CounterRng::new(4, index as u32, frame).next_f32()
    }

    /// What does not change is left alone, whatever the motion along a plane: edges between planes,
    /// and albedo.
    #[test]
    fn constant_light_stays() {
        let mut filter = Svgf::new(SIZE, SvgfOptions::default());
        let guides = guides(Vec2::new(0.0, 0.7));
        let frame: Vec<Rgb> = guides
            .iter()
            .map(|guide| guide.albedo * 3.0 * guide.normal.z.max(0.1))
            .collect();
        for _ in 0..6 {
            let filtered = filter.filter(&frame, &guides).unwrap();
            for (found, expected) in filtered.iter().zip(&frame) {
                assert!(
                    (*found - *expected).abs().max_element() < 1e-4 * expected.x,
                    "{found} for {expected}"
                );
            }
        }
    }

    /// Independent noise of mean ½ and variance 1/12: after ten frames the filtered planes have
    /// less than a fiftieth of its variance, and their mean to a percent. Noise that all frames
    /// share stays, but for what the filter in space takes: that is what reuse is measured for.
    #[test]
    fn noise_goes_and_blotches_stay() {
        let guides = guides(Vec2::ZERO);
        let left = |frame_of: &dyn Fn(usize, u32) -> f32| {
            let mut filter = Svgf::new(SIZE, SvgfOptions::default());
            let mut filtered = Vec::new();
            for frame in 0..10 {
                let image: Vec<Rgb> = (0..guides.len())
                    .map(|index| guides[index].albedo * frame_of(index, frame))
                    .collect();
                filtered = filter.filter(&image, &guides).unwrap();
            }
            let values: Vec<f64> = filtered
                .iter()
                .zip(&guides)
                .map(|(value, guide)| f64::from(value.x / guide.albedo.x))
                .collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let variance =
                values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64;
            (mean, variance)
        };
        let (mean, variance) = left(&|index, frame| noise(index, frame));
        assert!(
            (mean - 0.5).abs() < 0.01 && variance < 1.0 / 12.0 / 50.0,
            "{mean}, {variance}"
        );
        // Blotches of 8 × 8 pixels that stay.
        let blotch = |index: usize, _: u32| noise(index % 48 / 8 + index / 48 / 8 * 6, 0);
        let (mean, blotches) = left(&blotch);
        assert!(
            (mean - 0.5).abs() < 0.1 && blotches > 10.0 * variance,
            "{mean}, {blotches}"
        );
    }

    /// A surface that comes into view starts anew: nothing of the frame before is in it.
    #[test]
    fn disocclusion_starts_anew() {
        let mut filter = Svgf::new(SIZE, SvgfOptions::default());
        let mut guides = guides(Vec2::ZERO);
        let bright = vec![Rgb::splat(10.0); guides.len()];
        filter.filter(&bright, &guides).unwrap();
        for guide in &mut guides {
            if guide.normal == Vec3::X {
                guide.normal = Vec3::Y;
            }
        }
        let dark = vec![Rgb::ONE; guides.len()];
        let filtered = filter.filter(&dark, &guides).unwrap();
        for (value, guide) in filtered.iter().zip(&guides) {
            let is_new = guide.normal == Vec3::Y;
            assert_eq!((value.x - 1.0).abs() < 1e-4, is_new, "{value}");
        }
        let old = filter
            .ages()
            .zip(&guides)
            .map(|(age, guide)| (age, guide.normal == Vec3::Y));
        assert!(
            old.into_iter()
                .all(|(age, is_new)| age == if is_new { 1.0 } else { 2.0 })
        );
    }

    /// Where no surface is seen, light at its border with surfaces stays where it is: beside it
    /// there is none.
    #[test]
    fn light_beside_surfaces_stays_at_their_edge() {
        let mut guides = guides(Vec2::ZERO);
        let beside = |index: usize| index % 48 >= 24;
        for (_, guide) in guides.iter_mut().enumerate().filter(|(index, _)| beside(*index)) {
            guide.normal = Vec3::ZERO;
        }
        let mut filter = Svgf::new(SIZE, SvgfOptions::default());
        for number in 0..6 {
            let lit = |index: usize| match index % 48 <= 24 {
                true => Rgb::splat(noise(index, number)),
                false => Rgb::ZERO,
            };
            let frame: Vec<Rgb> = (0..guides.len()).map(lit).collect();
            let filtered = filter.filter(&frame, &guides).unwrap();
            for (index, value) in filtered.iter().enumerate() {
                assert_eq!(*value == Rgb::ZERO, index % 48 > 24, "{index}: {value}");
            }
        }
    }

    #[test]
    fn other_sizes_are_refused_and_bad_numbers_are_black() {
        let mut filter = Svgf::new(SIZE, SvgfOptions::default());
        let mut guides = guides(Vec2::NAN);
        assert!(filter.filter(&[Rgb::ONE], &guides).is_none());
        let mut frame = vec![Rgb::ONE; guides.len()];
        (frame[5], frame[900]) = (Rgb::NAN, Rgb::INFINITY);
        guides[7].distance = f32::INFINITY;
        for _ in 0..2 {
            let filtered = filter.filter(&frame, &guides).unwrap();
            assert!(filtered.iter().all(|value| value.is_finite()));
        }
    }
}
