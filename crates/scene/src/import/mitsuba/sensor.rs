//! Sensors, films, samplers and integrators.

use super::Importer;
use super::properties::Properties;
use super::values;
use crate::import::error::ImportError;
use crate::import::fit;
use crate::import::transform::orthonormal;
use crate::import::xml::Node;
use crate::{CameraDescription, FovAxis, Projection};
use glam::{DAffine3, DMat3, DVec3};

impl<'a> Importer<'a> {
    /// Reads a sensor. Says whether it places the camera.
    pub(super) fn sensor(&mut self, node: &Node) -> Result<bool, ImportError> {
        let properties = Properties::new(node)?;
        let kind = properties.kind()?;
        if kind == "batch" {
            self.warn(node, "of a batch of sensors only the first is used");
            let nested = properties.all(|child| child.tag == "sensor");
            return match nested[..] {
                [first, ..] => self.sensor(first),
                [] => Err(node.malformed("a batch without sensors")),
            };
        }
        if !matches!(
            kind,
            "perspective" | "thinlens" | "orthographic" | "radiancemeter"
        ) {
            self.warn(
                node,
                format!("the sensor `{kind}` is not supported: the camera looks at the whole scene"),
            );
            self.film(&properties)?;
            properties.all(|_| true);
            return Ok(false);
        }
        // Nothing moves, so the shutter changes nothing.
        properties.ignore(&["shutter_open", "shutter_close"]);
        for name in ["principal_point_offset_x", "principal_point_offset_y"] {
            if properties.float(name)?.is_some_and(|offset| offset != 0.0) {
                self.warn(
                    node,
                    format!("`{name}` is not supported: the image is centred on the axis"),
                );
            }
        }
        let near_clip = properties.positive("near_clip")?.unwrap_or(1e-2);
        let far_clip = properties.positive("far_clip")?.unwrap_or(1e4);
        if near_clip >= far_clip {
            return Err(node.malformed("`near_clip` is not below `far_clip`"));
        }
        let focus_distance = properties.positive("focus_distance")?.unwrap_or(far_clip);
        let mut projection = Projection::Pinhole;
        if kind == "thinlens" {
            let aperture_radius = properties
                .float("aperture_radius")?
                .ok_or_else(|| node.malformed("`aperture_radius` is missing"))?;
            if aperture_radius > 0.0 {
                projection = Projection::ThinLens {
                    aperture_radius,
                    focus_distance,
                };
            } else if aperture_radius < 0.0 {
                return Err(node.malformed("`aperture_radius` is negative"));
            }
        }

        self.film(&properties)?;
        if let Some(sampler) = self.one(&properties, "sampler")? {
            self.sampler(sampler)?;
        }
        if properties.get("srf").is_some() {
            self.warn(node, "the response by wavelength of a sensor is not supported");
        }
        let is_other = |child: &Node| self.refers_to(child, "film") || self.refers_to(child, "sampler");
        let media = properties.all(|child| child.tag == "medium" || (child.tag == "ref" && !is_other(child)));
        for reference in media.iter().filter(|child| child.tag == "ref") {
            self.target(reference, "medium")?;
        }
        match media[..] {
            [] => {}
            [one] => self.description.camera_medium = Some(self.medium_of(one)?),
            [_, second, ..] => return Err(second.malformed("a second medium")),
        }
        let settings = &self.description.settings;
        let aspect = f64::from(settings.width) / f64::from(settings.height);
        if kind == "orthographic" {
            let to_world = properties.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
            let half_width = to_world.matrix3.x_axis.length();
            let scaled = to_world.matrix3 * DMat3::from_diagonal(DVec3::splat(1.0 / half_width));
            let turned = orthonormal(&to_world.matrix3).filter(|_| scaled.is_finite());
            let turned = turned.ok_or_else(|| node.malformed("`to_world` is singular"))?;
            let to_world = DAffine3::from_mat3_translation(turned, to_world.translation);
            // Distances are those of the sensor's own space, which the transform scales.
            let along = to_world.matrix3.z_axis.length();
            let clip = [near_clip, far_clip].map(|distance| f64::from(distance) * along);
            self.description.camera = fit::orthographic(&to_world, half_width, clip);
            self.warn(node, fit::ORTHOGRAPHIC);
            self.finish(&properties);
            return Ok(true);
        }
        if kind == "radiancemeter" {
            self.warn(node, "a `radiancemeter` sees a field of a fiftieth of a degree");
            let to_world = rigid(&Self::along_ray(&properties)?);
            let to_world =
                to_world.ok_or_else(|| node.malformed("`to_world` must rotate and translate only"))?;
            self.description.camera = CameraDescription {
                to_world: to_world.as_affine3a(),
                fov_x: 0.02_f32.to_radians(),
                projection,
                near_clip: 0.0,
                far_clip: f32::INFINITY,
            };
            self.finish(&properties);
            return Ok(true);
        }
        let fov_x = field_of_view(&properties, aspect)?;
        let to_world = properties.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
        let to_world = rigid(&to_world).ok_or_else(|| {
            node.malformed("`to_world` of a sensor must rotate and translate only, not scale or shear")
        })?;
        self.description.camera = CameraDescription {
            to_world: to_world.as_affine3a(),
            fov_x: fov_x as f32,
            projection,
            near_clip,
            far_clip,
        };
        self.finish(&properties);
        Ok(true)
    }

