//! `lightshed-lights`: bounds, cones, and probabilities of choices.

use crate::worst::{Kind, Row, Worst, direction, log_uniform, rng};
use lightshed::lights::glam::{DVec3, Quat, Vec3};
use lightshed::lights::{
    Bounds, BvhBuild, Light, LightBvh, LightInstance, LightSampler, LightSubtrees, Lightcut, OpenedTree,
    OrientationCone, PerfectTree, PowerLights, RaySegment, ShadingPoint, TwoLevelTree, UniformLights,
};
use lightshed::sampling::CounterRng;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

pub const PART: &str = "lightshed-lights";

fn worst(function: &'static str, inputs: &'static str, kind: Kind, fill: impl FnOnce(&mut Worst)) -> Row {
    Worst::row(PART, function, inputs, kind, fill)
}

pub fn rows() -> Vec<Row> {
    [boxes(), cones(), choices(), cuts()].concat()
}

/// A box of up to 10⁶ times its least extent, flat along an axis now and then, and a point near
/// it, in it, or at a corner.
fn box_and_point(rng: &mut CounterRng) -> (Bounds, Vec3) {
    let scale = log_uniform(rng, 1e-15, 1e15);
    let corner = |rng: &mut CounterRng| direction(rng) * scale * log_uniform(rng, 1e-6, 1.0);
    let (a, mut b) = (corner(rng), corner(rng));
    if rng.next_f32() < 0.2 {
        b.y = a.y;
    }
    let bounds = Bounds::new(a.min(b), a.max(b));
    let point = match rng.next_u32() % 4 {
        0 => bounds.min,
        1 => bounds.center(),
        _ => direction(rng) * scale * log_uniform(rng, 1e-3, 1e3),
    };
    (bounds, point)
}

fn boxes() -> Vec<Row> {
    let over = |function, truth: fn(DVec3, DVec3, DVec3) -> f64, found: fn(&Bounds, Vec3) -> f32| {
        worst(
            function,
            "boxes and points over 30 decades, flat boxes, points at corners",
            Kind::Relative,
            |w| {
                let mut rng = rng(100);
                for _ in 0..100_000 {
                    let (b, x) = box_and_point(&mut rng);
                    let truth = truth(b.min.as_dvec3(), b.max.as_dvec3(), x.as_dvec3());
                    w.add(f64::from(found(&b, x)), truth);
                }
            },
        )
    };
    vec![
        over(
            "Bounds::half_area",
            |a, b, _| {
                let d = b - a;
                d.x * d.y + d.y * d.z + d.z * d.x
            },
            |b, _| b.half_area(),
        ),
        over(
            "Bounds::distance_squared_min",
            |a, b, x| (a - x).max(x - b).max(DVec3::ZERO).length_squared(),
            Bounds::distance_squared_min,
        ),
        over(
            "Bounds::distance_squared_max",
            |a, b, x| (x - a).max(b - x).length_squared(),
            Bounds::distance_squared_max,
        ),
        over(
            "Bounds::diagonal",
            |a, b, _| (b - a).length(),
            |b, _| b.diagonal().as_dvec3().length() as f32,
        ),
        worst(
            "Bounds::center",
            "corners over 70 decades, error over the larger one",
            Kind::Absolute,
            |w| {
                let mut rng = rng(101);
                for _ in 0..100_000 {
                    let [a, b] = [0; 2].map(|_| direction(&mut rng) * log_uniform(&mut rng, 1e-32, 3e38));
                    let bounds = Bounds::new(a.min(b), a.max(b));
                    let large = a.as_dvec3().length().max(b.as_dvec3().length());
                    let truth = (a.as_dvec3() + b.as_dvec3()) * 0.5;
                    w.add((bounds.center().as_dvec3() - truth).length() / large, 0.0);
                }
            },
        ),
        worst(
            "Bounds::of_points",
            "points over 70 decades: contains and touches them",
            Kind::Absolute,
            |w| {
                let mut rng = rng(102);
                for count in 1..2_000 {
                    let points: Vec<Vec3> = (0..count % 17 + 1)
                        .map(|_| direction(&mut rng) * log_uniform(&mut rng, 1e-32, 3e38))
                        .collect();
                    let around = Bounds::of_points(points.iter().copied());
                    let (a, b) = points.split_at(points.len() / 2);
                    let halves = Bounds::of_points(a.iter().copied());
                    w.exactly(halves.union(&Bounds::of_points(b.iter().copied())) == around);
                    w.exactly(points.iter().all(|&x| around.contains(x)));
                    w.exactly(around.is_valid() && points.iter().any(|x| x.x == around.min.x));
                }
            },
        ),
    ]
}

