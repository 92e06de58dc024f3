//! Cameras that move from frame to frame, and where points were seen by an earlier one.

use lightshed_resampling::Extent;
use lightshed_scene::glam::{Quat, Vec3};
use lightshed_scene::{Camera, Scene};
use std::fmt;

/// How the camera moves: frame `f` is seen from `x ↦ R_f x + t_f`, applied to the scene's camera.
/// Frame 0 shows the scene as its camera does.
///
/// ```
/// use lightshed_integrator::CameraMotion;
/// use lightshed_scene::{Scene, builtin, glam::{Vec2, Vec3}};
///
/// let scene = Scene::new(&builtin::cornell())?;
/// let motion = CameraMotion::translation(Vec3::new(0.1, 0.0, 0.0))?;
/// let [first, third] = [0, 2].map(|frame| motion.camera(&scene, frame).ray(Vec2::ZERO, [0.5; 2]));
/// assert!((third.origin - first.origin).distance(Vec3::new(0.2, 0.0, 0.0)) < 1e-6);
/// assert_eq!(third.direction, first.direction);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraMotion {
    path: Path,
    /// Frame from which on nothing moves.
    end: Option<u32>,
    /// Frame from which on it goes back.
    turn: Option<u32>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Path {
    #[default]
    Still,
    Translation {
        per_frame: Vec3,
    },
    Orbit {
        pivot: Vec3,
        axis: Vec3,
        radians_per_frame: f32,
    },
}

/// Why a motion is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CameraMotionError {
    /// A translation, a pivot or an angle is NaN or infinite.
    NotFinite,
    /// The axis of an orbit is zero or not finite.
    Axis,
}

impl fmt::Display for CameraMotionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a camera's motion must be finite",
            Self::Axis => "the axis of an orbit must be finite and not zero",
        })
    }
}

impl std::error::Error for CameraMotionError {}

impl CameraMotion {
    /// All frames show the same view.
    pub const STILL: Self = Self::along(Path::Still);

    const fn along(path: Path) -> Self {
        Self {
            path,
            end: None,
            turn: None,
        }
    }

    /// Moves by `per_frame` in world space from each frame to the next.
    ///
    /// # Errors
    /// [`CameraMotionError::NotFinite`].
    pub fn translation(per_frame: Vec3) -> Result<Self, CameraMotionError> {
        let finite = per_frame.is_finite();
        finite
            .then_some(Self::along(Path::Translation { per_frame }))
            .ok_or(CameraMotionError::NotFinite)
    }

    /// Turns about the line through `pivot` along `axis` by `radians_per_frame`, counterclockwise
    /// as seen from where `axis` points.
    ///
    /// # Errors
    /// See [`CameraMotionError`].
    pub fn orbit(pivot: Vec3, axis: Vec3, radians_per_frame: f32) -> Result<Self, CameraMotionError> {
        if !pivot.is_finite() || !radians_per_frame.is_finite() {
            return Err(CameraMotionError::NotFinite);
        }
        let axis = axis.try_normalize().ok_or(CameraMotionError::Axis)?;
        Ok(Self::along(Path::Orbit {
            pivot,
            axis,
            radians_per_frame,
        }))
    }

    /// The same motion up to frame `frame`, whose view all later ones have.
    #[must_use]
    pub fn until(self, frame: u32) -> Self {
        Self {
            end: Some(frame),
            ..self
        }
    }

    /// The same motion up to frame `frame`, and from there the same way back: frame `frame + n` has
    /// the view of frame `frame − n`, and the first view stays once it is reached again. What was
    /// seen before comes into view again.
    #[must_use]
    pub fn returning_from(self, frame: u32) -> Self {
        Self {
            turn: Some(frame),
            ..self
        }
    }

    /// Whether frame `frame` shows the same view as the one before.
    pub fn rests_at(&self, frame: u32) -> bool {
        self.is_still()
            || frame
                .checked_sub(1)
                .is_some_and(|before| self.step(frame) == self.step(before))
    }

