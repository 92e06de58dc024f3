//! Emitters given for eight points against one after the other.

use super::lanes::EmitterLanes;
use super::tests::{scene, sphere, triangle};
use crate::{EmitterDescription, EnvironmentMap, Image, Rgb, Scene, SkySampling};
use glam::{Affine3A, Vec3};
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, LaneMask, Lanes, Vec3Lanes};
use lightshed_sampling::CounterRng;
use lightshed_testkit::check_faults;
use std::sync::Arc;

#[derive(Clone, Copy, Debug)]
enum Fault {
    /// Near triangles are sampled as far ones are.
    Far,
    /// The probability of the choice is left out.
    Certain,
    /// Other emitters than triangles are those of the next lane.
    NextLane,
}

/// Points, their emitters, the probabilities of these and random numbers.
struct Given<'a> {
    scene: &'a Scene,
    from: [[f32; LANES]; 3],
    emitter: [u32; LANES],
    probability: [f32; LANES],
    u: [[f32; LANES]; 2],
    wanted: u32,
}

impl LaneKernel for Given<'_> {
    type Output = (Vec<[u32; LANES]>, u32);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let [x, y, z] = self.from;
        let samples = self
            .scene
            .emitters()
            .sample_on_lanes::<L>(
                Vec3Lanes::new(L::load(&x), L::load(&y), L::load(&z)),
                self.emitter,
                [L::load(&self.u[0]), L::load(&self.u[1])],
                self.wanted,
            )
            .chosen_with(L::load(&self.probability));
        (rows(&samples), samples.found.bits())
    }
}

fn rows<L: Lanes>(samples: &EmitterLanes<L>) -> Vec<[u32; LANES]> {
    let mut rows = vec![samples.emitter];
    for v in [samples.direction, samples.weight, samples.target] {
        rows.extend(v.store().map(|row| row.map(f32::to_bits)));
    }
    rows.push(samples.pdf_solid_angle.store().map(f32::to_bits));
    for mask in [samples.is_delta, samples.finite] {
        let bits = mask.bits();
        rows.push(std::array::from_fn(|lane| bits >> lane & 1));
    }
    rows
}

/// Triangles from near and far, spheres, points and numbers of none: bit for bit, with every kind
/// of lanes. Without a sample only the bit that says so is compared.
#[test]
fn given_emitters_in_lanes_are_those_alone() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let small = corners.map(|corner| 0.01 * corner + Vec3::new(0.5, 0.5, -0.5));
    let shapes = vec![
        (triangle(corners), 2.0),
        (triangle(small), 3.0),
        (sphere(Vec3::new(-0.5, 0.2, 0.4), 0.3, false), 1.0),
    ];
    let point = EmitterDescription::Point {
        position: Vec3::new(0.1, -0.4, 0.3),
        intensity: Rgb::ONE,
    };
    let scene = scene(shapes, vec![point]);
    check_faults(&[Fault::Far, Fault::Certain, Fault::NextLane], |fault| {
        let mut found_in_all = [0; 5];
        for number in 0..400 {
            let mut rng = CounterRng::new(5, number, 0);
            let mut row = |scale: f32| std::array::from_fn(|_| scale * (2.0 * rng.next_f32() - 1.0));
            let from = [row(1.5), row(1.5), row(1.5)];
            let positive = |row: [f32; LANES]| row.map(f32::abs);
            let (u, probability) = ([positive(row(1.0)), positive(row(1.0))], positive(row(1.0)));
            let emitter = std::array::from_fn(|_| rng.next_u32() % 5);
            let wanted = rng.next_u32() & 0xff;
            for choice in LaneChoice::all() {
                let (rows, found) = choice.run(Given {
                    scene: &scene,
                    from,
                    emitter,
                    probability,
                    u,
                    wanted,
                });
                for lane in 0..LANES {
                    let given = match fault {
                        Some(Fault::NextLane) if emitter[lane] > 1 => emitter[(lane + 1) % LANES],
                        _ => emitter[lane],
                    };
                    let (at, u) = (Vec3::from(from.map(|row| row[lane])), u.map(|row| row[lane]));
                    let emitters = scene.emitters();
                    let sample = match (fault, emitters.areas.get(given as usize)) {
                        (Some(Fault::Far), Some(area)) => area.sample(at, given, u),
                        _ => emitters.sample_on(at, given, u),
                    };
                    let chosen = match fault {
                        Some(Fault::Certain) => 1.0,
                        _ => probability[lane],
                    };
                    let sample = sample.and_then(|sample| sample.chosen_with(chosen));
                    let sample = sample.filter(|_| wanted >> lane & 1 == 1);
                    if sample.is_some() != (found >> lane & 1 == 1) {
                        return Err(format!("{given} from {at}: {sample:?}"));
                    }
                    let Some(sample) = sample else { continue };
                    let alone = EmitterLanes::<lightshed_lanes::ArrayLanes>::one_by_one(1, |_| Some(sample));
                    let alone = self::rows(&alone).into_iter().map(|row| row[0]);
                    if !alone.eq(rows.iter().map(|row| row[lane])) {
                        return Err(format!("{given} from {at}: {sample:?}"));
                    }
                    found_in_all[given as usize] += 1;
                }
            }
        }
        assert!(
            found_in_all[..4].iter().all(|&count| count > 50),
            "{found_in_all:?}"
        );
        Ok(())
    })
    .unwrap();
}

