//! Which paths are resampled beside tiles that share.

use crate::emitter_sampler::EmitterSampler;
use crate::{PathReuse, SceneWorld};
use lightshed_film::FrameMethod;
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Rgb, SceneFeatures};
use lightshed_shift::{PathPart, RayKind, WorldGeometry};
use std::sync::atomic::AtomicBool;

/// What a frame of [`RestirPtOffline`](crate::RestirPtOffline) is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OfflineSplit {
    /// The paths that are resampled, which tiles leave out; `None` if tiles have all.
    pub resampled: Option<PathPart>,
    /// Frames of tiles in a frame.
    pub tile_frames: u32,
    /// Trees of resampled paths in a pixel of a frame.
    pub candidates: u32,
}

/// Frames of tiles in a frame where they have most of the error.
const TILE_FRAMES: u32 = 4;

/// Trees of paths by a delta lobe at `x₁`: pixels that see none trace none, so they cost little.
const FIRST_CANDIDATES: u32 = 12;

/// Trees of paths by a delta lobe at `x₁` or `x₂`, which all pixels trace up to `x₂`.
const EARLY_CANDIDATES: u32 = 6;

/// Least variance of paths by a delta lobe at `x₂` over that of all paths that tiles share, for
/// which the former are resampled: to look for them costs about as much as a few frames of tiles.
const LEAST_SHARE: f64 = 2.0;

/// The squared number of frames of tiles for which their error and that of resampled paths cost the
/// same, times that quotient of variances, as measured.
const BALANCE: f64 = 55.0;

/// Seeds of the pilot.
const SEEDS: [u64; 2] = [0xd1b5_4a32_d192_ed03, 0x8cb9_2ba7_2f3d_8dd7];

/// Points along a side of the image at which the camera looks for delta lobes, at most.
const LOOKS: u32 = 64;

impl OfflineSplit {
    /// Tiles have all paths.
    pub const TILES: Self = Self {
        resampled: None,
        tile_frames: TILE_FRAMES,
        candidates: 1,
    };

    /// Paths by a delta lobe at `x₁` are resampled.
    pub const FIRST_SPECULAR: Self = Self {
        resampled: Some(PathPart::FirstSpecular),
        tile_frames: TILE_FRAMES,
        candidates: FIRST_CANDIDATES,
    };

    /// By the variances of all that tiles share and of paths by a delta lobe at `x₂`, and by
    /// whether the camera sees delta lobes.
    fn of(shared: f64, second: f64, sees_specular: bool) -> Self {
        if second <= LEAST_SHARE * shared {
            return match sees_specular {
                true => Self::FIRST_SPECULAR,
                false => Self::TILES,
            };
        }
        let frames = (BALANCE * shared / second).sqrt().round() as u32;
        Self {
            resampled: Some(PathPart::EarlySpecular),
            tile_frames: frames.clamp(1, TILE_FRAMES),
            candidates: EARLY_CANDIDATES,
        }
    }
}

/// The split of a scene, by a pilot if it has delta lobes.
pub(super) fn split_of<S: EmitterSampler + Send, E: EmitterSampler>(
    tiles: &mut PathReuse<'_, S>,
    world: &SceneWorld<'_, E>,
) -> OfflineSplit {
    let scene = world.scene();
    let features = SceneFeatures::of(scene);
    let is_short = scene.settings().max_depth.is_some_and(|depth| depth < 3);
    if features.delta_materials == 0 || is_short || !features.has_light() {
        return OfflineSplit::TILES;
    }
    let sees_specular = sees_specular(world);
    let [width, height] = tiles.size();
    let pixels = width as usize * height as usize;
    let never = AtomicBool::new(false);
    let mut image = |part: Option<PathPart>, seed: u64| {
        tiles.leave_out(part);
        let mut image = vec![Rgb::ZERO; pixels];
        tiles.render_frame(0, seed, &mut image, &never);
        image
    };
    let first = sees_specular.then_some(PathPart::FirstSpecular);
    let [[all, shared], [other, other_shared]] =
        SEEDS.map(|seed| [first, Some(PathPart::EarlySpecular)].map(|part| image(part, seed)));
    // The same trees, so that all else is the same.
    let second = |all: &[Rgb], shared: &[Rgb]| -> Vec<Rgb> {
        all.iter()
            .zip(shared)
            .map(|(all, shared)| *all - *shared)
            .collect()
    };
    let (variance, _) = half_squares(&shared, &other_shared);
    let (sum, squares) = half_squares(&second(&all, &shared), &second(&other, &other_shared));
    // Without one standard error: a single bright path says little.
    OfflineSplit::of(variance, sum - squares.sqrt(), sees_specular)
}

/// Whether the camera sees a delta lobe, at points of a grid.
fn sees_specular<E: EmitterSampler>(world: &SceneWorld<'_, E>) -> bool {
    let (settings, camera) = (world.scene().settings(), world.scene().camera());
    let [columns, rows] = [settings.width, settings.height].map(|side| side.min(LOOKS));
    let step = Vec2::new(
        settings.width as f32 / columns.max(1) as f32,
        settings.height as f32 / rows.max(1) as f32,
    );
    let sees = (0..columns * rows).any(|place| {
        let (x, y) = (place % columns, place / columns);
        let at = (Vec2::new(x as f32, y as f32) + 0.5) * step;
        let seen = world.trace(&camera.ray(at, [0.5; 2]), RayKind::Sensor);
        seen.is_some_and(|seen| seen.has_delta_lobe())
    });
    // These rays belong to no frame.
    world.take_counts();
    sees
}

/// The sum over pixels of the variances by two images, and that of their squares.
fn half_squares(a: &[Rgb], b: &[Rgb]) -> (f64, f64) {
    a.iter().zip(b).fold((0.0, 0.0), |(sum, squares), (a, b)| {
        let d = *a - *b;
        let half = 0.5 * f64::from(d.dot(d));
        match half.is_finite() {
            true => (sum + half, squares + half * half),
            false => (sum, squares),
        }
    })
}
