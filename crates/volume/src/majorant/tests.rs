use super::*;
use crate::testing::{media, random_path};
use crate::{DenseGrid, Filter, Homogeneous, Procedural};
use lightshed_testkit::{check_faults, rng};

#[test]
fn segments_bound_the_density_and_cover_the_ray() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        TooLow,
        Shifted,
    }
    check_faults(&[Fault::TooLow, Fault::Shifted], |fault| {
        let mut rng = rng(1);
        for filter in [Filter::Nearest, Filter::Trilinear] {
            for medium in media(filter) {
                for _ in 0..60 {
                    let path = random_path(&medium, &mut rng);
                    let inside = medium.grid.bounds().clip(&path.ray, path.interval).unwrap();
                    let mut t = inside.t0;
                    let mut segments: Vec<Segment> = medium.segments(&path).collect();
                    match fault {
                        Some(Fault::TooLow) => segments.iter_mut().for_each(|s| s.majorant *= 0.9),
                        Some(Fault::Shifted) => segments.rotate_right(1),
                        None => (),
                    }
                    for s in &segments {
                        if s.t0 != t || s.t1 < s.t0 {
                            return Err(format!("gap at {t} before {s:?}"));
                        }
                        t = s.t1;
                        for i in 0..=8 {
                            let at = s.t0 + (s.t1 - s.t0) * i as f32 / 8.0;
                            let density = medium.grid.density(path.ray.at(at));
                            if !(s.minorant <= density + 1e-6 && density <= s.majorant + 1e-6) {
                                return Err(format!("{density} at {at}, {s:?}"));
                            }
                        }
                    }
                    assert!(
                        fault.is_some() || t == inside.t1,
                        "ends at {t}, not {}",
                        inside.t1
                    );
                }
            }
        }
        Ok(())
    })
    .unwrap();
}

/// Two points of a segment have bounds in common, mostly the segment's own: those of a ray in a
/// face of super-voxels may be the neighbour's, or none outside of the grid. Points of several
/// segments have none.
#[test]
fn a_short_way_has_the_bounds_of_its_segment() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        Swapped,
    }
    check_faults(&[Fault::Swapped], |fault| {
        let mut rng = rng(3);
        let (mut all, mut equal, mut apart) = (0, 0, 0);
        for medium in media(Filter::Trilinear) {
            for _ in 0..60 {
                let path = random_path(&medium, &mut rng);
                let asked = |t: f32| match (fault, path.ray.at(t)) {
                    (None, p) => p,
                    (Some(Fault::Swapped), p) => Vec3::new(p.y, p.x, p.z),
                };
                let segments: Vec<Segment> = medium.segments(&path).collect();
                for s in segments.iter().filter(|s| s.t1 - s.t0 > 1e-2) {
                    all += 1;
                    let at = |share: f32| s.t0 + (s.t1 - s.t0) * share;
                    let Some(range) = medium.majorants.range_around(asked(at(0.3)), asked(at(0.7))) else {
                        continue;
                    };
                    equal += usize::from((range.min, range.max) == (s.minorant, s.majorant));
                    for share in [0.3, 0.4, 0.5, 0.6, 0.7] {
                        let density = medium.grid.density(path.ray.at(at(share)));
                        if !(range.min <= density + 1e-6 && density <= range.max + 1e-6) {
                            return Err(format!("{density} beyond {range:?}"));
                        }
                    }
                }
                let (first, last) = (segments[0], segments[segments.len() - 1]);
                let middle = |s: Segment| path.ray.at(0.5 * (s.t0 + s.t1));
                if segments.len() > 2 {
                    apart += 1;
                    assert_eq!(medium.majorants.range_around(middle(first), middle(last)), None);
                }
            }
        }
        if equal * 10 < all * 9 {
            return Err(format!("{equal} of {all} are the segment's"));
        }
        assert!(all > 100 && apart > 50, "{all}, {apart}");
        Ok(())
    })
    .unwrap();
    let medium = &media(Filter::Trilinear)[0];
    let outside = medium.grid.bounds().max() + Vec3::splat(100.0);
    assert_eq!(medium.majorants.range_around(outside, outside), None);
}

