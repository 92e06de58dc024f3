//! The contents of a description, as a number.

use super::{
    DensityDescription, EmissionDescription, EmitterDescription, EnvironmentMap, Geometry, GridDescription,
    MediumDescription, MeshInstances, RenderSettings, SceneDescription, ShapeDescription, TriangleMesh,
};
use crate::fingerprint::Fingerprint;

impl SceneDescription {
    /// A fingerprint of everything that images of the scene depend on: shapes, materials with their
    /// textures, emitters, media, the camera, image size and path length. Names and the number of
    /// samples are left out.
    ///
    /// It is the same on every machine for the same version of this crate. It distinguishes scenes
    /// that differ by chance or mistake: of pairs of different scenes, one in 2⁶⁴ has the same
    /// fingerprint.
    pub fn fingerprint(&self) -> u64 {
        // Destructured, so that a new field cannot be forgotten.
        let Self {
            shapes,
            materials,
            emitters,
            camera,
            settings,
            media,
            boundaries,
            camera_medium,
        } = self;
        let RenderSettings {
            width,
            height,
            samples_per_pixel: _,
            max_depth,
            roulette_depth,
        } = settings;
        let mut sum = Fingerprint::new();
        sum.shown(&(width, height, max_depth, roulette_depth, camera));
        sum.shown(&(
            boundaries,
            camera_medium,
            materials.len(),
            emitters.len(),
            media.len(),
            shapes.len(),
        ));
        materials.iter().for_each(|material| sum.shown(material));
        emitters.iter().for_each(|emitter| add_emitter(&mut sum, emitter));
        media.iter().for_each(|medium| add_medium(&mut sum, medium));
        shapes.iter().for_each(|shape| add_shape(&mut sum, shape));
        sum.value()
    }
}

fn add_shape(sum: &mut Fingerprint, shape: &ShapeDescription) {
    let ShapeDescription {
        name: _,
        geometry,
        material,
        emission,
    } = shape;
    sum.shown(&(material, emission));
    match geometry {
        Geometry::Sphere(sphere) => sum.shown(sphere),
        Geometry::Mesh(mesh) => add_mesh(sum, mesh),
        Geometry::Instances(MeshInstances { mesh, to_world }) => {
            sum.shown(&"instances");
            add_mesh(sum, mesh);
            sum.reals(to_world.iter().map(|map| map.to_cols_array()));
        }
    }
}

fn add_mesh(sum: &mut Fingerprint, mesh: &TriangleMesh) {
    let TriangleMesh {
        positions,
        normals,
        uvs,
        indices,
        colors,
        glow,
    } = mesh;
    sum.reals(positions.iter().map(|position| position.to_array()));
    sum.reals(normals.iter().map(|normal| normal.to_array()));
    sum.reals(uvs.iter().map(|uv| uv.to_array()));
    sum.words(indices.as_flattened().iter().copied());
    if !(colors.is_empty() && glow.is_empty()) {
        sum.reals(colors.iter().map(|color| color.to_array()));
        sum.reals(glow.iter().map(|share| share.to_array()));
    }
}

fn add_emitter(sum: &mut Fingerprint, emitter: &EmitterDescription) {
    match emitter {
        EmitterDescription::Environment(EnvironmentMap {
            image,
            scale,
            to_world,
        }) => sum.shown(&("environment", image, scale, to_world)),
        other => sum.shown(other),
    }
}

fn add_medium(sum: &mut Fingerprint, medium: &MediumDescription) {
    let MediumDescription {
        name: _,
        density,
        extinction,
        albedo,
        albedo_grids,
        phase,
        emission,
    } = medium;
    sum.shown(&(extinction, albedo, phase));
    albedo_grids.iter().for_each(|grid| add_grid(sum, grid));
    match density {
        DensityDescription::Homogeneous => sum.shown(&"homogeneous"),
        DensityDescription::Grid(grid) => add_grid(sum, grid),
    }
    match emission {
        None => sum.shown(&"dark"),
        Some(EmissionDescription { radiance, grid }) => {
            sum.shown(&(radiance, grid.is_some()));
            grid.iter().for_each(|grid| add_grid(sum, grid));
        }
    }
}

fn add_grid(sum: &mut Fingerprint, grid: &GridDescription) {
    let GridDescription {
        resolution,
        values,
        filter,
        to_world,
    } = grid;
    sum.shown(&(resolution, filter, to_world));
    sum.reals(values.iter().map(|&value| [value]));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ColorTexture, Filter, Image, ImageTexture, Material, Rgb, Wrap, builtin};
    use std::sync::Arc;

    /// A change of a scene.
    type Change = (&'static str, fn(&mut SceneDescription));

    const CHANGES: [Change; 9] = [
        ("width", |scene| scene.settings.width += 1),
        ("depth", |scene| scene.settings.max_depth = Some(77)),
        ("camera", |scene| {
            scene.camera.fov_x = f32::from_bits(scene.camera.fov_x.to_bits() + 1)
        }),
        ("material", |scene| scene.shapes[0].material += 1),
        ("emission", |scene| {
            scene.shapes[0].emission = Some(Rgb::splat(0.5))
        }),
        ("order", |scene| scene.shapes.swap(0, 1)),
        ("vertex", |scene| match &mut scene.shapes[0].geometry {
            Geometry::Mesh(mesh) => mesh.positions[0].x = f32::from_bits(mesh.positions[0].x.to_bits() ^ 1),
            Geometry::Sphere(sphere) => sphere.radius *= 2.0,
            Geometry::Instances(_) => unreachable!("the box has none"),
        }),
        ("emitter", |scene| {
            scene.emitters.push(EmitterDescription::Constant {
                radiance: Rgb::splat(1e-3),
            });
        }),
        ("texture", |scene| scene.materials.push(textured(3))),
    ];

    fn textured(code: u8) -> Material {
        let image = Image::from_srgb8(2, 1, vec![[1, 2, code], [0, 0, 0]]).unwrap();
        let texture = ImageTexture {
            image: Arc::new(image),
            to_uv: glam::Affine2::IDENTITY,
            filter: Filter::default(),
            wrap: Wrap::default(),
            scale: Rgb::ONE,
        };
        Material::Diffuse {
            reflectance: ColorTexture::Image(texture),
        }
    }

    #[test]
    fn every_change_changes_it_and_names_do_not() {
        let scene = builtin::cornell();
        let own = scene.fingerprint();
        assert_eq!(builtin::cornell().fingerprint(), own);
        let mut seen = vec![own];
        for (what, change) in CHANGES {
            let mut changed = scene.clone();
            change(&mut changed);
            let found = changed.fingerprint();
            assert!(!seen.contains(&found), "{what}");
            seen.push(found);
        }
        let mut renamed = scene.clone();
        renamed.shapes[0].name += " again";
        renamed.settings.samples_per_pixel += 1;
        assert_eq!(renamed.fingerprint(), own);
    }

    #[test]
    fn one_texel_or_voxel_is_enough() {
        let with = |code| {
            let mut scene = builtin::cornell();
            scene.materials.push(textured(code));
            scene.fingerprint()
        };
        assert_eq!(with(3), with(3));
        assert_ne!(with(3), with(4));
        let mut cloud = builtin::by_name("cloud").unwrap();
        let own = cloud.fingerprint();
        let DensityDescription::Grid(grid) = &mut cloud.media[0].density else {
            panic!("the cloud is a grid");
        };
        let mut values = grid.values.to_vec();
        values[17] += 1.0;
        grid.values = values.into();
        assert_ne!(cloud.fingerprint(), own);
    }
}