    /// Which frame of the path alone has the view of frame `frame`.
    fn step(&self, frame: u32) -> u32 {
        let frame = self.end.map_or(frame, |end| frame.min(end));
        match self.turn {
            Some(turn) if frame > turn => turn.saturating_sub(frame - turn),
            _ => frame,
        }
    }

    /// Whether all frames show the same view.
    pub fn is_still(&self) -> bool {
        if cfg!(lightshed_without = "motion") {
            return true;
        }
        match self.path {
            Path::Still => true,
            Path::Translation { per_frame } => per_frame == Vec3::ZERO,
            Path::Orbit {
                radians_per_frame, ..
            } => radians_per_frame == 0.0,
        }
    }

    /// The camera of frame `frame`. A camera that would leave the range of numbers stays at the
    /// scene's own.
    pub fn camera(&self, scene: &Scene, frame: u32) -> Camera {
        let camera = scene.camera();
        let frame = self.step(frame);
        let (rotation, translation) = match self.path {
            _ if cfg!(lightshed_without = "motion") => return camera.clone(),
            Path::Still => return camera.clone(),
            Path::Translation { per_frame } => (Quat::IDENTITY, per_frame * frame as f32),
            Path::Orbit {
                pivot,
                axis,
                radians_per_frame,
            } => {
                // Removing whole turns keeps precision.
                let turns = f64::from(radians_per_frame) * f64::from(frame) / std::f64::consts::TAU;
                let angle = (turns.fract() * std::f64::consts::TAU) as f32;
                let rotation = Quat::from_axis_angle(axis, angle);
                (rotation, pivot - rotation * pivot)
            }
        };
        camera
            .moved(rotation, translation)
            .unwrap_or_else(|_| camera.clone())
    }
}

