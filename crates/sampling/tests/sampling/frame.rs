//! Orthonormality of frames, in f64, to stated bounds.

use glam::{DVec3, Vec3};
use lightshed_sampling::{CounterRng, Frame, glam};
use lightshed_testkit::check_faults;

/// Largest deviation from an orthonormal right-handed frame: of lengths, dots and the triple
/// product.
fn deviation(frame: &Frame) -> f64 {
    let [t, b, n] = [frame.tangent, frame.bitangent, frame.normal].map(Vec3::as_dvec3);
    let errors = [
        t.length() - 1.0,
        b.length() - 1.0,
        t.dot(b),
        t.dot(n),
        b.dot(n),
        t.cross(b).dot(n) - 1.0,
    ];
    // `max` would drop a NaN.
    errors.iter().fold(
        0.0,
        |most, error| if error.abs() <= most { most } else { error.abs() },
    )
}

/// Unit vectors: uniform ones, near the poles, near the equator's seam, the axes with either sign
/// of zero.
fn normals() -> impl Iterator<Item = Vec3> {
    let uniform = (0..1_000_000).map(|i| {
        let [u, v] = CounterRng::new(11, i, 0).next_2d().map(f64::from);
        let z = match i % 4 {
            0 => (1.0 - u * u * 1e-6) * if i % 8 == 0 { 1.0 } else { -1.0 },
            1 => (u - 0.5) * 1e-30,
            _ => 1.0 - 2.0 * u,
        };
        let (r, phi) = ((1.0 - z * z).max(0.0).sqrt(), core::f64::consts::TAU * v);
        DVec3::new(r * phi.cos(), r * phi.sin(), z).normalize().as_vec3()
    });
    let small = [0.0, -0.0, 1e-45, -1e-45, 1e-38, -1e-20, 1e-8];
    let axes = small.into_iter().flat_map(move |a| {
        small.into_iter().flat_map(move |b| {
            [1.0, -1.0]
                .into_iter()
                .flat_map(move |one| [Vec3::new(one, a, b), Vec3::new(a, one, b), Vec3::new(a, b, one)])
        })
    });
    uniform.chain(axes)
}

#[test]
fn frames_are_orthonormal_to_5e_7() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// One formula for both hemispheres, which loses its digits at the lower pole.
        SignForgotten,
        LeftHanded,
    }
    check_faults(&[Fault::SignForgotten, Fault::LeftHanded], |fault| {
        for normal in normals() {
            let mut frame = Frame::from_normal(normal);
            match fault {
                Some(Fault::SignForgotten) => {
                    let Vec3 { x, y, z } = normal;
                    let a = -1.0 / (1.0 + z);
                    frame.tangent = Vec3::new(1.0 + x * x * a, x * y * a, -x);
                    frame.bitangent = Vec3::new(x * y * a, 1.0 + y * y * a, -y);
                }
                Some(Fault::LeftHanded) => frame.bitangent = -frame.bitangent,
                None => {}
            }
            let deviation = deviation(&frame);
            if !(deviation < 5e-7) {
                return Err(format!("{normal:?}: {deviation:e}"));
            }
        }
        Ok(())
    })
    .unwrap();
}

#[test]
fn frames_along_a_tangent() {
    for (i, normal) in (0u32..).zip(normals().step_by(7)) {
        let mut rng = CounterRng::new(12, i, 0);
        let along = Vec3::from_array(core::array::from_fn(|_| rng.next_f32() - 0.5));
        let frame = Frame::from_normal_and_tangent(normal, along);
        assert!(
            deviation(&frame) < 5e-7,
            "{normal:?} {along:?}: {:e}",
            deviation(&frame)
        );
        assert!(frame.tangent.dot(along) > -1e-6);
    }
    // Parallel, nearly parallel, zero, huge and tiny tangents.
    for normal in normals().step_by(997) {
        for along in [
            normal,
            -normal * 3.0,
            normal + Vec3::splat(1e-7),
            normal * 1e-20,
            Vec3::ZERO,
            Vec3::splat(1e-45),
            Vec3::splat(1e30),
            Vec3::new(f32::MAX, f32::MAX, -f32::MAX),
            Vec3::splat(f32::NAN),
            Vec3::splat(f32::INFINITY),
        ] {
            let frame = Frame::from_normal_and_tangent(normal, along);
            assert!(
                deviation(&frame) < 1e-6,
                "{normal:?} {along:?}: {:e}",
                deviation(&frame)
            );
        }
    }
}

/// The tangent follows `along` whatever its length: the greatest and the least there are.
#[test]
fn tangents_of_any_length_are_followed() {
    for length in [f32::MAX, 1e30, 1.0, 1e-30, f32::MIN_POSITIVE, 1e-45] {
        let frame = Frame::from_normal_and_tangent(Vec3::Z, Vec3::new(length, -length, 0.0));
        let expected = Vec3::new(1.0, -1.0, 0.0).normalize();
        assert!(
            (frame.tangent - expected).length() < 1e-6,
            "{length}: {:?}",
            frame.tangent
        );
    }
}

#[test]
fn local_and_back() {
    for (i, normal) in (0u32..).zip(normals().step_by(11)) {
        let mut rng = CounterRng::new(13, i, 0);
        let v = Vec3::from_array(core::array::from_fn(|_| rng.next_f32() - 0.5));
        let frame = Frame::from_normal(normal);
        assert!((frame.to_world(frame.to_local(v)) - v).length() < 1e-6);
        assert!((frame.to_local(normal) - Vec3::Z).length() < 1e-6);
        assert_eq!(frame.to_world(Vec3::Z), normal);
    }
}
