// Linked from camera.wesl.

struct Camera {
    x_axis: vec3f,
    aperture_radius: f32,
    y_axis: vec3f,
    focus_distance: f32,
    z_axis: vec3f,
    near_clip: f32,
    position: vec3f,
    far_clip: f32,
    corner: vec2f,
    pixel: vec2f,
    size: vec2u,
    padding: vec2u
}

fn turned(camera: Camera, v: vec3f) -> vec3f {
    return camera.x_axis * v.x + camera.y_axis * v.y + camera.z_axis * v.z;
}

fn camera_ray(camera: Camera, film: vec2f, u_lens: vec2f) -> package_lightshed_ray_Ray {
    let through = vec3f(camera.corner + camera.pixel * film, 1.0);
    var origin = vec3f(0.0);
    var direction = through;
    if camera.aperture_radius > 0.0 {
        origin = vec3f(package_lightshed_warp__1concentric_disk(u_lens) * camera.aperture_radius, 0.0);
        direction = through * camera.focus_distance - origin;
    }
    direction = direction / package_lightshed_vector_length3(direction);
    let along_axis = direction.z;
    let scaled = turned(camera, direction);
    let world_origin = turned(camera, origin) + camera.position;
    let length = package_lightshed_vector_length3(scaled);
    let world_direction = scaled / length;
    let near = camera.near_clip / along_axis * length;
    let far = camera.far_clip / along_axis * length;
    return package_lightshed_ray_Ray(world_origin + world_direction * near, far - near, world_direction, 0u);
}

struct package_lightshed_ray_Ray {
    origin: vec3f,
    t_max: f32,
    direction: vec3f,
    padding: u32
}

fn package_lightshed_turn__2sin_cos_quarter(r: f32) -> vec2f {
    let t = r * r;
    let sine = r * (1.5707964 + t * (-0.6459635 + t * (0.07968022 + t * -0.004602149)));
    let cosine = 1.0 - t * (1.2337005 + t * (-0.2536694 + t * (0.020861529 + t * -0.0009067399)));
    return vec2f(sine, cosine);
}

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn package_lightshed_vector_length3(v: vec3f) -> f32 {
    return sqrt(package_lightshed_vector_dot3(v, v));
}

fn package_lightshed_warp__1concentric_disk(u: vec2f) -> vec2f {
    return package_lightshed_warp__3concentric_disk_with_radius(u).xy;
}

fn package_lightshed_warp__3concentric_disk_with_radius(u: vec2f) -> vec3f {
    let a = 2.0 * u.x - 1.0;
    let b = 2.0 * u.y - 1.0;
    let along_x = abs(a) > abs(b);
    let radius = select(b, a, along_x);
    let other = select(a, b, along_x);
    var ratio = 0.0;
    if radius != 0.0 {
        ratio = other / radius;
    }
    let part = package_lightshed_turn__2sin_cos_quarter(0.5 * ratio);
    let xy = select(part, part.yx, along_x);
    return vec3f(radius * xy.x, radius * xy.y, radius);
}