/// The angle between directions of about unit length.
fn angle(a: Vec3, b: Vec3) -> f64 {
    let (a, b) = (a.as_dvec3().normalize(), b.as_dvec3().normalize());
    2.0 * (a - b).length().atan2((a + b).length())
}

/// Of an angle from 10⁻⁶ to π, and now and then 0 or a right one.
fn cone(rng: &mut CounterRng) -> OrientationCone {
    let mut angle = || match rng.next_u32() % 4 {
        0 => 0.0,
        1 => std::f32::consts::FRAC_PI_2,
        _ => log_uniform(rng, 1e-6, 3.1),
    };
    let (normals_angle, emission_angle) = (angle(), angle());
    OrientationCone {
        axis: direction(rng),
        normals_angle,
        emission_angle,
    }
}

fn cones() -> Vec<Row> {
    // Pairs whose axes are anything from equal to opposite.
    let pairs = |salt| {
        let mut rng = rng(salt);
        (0..100_000).map(move |_| {
            let (a, mut b) = (cone(&mut rng), cone(&mut rng));
            match rng.next_u32() % 4 {
                0 => b.axis = a.axis,
                1 => b.axis = -a.axis,
                2 => {
                    let off = direction(&mut rng) * log_uniform(&mut rng, 1e-8, 1.0);
                    b.axis = (a.axis + off).try_normalize().unwrap_or(a.axis);
                }
                _ => (),
            }
            (a, b)
        })
    };
    vec![
        worst(
            "OrientationCone::measure",
            "angles from 0 to π, error over 4π",
            Kind::Absolute,
            |w| {
                let mut rng = rng(110);
                for _ in 0..100_000 {
                    let cone = cone(&mut rng);
                    let (o, e) = (f64::from(cone.normals_angle), f64::from(cone.emission_angle));
                    let end = (o + e).min(PI);
                    // 2π (1 − cos o) + 2π ∫_o^end cos(t − o) sin t dt.
                    let around = 0.5 * (end - o) * o.sin() + 0.25 * (o.cos() - (2.0 * end - o).cos());
                    let truth = TAU * (1.0 - o.cos()) + TAU * around;
                    w.add(f64::from(cone.measure()) / (2.0 * TAU), truth / (2.0 * TAU));
                }
            },
        ),
        worst(
            "OrientationCone::union",
            "axes from equal to opposite: radians by which a cone sticks out",
            Kind::Absolute,
            |w| {
                for (a, b) in pairs(111) {
                    let both = a.union(&b);
                    w.exactly(
                        both.is_valid() && both.emission_angle == a.emission_angle.max(b.emission_angle),
                    );
                    for part in [a, b] {
                        let reach = angle(both.axis, part.axis) + f64::from(part.normals_angle);
                        w.add((reach.min(PI) - f64::from(both.normals_angle)).max(0.0), 0.0);
                    }
                }
            },
        ),
        worst(
            "OrientationCone::union",
            "axes from equal to opposite: radians wider than the least cone",
            Kind::Absolute,
            |w| {
                for (a, b) in pairs(112) {
                    let (o, p) = (f64::from(a.normals_angle), f64::from(b.normals_angle));
                    let least = (0.5 * (o + p + angle(a.axis, b.axis))).max(o).max(p).min(PI);
                    w.add(f64::from(a.union(&b).normals_angle), least);
                }
            },
        ),
        worst(
            "OrientationCone::diffuse",
            "measure of a cosine lobe, and of a spot by `OrientationCone::spot`, over 4π",
            Kind::Absolute,
            |w| {
                let mut rng = rng(113);
                for _ in 0..10_000 {
                    let axis = direction(&mut rng);
                    w.add(
                        f64::from(OrientationCone::diffuse(axis).measure()) / (2.0 * TAU),
                        FRAC_PI_2 / TAU,
                    );
                    let angle = log_uniform(&mut rng, 1e-6, 3.1);
                    let truth = (0.5 * f64::from(angle)).sin().powi(2);
                    w.add(
                        f64::from(OrientationCone::spot(axis, angle).measure()) / (2.0 * TAU),
                        truth,
                    );
                }
            },
        ),
    ]
}

