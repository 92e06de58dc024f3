//! Cameras and films.

use super::Importer;
use super::parameters::Parameters;
use crate::import::error::ImportError;
use crate::import::fit;
use crate::import::transform::orthonormal;
use crate::{CameraDescription, FovAxis, Projection};
use glam::{DAffine3, DMat3, DVec3};

impl Importer<'_> {
    pub(super) fn film(&mut self, parameters: &Parameters) -> Result<(), ImportError> {
        if let Some(width) = parameters.count("xresolution")? {
            self.description.settings.width = width;
        }
        if let Some(height) = parameters.count("yresolution")? {
            self.description.settings.height = height;
        }
        if ["cropwindow", "pixelbounds"]
            .iter()
            .any(|name| parameters.get(name).is_some())
        {
            self.warn(parameters, "the whole image is rendered, not its crop");
        }
        Ok(())
    }

    /// The camera, once the size of the image is known.
    pub(super) fn view(&mut self, parameters: &Parameters, to_world: &DAffine3) -> Result<(), ImportError> {
        let settings = &self.description.settings;
        let aspect = f64::from(settings.width) / f64::from(settings.height);
        let singular = || parameters.malformed("the camera's transform is singular");
        let turned = orthonormal(&to_world.matrix3).ok_or_else(singular)?;
        // pbrt's cameras have +X to the right, these to the left.
        let turned = turned * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
        let placed = DAffine3::from_mat3_translation(turned, to_world.translation);
        parameters.ignore(&["shutteropen", "shutterclose"]);
        if parameters.what.contains("orthographic") {
            let window = parameters.numbers("screenwindow")?;
            // The shorter side shows two units.
            let half_width = window.and_then(|window| window.get(1)).copied();
            let scale = to_world.matrix3.x_axis.length();
            let half_width = half_width.unwrap_or(aspect.max(1.0)) * scale;
            if !(half_width > 0.0 && half_width.is_finite()) {
                return Err(parameters.malformed("`screenwindow` is out of range"));
            }
            self.description.camera = fit::orthographic(&placed, half_width, [0.0, f64::from(f32::MAX)]);
            self.warn(parameters, fit::ORTHOGRAPHIC);
            return Ok(());
        }
        if !parameters.what.contains("perspective") {
            self.warn(parameters, "the camera is taken as one of perspective");
        }
        let fov = parameters.number("fov")?.unwrap_or(90.0);
        if !(fov > 0.0 && fov < 180.0) {
            return Err(parameters.malformed(format!("`fov` must be within (0, 180), found {fov}")));
        }
        let fov_x = FovAxis::Smaller.to_horizontal(fov.to_radians(), aspect);
        let aperture_radius = parameters.float("lensradius", 0.0)?;
        let focus_distance = parameters.float("focaldistance", 1e6)?;
        let projection = if aperture_radius > 0.0 && focus_distance > 0.0 {
            Projection::ThinLens {
                aperture_radius,
                focus_distance,
            }
        } else {
            Projection::Pinhole
        };
        self.warn_left_over(parameters);
        self.description.camera = CameraDescription {
            to_world: placed.as_affine3a(),
            fov_x: fov_x as f32,
            projection,
            ..CameraDescription::default()
        };
        Ok(())
    }
}