/// Samples of emitters at infinity.
struct AtInfinity<'a> {
    scene: &'a Scene,
    u_select: [u64; LANES],
    u: [[f32; LANES]; 2],
    wanted: u32,
}

impl LaneKernel for AtInfinity<'_> {
    type Output = (Vec<[u32; LANES]>, u32);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let u = [L::load(&self.u[0]), L::load(&self.u[1])];
        let emitters = self.scene.emitters();
        let sky = SkySampling::AboveMean;
        let samples = emitters.sample_at_infinity_lanes(sky, &self.u_select, u, self.wanted);
        (rows(&samples), samples.found.bits())
    }
}

/// A sun and a sky, chosen for few and for many of the lanes; the sky's pole, where nothing is
/// sampled, too.
#[test]
fn emitters_at_infinity_in_lanes_are_those_alone() {
    let texels = (0..8 * 4).map(|i| [(i % 7) as f32, (i % 3) as f32, 1.0]);
    let sky = EmitterDescription::Environment(EnvironmentMap {
        image: Arc::new(Image::from_linear(8, 4, texels.collect()).unwrap()),
        scale: 2.0,
        to_world: Affine3A::from_rotation_x(0.3),
    });
    let sun = EmitterDescription::Directional {
        direction: Vec3::NEG_Y,
        irradiance: Rgb::ONE,
    };
    let scene = scene(vec![], vec![sky, sun]);
    let (mut skies, mut none) = (0, 0);
    for number in 0..400 {
        let mut rng = CounterRng::new(6, number, 0);
        let u_select = std::array::from_fn(|_| rng.next_u64());
        let mut u = [(); 2].map(|()| std::array::from_fn(|_| rng.next_f32()));
        if number % 8 == 0 {
            u[1][number as usize / 8 % LANES] = 0.0;
        }
        let wanted = rng.next_u32() & 0xff;
        for choice in LaneChoice::all() {
            let (rows, found) = choice.run(AtInfinity {
                scene: &scene,
                u_select,
                u,
                wanted,
            });
            for lane in (0..LANES).filter(|lane| wanted >> lane & 1 == 1) {
                let u = [u[0][lane], u[1][lane]];
                let sample = scene
                    .emitters()
                    .sample_at_infinity(SkySampling::AboveMean, u_select[lane], u);
                assert_eq!(sample.is_some(), found >> lane & 1 == 1);
                let Some(sample) = sample else {
                    none += 1;
                    continue;
                };
                let alone = EmitterLanes::<lightshed_lanes::ArrayLanes>::one_by_one(1, |_| Some(sample));
                let alone = self::rows(&alone).into_iter().map(|row| row[0]);
                assert!(alone.eq(rows.iter().map(|row| row[lane])), "{sample:?}");
                skies += u32::from(!sample.is_delta);
            }
        }
    }
    assert!(skies > 1000 && none > 5, "{skies}, {none}");
}
