//! Which paths are resampled beside those that pixels share.

use crate::emitter_sampler::EmitterSampler;
use crate::{PathReuse, SceneWorld};
use lightshed_film::FrameMethod;
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Rgb, SceneFeatures};
use lightshed_shift::{PathPart, RayKind, WorldGeometry};

/// What a frame of [`RestirPtOffline`](crate::RestirPtOffline) is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OfflineSplit {
    /// The paths that are resampled, which path reuse leaves out; `None` if it has all.
    pub resampled: Option<PathPart>,
    /// Frames of path reuse in a frame.
    pub reuse_frames: u32,
    /// Trees of resampled paths in a pixel of a frame.
    pub candidates: u32,
}

/// Frames of path reuse in a frame where they have most of the error.
const REUSE_FRAMES: u32 = 4;

/// Trees of paths by a delta lobe at `x₁`: pixels that see none trace none, so they cost little.
const FIRST_CANDIDATES: u32 = 12;

/// Trees of paths by a delta lobe at `x₁` or `x₂`, which all pixels trace up to `x₂`.
const EARLY_CANDIDATES: u32 = 6;

/// Least variance of paths by a delta lobe at `x₂` over that of all that is shared, from which on
/// they are resampled: to look for them costs about as much as a few frames of path reuse.
const LEAST_SECOND: f64 = 2.0;

/// Least variance of paths by a delta lobe at `x₁` over that of all others, from which on they are
/// resampled: the camera rays and reservoirs of a frame cost about as much of its time.
const LEAST_FIRST: f64 = 0.05;

/// The squared number of frames of path reuse for which its error and that of resampled paths cost
/// the same, times that quotient of variances, as measured.
const BALANCE: f64 = 55.0;

/// Seeds of the pilot.
const SEEDS: [u64; 2] = [0xd1b5_4a32_d192_ed03, 0x8cb9_2ba7_2f3d_8dd7];

/// Pixels that show variances. Of larger images these are in every second row of squares, every
/// third and so on.
const PIXELS: usize = 9216;
const LARGEST_STEP: usize = 8;

/// Points along a side of the image at which the camera looks for delta lobes, at most.
const LOOKS: u32 = 64;

impl OfflineSplit {
    /// Path reuse has all paths.
    pub const ALL_SHARED: Self = Self {
        resampled: None,
        reuse_frames: REUSE_FRAMES,
        candidates: 1,
    };

    /// Paths by a delta lobe at `x₁` are resampled.
    pub const FIRST_SPECULAR: Self = Self {
        resampled: Some(PathPart::FirstSpecular),
        reuse_frames: REUSE_FRAMES,
        candidates: FIRST_CANDIDATES,
    };

    /// By the variances of all that is shared, and of paths by a delta lobe at `x₁` and at `x₂`.
    fn of(shared: f64, [first, second]: [f64; 2]) -> Self {
        if second > LEAST_SECOND * shared {
            let frames = (BALANCE * shared / second).sqrt().round() as u32;
            return Self {
                resampled: Some(PathPart::EarlySpecular),
                reuse_frames: frames.clamp(1, REUSE_FRAMES),
                candidates: EARLY_CANDIDATES,
            };
        }
        match first > LEAST_FIRST * (shared + second) {
            true => Self::FIRST_SPECULAR,
            false => Self::ALL_SHARED,
        }
    }
}

/// The split of a scene, by a pilot if it has delta lobes.
pub(super) fn split_of<S: EmitterSampler + Send, E: EmitterSampler>(
    reuse: &mut PathReuse<'_, S>,
    world: &SceneWorld<'_, E>,
) -> OfflineSplit {
    let scene = world.scene();
    let features = SceneFeatures::of(scene);
    let is_short = scene.settings().max_depth.is_some_and(|depth| depth < 3);
    if features.delta_materials == 0 || is_short || !features.has_light() {
        return OfflineSplit::ALL_SHARED;
    }
    let [width, height] = reuse.size();
    let pixels = width as usize * height as usize;
    let step = pixels.div_ceil(PIXELS).clamp(1, LARGEST_STEP);
    let mut image = |part: Option<PathPart>, seed: u64| {
        reuse.leave_out(part);
        let mut image = vec![Rgb::ZERO; pixels];
        reuse.render_rows(step, (0, seed), &mut image);
        image
    };
    let shared = SEEDS.map(|seed| image(Some(PathPart::EarlySpecular), seed));
    // The same trees go on, so that differences are what belongs to their pixels only.
    let without_first = SEEDS.map(|seed| image(Some(PathPart::FirstSpecular), seed));
    let second = certain_variance([0, 1].map(|n| less(&without_first[n], &shared[n])));
    let first = match sees_specular(world) {
        true => {
            let all = SEEDS.map(|seed| image(None, seed));
            certain_variance([0, 1].map(|n| less(&all[n], &without_first[n])))
        }
        false => 0.0,
    };
    let (shared, _) = half_squares(&shared);
    OfflineSplit::of(shared, [first, second])
}

