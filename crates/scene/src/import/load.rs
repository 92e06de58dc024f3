//! One entry point for all formats.

use super::error::{ImportError, Location, extension};
#[cfg(feature = "gltf")]
use super::gltf;
use super::limits::LoadLimits;
use super::loaded::{Defines, Loaded, Warning};
use super::loading::Loading;
#[cfg(feature = "mitsuba")]
use super::mitsuba;
use super::normals::angle_weighted_normals;
use super::{fit, obj, ply};
use crate::{ColorTexture, Geometry, Material, Rgb, SceneDescription, ShapeDescription, TriangleMesh};
use std::path::Path;

/// Extensions that [`load`] knows.
const EXTENSIONS: &str = match (
    cfg!(feature = "mitsuba"),
    cfg!(feature = "gltf"),
    cfg!(feature = "pbrt"),
) {
    (true, true, true) => "xml, gltf, glb, pbrt, ply, obj",
    _ => "ply, obj, and with the features `mitsuba` xml, `gltf` gltf and glb, `pbrt` pbrt",
};

/// Imports a scene by its file name's extension, within the default [`LoadLimits`]: as
/// [`load_with`].
///
/// # Errors
///
/// As [`load_with`].
pub fn load(path: impl AsRef<Path>, defines: &Defines) -> Result<Loaded, ImportError> {
    load_with(path, defines, &LoadLimits::default())
}

/// Imports a scene by its file name's extension: `xml` (Mitsuba 3; with the feature `mitsuba`),
/// `gltf` or `glb` (with the feature `gltf`), `pbrt` (pbrt-v4; with the feature `pbrt`), or a lone
/// mesh, `ply` or `obj`.
///
/// A lone mesh becomes a Lambertian surface of albedo one half, seen from both sides, with the
/// file's normals or smooth ones, with a camera that sees all of it, and light from grey
/// surroundings that are brighter behind the camera.
///
/// # Errors
///
/// The extension is unknown, a file is missing, truncated or malformed, or asks for something that
/// is not supported, or needs more than `limits` allow. Definitions are an error where the file has
/// no use for them.
pub fn load_with(
    path: impl AsRef<Path>,
    defines: &Defines,
    limits: &LoadLimits,
) -> Result<Loaded, ImportError> {
    let path = path.as_ref();
    let loading = Loading::new(path, limits);
    let extension = extension(path);
    if let (true, Some((name, _))) = (extension != "xml", defines.first()) {
        return Err(ImportError::UnusedDefine {
            path: path.to_path_buf(),
            name: name.clone(),
        });
    }
    match extension.as_str() {
        #[cfg(feature = "mitsuba")]
        "xml" => mitsuba::load(path, defines, &loading),
        #[cfg(feature = "pbrt")]
        "pbrt" => super::pbrt::load(path, &loading),
        #[cfg(feature = "gltf")]
        "gltf" | "glb" => gltf::load(path, &loading),
        "ply" => {
            let mesh = ply::parse_within(&loading.read_main(path)?, path, &loading)?;
            Ok(lone_mesh(mesh, path))
        }
        "obj" => {
            let mesh = obj::parse_within(&loading.read_main(path)?, path, &loading)?;
            Ok(lone_mesh(mesh, path))
        }
        _ => Err(ImportError::UnknownFormat {
            path: path.to_path_buf(),
            expected: EXTENSIONS,
        }),
    }
}

fn lone_mesh(mut mesh: TriangleMesh, path: &Path) -> Loaded {
    if mesh.normals.is_empty() {
        mesh.normals = angle_weighted_normals(&mesh.positions, &mesh.indices);
    }
    let name = path
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let mut description = SceneDescription {
        shapes: vec![ShapeDescription {
            name,
            geometry: Geometry::Mesh(mesh),
            material: 0,
            emission: None,
        }],
        materials: vec![Material::TwoSided {
            front: Box::new(Material::Diffuse {
                reflectance: ColorTexture::Constant(Rgb::splat(0.5)),
            }),
            back: None,
        }],
        ..SceneDescription::default()
    };
    fit::camera(&mut description);
    fit::light(&mut description);
    let warning = Warning {
        location: Location::file(path),
        message: format!("a lone mesh: grey, seen as a whole; {}", fit::STUDIO),
    };
    Loaded {
        description,
        warnings: vec![warning],
        view_is_chosen: true,
    }
}
