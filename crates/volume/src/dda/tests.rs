use super::*;
use crate::FieldBounds;
use lightshed_sampling::rand::Rng;
use lightshed_testkit::{check_faults, rng, uniform_f64};

const COUNTS: [u32; 3] = [5, 3, 7];

fn lattice() -> Lattice {
    Lattice::new(DVec3::new(-1.0, 0.0, 2.0), 2.0, COUNTS)
}

fn bounds() -> FieldBounds {
    FieldBounds::new(Vec3::new(-1.0, 0.0, 2.0), Vec3::new(9.0, 6.0, 16.0)).unwrap()
}

/// Random rays with many that are parallel to axes, in planes, through edges and corners, from
/// inside and outside.
fn hostile_ray(rng: &mut impl Rng) -> FieldRay {
    let mut point = |outside: f64| {
        Vec3::from_array(core::array::from_fn(|a| {
            let extent = f64::from(COUNTS[a]) * 2.0;
            let x = (uniform_f64(rng) * (1.0 + 2.0 * outside) - outside) * extent;
            let x = match rng.next_u32() % 4 {
                0 => (x / 2.0).round() * 2.0,
                1 => x.round(),
                _ => x,
            };
            (lattice().min[a] + x) as f32
        }))
    };
    let (from, to) = (point(0.6), point(0.0));
    let mut direction = to - from;
    for axis in 0..3 {
        match rng.next_u32() % 8 {
            0 => direction[axis] = 0.0,
            1 => direction[axis] = -0.0,
            2 => direction[axis] *= 1e-30,
            _ => (),
        }
    }
    FieldRay::new(from, direction)
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    OneCellShort,
    Shifted,
    StopsAtFirstTie,
}

#[test]
fn cells_cover_the_ray_without_gap_and_hold_their_points() {
    check_faults(
        &[Fault::OneCellShort, Fault::Shifted, Fault::StopsAtFirstTie],
        |fault| {
            let mut rng = rng(1);
            let mut hits = 0;
            for _ in 0..20_000 {
                let ray = hostile_ray(&mut rng);
                let interval = Interval { t0: 0.0, t1: 3.0 };
                let clipped = bounds().clip(&ray, interval);
                let mut crossings: Vec<Crossing> = Dda::new(&lattice(), &ray, clipped).collect();
                match fault {
                    Some(Fault::OneCellShort) => drop(crossings.pop()),
                    Some(Fault::Shifted) => crossings.iter_mut().for_each(|c| c.index += 1),
                    Some(Fault::StopsAtFirstTie) => {
                        let tie = crossings.iter().position(|c| c.t0 == c.t1);
                        crossings.truncate(tie.unwrap_or(crossings.len()));
                    }
                    None => (),
                }
                let Some(clipped) = clipped else {
                    assert!(crossings.is_empty());
                    continue;
                };
                hits += 1;
                let mut t = f64::from(clipped.t0);
                for c in &crossings {
                    if c.t0 != t || c.t1 < c.t0 || c.index >= COUNTS.iter().product::<u32>() as usize {
                        return Err(format!("{ray:?}: gap at {t} before {c:?}"));
                    }
                    t = c.t1;
                    let cell = [c.index % 5, c.index / 5 % 3, c.index / 15].map(|i| i as u32);
                    let (low, high) = lattice().cell_bounds(cell);
                    let middle = ray.origin.as_dvec3() + ray.direction.as_dvec3() * (0.5 * (c.t0 + c.t1));
                    let slack = DVec3::splat(1e-5 * (1.0 + c.t1));
                    let within = middle.cmpge(low.as_dvec3() - slack) & middle.cmple(high.as_dvec3() + slack);
                    if !within.all() {
                        return Err(format!("{ray:?}: {middle} is not in cell {cell:?}"));
                    }
                }
                if t != f64::from(clipped.t1) {
                    return Err(format!("{ray:?}: ends at {t}, not at {}", clipped.t1));
                }
            }
            if hits < 10_000 {
                Err(format!("only {hits} hits"))
            } else {
                Ok(())
            }
        },
    )
    .unwrap();
}

#[test]
fn no_ray_through_the_box_is_lost() {
    // Brute force in f64: a point in the open box at some t of the interval means that there are
    // cells.
    let mut rng = rng(2);
    let (low, high) = (bounds().min().as_dvec3(), bounds().max().as_dvec3());
    let mut inside = 0;
    for _ in 0..5000 {
        let ray = hostile_ray(&mut rng);
        let t = 2.0 * uniform_f64(&mut rng);
        let p = ray.origin.as_dvec3() + ray.direction.as_dvec3() * t;
        if p.cmpgt(low).all() && p.cmplt(high).all() {
            inside += 1;
            let clipped = bounds().clip(&ray, Interval { t0: 0.0, t1: 2.0 });
            let within = Dda::new(&lattice(), &ray, clipped).any(|c| c.t0 <= t + 1e-5 && t <= c.t1 + 1e-5);
            assert!(within, "{ray:?} at {t}");
        }
    }
    assert!(inside > 1000, "{inside}");
}

#[test]
fn hostile_intervals_end() {
    let ray = FieldRay::new(Vec3::new(0.5, 0.5, 3.0), Vec3::new(0.0, 0.0, 0.0));
    for (t0, t1) in [(0.0, f32::INFINITY), (f32::NAN, 1.0), (1.0, 0.0), (0.0, f32::NAN)] {
        let clipped = bounds().clip(&ray, Interval { t0, t1 });
        assert!(Dda::new(&lattice(), &ray, clipped).count() <= 1);
    }
}
