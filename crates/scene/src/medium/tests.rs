//! Media of scenes: what is refused, and where they are.

use crate::builtin::{self, icosphere};
use crate::{
    DensityDescription, EmissionDescription, Geometry, GridDescription, GridFilter, Material, MediumBoundary,
    MediumDescription, PhaseDescription, Ray, Rgb, Scene, SceneDescription, ShapeDescription, SphereGeometry,
};
use glam::{Affine3A, Vec3};

fn medium(name: &str) -> MediumDescription {
    MediumDescription {
        name: name.to_owned(),
        density: DensityDescription::Homogeneous,
        extinction: Rgb::ONE,
        albedo: Rgb::splat(0.5),
        albedo_grids: Vec::new(),
        phase: PhaseDescription::Isotropic,
        emission: None,
    }
}

fn grid() -> GridDescription {
    GridDescription {
        resolution: [2, 1, 1],
        values: vec![1.0, 3.0].into(),
        filter: GridFilter::Trilinear,
        to_world: Affine3A::from_scale(Vec3::new(4.0, 1.0, 1.0)),
    }
}

/// Medium 1 in a ball of radius 1, within medium 0 in a mesh of radius 3, in empty space; and a
/// ball with nothing to do with media.
fn nested() -> SceneDescription {
    let sphere = |center, radius| {
        Geometry::Sphere(SphereGeometry {
            center,
            radius,
            flip_normals: false,
        })
    };
    let shapes = [
        sphere(Vec3::new(2.0, 0.0, 0.0), 0.5),
        sphere(Vec3::ZERO, 1.0),
        Geometry::Mesh(icosphere(Vec3::ZERO, 3.0, 2)),
    ];
    let shapes = shapes.map(|geometry| ShapeDescription {
        name: "ball".to_owned(),
        geometry,
        material: 0,
        emission: Some(Rgb::ONE),
    });
    let boundary = |shape, interior, exterior| MediumBoundary {
        shape,
        interior,
        exterior,
    };
    SceneDescription {
        shapes: shapes.to_vec(),
        materials: vec![Material::Null],
        media: vec![medium("outer"), medium("inner")],
        boundaries: vec![boundary(2, Some(0), None), boundary(1, Some(1), Some(0))],
        ..SceneDescription::default()
    }
}

#[test]
fn places_are_in_the_medium_of_the_boundaries_around_them() {
    let scene = Scene::new(&nested()).unwrap();
    let cases = [
        (Vec3::new(0.2, -0.3, 0.1), Some(1)),
        (Vec3::new(0.0, 2.0, 0.0), Some(0)),
        // Within the ball that bounds nothing, and outside of all.
        (Vec3::new(2.0, 0.1, 0.0), Some(0)),
        (Vec3::new(0.0, 3.5, 0.0), None),
        (Vec3::new(-2.0, -2.5, -2.6), None),
    ];
    for (place, expected) in cases {
        assert_eq!(scene.medium_around(place), expected, "{place}");
    }
    // Along a ray, one after the other.
    let mut ray = Ray::new(Vec3::new(-5.0, 0.01, 0.02), Vec3::X);
    let mut seen = Vec::new();
    while let Some(point) = scene.intersect(&ray) {
        if let Some(sides) = scene.medium_sides(point.primitive) {
            seen.push(sides.towards(point.geometric_normal.x));
        }
        ray = point.spawn(Vec3::X);
    }
    assert_eq!(seen, [Some(0), Some(1), Some(0), None]);
}

#[test]
fn the_camera_is_where_the_description_or_the_boundaries_say() {
    let mut description = nested();
    let around = |description: &SceneDescription| {
        let scene = Scene::new(description).unwrap();
        scene.camera_medium(scene.camera())
    };
    assert_eq!(around(&description), Some(1));
    description.camera.near_clip = 2.0;
    assert_eq!(around(&description), Some(0));
    description.camera_medium = Some(1);
    assert_eq!(around(&description), Some(1));
}

