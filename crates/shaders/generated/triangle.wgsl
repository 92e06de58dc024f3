// Linked from triangle.wesl.

struct TriangleRay {
    origin: vec3f,
    axes: vec3u,
    shear: vec2f,
    inverse_z: f32
}

fn triangle_ray(ray: package_lightshed_ray_Ray) -> TriangleRay {
    var d = ray.direction;
    let m = abs(d);
    var kz = 2u;
    if m.x > m.y {
        kz = select(2u, 0u, m.x > m.z);
    }
    else if m.y > m.z {
        kz = 1u;
    }
    let kx = (kz + 1u) % 3u;
    let ky = (kz + 2u) % 3u;
    let inverse_z = 1.0 / d[kz];
    return TriangleRay(ray.origin, vec3u(kx, ky, kz), vec2f(d[kx] * inverse_z, d[ky] * inverse_z), inverse_z);
}

fn sheared(ray: TriangleRay, corner: vec3f) -> vec3f {
    var p = corner - ray.origin;
    let z = p[ray.axes.z];
    return vec3f(p[ray.axes.x] - ray.shear.x * z, p[ray.axes.y] - ray.shear.y * z, z);
}

fn intersect_triangle(ray: TriangleRay, a0: vec3f, b0: vec3f, c0: vec3f, primitive: u32, t_max: f32) -> package_lightshed_ray_Hit {
    let none = package_lightshed_ray_Hit(t_max, package_lightshed_ray_NOTHING, vec2f(0.0));
    let a = sheared(ray, a0);
    let b = sheared(ray, b0);
    let c = sheared(ray, c0);
    let area_a = c.x * b.y - c.y * b.x;
    let area_b = a.x * c.y - a.y * c.x;
    let area_c = b.x * a.y - b.y * a.x;
    let inside = (area_a >= 0.0 && area_b >= 0.0 && area_c >= 0.0) || (area_a <= 0.0 && area_b <= 0.0 && area_c <= 0.0);
    if !inside {
        return none;
    }
    let inverse_determinant = 1.0 / (area_a + (area_b + area_c));
    let z = area_a * a.z + (area_b * b.z + area_c * c.z);
    let t = z * ray.inverse_z * inverse_determinant;
    if !(t > 0.0 && t < t_max) {
        return none;
    }
    let u = area_a * inverse_determinant;
    let v = area_b * inverse_determinant;
    return package_lightshed_ray_Hit(t, primitive, vec2f(v, max(1.0 - u - v, 0.0)));
}

struct package_lightshed_ray_Hit {
    t: f32,
    primitive: u32,
    barycentric: vec2f
}

const package_lightshed_ray_NOTHING: u32 = 4294967295u;

struct package_lightshed_ray_Ray {
    origin: vec3f,
    t_max: f32,
    direction: vec3f,
    padding: u32
}
