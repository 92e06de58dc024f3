//! The octahedral map: round trips to stated bounds, folds, packings bit for bit, and its density.

use glam::{DVec3, Vec2, Vec3};
use lightshed_sampling::{
    CounterRng, Density, PrimarySample, SolidAngle, glam, octahedral_decode, octahedral_encode,
    octahedral_from_solid_angle, octahedral_pack16, octahedral_pack32, octahedral_to_solid_angle,
    octahedral_unpack16, octahedral_unpack32,
};
use lightshed_testkit::{check_faults, integrate_sphere, jacobian_determinant};

fn angle(a: Vec3, b: Vec3) -> f64 {
    let (a, b) = (a.as_dvec3(), b.as_dvec3());
    a.cross(b).length().atan2(a.dot(b))
}

/// Uniform directions, and ones within 1e-3 … 1e-9 of the octahedron's edges and corners, where
/// the map folds.
fn directions(count: u32) -> impl Iterator<Item = Vec3> {
    (0..count).map(|i| {
        let mut rng = CounterRng::new(31, i, 0);
        let mut d = DVec3::from_array(core::array::from_fn(|_| 2.0 * f64::from(rng.next_f32()) - 1.0));
        let small = 10f64.powi(-((i / 8 % 7) as i32) - 3);
        for axis in 0..3 {
            if i >> axis & 1 == 1 {
                d[axis] *= small;
            }
        }
        d.normalize().as_vec3()
    })
}

#[test]
fn round_trip_to_6e_7() {
    check_faults(&["sign of zero", "unfolded"], |fault| {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z]
            .into_iter()
            .flat_map(|axis| [axis, -axis]);
        let signs = [0.0, -0.0, 1e-45, -1e-45].into_iter().flat_map(|zero| {
            [
                Vec3::new(zero, 1.0, zero),
                Vec3::new(1.0, zero, -zero),
                Vec3::new(zero, -zero, -1.0),
            ]
        });
        for d in directions(1_000_000).chain(axes).chain(signs) {
            let mut uv = octahedral_encode(d);
            match fault {
                // The pole −z, whose fold depends on the signs of two zeros, put into the wrong
                // place.
                Some("sign of zero") if d.z < 0.0 && d.x == 0.0 => uv *= d.x.signum(),
                Some("unfolded") if d.z < 0.0 => uv = Vec2::ONE - uv,
                _ => {}
            }
            if !((0.0..=1.0).contains(&uv.x) && (0.0..=1.0).contains(&uv.y)) {
                return Err(format!("{d:?} leaves the square: {uv:?}"));
            }
            let error = angle(d, octahedral_decode(uv));
            if !(error < 6e-7) {
                return Err(format!("{d:?} comes back off by {error:e}"));
            }
        }
        Ok(())
    })
    .unwrap();
}

/// Square → sphere → square: the same point, but on the border, where two points are one
/// direction.
#[test]
fn square_round_trip() {
    for i in 0..200_000 {
        let uv = Vec2::from(CounterRng::new(32, i, 0).next_2d());
        let back = octahedral_encode(octahedral_decode(uv));
        assert!((uv - back).length() < 3e-7, "{uv:?} → {back:?}");
    }
    let border = octahedral_decode(Vec2::new(0.0, 0.3));
    assert!(angle(border, octahedral_decode(Vec2::new(0.0, 0.7))) < 1e-6);
    // Continuous across the folds.
    for i in 0..1000 {
        let t = i as f32 / 1000.0;
        let diamond = Vec2::new(t / 2.0, 0.5 - t / 2.0);
        let [a, b] = [diamond - 1e-6, diamond + 1e-6].map(octahedral_decode);
        assert!(angle(a, b) < 2e-5, "{diamond:?}");
    }
}

#[test]
fn degenerate_input() {
    let centre = Vec2::splat(0.5);
    assert_eq!(octahedral_encode(Vec3::ZERO), centre);
    assert_eq!(octahedral_encode(Vec3::Z), centre);
    for uv in [Vec2::splat(-1.0), Vec2::splat(9.0), Vec2::new(f32::MAX, 0.5)] {
        assert!((octahedral_decode(uv).length() - 1.0).abs() < 1e-6);
    }
    for tiny in [1e-45, 1e-38, 1e-20, 1e30] {
        let uv = octahedral_encode(Vec3::new(tiny, 0.0, 0.0));
        assert_eq!(uv, Vec2::new(1.0, 0.5));
    }
}

