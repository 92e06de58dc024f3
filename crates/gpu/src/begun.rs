//! Frames that the device has been given.

use crate::buffer::Buffer;
use crate::readback::AskedReadback;
use crate::work::BegunWork;
use crate::{GpuError, PassTime, Work};
use lightshed_film::RayCounts;
use lightshed_integrator::sampling::parallel;
use lightshed_scene::Rgb;

/// Pixels that a thread copies at once.
const PART: usize = 1 << 14;

/// What a frame gave.
#[derive(Clone, Debug, Default)]
pub struct FinishedFrame {
    /// Values of all pixels, row by row.
    pub values: Vec<[f32; 3]>,
    /// Rays, as far as the method counts them.
    pub rays: RayCounts,
    /// Run time of each dispatch; empty if the device has no clock.
    pub times: Vec<PassTime>,
}

/// A frame that the device has been given, and that nobody has waited for.
///
/// It goes on while the host does other work, and while the next frame is begun. Dropped, its
/// values are lost, and it still takes its time on the device.
pub struct BegunFrame(State);

enum State {
    Finished(FinishedFrame),
    OnDevice(OnDevice),
}

struct OnDevice {
    /// Times of what had to be waited for already.
    times: Vec<PassTime>,
    work: BegunWork,
    image: AskedReadback,
    pixels: usize,
    /// Words of a pixel in it.
    words: usize,
    rays: Rays,
}

/// Where a frame's counts of rays are.
pub(crate) enum Rays {
    /// On the host.
    Known(RayCounts),
    /// On the device: paths at each edge and shadow rays by turns, from the third number on.
    Counted(AskedReadback),
}

impl BegunFrame {
    /// Waits for it.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`].
    pub fn finish(self) -> Result<FinishedFrame, GpuError> {
        let mut values = vec![Rgb::ZERO; self.pixels()];
        let (rays, times) = self.finish_into(&mut values)?;
        let values = values.iter().map(Rgb::to_array).collect();
        Ok(FinishedFrame { values, rays, times })
    }

    /// [`finish`](Self::finish) with the values in an image of the frame's size, which parallel
    /// threads of the current pool copy.
    pub(crate) fn finish_into(self, values: &mut [Rgb]) -> Result<(RayCounts, Vec<PassTime>), GpuError> {
        let OnDevice {
            mut times,
            work,
            image,
            pixels: _,
            words,
            rays,
        } = match self.0 {
            State::OnDevice(frame) => frame,
            State::Finished(frame) => {
                for (pixel, value) in values.iter_mut().zip(frame.values) {
                    *pixel = value.into();
                }
                return Ok((frame.rays, frame.times));
            }
        };
        times.extend(work.wait()?);
        image.bytes(|bytes| {
            let parts = bytes.chunks(4 * words * PART).zip(values.chunks_mut(PART));
            parallel::for_each(parts, |_, (bytes, values)| {
                for (pixel, bytes) in values.iter_mut().zip(bytes.chunks_exact(4 * words)) {
                    *pixel = bytemuck::pod_read_unaligned(&bytes[..12]);
                }
            });
        })?;
        let rays = match rays {
            Rays::Known(rays) => rays,
            Rays::Counted(counts) => counted(&counts.values()?),
        };
        Ok((rays, times))
    }

    fn pixels(&self) -> usize {
        match &self.0 {
            State::Finished(frame) => frame.values.len(),
            State::OnDevice(frame) => frame.pixels,
        }
    }
}

impl From<FinishedFrame> for BegunFrame {
    fn from(frame: FinishedFrame) -> Self {
        Self(State::Finished(frame))
    }
}

fn counted(counts: &[u32]) -> RayCounts {
    let sum = |first: usize| counts.iter().skip(first).step_by(2).map(|&n| u64::from(n)).sum();
    RayCounts {
        camera: u64::from(counts[2]),
        path: sum(4),
        emitter: sum(3),
        ..RayCounts::default()
    }
}

impl Work<'_> {
    /// Hands the last work of a frame to the device: then `image` has four words for each of
    /// `width` × `height` pixels. For methods that trace a camera ray for each pixel and
    /// count no others.
    pub(crate) fn begin_image(mut self, image: &Buffer, [width, height]: [u32; 2]) -> BegunFrame {
        let pixels = width as usize * height as usize;
        let image = self.read_back(image, 16 * pixels as u64);
        let rays = RayCounts {
            camera: u64::from(width) * u64::from(height),
            ..RayCounts::default()
        };
        let work = self.begin();
        BegunFrame(State::OnDevice(OnDevice {
            times: Vec::new(),
            work,
            image: image.ask(),
            pixels,
            words: 4,
            rays: Rays::Known(rays),
        }))
    }

    /// The same of three words a pixel and with counts of rays, after work with these times.
    pub(crate) fn begin_paths(
        mut self,
        times: Vec<PassTime>,
        (image, pixels): (&Buffer, u32),
        (counts, words): (&Buffer, u64),
    ) -> BegunFrame {
        let image = self.read_back(image, 12 * u64::from(pixels));
        let counts = self.read_back(counts, 4 * words);
        let work = self.begin();
        BegunFrame(State::OnDevice(OnDevice {
            times,
            work,
            image: image.ask(),
            pixels: pixels as usize,
            words: 3,
            rays: Rays::Counted(counts.ask()),
        }))
    }
}

impl BegunFrame {
    /// The same with these rays in addition to those that were counted.
    pub(crate) fn with_path_rays(mut self, path: u64) -> Self {
        if let State::OnDevice(OnDevice {
            rays: Rays::Known(rays),
            ..
        }) = &mut self.0
        {
            rays.path += path;
        }
        self
    }
}