/// Lights that are hard on a sampler: one, many at one point, and others over 30 decades of places
/// and 60 of intensities, some off.
fn hostile_lights() -> Vec<Vec<Light>> {
    let mut rng = rng(120);
    let mut light = |place: Vec3, size: f32, intensity: f32| Light {
        bounds: Bounds::new(place, place + size * direction(&mut rng).abs()),
        intensity,
        cone: None,
    };
    let mut numbers = crate::worst::rng(121);
    let mut sets = vec![
        vec![light(Vec3::ONE, 0.0, 1.0)],
        vec![light(Vec3::ONE, 0.0, 1e-30)],
        vec![light(Vec3::ZERO, 0.0, 1.0); 2],
        vec![light(Vec3::ONE, 0.0, 1.0); 37],
    ];
    for (scale, low, high) in [
        (1.0, 1e-3, 1e3),
        (1e-15, 1e-30, 1e-15),
        (1e15, 1e-15, 1e30),
        (1.0, 1e-30, 1e30),
    ] {
        let mut lights: Vec<Light> = (0..200)
            .map(|_| {
                let place = direction(&mut numbers) * scale * log_uniform(&mut numbers, 1e-3, 1.0);
                let size = scale * log_uniform(&mut numbers, 1e-6, 0.3);
                light(place, size, log_uniform(&mut numbers, low, high))
            })
            .collect();
        for off in lights.iter_mut().step_by(7) {
            off.intensity = 0.0;
        }
        // All at one place, and large ones around all others.
        lights[1] = lights[2];
        lights[4].bounds = Bounds::new(Vec3::splat(-scale), Vec3::splat(scale));
        sets.push(lights);
    }
    sets
}

/// Where a set is lit: in the middle of a box, at a corner, beside, far away.
fn places(lights: &[Light]) -> Vec<Vec3> {
    let all = lights
        .iter()
        .fold(Bounds::EMPTY, |b, light| b.union(&light.bounds));
    let some = lights[lights.len() / 2].bounds;
    vec![
        some.center(),
        some.min,
        all.max + 0.5 * all.diagonal(),
        all.center() + all.diagonal() * Vec3::new(1.0, -30.0, 20.0) + Vec3::splat(1e-6),
    ]
}

/// Points of all kinds, and whether something must come from some light.
fn receivers(lights: &[Light]) -> impl Iterator<Item = ShadingPoint> {
    places(lights).into_iter().map(ShadingPoint::without_normal)
}