    fn film(&mut self, sensor: &Properties) -> Result<(), ImportError> {
        // Mitsuba's defaults.
        self.description.settings.width = 768;
        self.description.settings.height = 576;
        let Some(node) = self.one(sensor, "film")? else {
            self.warn(sensor.node, "no film: 768 × 576 pixels and a box filter");
            return Ok(());
        };
        let properties = Properties::new(node)?;
        let kind = properties.kind()?;
        if kind == "specfilm" {
            self.warn(
                node,
                "the film has red, green and blue, not the bands of a `specfilm`",
            );
            properties.all(|child| child.tag == "spectrum");
        } else if kind != "hdrfilm" {
            self.warn(
                node,
                format!("the film `{kind}` is not supported: `hdrfilm` is taken"),
            );
        }
        properties.ignore(&[
            "pixel_format",
            "component_format",
            "file_format",
            "compensate",
            "sample_border",
            "banner",
        ]);
        let crop = ["crop_width", "crop_height", "crop_offset_x", "crop_offset_y"];
        // All are looked up, so that all count as read.
        if crop.iter().filter_map(|name| properties.get(name)).count() > 0 {
            self.warn(node, "the whole image is rendered, not its crop");
        }
        if let Some(width) = properties.count("width")? {
            self.description.settings.width = width;
        }
        if let Some(height) = properties.count("height")? {
            self.description.settings.height = height;
        }
        match self.one(&properties, "rfilter")? {
            None => self.warn(
                node,
                "Mitsuba's default filter is Gaussian; the film here uses a box",
            ),
            Some(filter) => {
                let kind = filter.require("type")?;
                if kind != "box" {
                    self.warn(
                        filter,
                        format!("the film here uses a box instead of the filter `{kind}`"),
                    );
                }
            }
        }
        self.finish(&properties);
        Ok(())
    }

    /// The one child of that tag, or the one that a `ref` among the children refers to, if any.
    fn one<'n>(&self, properties: &Properties<'n>, tag: &str) -> Result<Option<&'n Node>, ImportError>
    where
        'a: 'n,
    {
        match properties.all(|child| child.tag == tag || self.refers_to(child, tag))[..] {
            [] => Ok(None),
            [one] if one.tag == "ref" => self.target(one, tag).map(Some),
            [one] => Ok(Some(one)),
            [_, second, ..] => Err(second.malformed(format!("a second <{tag}>"))),
        }
    }

    /// Whether a child is a `ref` to something of that tag.
    fn refers_to(&self, child: &Node, tag: &str) -> bool {
        child.tag == "ref" && self.any_target(child).is_ok_and(|target| target.tag == tag)
    }

    fn sampler(&mut self, node: &Node) -> Result<(), ImportError> {
        let properties = Properties::new(node)?;
        let kind = properties.kind()?;
        if !matches!(
            kind,
            "independent" | "stratified" | "multijitter" | "orthogonal" | "ldsampler"
        ) {
            self.warn(
                node,
                format!("the sampler `{kind}` is not supported: another is taken"),
            );
        }
        properties.ignore(&["seed", "jitter", "strength"]);
        self.description.settings.samples_per_pixel = properties.count("sample_count")?.unwrap_or(4);
        self.finish(&properties);
        Ok(())
    }

    pub(super) fn integrator(&mut self, node: &Node) -> Result<(), ImportError> {
        let properties = Properties::new(node)?;
        let kind = properties.kind()?;
        // Whether paths see media is for the command line to say.
        if matches!(kind, "moment" | "aov" | "stokes") {
            // Of what these write, the image is that of the integrator within.
            properties.ignore(&["aovs"]);
            let within = only(&properties, "integrator")?;
            self.finish(&properties);
            return within.map_or(Ok(()), |within| self.wrapped_integrator(within));
        }
        self.wrapped_integrator(node)
    }

    fn wrapped_integrator(&mut self, node: &Node) -> Result<(), ImportError> {
        let properties = Properties::new(node)?;
        let kind = properties.kind()?;
        // What these show is another image, or derivatives.
        let is_other = kind.starts_with("prb_")
            || kind.ends_with("_reparam")
            || kind.starts_with("volprim")
            || matches!(kind, "depth" | "prbvolpath_projective");
        if is_other && !matches!(kind, "prb_basic" | "prb_projective") {
            self.warn(node, format!("`{kind}` is not supported: paths are traced"));
            properties.all(|_| true);
            return Ok(());
        }
        if !matches!(
            kind,
            "path"
                | "direct"
                | "volpath"
                | "volpathmis"
                | "prb"
                | "prb_basic"
                | "prb_projective"
                | "prbvolpath"
                | "direct_projective"
                | "ptracer"
        ) {
            self.warn(
                node,
                format!("the integrator `{kind}` is not supported: paths are traced"),
            );
            properties.all(|_| true);
            return Ok(());
        }
        if properties.boolean("hide_emitters")? == Some(true) {
            self.warn(node, "`hide_emitters` is not supported: emitters are seen");
        }
        let settings = &mut self.description.settings;
        // How to sample.
        properties.ignore(&[
            "samples_per_pass",
            "sppc",
            "sppp",
            "sppi",
            "guiding",
            "guiding_proj",
            "guiding_rounds",
            "block_size",
            "timeout",
        ]);
        if kind.starts_with("direct") {
            properties.ignore(&["shading_samples", "emitter_samples", "bsdf_samples"]);
            settings.max_depth = Some(2);
        } else {
            settings.max_depth = match properties.integer("max_depth")?.unwrap_or(-1) {
                -1 => None,
                depth => Some(
                    u32::try_from(depth).map_err(|_| node.malformed(format!("`max_depth` of {depth}")))?,
                ),
            };
            settings.roulette_depth = properties.count("rr_depth")?.unwrap_or(5);
        }
        self.finish(&properties);
        Ok(())
    }
}

