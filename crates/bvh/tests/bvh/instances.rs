//! Copies of objects.

use crate::hits::hit;
use crate::triangles;
use lightshed_bvh::glam::{Affine3A, Quat, Vec3};
use lightshed_bvh::{BuildError, Bvh, Instance, InstanceTree, Method, Preset, Ray};
use lightshed_sampling::{CounterRng, UniformSphere};

fn instances(count: u32, seed: u64) -> Vec<Instance> {
    (0..count)
        .map(|index| {
            let mut rng = CounterRng::new(seed, index, 0);
            let axis = UniformSphere::sample(rng.next_2d());
            let scale = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) + 0.2;
            let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 20.0 - 10.0;
            let turn = Quat::from_axis_angle(axis, rng.next_f32() * 6.0);
            Instance {
                object: index % 3,
                to_world: Affine3A::from_scale_rotation_translation(scale, turn, place),
            }
        })
        .collect()
}

/// Hits among placed copies are those of a search through every triangle of every copy, before and
/// after copies have moved.
#[test]
fn hits_among_copies_are_those_of_brute_force() {
    let meshes = [triangles(60, 0.5, 1), triangles(1, 2.0, 2), triangles(9, 1.0, 3)];
    let objects: Vec<Bvh> = meshes
        .iter()
        .map(|mesh| Bvh::build(mesh, Method::Binned).unwrap())
        .collect();
    let mut tree = InstanceTree::new(&objects, &[], Preset::Fastest.options()).unwrap();
    for (count, seed) in [(1, 1), (90, 2), (90, 3), (7, 4)] {
        let instances = instances(count, seed);
        tree.rebuild(&objects, &instances).unwrap();
        let mut found = 0;
        for index in 0..500 {
            let mut rng = CounterRng::new(8, index, count);
            let ray = Ray {
                origin: UniformSphere::sample(rng.next_2d()) * 20.0,
                direction: UniformSphere::sample(rng.next_2d()),
                t_max: f32::INFINITY,
            };
            let expected = instances
                .iter()
                .flat_map(|instance| {
                    let to_object = instance.to_world.inverse();
                    let local = Ray {
                        origin: to_object.transform_point3(ray.origin),
                        direction: to_object.transform_vector3(ray.direction),
                        t_max: f32::INFINITY,
                    };
                    let mesh = &meshes[instance.object as usize];
                    mesh.iter().filter_map(move |triangle| hit(&local, triangle))
                })
                .min_by(f32::total_cmp);
            let own = tree.nearest(&objects, &ray, |object, primitive, ray| {
                hit(ray, &meshes[object as usize][primitive as usize])
            });
            assert_eq!(own.map(|(_, _, t)| t), expected);
            found += u32::from(own.is_some());
        }
        assert!(found > 0 || count < 50);
    }
}

#[test]
fn copies_of_nothing_are_refused() {
    let objects = [
        Bvh::build(&triangles(3, 1.0, 1), Method::Curve).unwrap(),
        Bvh::default(),
    ];
    let mut all = instances(5, 1);
    all.iter_mut().for_each(|instance| instance.object = 0);
    let error = |all: &[Instance]| InstanceTree::new(&objects, all, Method::Binned).err();
    assert_eq!(error(&all), None);
    all[3].object = 7;
    assert_eq!(
        error(&all),
        Some(BuildError::Object {
            instance: 3,
            object: 7
        })
    );
    all[3].object = 1;
    assert_eq!(error(&all), Some(BuildError::Bounds(3)));
    all[3].object = 0;
    all[2].to_world.translation.y = f32::NAN;
    assert_eq!(error(&all), Some(BuildError::Bounds(2)));
}