/// Calls `each` with every kind of sampler for every set of lights.
fn for_each_sampler(mut each: impl FnMut(&'static str, &[Light], &dyn LightSampler)) {
    for lights in hostile_lights() {
        let accept = "these lights are valid";
        let bvh = || LightBvh::with_build(&lights, BvhBuild::Agglomerative).expect(accept);
        let tree = || PerfectTree::new(&lights).expect(accept);
        each(
            "PowerLights::pmf",
            &lights,
            &PowerLights::new(&lights).expect(accept),
        );
        each(
            "UniformLights::pmf",
            &lights,
            &UniformLights::new(lights.len()).expect(accept),
        );
        each("PerfectTree::pmf", &lights, &tree());
        each("LightBvh::pmf", &lights, &bvh());
        each("OpenedTree::pmf", &lights, &OpenedTree::new(bvh()));
        let middle = lights.len() / 2;
        let meshes: Vec<&[Light]> = [&lights[..middle], &lights[middle..]]
            .into_iter()
            .filter(|mesh| !mesh.is_empty())
            .collect();
        let instances: Vec<LightInstance> = (0..meshes.len() as u32)
            .map(|mesh| LightInstance {
                rotation: Quat::from_rotation_y(0.7),
                ..LightInstance::at_rest(mesh)
            })
            .collect();
        each(
            "TwoLevelTree::pmf",
            &lights,
            &TwoLevelTree::new(&meshes, &instances).expect(accept),
        );
    }
}

const SAMPLERS: [&str; 6] = [
    "PowerLights::pmf",
    "UniformLights::pmf",
    "PerfectTree::pmf",
    "LightBvh::pmf",
    "OpenedTree::pmf",
    "TwoLevelTree::pmf",
];

fn choices() -> Vec<Row> {
    let each = |inputs, kind| SAMPLERS.map(|name| Worst::new(PART, name, inputs, kind));
    let mut sums = each(
        "8 sets of lights over 30 decades of places and 60 of intensities, equal ones, some off; points within: sum over lights",
        Kind::Absolute,
    );
    let mut same = Worst::new(
        PART,
        "LightSampler::sample",
        "the same sets: its probability is that of `pmf`, and that of `sample_many` and `sample_each`",
        Kind::Absolute,
    );
    let mut segments = Worst::new(
        PART,
        "LightSampler::pmf",
        "the same trees, stretches of 10⁻⁶ to 10³ of the lights' extent: sum over lights",
        Kind::Absolute,
    );
    let mut rng = rng(122);
    for_each_sampler(|name, lights, sampler| {
        let row = SAMPLERS
            .iter()
            .position(|&known| known == name)
            .expect("it is known");
        for at in receivers(lights) {
            let sum: f64 = (0..lights.len() as u32)
                .map(|i| f64::from(sampler.pmf(&at, i)))
                .sum();
            sums[row].add(sum, 1.0);
            let u: Vec<u64> = (0..64)
                .map(|i| match i {
                    0 => 0,
                    1 => u64::MAX,
                    _ => rng.next_u64(),
                })
                .collect();
            let mut many = vec![None; u.len()];
            sampler.sample_many(&at, &u, &mut many);
            for (&u, many) in u.iter().zip(many) {
                let one = sampler.sample(&at, u);
                same.exactly(one == many);
                same.exactly(one.is_some_and(|one| one.pmf > 0.0 && one.pmf == sampler.pmf(&at, one.light)));
            }
            let ats = vec![at; u.len()];
            let mut apart = vec![None; u.len()];
            sampler.sample_each(&ats, &u, &mut apart);
            same.exactly(
                u.iter()
                    .zip(apart)
                    .all(|(&u, choice)| choice == sampler.sample(&at, u)),
            );
        }
    });
    for lights in hostile_lights() {
        let tree = PerfectTree::new(&lights).expect("these lights are valid");
        let bvh = LightBvh::new(&lights).expect("these lights are valid");
        let extent = lights
            .iter()
            .fold(Bounds::EMPTY, |b, light| b.union(&light.bounds))
            .diagonal()
            .length();
        for start in places(&lights) {
            let length = extent * log_uniform(&mut rng, 1e-6, 1e3) + f32::MIN_POSITIVE;
            let at = RaySegment::new(start, direction(&mut rng), length).expect("it is finite");
            for sampler in [&tree as &dyn LightSampler<RaySegment>, &bvh] {
                let sum: f64 = (0..lights.len() as u32)
                    .map(|i| f64::from(sampler.pmf(&at, i)))
                    .sum();
                segments.add(sum, 1.0);
            }
        }
    }
    let mut rows: Vec<Row> = sums.map(Worst::done).into();
    rows.extend([same.done(), segments.done(), shares()]);
    rows
}

/// The share of all numbers that lead to a light, by bisection: lights of a tree have intervals of
/// numbers.
fn shares() -> Row {
    worst(
        "LightSampler::sample",
        "the same trees: share of all 2⁶⁴ numbers that lead to a light against `pmf`, those of more than 10⁻⁶",
        Kind::Relative,
        |w| {
            for lights in hostile_lights() {
                let tree = PerfectTree::new(&lights).expect("these lights are valid");
                let bvh = LightBvh::new(&lights).expect("these lights are valid");
                for sampler in [&tree as &dyn LightSampler, &bvh] {
                    for at in receivers(&lights) {
                        intervals(sampler, &at, w);
                    }
                }
            }
        },
    )
}

fn intervals(sampler: &dyn LightSampler, at: &ShadingPoint, w: &mut Worst) {
    let mut start: u64 = 0;
    loop {
        let light = sampler.sample(at, start).map(|choice| choice.light);
        // The last number that leads there.
        let (mut inside, mut outside) = (start, u128::from(u64::MAX) + 1);
        while outside - u128::from(inside) > 1 {
            let middle = (u128::from(inside) + (outside - u128::from(inside)) / 2) as u64;
            if sampler.sample(at, middle).map(|choice| choice.light) == light {
                inside = middle;
            } else {
                outside = u128::from(middle);
            }
        }
        let share = (outside - u128::from(start)) as f64 / 2f64.powi(64);
        let stated = light.map_or(0.0, |light| f64::from(sampler.pmf(at, light)));
        if share.max(stated) > 1e-6 {
            w.add(share, stated);
        }
        if outside > u128::from(u64::MAX) {
            return;
        }
        start = outside as u64;
    }
}

fn cuts() -> Vec<Row> {
    vec![worst(
        "LightSubtrees::subtree_pmf",
        "the same trees, cuts of up to 9 subtrees: sum over lights, over the number of subtrees",
        Kind::Absolute,
        |w| {
            for lights in hostile_lights() {
                let tree = PerfectTree::new(&lights).expect("these lights are valid");
                let bvh = LightBvh::new(&lights).expect("these lights are valid");
                for trees in [&tree as &dyn LightSubtrees, &bvh] {
                    for at in receivers(&lights) {
                        for count in [1, 2, 9] {
                            let mut cut = Lightcut::default();
                            trees.choose_cut(&at, count, &mut cut);
                            let sum: f64 = (0..lights.len() as u32)
                                .map(|i| f64::from(trees.subtree_pmf(&cut, &at, i)))
                                .sum();
                            w.add(sum / cut.len() as f64, 1.0);
                            let mut chosen = vec![None; cut.len()];
                            trees.sample_subtrees(&cut, 0, &at, &vec![1 << 40; cut.len()], &mut chosen);
                            w.exactly(chosen.iter().flatten().count() == cut.len());
                            w.exactly(
                                chosen
                                    .iter()
                                    .flatten()
                                    .all(|one| one.pmf == trees.subtree_pmf(&cut, &at, one.light)),
                            );
                        }
                    }
                }
            }
        },
    )]
}