/// The one child of that tag, if any.
pub(super) fn only<'a>(properties: &Properties<'a>, tag: &str) -> Result<Option<&'a Node>, ImportError> {
    match properties.all(|child| child.tag == tag)[..] {
        [] => Ok(None),
        [one] => Ok(Some(one)),
        [_, second, ..] => Err(second.malformed(format!("a second <{tag}>"))),
    }
}

/// Horizontal field of view in radians.
fn field_of_view(properties: &Properties, aspect: f64) -> Result<f64, ImportError> {
    let node = properties.node;
    let axis = properties.string("fov_axis")?;
    let focal_length = properties.string("focal_length")?;
    let (angle, axis) = match (properties.positive("fov")?, focal_length) {
        (Some(_), Some(_)) => return Err(node.malformed("`fov` and `focal_length` exclude each other")),
        (Some(degrees), None) if degrees >= 180.0 => {
            return Err(node.malformed(format!("`fov` must be below 180 degrees, found {degrees}")));
        }
        (Some(degrees), None) => {
            let axis = match axis.unwrap_or("x") {
                "x" => FovAxis::X,
                "y" => FovAxis::Y,
                "diagonal" => FovAxis::Diagonal,
                "smaller" => FovAxis::Smaller,
                "larger" => FovAxis::Larger,
                other => return Err(node.malformed(format!("unknown `fov_axis` `{other}`"))),
            };
            (f64::from(degrees).to_radians(), axis)
        }
        (None, text) => {
            // A focal length is that of 35 mm film, 36 mm × 24 mm, and speaks of the diagonal.
            let text = text.unwrap_or("50mm");
            let millimetres = values::number(node, text.trim().trim_end_matches("mm"))?;
            if millimetres <= 0.0 {
                return Err(node.malformed(format!("`focal_length` must be positive, found `{text}`")));
            }
            let diagonal = 36.0_f64.hypot(24.0);
            (2.0 * (0.5 * diagonal / millimetres).atan(), FovAxis::Diagonal)
        }
    };
    Ok(axis.to_horizontal(angle, aspect))
}

/// `map` without the rounding of its figures, or `None` if it is more than a rotation (or
/// reflection) and a shift.
fn rigid(map: &DAffine3) -> Option<DAffine3> {
    const TOLERANCE: f64 = 1e-3;
    let m = map.matrix3;
    let error = m.transpose() * m - DMat3::IDENTITY;
    if error.to_cols_array().iter().any(|e| !(e.abs() <= TOLERANCE)) {
        return None;
    }
    Some(DAffine3::from_mat3_translation(orthonormal(&m)?, map.translation))
}