/// Worst errors over a million directions, against the bounds in the documentation, and axes exact.
#[test]
fn packing_errors() {
    let (mut worst32, mut worst16) = (0f64, 0f64);
    for d in directions(1_000_000) {
        worst32 = worst32.max(angle(d, octahedral_unpack32(octahedral_pack32(d))));
        worst16 = worst16.max(angle(d, octahedral_unpack16(octahedral_pack16(d))));
    }
    assert!(worst32 < 6.5e-5, "{worst32:e}");
    assert!(worst16 < 1.7e-2, "{worst16:e}");
    // Not a bound that anything would pass.
    assert!(worst32 > 4e-5 && worst16 > 1e-2, "{worst32:e} {worst16:e}");
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for d in [axis, -axis] {
            assert_eq!(octahedral_unpack32(octahedral_pack32(d)), d);
            assert_eq!(octahedral_unpack16(octahedral_pack16(d)), d);
        }
    }
}

/// Packing an unpacked direction gives an equal direction: no drift. All of 2¹⁶ patterns, and a
/// sweep of 2³².
#[test]
fn repacking_is_stable() {
    for bits in 0..=u16::MAX {
        let d = octahedral_unpack16(bits);
        assert!((d.length() - 1.0).abs() < 1e-6);
        assert!(
            angle(d, octahedral_unpack16(octahedral_pack16(d))) < 1e-6,
            "{bits:#x}"
        );
    }
    for bits in (0..=u32::MAX).step_by(4093) {
        let d = octahedral_unpack32(bits);
        assert!((d.length() - 1.0).abs() < 1e-6);
        assert!(
            angle(d, octahedral_unpack32(octahedral_pack32(d))) < 1e-6,
            "{bits:#x}"
        );
    }
}

#[test]
fn value_stability() {
    let d = Vec3::new(1.0, 2.0, -3.0).normalize();
    assert_eq!(octahedral_pack32(Vec3::Z), 0);
    assert_eq!(octahedral_pack32(Vec3::X), 0x7fff);
    assert_eq!(octahedral_pack32(-Vec3::Y), 0x8001_0000);
    assert_eq!(octahedral_pack32(-Vec3::Z), 0x7fff_7fff);
    // xy = (1 − 1/3, 1 − 1/6) of 32767, of 127.
    assert_eq!(octahedral_pack32(d), 27306 << 16 | 21845);
    assert_eq!(octahedral_pack16(d), 106 << 8 | 85);
}

/// The conversion of densities: the uniform density on the square integrates to one over the
/// sphere, and the factor is the map's Jacobian by finite differences in f64.
#[test]
fn density_conversion() {
    check_faults(&["square instead of cube", "factor 4 forgotten"], |fault| {
        let density = |d: Vec3| {
            let p = octahedral_to_solid_angle(Density::<PrimarySample>::new(1.0), d).value();
            let q = (d / d.abs().element_sum()).length();
            f64::from(match fault {
                Some("square instead of cube") => p / q,
                Some("factor 4 forgotten") => p * 4.0,
                _ => p,
            })
        };
        let total = integrate_sphere(|d| density(DVec3::from(d).as_vec3()), 1e-6);
        if (total.value - 1.0).abs() > 1e-5 {
            return Err(format!("integral {}", total.value));
        }
        for i in 0..2000 {
            let [u, v] = CounterRng::new(33, i, 0).next_2d().map(f64::from);
            // Away from the folds, where the map has no derivative.
            let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
            if [x, y, x.abs() + y.abs() - 1.0]
                .iter()
                .any(|distance| distance.abs() < 0.01)
            {
                continue;
            }
            let d = decode_f64([u, v]);
            // Two orthonormal coordinates around d: |∂ω/∂uv| is the determinant of the
            // tangential derivative.
            let tangent = d.any_orthonormal_vector();
            let bitangent = d.cross(tangent);
            let jacobian = jacobian_determinant(
                |uv: [f64; 2]| {
                    let moved = decode_f64(uv);
                    [tangent.dot(moved), bitangent.dot(moved)]
                },
                [u, v],
                1e-5,
            );
            let product = density(d.as_vec3()) * jacobian.value.abs();
            if (product - 1.0).abs() > 1e-5 {
                return Err(format!("{d:?}: density × Jacobian = {product}"));
            }
        }
        Ok(())
    })
    .unwrap();
}

/// The map in f64, written from the formula.
fn decode_f64([u, v]: [f64; 2]) -> DVec3 {
    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let z = 1.0 - x.abs() - y.abs();
    if z >= 0.0 {
        DVec3::new(x, y, z).normalize()
    } else {
        DVec3::new((1.0 - y.abs()) * x.signum(), (1.0 - x.abs()) * y.signum(), z).normalize()
    }
}

#[test]
fn agrees_with_f64_and_inverts() {
    for i in 0..100_000 {
        let uv = CounterRng::new(34, i, 0).next_2d();
        let exact = decode_f64(uv.map(f64::from)).as_vec3();
        let d = octahedral_decode(Vec2::from(uv));
        assert!(angle(d, exact) < 6e-7);
        let there = octahedral_from_solid_angle(Density::<SolidAngle>::new(0.3), d);
        let back = octahedral_to_solid_angle(there, d).value();
        assert!((back / 0.3 - 1.0).abs() < 4e-7);
    }
}
