//! Intel's denoiser: what a trained filter makes of frames.

use crate::EvaluateError;
use crate::svgf::PixelGuide;
use lightshed_sampling::Rgb;
use lightshed_sampling::glam::Vec3;

/// Intel's Open Image Denoise on the processor: a neural network that sees one frame, its albedo
/// and its normals.
///
/// A measuring instrument as [`Svgf`](crate::Svgf) is, but it knows nothing of earlier frames. The
/// guides count as free of noise. Its images are biased.
pub struct Oidn {
    device: ::oidn::Device,
    size: [usize; 2],
}

impl Oidn {
    /// For frames of this size.
    ///
    /// # Errors
    /// [`EvaluateError::Filter`] if the size is zero or the library cannot be started.
    pub fn new([width, height]: [u32; 2]) -> Result<Self, EvaluateError> {
        if width == 0 || height == 0 {
            return Err(EvaluateError::Filter(format!(
                "an image of {width}x{height} pixels"
            )));
        }
        Ok(Self {
            device: ::oidn::Device::cpu().map_err(failed)?,
            size: [width as usize, height as usize],
        })
    }

    /// Filters a frame. What is not finite or negative in it counts as black. Of the guides the
    /// normal and the albedo have an effect.
    ///
    /// # Errors
    /// [`EvaluateError::Filter`] if `frame` or `guides` are of another size, and for errors of the
    /// library.
    pub fn filter(&self, frame: &[Rgb], guides: &[PixelGuide]) -> Result<Vec<Rgb>, EvaluateError> {
        let [width, height] = self.size;
        let count = width * height;
        if frame.len() != count || guides.len() != count {
            let (frame, guides) = (frame.len(), guides.len());
            return Err(EvaluateError::Filter(format!(
                "{frame} pixels and {guides} guides for {width}x{height} pixels"
            )));
        }
        let shown = |light: &Rgb| match light.is_finite() {
            true => light.max(Rgb::ZERO),
            false => Rgb::ZERO,
        };
        let color = flat(frame.iter().map(shown));
        let albedo = flat(guides.iter().map(|guide| guide.albedo.clamp(Rgb::ZERO, Rgb::ONE)));
        let normal = flat(guides.iter().map(|guide| guide.normal));
        let held = |values: &[f32]| self.device.create_buffer(values).map_err(failed);
        let mut filter = ::oidn::RayTracing::try_new(&self.device).map_err(failed)?;
        filter
            .image_dimensions(width, height)
            .hdr(true)
            .clean_aux(true)
            .albedo_normal_buffer(held(&albedo)?, held(&normal)?)
            .map_err(failed)?;
        let mut filtered = vec![0.0; color.len()];
        filter.filter(&color, &mut filtered).map_err(failed)?;
        Ok(filtered.chunks_exact(3).map(Rgb::from_slice).collect())
    }
}

/// An error of the library.
fn failed(error: ::oidn::Error) -> EvaluateError {
    EvaluateError::Filter(error.to_string())
}

fn flat(values: impl Iterator<Item = Vec3>) -> Vec<f32> {
    values.flat_map(|value| value.to_array()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;
    use lightshed_sampling::glam::Vec2;

    const SIZE: [u32; 2] = [64, 48];

    /// Two walls that meet in the middle column, unevenly lit.
    fn truth() -> (Vec<Rgb>, Vec<PixelGuide>) {
        let place = |index: u32| [index % SIZE[0], index / SIZE[0]].map(|i| i as f32);
        let pixels = SIZE[0] * SIZE[1];
        let is_left = |x: f32| x < SIZE[0] as f32 / 2.0;
        let light = (0..pixels).map(|index| {
            let [x, y] = place(index);
            let brightness = if is_left(x) { 0.4 } else { 1.2 };
            Rgb::new(1.0, 0.8, 0.6) * (brightness * (1.0 + 0.01 * y))
        });
        let guide = (0..pixels).map(|index| {
            let [x, y] = place(index);
            PixelGuide {
                normal: if is_left(x) { Vec3::X } else { Vec3::Z },
                distance: 3.0,
                slope: Vec2::ZERO,
                albedo: Rgb::splat(0.5),
                seen_at: Some(Vec2::new(x + 0.5, y + 0.5)),
            }
        });
        (light.collect(), guide.collect())
    }

    fn mse(image: &[Rgb], truth: &[Rgb]) -> f64 {
        let sum: f64 = image
            .iter()
            .zip(truth)
            .map(|(a, b)| f64::from(a.distance_squared(*b)))
            .sum();
        sum / (3 * truth.len()) as f64
    }

    /// Exponential noise falls by far, and the edge between the walls stays.
    #[test]
    fn noise_falls_and_edges_stay() {
        let (truth, guides) = truth();
        let mut rng = CounterRng::new(1, 0, 0);
        let noisy: Vec<Rgb> = truth
            .iter()
            .map(|light| light * -(1.0 - rng.next_f32()).ln())
            .collect();
        let filter = Oidn::new(SIZE).unwrap();
        let filtered = filter.filter(&noisy, &guides).unwrap();
        let [before, after] = [&noisy, &filtered].map(|image| mse(image, &truth));
        assert!(after < 0.02 * before, "{before} -> {after}");
        for row in 4..SIZE[1] as usize - 4 {
            let middle = row * SIZE[0] as usize + SIZE[0] as usize / 2;
            assert!(filtered[middle].x > 1.8 * filtered[middle - 1].x, "row {row}");
        }
        assert_eq!(
            filtered,
            filter.filter(&noisy, &guides).unwrap(),
            "not repeatable"
        );
    }

    #[test]
    fn what_is_not_finite_is_black() {
        let (mut frame, guides) = truth();
        frame[100] = Rgb::new(f32::NAN, f32::INFINITY, -1.0);
        let filtered = Oidn::new(SIZE).unwrap().filter(&frame, &guides).unwrap();
        assert!(filtered.iter().all(|light| light.is_finite()));
    }

    #[test]
    fn other_sizes_are_refused() {
        let (frame, guides) = truth();
        assert!(Oidn::new([0, 4]).is_err());
        let filter = Oidn::new(SIZE).unwrap();
        assert!(filter.filter(&frame[1..], &guides).is_err());
        assert!(filter.filter(&frame, &guides[1..]).is_err());
    }
}
