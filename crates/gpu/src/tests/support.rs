//! What tests share.

use crate::{Gpu, GpuMethod};
use lightshed_scene::{EmitterDescription, Rgb, SceneDescription, builtin, luminance};
use lightshed_testkit::{MeanTest, StatisticsError, found_or_skipped};
use std::ops::Range;
use std::sync::{Mutex, OnceLock, PoisonError};

/// The sky over the built-in cloud, an image with a sun in it, over another scene.
pub(crate) fn under_the_sky(mut scene: SceneDescription) -> SceneDescription {
    let is_image = |emitter: &EmitterDescription| matches!(emitter, EmitterDescription::Environment(_));
    scene
        .emitters
        .extend(builtin::cloud().emitters.into_iter().filter(is_image));
    scene
}

/// Devices of all tests. A software device runs and compiles in one thread, so tests that run at
/// the same time have different ones.
static DEVICES: [OnceLock<Option<Gpu>>; 2] = [const { OnceLock::new() }; 2];

/// Threads that use each device.
static THREADS: Mutex<[usize; DEVICES.len()]> = Mutex::new([0; DEVICES.len()]);

/// The place of a thread's device, which it gives back at its end.
struct Place(usize);

impl Place {
    /// That of the least used device.
    fn take() -> Self {
        let mut threads = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
        let place = (0..threads.len())
            .min_by_key(|&place| threads[place])
            .unwrap_or(0);
        threads[place] += 1;
        Self(place)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        THREADS.lock().unwrap_or_else(PoisonError::into_inner)[self.0] -= 1;
    }
}

thread_local! {
    static PLACE: Place = Place::take();
}

/// The device of this thread's test, or `None` with a word about it where there is none; with
/// `LIGHTSHED_REQUIRE_GPU=1` there must be one.
pub(crate) fn gpu() -> Option<&'static Gpu> {
    let open = || found_or_skipped(Gpu::new(), "LIGHTSHED_REQUIRE_GPU");
    let gpu = PLACE.with(|place| DEVICES[place.0].get_or_init(open)).as_ref()?;
    println!("adapter: {}", gpu.description());
    Some(gpu)
}

/// The device, for a test of nothing but bits: `None`, with a word about it, where its arithmetic
/// rounds otherwise than the host's.
pub(crate) fn exact_gpu() -> Option<&'static Gpu> {
    let gpu = gpu()?;
    if !gpu.is_exact() {
        println!("SKIPPED: the arithmetic of {} is not the host's", gpu.name());
    }
    gpu.is_exact().then_some(gpu)
}

/// Mean luminance of what is at the pixels of an image, column and row.
pub(crate) fn mean_luminance([width, height]: [u32; 2], value: impl Fn(u32, u32) -> Rgb) -> f64 {
    let pixels = (0..width * height).map(|i| f64::from(luminance(value(i % width, i / width))));
    pixels.sum::<f64>() / f64::from(width * height)
}

/// The faults that a test of images plants on this device. Each is a program of its own, which a
/// software device compiles for seconds: there they are planted where `LIGHTSHED_FAULTS=1` asks for
/// them.
pub(crate) fn planted<'f, T>(gpu: &Gpu, faults: &'f [T]) -> &'f [T] {
    let asked = std::env::var("LIGHTSHED_FAULTS").is_ok_and(|value| value == "1");
    if asked || !gpu.is_software() {
        return faults;
    }
    println!("no faults are planted on a software device without LIGHTSHED_FAULTS=1");
    &[]
}

/// A program with a fault: what is right in its text, and what is planted.
pub(crate) fn faulty(program: &str, [right, planted]: [&str; 2]) -> String {
    assert!(program.contains(right), "{right}");
    println!(" {planted}");
    program.replace(right, planted)
}

/// Means of images of the host: of what is at a column and a row of each.
pub(crate) fn host_means(size: [u32; 2], images: u32, value: impl Fn(u32, u32, u32) -> Rgb) -> MeanTest {
    let mut means = MeanTest::new();
    for index in 0..images {
        means.push(mean_luminance(size, |x, y| value(x, y, index)));
    }
    means
}

/// Values of the device beside the host's.
#[derive(Default)]
pub(crate) struct Likeness {
    alike: u32,
    count: u32,
    /// What the luminance of the device's values exceeds that of the host's by: nothing where they
    /// are alike.
    pub differences: MeanTest,
}

impl Likeness {
    /// Compares a value with the host's.
    pub fn push(&mut self, value: Rgb, truth: Rgb) {
        let same = (value - truth).abs().max_element() <= 1e-4 * truth.max_element().max(1e-3);
        self.alike += u32::from(same);
        self.count += 1;
        self.differences.push(match same {
            true => 0.0,
            false => f64::from(luminance(value) - luminance(truth)),
        });
    }

    /// The share of the values that are the host's within 10⁻⁴.
    pub fn share(&self) -> f64 {
        f64::from(self.alike) / f64::from(self.count)
    }
}

/// Independent chains of frames of a method, each with a seed of its own.
pub(crate) struct Chains<'a> {
    /// The frames of a chain whose mean counts; those before are rendered, too.
    pub counted: Range<u32>,
    /// Subtracted from a pixel (column, row) of a frame, by its number and the seed: what is known
    /// and would only be noise.
    pub known: &'a dyn Fn([u32; 2], u32, u64) -> Rgb,
}

impl Chains<'_> {
    /// Whether so many chains of the method have the expectation `truth`, by a z-test at 1e-4.
    pub fn agree(&self, name: &str, method: &mut dyn GpuMethod, count: u64, truth: &MeanTest) -> bool {
        let mut found = MeanTest::new();
        self.add(method, 0..count, &mut found);
        println!(
            "{name}: {:.5} ({:.5}) against {:.5} ({:.5})",
            found.mean(),
            found.standard_error(),
            truth.mean(),
            truth.standard_error()
        );
        found.test_equal(truth, 1e-4).is_ok()
    }

    /// Whether the method turns out to have another expectation than `truth` in some chains of at
    /// most `most`, at 1e-4 each time it is asked. For programs with a fault: most are found out
    /// early.
    pub fn differ(&self, method: &mut dyn GpuMethod, most: u64, truth: &MeanTest) -> bool {
        const STEP: u64 = 6;
        let mut means = MeanTest::new();
        (0..most.div_ceil(STEP)).any(|step| {
            self.add(method, step * STEP..(step + 1) * STEP, &mut means);
            let error = means.standard_error().hypot(truth.standard_error());
            let score = (means.mean() - truth.mean()) / error;
            println!(
                "  {:.5} ({:.5}), {score:.1}",
                means.mean(),
                means.standard_error()
            );
            // Six values are beyond 12 with a probability of 7e-5 (Student's t, five degrees of
            // freedom); the z-test wants twenty.
            let judged = means.test_equal(truth, 1e-4);
            score.abs() > 12.0 || matches!(judged, Err(StatisticsError::Rejected { .. }))
        })
    }

    fn add(&self, method: &mut dyn GpuMethod, chains: Range<u64>, means: &mut MeanTest) {
        let size = method.size();
        for seed in chains.map(|chain| 1000 + chain) {
            let mut sum = 0.0;
            for frame in 0..self.counted.end {
                let (image, _) = method.frame(frame, seed).expect("the device answers");
                if self.counted.contains(&frame) {
                    sum += mean_luminance(size, |x, y| {
                        Rgb::from(image[(y * size[0] + x) as usize]) - (self.known)([x, y], frame, seed)
                    });
                }
            }
            means.push(sum / f64::from(self.counted.end - self.counted.start));
        }
    }
}
