//! Maps of the unit square, and frames.

use crate::tests::parity::harness::{Shader, Tier, bits, check, directions, floats, unit_numbers};
use glam::Vec3;
use lightshed_sampling::{
    ConcentricDisk, CosineHemisphere, Frame, PolarDisk, Tent, UniformCone, UniformHemisphere, UniformSphere,
    UniformTriangle,
};

#[test]
fn planes() {
    check::<2, 9>(
        "disks, triangle, tent",
        Tier::Exact,
        &Shader::new(
            "import package::lightshed::warp::{concentric_disk, polar_disk, tent, uniform_triangle};",
            "let u = vec2f(number(0u), number(1u));
             put_2(0u, concentric_disk(u)); put_2(2u, polar_disk(u)); put_2(4u, tent(u));
             put_3(6u, uniform_triangle(u));",
        ),
        &unit_numbers(20),
        |words| {
            let u = floats(words);
            let (disk, polar, tent) = (ConcentricDisk::sample(u), PolarDisk::sample(u), Tent::sample(u));
            let [a, b, c] = UniformTriangle::sample(u);
            bits([disk.x, disk.y, polar.x, polar.y, tent.x, tent.y, a, b, c])
        },
    );
}

#[test]
fn spheres() {
    check::<3, 14>(
        "hemispheres, sphere, cone",
        Tier::Exact,
        &Shader::new(
            "import package::lightshed::warp::{cosine_hemisphere, cosine_hemisphere_density, uniform_hemisphere,
                 uniform_sphere, uniform_cone, uniform_cone_density, cone_from};",
            "let u = vec2f(number(0u), number(1u));
             let d = cosine_hemisphere(u);
             put_3(0u, d); put_f(3u, cosine_hemisphere_density(d.z - 0.5));
             put_3(4u, uniform_hemisphere(u)); put_3(7u, uniform_sphere(u));
             let cone = cone_from(number(2u) * 2.1);
             put_3(10u, uniform_cone(cone, u)); put_f(13u, uniform_cone_density(cone));",
        ),
        &unit_numbers(21),
        |words| {
            let [a, b, width] = floats(words);
            let u = [a, b];
            let d = CosineHemisphere::sample(u);
            let cone = UniformCone::from_one_minus_cos(width * 2.1);
            let mut all = Vec::new();
            all.extend(d.to_array());
            all.push(CosineHemisphere::density(d.z - 0.5).value());
            all.extend(UniformHemisphere::sample(u).to_array());
            all.extend(UniformSphere::sample(u).to_array());
            all.extend(cone.sample(u).to_array());
            all.push(cone.density(Vec3::Z).value());
            core::array::from_fn(|k| all[k].to_bits())
        },
    );
    check::<2, 1>(
        "cone of a sphere",
        Tier::Exact,
        &Shader::new(
            "import package::lightshed::warp::cone_of_sphere;",
            "put_f(0u, cone_of_sphere(number(0u), number(1u)));",
        ),
        &unit_numbers(22),
        |words| {
            let [radius_squared, distance_squared] = floats(words);
            let cone = UniformCone::of_sphere(radius_squared, distance_squared);
            bits([cone.map_or(-1.0, |cone| cone.one_minus_cos_theta_max())])
        },
    );
}

#[test]
fn frames() {
    check::<3, 12>(
        "frame",
        Tier::Exact,
        &Shader::new(
            "import package::lightshed::frame::{frame_from_normal, to_local, to_world};",
            "let f = frame_from_normal(vec3f(number(0u), number(1u), number(2u)));
             put_3(0u, f.tangent); put_3(3u, f.bitangent);
             put_3(6u, to_world(f, vec3f(0.25, -0.5, 0.75))); put_3(9u, to_local(f, vec3f(0.25, -0.5, 0.75)));",
        ),
        &directions(23),
        |words| {
            let frame = Frame::from_normal(Vec3::from_array(floats(words)));
            let v = Vec3::new(0.25, -0.5, 0.75);
            let all = [frame.tangent, frame.bitangent, frame.to_world(v), frame.to_local(v)];
            core::array::from_fn(|k| all[k / 3][k % 3].to_bits())
        },
    );
}
