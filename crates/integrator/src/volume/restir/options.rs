//! Options of a frame, and why they are refused.

use super::coarse::MAX_COARSENESS;
use super::lobe::has_lobe;
use lightshed_resampling::{Pattern, PatternError};
use lightshed_sampling::PointSet;
use lightshed_scene::{Material, Scene};
use lightshed_shift::MAX_SCATTERINGS;
use std::fmt;

/// Most reservoirs of a pixel.
pub(super) const MAX_RESERVOIRS: u32 = 16;

/// Options of a [`RestirVolume`](crate::RestirVolume) frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RestirVolumeOptions {
    /// Most scattering vertices of a path, `K`: 1 to 8. Paths then have up to `K + 1` edges.
    pub scatterings: u32,
    /// Reservoirs of a pixel: 1 to 16. They share only the camera ray, and a frame shows their
    /// mean. If neighbours are unlike, several reservoirs are better than neighbours: each adds
    /// another colour and another place.
    pub reservoirs: u32,
    /// Random walks for each reservoir and frame, `M`: 1 to 1024.
    pub walks: u32,
    /// Neighbours in the round of spatial reuse; 0 for none.
    pub neighbours: u32,
    /// They lie within this many pixels; positive. A shifted path moves with the camera ray, and
    /// noise grows with the differences it meets: a smaller radius has less error, but larger
    /// blotches (Lin 2022 fig. 5.15).
    pub radius_pixels: f32,
    /// Least length of a path's connected edge, in widths of a pixel; positive. A shifted path
    /// moves as a whole up to its first such edge and stays unchanged from its far end on. If it is
    /// less than some times the radius, targets are unlike; infinity moves the whole path.
    pub connection_pixels: f32,
    /// Whether a pixel reuses a reservoir of the previous frame.
    pub temporal_reuse: bool,
    /// Greatest confidence of a pixel's history while something moves and for 16 frames after, in
    /// frames, `Q`; positive.
    pub confidence_cap: f32,
    /// The same in a still image, where a path from the previous frame is the same path; positive.
    pub still_confidence_cap: f32,
    /// Level of the cubes that bound the densities which walks see behind the first vertex, 1 to 4.
    pub candidate_level: u32,
    /// Level of the densities along camera rays, in proposals and targets, 0 to 4.
    pub camera_level: u32,
    /// Level of the interpolated densities between vertices, in walks and targets, 0 to 4; where
    /// the medium is thin level 1 serves for 0.
    pub reuse_level: u32,
    /// Level of the densities between vertices and emitters in all targets, 0 to 4; where the
    /// medium is thin level 1 serves for 0.
    pub shadow_level: u32,
    /// Whether the position in the previous frame is that of a point in the medium also if the
    /// pixel's own path starts on a surface or does not exist (Lin 2022 §5.5.2). Has an effect
    /// under motion only.
    pub velocity_resampling: bool,
    /// Random numbers of camera rays over the frames. Stratified ones reduce the noise of edges in
    /// the mean of frames.
    pub points: PointSet,
}

impl RestirVolumeOptions {
    /// With at most `scatterings` scattering vertices and the options with the least error for
    /// their time in clouds: 4 reservoirs, a walk each, and temporal reuse with cap 4 under motion,
    /// 16 in a still image. Densities are those of level 0: where marching is cheap, finer targets
    /// pay, the more the denser the medium, because whatever they miss is noise.
    pub const fn new(scatterings: u32) -> Self {
        Self {
            scatterings,
            reservoirs: 4,
            walks: 1,
            neighbours: 0,
            radius_pixels: 2.5,
            connection_pixels: 8.0,
            temporal_reuse: true,
            confidence_cap: 4.0,
            still_confidence_cap: 16.0,
            candidate_level: 1,
            camera_level: 0,
            reuse_level: 0,
            shadow_level: 0,
            velocity_resampling: true,
            points: PointSet::Independent,
        }
    }

    /// The same nearer to Lin 2022 §5.5: one reservoir, 4 walks, and 3 neighbours, which shade
    /// with the pixel. For few frames, and where light is hard to find but neighbours are alike.
    #[must_use]
    pub const fn with_neighbours(self) -> Self {
        Self {
            reservoirs: 1,
            walks: 4,
            neighbours: 3,
            ..self
        }
    }

    /// [`RestirVolumeOptions::new`] with cap 10 under motion, for scenes with surfaces (§5.5.3).
    pub const fn with_surfaces(scatterings: u32) -> Self {
        Self {
            confidence_cap: 10.0,
            ..Self::new(scatterings)
        }
    }

