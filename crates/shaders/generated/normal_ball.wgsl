// Linked from normal_ball.wesl.

struct NormalBall {
    center: vec3f,
    radius: f32
}

const CENTER_STEPS: f32 = 127.0;

const RADIUS_STEP: f32 = 0.49803925;

const RADIUS_STEPS: f32 = 2.007874;

const SLACK: f32 = 0.000127;

const TO_INTEGER: f32 = 8388608.0;

const ALL_NORMALS: u32 = 2139062271u;

fn ball_unpack(bits: u32) -> NormalBall {
    let steps = vec3f((vec3u(bits) >> vec3u(24u, 16u, 8u)) & vec3u(255u)) - CENTER_STEPS;
    return NormalBall(min(steps, vec3f(package_lightshed_float__1F32_MAX)), package_lightshed_float__2as_it_is(f32(bits & 255u) * RADIUS_STEP));
}

fn ball_pack(ball: NormalBall) -> u32 {
    let counted = min(ball.center, vec3f(package_lightshed_float__1F32_MAX)) + CENTER_STEPS;
    let wanted = min(max(counted, vec3f(0.0)), vec3f(2.0 * CENTER_STEPS));
    let step = min(wanted + TO_INTEGER, vec3f(package_lightshed_float__1F32_MAX));
    let off = min(step - TO_INTEGER, vec3f(package_lightshed_float__1F32_MAX)) - wanted;
    let radius = package_lightshed_float__2as_it_is(ball.radius + sqrt(package_lightshed_vector_dot3(off, off))) + SLACK;
    let radius_steps = package_lightshed_float__2as_it_is(package_lightshed_float__2as_it_is(radius) * RADIUS_STEPS);
    if !(radius_steps <= 255.0) {
        return ALL_NORMALS;
    }
    let radius_byte = bitcast<u32>(package_lightshed_float__2as_it_is(radius_steps + 0.5) + TO_INTEGER) & 255u;
    let bytes = bitcast<vec3u>(step) & vec3u(255u);
    return (bytes.x << 24u) | (bytes.y << 16u) | (bytes.z << 8u) | radius_byte;
}

fn ball_union(a: u32, b: u32) -> u32 {
    let ball_a = ball_unpack(a);
    let ball_b = ball_unpack(b);
    let across = ball_b.center - ball_a.center;
    let distance = package_lightshed_float__2as_it_is(sqrt(package_lightshed_vector_dot3(across, across)) * 1.0000005);
    if package_lightshed_float__2as_it_is(distance + ball_b.radius) <= ball_a.radius {
        return a;
    }
    if package_lightshed_float__2as_it_is(distance + ball_a.radius) <= ball_b.radius {
        return b;
    }
    let radius = package_lightshed_float__2as_it_is((distance + ball_a.radius + ball_b.radius) * 0.5);
    let part = (radius - ball_a.radius) / max(distance, 1.0);
    return ball_pack(NormalBall(ball_a.center + across * part, radius));
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;

fn package_lightshed_float__2as_it_is(x: f32) -> f32 {
    return min(x, package_lightshed_float__1F32_MAX);
}

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