#[test]
fn a_grid_lies_where_its_transform_puts_it() {
    let mut description = nested();
    description.media[0].density = DensityDescription::Grid(grid());
    description.media[0].emission = Some(EmissionDescription {
        radiance: Rgb::new(1.0, 2.0, 0.0),
        grid: Some(grid()),
    });
    let scene = Scene::new(&description).unwrap();
    let medium = &scene.media()[0];
    let crate::MediumDensity::Grid(field) = medium.density() else {
        panic!("a grid");
    };
    use crate::volume::DensityField;
    // Voxel centres are at 1 and 3 of the world's x.
    let at = |x: f32| {
        let ray = field.field_ray(&Ray::new(Vec3::new(x, 0.2, 0.3), Vec3::X));
        (field.grid().density(ray.origin), ray.direction)
    };
    assert_eq!(at(0.3), (1.0, Vec3::new(0.5, 0.0, 0.0)));
    assert_eq!(at(2.0).0, 2.0);
    assert_eq!(at(3.9).0, 3.0);
    // Half of what it absorbs, and nothing beyond the grid.
    let emitted = |x: f32| medium.emission_per_collision(Vec3::new(x, 0.5, 0.5));
    assert_eq!(emitted(2.0), Rgb::new(1.0, 2.0, 0.0));
    assert_eq!((emitted(-0.1), emitted(4.1)), (Rgb::ZERO, Rgb::ZERO));
    assert_eq!(scene.media()[1].emission_per_collision(Vec3::ZERO), Rgb::ZERO);
}

/// Spoils a sound description.
type Spoil = fn(&mut SceneDescription);

#[test]
fn impossible_media_are_errors() {
    let cases: [(Spoil, &str); 18] = [
        (
            |s| s.media[1].extinction.y = -1.0,
            "medium 'inner': its extinction must be finite",
        ),
        (
            |s| s.media[1].extinction.y = f32::NAN,
            "medium 'inner': its extinction must be finite",
        ),
        (
            |s| s.media[0].albedo.z = 1.1,
            "medium 'outer': its albedo must be in [0, 1]",
        ),
        (
            |s| s.media[0].albedo.z = f32::NAN,
            "medium 'outer': its albedo must be in [0, 1]",
        ),
        (
            |s| s.media[0].phase = PhaseDescription::HenyeyGreenstein { g: 1.0 },
            "asymmetry",
        ),
        (
            |s| s.media[0].phase = PhaseDescription::HenyeyGreenstein { g: f32::NAN },
            "asymmetry",
        ),
        (
            |s| s.media[0].phase = PhaseDescription::Draine { g: 0.0, alpha: -1.0 },
            "alpha",
        ),
        (
            |s| s.media[0].phase = blend(2.0, PhaseDescription::Isotropic),
            "share",
        ),
        (
            |s| s.media[0].phase = blend(0.5, blend(0.5, PhaseDescription::Isotropic)),
            "cannot hold another",
        ),
        (
            |s| s.media[0].density = spoilt(|g| g.resolution = [3, 1, 1]),
            "2 values for 3 voxels",
        ),
        (
            |s| s.media[0].density = spoilt(|g| g.values = vec![0.0, -1.0].into()),
            "value 1 of the grid",
        ),
        (
            |s| s.media[0].density = spoilt(|g| g.to_world.matrix3.x_axis = glam::Vec3A::ZERO),
            "invertible",
        ),
        (
            |s| {
                s.media[0].extinction = Rgb::splat(1e38);
                s.media[0].density = spoilt(|g| g.values = vec![1.0, 100.0].into());
            },
            "overflows",
        ),
        (
            |s| {
                let (radiance, grid) = (Rgb::splat(f32::INFINITY), None);
                s.media[0].emission = Some(EmissionDescription { radiance, grid });
            },
            "its emitted radiance must be finite",
        ),
        (
            |s| s.boundaries[0].interior = Some(2),
            "shape 'ball' refers to medium 2, but there are only 2",
        ),
        (
            |s| s.boundaries[0].shape = 3,
            "boundary 0 refers to shape 3, but there are only 3",
        ),
        (|s| s.boundaries[0].shape = 1, "shape 'ball' bounds media twice"),
        (|s| s.camera_medium = Some(9), "the camera refers to medium 9"),
    ];
    for (spoil, expected) in cases {
        let mut description = nested();
        spoil(&mut description);
        let message = match Scene::new(&description) {
            Ok(_) => panic!("accepted, instead of {expected}"),
            Err(error) => error.to_string(),
        };
        assert!(message.contains(expected), "{message}\ninstead of {expected}");
    }
}

fn blend(share: f32, second: PhaseDescription) -> PhaseDescription {
    PhaseDescription::Blend {
        first: Box::new(PhaseDescription::Isotropic),
        second: Box::new(second),
        share,
    }
}

fn spoilt(spoil: fn(&mut GridDescription)) -> DensityDescription {
    let mut grid = grid();
    spoil(&mut grid);
    DensityDescription::Grid(grid)
}