    /// [`RestirVolumeOptions::with_surfaces`] for a scene with surfaces that scatter, else
    /// [`RestirVolumeOptions::new`]; with as many scattering vertices as paths of `max_depth` edges
    /// have; [`MAX_SCATTERINGS`] where nothing bounds them. Should neighbours be asked for, they
    /// are within 10 pixels (§5.5.3) of an image with 1080 rows, fewer in proportion in smaller
    /// ones, at least 2.
    pub fn of_scene(scene: &Scene, max_depth: Option<u32>) -> Self {
        let scatterings = max_depth.map_or(MAX_SCATTERINGS, |edges| edges.saturating_sub(1));
        let scatters = |material: &Material| !matches!(material, Material::Null);
        let options = if scene.materials().iter().any(scatters) {
            Self::with_surfaces(scatterings)
        } else {
            Self::new(scatterings)
        };
        Self {
            radius_pixels: (scene.settings().height as f32 * (10.0 / 1080.0)).max(2.0),
            ..options
        }
    }

    /// The same for a moving camera or moving media: [`RestirVolumeOptions::with_neighbours`] if a
    /// medium scatters into a lobe more than 5 times as bright as the mean. A still image is better
    /// without: a path that never leaves its pixel costs little.
    #[must_use]
    pub fn under_motion(self, scene: &Scene) -> Self {
        if scene.media().iter().any(has_lobe) {
            self.with_neighbours()
        } else {
            self
        }
    }

    /// The pattern of neighbours, where there are any, if the options are sound.
    ///
    /// # Errors
    /// [`RestirVolumeError`] for options out of range.
    pub fn check(&self) -> Result<Option<Pattern>, RestirVolumeError> {
        if !(1..=MAX_SCATTERINGS).contains(&self.scatterings) {
            return Err(RestirVolumeError::Scatterings);
        }
        if !(1..=MAX_RESERVOIRS).contains(&self.reservoirs) {
            return Err(RestirVolumeError::Reservoirs);
        }
        if !(1..=1024).contains(&self.walks) {
            return Err(RestirVolumeError::Walks);
        }
        // Also refuses NaN.
        if !(self.confidence_cap > 0.0 && self.still_confidence_cap > 0.0) {
            return Err(RestirVolumeError::ConfidenceCap);
        }
        if !(self.connection_pixels > 0.0) {
            return Err(RestirVolumeError::ConnectionPixels);
        }
        if !(1..=MAX_COARSENESS).contains(&self.candidate_level)
            || self.reuse_level.max(self.shadow_level).max(self.camera_level) > MAX_COARSENESS
        {
            return Err(RestirVolumeError::Level);
        }
        (self.neighbours > 0)
            .then(|| Pattern::disk(self.radius_pixels, self.neighbours))
            .transpose()
            .map_err(RestirVolumeError::Pattern)
    }
}

impl Default for RestirVolumeOptions {
    /// [`RestirVolumeOptions::new`] with three scattering vertices.
    fn default() -> Self {
        Self::new(3)
    }
}

/// Why options or a scene are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RestirVolumeError {
    /// No scattering vertices, or more than 8.
    Scatterings,
    /// No reservoirs, or more than 16.
    Reservoirs,
    /// No walks, or more than 1024.
    Walks,
    /// A confidence cap is not positive, or NaN.
    ConfidenceCap,
    /// The least length of edges that are connected is not positive, or NaN.
    ConnectionPixels,
    /// A level of density out of range.
    Level,
    /// Neighbours or radius out of range.
    Pattern(PatternError),
    /// A material of that index reflects or refracts sharply; a method that finds light by emitter
    /// samples alone cannot render it.
    SharpMaterial(u32),
    /// No scenes, or scenes of other image sizes or numbers of emitters than the first.
    Scenes,
}

impl fmt::Display for RestirVolumeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scatterings => write!(
                f,
                "scattering vertices must number between 1 and {MAX_SCATTERINGS}"
            ),
            Self::Reservoirs => write!(f, "reservoirs must number between 1 and {MAX_RESERVOIRS}"),
            Self::Walks => f.write_str("walks must number between 1 and 1024"),
            Self::ConfidenceCap => f.write_str("confidence caps must be positive"),
            Self::ConnectionPixels => f.write_str("the least length of connected edges must be positive"),
            Self::Level => write!(
                f,
                "levels of density must be between 1 and {MAX_COARSENESS}, of reuse also 0"
            ),
            Self::Pattern(error) => error.fmt(f),
            Self::Scenes => f.write_str(
                "there must be a scene, and all must have one size of image and number of emitters",
            ),
            Self::SharpMaterial(index) => write!(
                f,
                "material {index} mirrors or refracts sharply, and no emitter sample finds light by it"
            ),
        }
    }
}

impl std::error::Error for RestirVolumeError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Pattern(error) => Some(error),
            _ => None,
        }
    }
}
