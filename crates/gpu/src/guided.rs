//! Guided paths on the device.

use crate::{BegunFrame, FinishedFrame, Gpu, GpuError, GpuMethod, GpuPathTracer, GpuScene};
use lightshed_film::RayCounts;
use lightshed_integrator::sampling::PointSet;
use lightshed_integrator::{GuideKind, GuidedHalf, GuidedPaths, GuidedPathsOptions, SceneField};
use lightshed_scene::{EmittersByPower, Rgb, Scene};
use std::sync::atomic::AtomicBool;

/// Path tracing with a guide of quadtrees: the estimator of `lightshed_integrator::GuidedPaths`,
/// with independent random numbers. The frames that train are rendered on the host. All others, and
/// those after a guide was dropped, are rendered on the device, with the host's random numbers and
/// the host's field, so that frames differ by rounding only.
pub struct GpuGuidedPaths<'a> {
    host: GuidedPaths<'a, EmittersByPower<'a>>,
    device: GpuPathTracer<'a>,
    size: [u32; 2],
    /// The guide that the device has.
    guide: OnDevice,
    image: Vec<Rgb>,
}

/// A guide on the device: the field does not change once it is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OnDevice {
    Unset,
    Field,
    None,
}

impl<'a> GpuGuidedPaths<'a> {
    /// Frames that train if nothing else is asked for. On the host there are 256: here the device
    /// would wait for them.
    pub const TRAINING: u32 = 16;

    /// With [`GpuGuidedPaths::TRAINING`] frames that train.
    ///
    /// # Errors
    ///
    /// As [`GpuGuidedPaths::with_options`].
    pub fn new(gpu: &'a Gpu, scene: &'a Scene, on_device: &'a GpuScene) -> Result<Self, GpuError> {
        let options = GuidedPathsOptions {
            training: Self::TRAINING,
            ..GuidedPathsOptions::new(GuideKind::Quadtree)
        };
        Self::with_options(gpu, scene, on_device, options)
    }

    /// With other options; whatever they say, points are independent and paths find visible
    /// emission. `on_device` is `scene` on the
    /// device.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for another kind of guide than quadtrees, one that trains without
    /// end, or media; [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn with_options(
        gpu: &'a Gpu,
        scene: &'a Scene,
        on_device: &'a GpuScene,
        options: GuidedPathsOptions,
    ) -> Result<Self, GpuError> {
        check_guide(&options)?;
        let options = GuidedPathsOptions {
            points: PointSet::Independent,
            // The device's roulette goes by throughput: what the host decides has to hold for it.
            worth_depth: u32::MAX,
            visible_emission: false,
            ..options
        };
        let host = GuidedPaths::new(
            scene,
            scene.emitters_by_power().with_sky(on_device.sky()),
            options,
        )
        .map_err(|error| GpuError::Settings(error.to_string().into()))?;
        let size = on_device.size();
        Ok(Self {
            host,
            device: GpuPathTracer::new(gpu, on_device)?,
            size,
            guide: OnDevice::Unset,
            image: vec![Rgb::ZERO; size[0] as usize * size[1] as usize],
        })
    }

    /// The host's part: what was learnt, and whether the guide was dropped.
    pub fn host(&self) -> &GuidedPaths<'a, EmittersByPower<'a>> {
        &self.host
    }

    /// The device's part.
    pub fn device(&self) -> &GpuPathTracer<'a> {
        &self.device
    }
}

/// What of a guide the device knows.
pub(crate) fn check_guide(options: &GuidedPathsOptions) -> Result<(), GpuError> {
    let refused = |why: &'static str| Err(GpuError::Settings(why.into()));
    if options.kind != GuideKind::Quadtree {
        return refused("the device knows the guide cdq alone");
    }
    if options.every_frame {
        return refused("on the device a guide trains before its frames, not with each of them");
    }
    if options.volume.is_some() {
        return refused("the device guides no paths through media");
    }
    Ok(())
}

/// Renders half a frame on the device.
fn render(
    device: &mut GpuPathTracer<'_>,
    guide: &mut OnDevice,
    half: GuidedHalf<'_>,
    image: &mut [Rgb],
) -> Result<RayCounts, GpuError> {
    let field = match half.field {
        Some(SceneField::Quadtree(field)) => Some(field),
        _ => None,
    };
    let wanted = field.map_or(OnDevice::None, |_| OnDevice::Field);
    if *guide != wanted {
        device.set_guide(field.map(|field| field.flat()).as_ref(), half.roulette_depth)?;
    }
    *guide = wanted;
    let rendered = device.render(half.first, half.samples, half.seed)?;
    for (pixel, &mean) in image.iter_mut().zip(rendered.mean()) {
        *pixel = mean.into();
    }
    // Each sample has a camera ray; other rays of several waves are not counted.
    let pixels = rendered.mean().len() as u64;
    Ok(RayCounts {
        camera: pixels * u64::from(half.samples),
        ..RayCounts::default()
    })
}

impl GpuMethod for GpuGuidedPaths<'_> {
    fn size(&self) -> [u32; 2] {
        self.size
    }

    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        let Self {
            host,
            device,
            guide,
            image,
            ..
        } = self;
        // None of a frame on the host.
        let mut times = Vec::new();
        let mut failure = None;
        let rays =
            host.render_frame_elsewhere(frame, seed, image, &AtomicBool::new(false), &mut |half, image| {
                match render(device, guide, half, image) {
                    Ok(rays) => {
                        times.extend_from_slice(device.times());
                        Some(rays)
                    }
                    Err(error) => {
                        failure = Some(error);
                        None
                    }
                }
            });
        match (rays, failure) {
            (_, Some(failure)) => Err(failure),
            (rays, None) => Ok(BegunFrame::from(FinishedFrame {
                values: image.iter().map(Rgb::to_array).collect(),
                rays: rays.unwrap_or_default(),
                times,
            })),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn guides_that_the_device_does_not_know_are_refused() {
        let refused = |options: GuidedPathsOptions| match check_guide(&options) {
            Err(GpuError::Settings(why)) => why.into_owned(),
            _ => String::new(),
        };
        let known = GuidedPathsOptions::new(GuideKind::Quadtree);
        assert_eq!(refused(known), "");
        for kind in GuideKind::ALL.into_iter().filter(|&kind| kind != known.kind) {
            assert!(refused(GuidedPathsOptions::new(kind)).contains("cdq"));
        }
        let endless = GuidedPathsOptions {
            every_frame: true,
            ..known
        };
        assert!(refused(endless).contains("trains before"));
    }
}