/// A grid in a cube that it fills, turned and moved, with something in it, or on its face, or
/// around a smaller boundary.
#[test]
fn a_grid_is_clear_if_no_surface_reaches_into_it() {
    let to_world = Affine3A::from_translation(Vec3::new(3.0, -70.0, 11.0))
        * Affine3A::from_rotation_z(0.7)
        * Affine3A::from_scale(Vec3::new(2.0, 0.3, 5.0));
    // The grid is over the unit cube, cuboids over [−1, 1]³.
    let of_unit = |to_unit: Affine3A| {
        let to_cube = Affine3A::from_translation(Vec3::splat(0.5)) * Affine3A::from_scale(Vec3::splat(0.5));
        Geometry::Mesh(crate::builtin::cuboid(to_world * to_unit * to_cube))
    };
    let scene = |boundary: Geometry, other: Option<Geometry>, media: usize| {
        let mut scene = nested();
        scene.media = vec![medium("fog"); media];
        scene.media[0].density = DensityDescription::Grid(GridDescription { to_world, ..grid() });
        let template = scene.shapes[0].clone();
        let shape = |geometry| ShapeDescription {
            geometry,
            ..template.clone()
        };
        scene.shapes = std::iter::once(boundary).chain(other).map(shape).collect();
        scene.boundaries = vec![MediumBoundary {
            shape: 0,
            interior: Some(0),
            exterior: None,
        }];
        Scene::new(&scene).unwrap()
    };
    let whole = || of_unit(Affine3A::IDENTITY);
    let sphere = |place: Vec3, radius| {
        let center = to_world.transform_point3(place);
        Some(Geometry::Sphere(SphereGeometry {
            center,
            radius,
            flip_normals: false,
        }))
    };
    let clear = |scene: &Scene| scene.medium_is_clear(0);
    let ray = Ray::new(to_world.transform_point3(Vec3::splat(0.5)), Vec3::X);
    let alone = scene(whole(), None, 1);
    assert!(clear(&alone) && alone.passes_grid_alone(&ray, 0) == Some(true));
    let two = scene(whole(), None, 2);
    assert!(clear(&two) && two.passes_grid_alone(&ray, 0).is_none() && !two.medium_is_clear(1));
    assert!(!clear(&scene(whole(), sphere(Vec3::new(0.9, 0.9, 0.1), 0.01), 1)));
    assert!(clear(&scene(whole(), sphere(Vec3::new(0.5, 3.0, 0.5), 0.01), 1)));
    let thinner = Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.99));
    assert!(!clear(&scene(of_unit(thinner), None, 1)));
    let beside = Affine3A::from_translation(Vec3::X * 2.0);
    assert!(!clear(&scene(of_unit(beside), None, 1)));
    let on_top = Affine3A::from_translation(Vec3::Z) * Affine3A::from_scale(Vec3::splat(0.5));
    assert!(clear(&scene(whole(), Some(of_unit(on_top)), 1)));
    assert!(!clear(&scene(
        Geometry::Sphere(SphereGeometry {
            center: ray.origin,
            radius: 0.1,
            flip_normals: false
        }),
        None,
        1
    )));
}

/// An albedo that varies: one grid for all channels or one each, and the edge beyond them.
#[test]
fn an_albedo_varies_with_its_grids() {
    let grid = |values: [f32; 2]| GridDescription {
        resolution: [2, 1, 1],
        values: values.into(),
        filter: GridFilter::Nearest,
        to_world: Affine3A::from_scale(Vec3::new(4.0, 1.0, 1.0)),
    };
    let of = |grids: Vec<GridDescription>| {
        let mut description = builtin::by_name("cloud").unwrap();
        description.media[0].albedo = Rgb::new(1.0, 0.5, 1.0);
        description.media[0].albedo_grids = grids;
        Scene::new(&description)
    };
    let at = |scene: &Scene, x: f32| scene.media()[0].albedo_at(Vec3::new(x, 0.5, 0.5));
    let one = of(vec![grid([0.2, 0.8])]).unwrap();
    assert_eq!(at(&one, 1.0), Rgb::new(0.2, 0.1, 0.2));
    assert_eq!(
        (at(&one, 3.0), at(&one, 9.0)),
        (Rgb::new(0.8, 0.4, 0.8), Rgb::new(0.8, 0.4, 0.8))
    );
    let three = of(vec![grid([0.2, 0.8]), grid([1.0, 0.0]), grid([0.5, 0.25])]).unwrap();
    assert_eq!(
        (at(&three, 1.0), at(&three, 3.0)),
        (Rgb::new(0.2, 0.5, 0.5), Rgb::new(0.8, 0.0, 0.25))
    );
    assert!(
        three.media()[0].has_varying_albedo() && !of(Vec::new()).unwrap().media()[0].has_varying_albedo()
    );
    for wrong in [vec![grid([0.2, 0.8]); 2], vec![grid([0.2, 1.5])]] {
        let error = of(wrong).err().expect("it is refused");
        assert!(error.to_string().contains("albedo"), "{error}");
    }
}