/// What an image has beyond another.
fn less(image: &[Rgb], other: &[Rgb]) -> Vec<Rgb> {
    image.iter().zip(other).map(|(a, b)| *a - *b).collect()
}

/// The variance less one standard error of its own: a single bright path says little.
fn certain_variance(images: [Vec<Rgb>; 2]) -> f64 {
    let (sum, squares) = half_squares(&images);
    sum - squares.sqrt()
}

/// Whether the camera sees a delta lobe, at points of a grid.
fn sees_specular<E: EmitterSampler>(world: &SceneWorld<'_, E>) -> bool {
    let (settings, camera) = (world.scene().settings(), world.scene().camera());
    let [columns, rows] = [settings.width, settings.height].map(|side| side.min(LOOKS));
    let step = Vec2::new(
        settings.width as f32 / columns.max(1) as f32,
        settings.height as f32 / rows.max(1) as f32,
    );
    let sees = |place: u32| {
        let (x, y) = (place % columns, place / columns);
        let at = (Vec2::new(x as f32, y as f32) + 0.5) * step;
        let seen = world.trace(&camera.ray(at, [0.5; 2]), RayKind::Sensor);
        seen.is_some_and(|seen| seen.has_delta_lobe())
    };
    let seen = (0..columns * rows).any(sees);
    // These rays belong to no frame.
    world.take_counts();
    seen
}

/// The sum over pixels of the variances by two images, and that of their squares.
fn half_squares([a, b]: &[Vec<Rgb>; 2]) -> (f64, f64) {
    a.iter().zip(b).fold((0.0, 0.0), |(sum, squares), (a, b)| {
        let d = *a - *b;
        let half = 0.5 * f64::from(d.dot(d));
        match half.is_finite() {
            true => (sum + half, squares + half * half),
            false => (sum, squares),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_film::RayCounts;
    use lightshed_scene::{Scene, builtin};

    fn split(name: &str, max_depth: Option<u32>) -> OfflineSplit {
        let mut description = builtin::by_name(name).unwrap();
        (description.settings.width, description.settings.height) = (96, 96);
        description.settings.max_depth = max_depth.or(description.settings.max_depth);
        let scene = Scene::new(&description).unwrap();
        let world = SceneWorld::new(&scene, scene.emitters_by_power());
        let split = split_of(&mut PathReuse::new(&scene, scene.emitters_by_power()), &world);
        // Rays of the choice belong to no frame.
        assert_eq!(world.take_counts(), RayCounts::default());
        split
    }

    /// In the pool light comes through the surface of the water alone. Without smooth surfaces, or
    /// with direct light alone, there is nothing to resample.
    #[test]
    fn splits_are_those_of_scenes() {
        let pool = split("pool", None);
        assert_eq!(pool.resampled, Some(PathPart::EarlySpecular), "{pool:?}");
        assert_eq!(pool.reuse_frames, 1);
        assert_eq!(split("pool", Some(2)), OfflineSplit::ALL_SHARED);
        for name in ["cornell", "cornell-glossy", "doorway"] {
            assert_eq!(split(name, None), OfflineSplit::ALL_SHARED, "{name}");
        }
    }

    /// More variance in what cannot be shared takes more of the work.
    #[test]
    fn splits_follow_variances() {
        assert_eq!(OfflineSplit::of(1.0, [0.01, 0.0]), OfflineSplit::ALL_SHARED);
        assert_eq!(OfflineSplit::of(1.0, [0.2, 0.5]), OfflineSplit::FIRST_SPECULAR);
        // An error that is not certain at all.
        assert_eq!(OfflineSplit::of(0.0, [-1.0, -1.0]), OfflineSplit::ALL_SHARED);
        let frames = |second: f64| OfflineSplit::of(1.0, [0.0, second]).reuse_frames;
        assert_eq!([3.0, 14.0, 1e3, f64::INFINITY].map(frames), [4, 2, 1, 1]);
    }
}
