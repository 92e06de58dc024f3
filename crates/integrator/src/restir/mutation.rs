//! Small steps among the endpoints of an emitter (Sawhney et al. 2022).

use super::light::{DirectReservoir, LightSample, SeenFrom};
use super::primary::Primary;
use lightshed_resampling::Mutation;
use lightshed_sampling::{
    CounterRng, Frame, UniformCone, UniformTriangle, octahedral_decode, octahedral_encode,
};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{EmitterEndpoint, Scene};

/// Largest step on the unit square that a triangle is mapped from.
const SQUARE_STEP: f32 = 0.15;
/// One minus the cosine of the largest turn about a sphere's middle, and of a direction to the
/// environment.
const SPHERE_TURN: f32 = 0.1;
const ENVIRONMENT_TURN: f32 = 0.005;

/// A point of the same emitter near `endpoint`, by proposals that are symmetric in the measure of
/// endpoints; `None` if it has no neighbours.
pub(super) fn near(scene: &Scene, endpoint: &EmitterEndpoint, u: [f32; 2]) -> Option<EmitterEndpoint> {
    match *endpoint {
        EmitterEndpoint::Surface { emitter, coordinates } => {
            let primitive = scene.emitter_primitive(emitter)?;
            let coordinates = if (primitive as usize) < scene.triangle_count() {
                near_on_triangle(coordinates, u)
            } else {
                let outward = octahedral_decode(Vec2::from_array(coordinates));
                octahedral_encode(turned(outward, SPHERE_TURN, u)).to_array()
            };
            Some(EmitterEndpoint::Surface { emitter, coordinates })
        }
        EmitterEndpoint::Environment { direction } => Some(EmitterEndpoint::Environment {
            direction: turned(direction, ENVIRONMENT_TURN, u),
        }),
        EmitterEndpoint::Delta { .. } => None,
    }
}

/// Steps on the square, whose borders are joined; the map to the triangle keeps areas.
fn near_on_triangle([a, b]: [f32; 2], u: [f32; 2]) -> [f32; 2] {
    let square = UniformTriangle::invert([a, b, 1.0 - a - b]);
    let step = |at: f32, u: f32| {
        (at + (2.0 * u - 1.0) * SQUARE_STEP)
            .rem_euclid(1.0)
            .min(1.0 - f32::EPSILON)
    };
    let [a, b, _] = UniformTriangle::sample([step(square[0], u[0]), step(square[1], u[1])]);
    [a, b]
}

/// A direction turned by at most so much, uniformly in solid angle.
fn turned(direction: Vec3, one_minus_cos: f32, u: [f32; 2]) -> Vec3 {
    let local = UniformCone::from_one_minus_cos(one_minus_cos).sample(u);
    Frame::from_normal(direction)
        .to_world(local)
        .normalize_or(direction)
}

/// One step of a Markov chain of a pixel's endpoint, by its target in the pixel's domain.
pub(super) fn mutated(
    seen: &SeenFrom<'_>,
    primary: &Primary,
    held: DirectReservoir,
    rng: &mut CounterRng,
) -> DirectReservoir {
    let Some(sample) = held.sample() else {
        return held;
    };
    let Some(endpoint) = near(seen.scene, &sample.endpoint, rng.next_2d()) else {
        return held;
    };
    let proposed = LightSample {
        endpoint,
        value: seen.value(primary, &endpoint),
    };
    let (target, mutation) = (
        sample.target(),
        Mutation {
            sample: proposed,
            target: proposed.target(),
            ratio: 1.0,
        },
    );
    held.mutated(target, mutation, rng)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps from a uniform point are uniform: the mean of each coordinate and of their squares
    /// stay what they are on the triangle (1/3, 1/6) and on the sphere (0, 1/3).
    #[test]
    fn steps_keep_the_uniform_distribution() {
        let (mut on_triangle, mut on_sphere) = ([0.0f64; 4], [0.0f64; 6]);
        let count = 200_000;
        for index in 0..count {
            let mut rng = CounterRng::new(41, index, 0);
            let [a, b, _] = UniformTriangle::sample(rng.next_2d());
            let [a, b] = near_on_triangle([a, b], rng.next_2d());
            assert!(a >= 0.0 && b >= 0.0 && a + b <= 1.0 + 1e-6);
            let values = [a, b, a * a, b * b];
            on_triangle
                .iter_mut()
                .zip(values)
                .for_each(|(sum, value)| *sum += f64::from(value));
            let direction = lightshed_sampling::UniformSphere::sample(rng.next_2d());
            let near = turned(direction, SPHERE_TURN, rng.next_2d());
            assert!(near.dot(direction) > 1.0 - SPHERE_TURN - 1e-4);
            let values = [
                near.x,
                near.y,
                near.z,
                near.x * near.x,
                near.y * near.y,
                near.z * near.z,
            ];
            on_sphere
                .iter_mut()
                .zip(values)
                .for_each(|(sum, value)| *sum += f64::from(value));
        }
        let expected = [1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0];
        let sphere = [0.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0];
        // Standard errors are at most 0.0013.
        for (sum, expected) in on_triangle
            .iter()
            .zip(expected)
            .chain(on_sphere.iter().zip(sphere))
        {
            let mean = sum / f64::from(count);
            assert!((mean - expected).abs() < 0.007, "{mean} for {expected}");
        }
    }
}