/// Index `y · width + x` of the pixel in which `camera` sees the world position `point` (through
/// the centre of its lens, without occlusion); `None` outside an image of this size.
#[inline]
pub(crate) fn pixel_seeing(camera: &Camera, extent: Extent, point: Vec3) -> Option<usize> {
    let Extent { width, height } = extent;
    let film = camera.film_position(point)?;
    let inside = film.x >= 0.0 && film.y >= 0.0 && film.x < width as f32 && film.y < height as f32;
    inside.then(|| film.y as usize * width as usize + film.x as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reuse_frames::extent_of;
    use lightshed_scene::builtin;
    use lightshed_scene::glam::Vec2;
    use std::f32::consts::{FRAC_PI_2, TAU};

    #[test]
    fn an_orbit_keeps_its_pivot_in_the_middle() {
        let scene = Scene::new(&builtin::cornell()).unwrap();
        let size = extent_of(&scene);
        let centre = Vec2::new(size.width as f32, size.height as f32) * 0.5;
        let ray = scene.camera().ray(centre, [0.5; 2]);
        let pivot = ray.origin + ray.direction * 3.0;
        let motion = CameraMotion::orbit(pivot, Vec3::Y, 0.1).unwrap();
        for frame in [0, 1, 7, 1000, u32::MAX] {
            let camera = motion.camera(&scene, frame);
            let film = camera.film_position(pivot).unwrap();
            assert!(film.distance(centre) < 0.05, "{film} in frame {frame}");
            let pixel = pixel_seeing(&camera, size, pivot + camera.ray(centre, [0.5; 2]).direction).unwrap();
            let place = Vec2::new(
                (pixel % size.width as usize) as f32,
                (pixel / size.width as usize) as f32,
            );
            assert!(place.distance(centre) < 2.0);
        }
        // A quarter turn, and a whole one.
        let quarter = CameraMotion::orbit(Vec3::ZERO, Vec3::Z * 3.0, FRAC_PI_2).unwrap();
        let direction = |frame| quarter.camera(&scene, frame).ray(centre, [0.5; 2]).direction;
        let turned = Vec3::new(-direction(0).y, direction(0).x, direction(0).z);
        assert!(direction(1).distance(turned) < 1e-6);
        assert!(direction(4).distance(direction(0)) < 1e-6);
        assert!((TAU - 4.0 * FRAC_PI_2).abs() < 1e-6);
    }

    #[test]
    fn what_is_not_finite_is_refused_and_what_overflows_stays() {
        let nan = Vec3::splat(f32::NAN);
        assert_eq!(CameraMotion::translation(nan), Err(CameraMotionError::NotFinite));
        let orbit = CameraMotion::orbit;
        assert_eq!(orbit(nan, Vec3::Y, 0.1), Err(CameraMotionError::NotFinite));
        assert_eq!(
            orbit(Vec3::ZERO, Vec3::Y, f32::INFINITY),
            Err(CameraMotionError::NotFinite)
        );
        assert_eq!(orbit(Vec3::ZERO, Vec3::ZERO, 0.1), Err(CameraMotionError::Axis));
        assert!(orbit(Vec3::ZERO, Vec3::Y, 0.0).unwrap().is_still() && CameraMotion::default().is_still());
        let scene = Scene::new(&builtin::cornell()).unwrap();
        let far = CameraMotion::translation(Vec3::splat(f32::MAX)).unwrap();
        assert!(!far.is_still());
        let origin = |frame| far.camera(&scene, frame).ray(Vec2::ZERO, [0.5; 2]).origin;
        assert_eq!(origin(9), origin(0));
    }

    #[test]
    fn a_motion_that_ends_stays_where_it_is() {
        let scene = Scene::new(&builtin::cornell()).unwrap();
        let motion = CameraMotion::translation(Vec3::X).unwrap().until(3);
        let origin = |frame| motion.camera(&scene, frame).ray(Vec2::ZERO, [0.5; 2]).origin;
        assert!((origin(2) - origin(1)).distance(Vec3::X) < 1e-5);
        assert_eq!((origin(4), origin(u32::MAX)), (origin(3), origin(3)));
        assert_eq!([3, 4].map(|frame| motion.rests_at(frame)), [false, true]);
        assert!(!motion.is_still() && CameraMotion::STILL.rests_at(0));
    }

    #[test]
    fn a_motion_that_returns_shows_the_same_views_again() {
        let scene = Scene::new(&builtin::cornell()).unwrap();
        let motion = CameraMotion::translation(Vec3::X).unwrap().returning_from(3);
        let origin = |frame| motion.camera(&scene, frame).ray(Vec2::ZERO, [0.5; 2]).origin;
        assert!(origin(3).distance(origin(0)) > 2.9);
        assert_eq!([4, 5, 6, 7, u32::MAX].map(origin), [2, 1, 0, 0, 0].map(origin));
        let rests = [0, 1, 3, 4, 6, 7, u32::MAX].map(|frame| motion.rests_at(frame));
        assert_eq!(rests, [false, false, false, false, false, true, true]);
    }

    #[test]
    fn points_outside_the_image_have_no_pixel() {
        let scene = Scene::new(&builtin::cornell()).unwrap();
        let (camera, size) = (scene.camera(), extent_of(&scene));
        let at = |x: f32, y: f32| {
            let ray = camera.ray(Vec2::new(x, y), [0.5; 2]);
            pixel_seeing(camera, size, ray.origin + ray.direction)
        };
        let (w, h) = (size.width as f32, size.height as f32);
        assert_eq!(at(0.5, 0.5), Some(0));
        assert_eq!(at(w - 0.5, h - 0.5), Some(size.len() - 1));
        for (x, y) in [(-0.5, 3.5), (w + 0.5, 3.5), (3.5, -0.5), (3.5, h + 0.5)] {
            assert_eq!(at(x, y), None);
        }
    }
}
