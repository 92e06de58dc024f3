use super::*;
use crate::testing::{media, random_path};
use crate::{DenseGrid, Filter, Homogeneous, Procedural};
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, Lanes, Vec3Lanes};
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

/// Eight rays from inside at once: their optical depths and ends are those of their segments, and
/// majorants at points are those of the segments that they are in.
#[test]
fn lanes_walk_as_single_rays_do() {
    struct Depths<'a> {
        majorants: &'a MajorantGrid,
        rays: &'a [FieldRay; LANES],
        t_max: f32,
        t: f32,
    }
    impl LaneKernel for Depths<'_> {
        type Output = [[f32; LANES]; 3];
        #[inline(always)]
        fn run<L: Lanes>(self) -> [[f32; LANES]; 3] {
            let rows = |part: fn(&FieldRay) -> Vec3| {
                let row = |axis: usize| L::load(&self.rays.each_ref().map(|ray| part(ray)[axis]));
                Vec3Lanes::new(row(0), row(1), row(2))
            };
            let (from, along) = (rows(|ray| ray.origin), rows(|ray| ray.direction));
            let [depth, end] = self.majorants.depths(from, along, L::splat(self.t_max));
            let majorant = self.majorants.majorants_at(from + along * L::splat(self.t));
            [depth, end, majorant].map(L::store)
        }
    }
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        Shorter,
        Elsewhere,
    }
    check_faults(&[Fault::Shorter, Fault::Elsewhere], |fault| {
        let mut rng = rng(5);
        let (mut compared, mut same) = (0, 0);
        for medium in media(Filter::Trilinear) {
            for _ in 0..40 {
                let rays: [FieldRay; LANES] = std::array::from_fn(|lane| {
                    let path = random_path(&medium, &mut rng);
                    let inside = medium.grid.bounds().clip(&path.ray, path.interval).unwrap();
                    let mut direction = path.ray.direction;
                    if lane == 0 {
                        // In a plane of super-voxels' faces.
                        direction.y = 0.0;
                    }
                    FieldRay::new(path.ray.at(0.5 * (inside.t0 + inside.t1)), direction)
                });
                for t_max in [0.2, f32::INFINITY] {
                    let t = 0.1;
                    let asked = Depths {
                        majorants: &medium.majorants,
                        rays: &rays,
                        t_max: match fault {
                            Some(Fault::Shorter) => 0.9 * t_max.min(1.0),
                            _ => t_max,
                        },
                        t: match fault {
                            Some(Fault::Elsewhere) => t + 0.3,
                            _ => t,
                        },
                    };
                    let [depths, ends, majorants] = LaneChoice::best().run(asked);
                    for (lane, ray) in rays.iter().enumerate() {
                        let interval = Interval { t0: 0.0, t1: t_max };
                        let segments: Vec<Segment> = medium.majorants.segments(ray, interval).collect();
                        let depth: f32 = segments.iter().map(|s| (s.t1 - s.t0) * s.majorant).sum();
                        let end = segments[segments.len() - 1].t1;
                        let (of_depth, of_end) = (depths[lane] - depth, ends[lane] - end);
                        if of_depth.abs() > 1e-4 * (1.0 + depth) || of_end.abs() > 1e-4 * (1.0 + end) {
                            return Err(format!("{}, {} of {depth}, {end}", depths[lane], ends[lane]));
                        }
                        if let Some(s) = segments.iter().find(|s| t < s.t1) {
                            compared += 1;
                            same += usize::from(s.majorant == majorants[lane]);
                        }
                    }
                }
            }
        }
        // All but those at a face of a super-voxel.
        if same * 100 < compared * 98 || compared < 500 {
            return Err(format!("{same} of {compared} majorants"));
        }
        Ok(())
    })
    .unwrap();
}