#[test]
fn one_segment_bounds_all() {
    let medium = &media(Filter::Trilinear)[0];
    let path = random_path(medium, &mut rng(2));
    let whole = medium.majorants.whole_segment(&path.ray, path.interval).unwrap();
    let range = medium.majorants.range();
    assert_eq!((whole.minorant, whole.majorant), (range.min, range.max));
    for s in medium.segments(&path) {
        assert!(
            s.t0 >= whole.t0
                && s.t1 <= whole.t1
                && s.majorant <= whole.majorant
                && s.minorant >= whole.minorant
        );
    }
    let away = FieldRay::new(Vec3::splat(-5.0), Vec3::NEG_X);
    assert!(medium.majorants.whole_segment(&away, path.interval).is_none());
    assert_eq!(medium.majorants.segments(&away, path.interval).count(), 0);
}

#[test]
fn what_has_no_bounds_is_refused() {
    let unit = FieldBounds::new(Vec3::ZERO, Vec3::ONE).unwrap();
    let flat = FieldBounds::new(Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0)).unwrap();
    let with =
        |bounds, size| MajorantGrid::new(&Homogeneous::new(0.5, bounds).unwrap(), size).map(|g| g.counts());
    assert_eq!(with(unit, 0.3), Ok([4; 3]));
    assert_eq!(with(unit, 5.0), Ok([1; 3]));
    assert_eq!(with(flat, 0.3), Err(MajorantError::Bounds));
    assert_eq!(with(FieldBounds::ALL, 0.3), Err(MajorantError::Bounds));
    for size in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(with(unit, size), Err(MajorantError::CellSize));
    }
    assert_eq!(with(unit, 1e-4), Err(MajorantError::TooMany));
    assert!(Homogeneous::new(f32::NAN, unit).is_none() && Homogeneous::new(-1.0, unit).is_none());

    struct Unbounded;
    impl DensityField for Unbounded {
        type Accessor<'a> = Homogeneous;
        fn bounds(&self) -> FieldBounds {
            FieldBounds::new(Vec3::ZERO, Vec3::ONE).unwrap()
        }
        fn accessor(&self) -> Homogeneous {
            Homogeneous::new(1.0, FieldBounds::ALL).unwrap()
        }
        fn range(&self, _: Vec3, _: Vec3) -> DensityRange {
            DensityRange {
                min: 0.0,
                max: f32::INFINITY,
            }
        }
    }
    assert_eq!(
        MajorantGrid::new(&Unbounded, 0.5).unwrap_err(),
        MajorantError::Range
    );
}

#[test]
fn procedural_densities_stay_within_their_bounds() {
    let bounds = FieldBounds::new(Vec3::ZERO, Vec3::splat(4.0)).unwrap();
    // Negative in places, NaN in others, and above what is said of it.
    let density = |p: Vec3| if p.x > 3.0 { f32::NAN } else { p.x - 1.0 };
    let range = |low: Vec3, high: Vec3| DensityRange {
        min: low.x - 1.0,
        max: (high.x - 1.0).min(1.5),
    };
    let field = Procedural::new(density, range, bounds).unwrap();
    for (x, expected) in [(0.5, 0.0), (2.0, 1.0), (2.9, 1.5), (3.5, 0.0)] {
        assert_eq!(field.density(Vec3::new(x, 1.0, 1.0)), expected);
    }
    let majorants = MajorantGrid::new(&field, 1.0).unwrap();
    let ray = FieldRay::new(Vec3::new(-1.0, 2.0, 2.0), Vec3::X);
    let interval = Interval {
        t0: 0.0,
        t1: f32::INFINITY,
    };
    let found: Vec<f32> = majorants.segments(&ray, interval).map(|s| s.majorant).collect();
    assert_eq!(found.len(), 4);
    assert!(found[0] < 1e-3 && (found[1] - 1.0).abs() < 1e-3 && found[2] == 1.5 && found[3] == 1.5);
    assert!(
        Procedural::new(
            density,
            |_, _| DensityRange {
                min: 0.0,
                max: f32::NAN
            },
            bounds
        )
        .is_none()
    );
    // A grid's super-voxels need not divide it.
    let grid = DenseGrid::from_fn([5, 5, 5], Filter::Nearest, |_| 1.0).unwrap();
    assert_eq!(MajorantGrid::new(&grid, 2.0).unwrap().counts(), [3; 3]);
}
