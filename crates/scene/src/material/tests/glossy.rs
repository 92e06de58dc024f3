//! Glossy materials in lanes against their scattering functions one by one, bit for bit.

use super::*;
use crate::BsdfSample;
use crate::material::fresnel;
use crate::material::{
    GlossyColumns, GlossyMaterials, GlossyRow, GlossyVertices, ScatterGlossy, StoreGlossy,
};
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, Lanes, Vec3Lanes};
use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_testkit::{check_faults, hostile_unit_f32};

/// Conductors and blends of all kinds that lanes shade: nearly smooth and very rough, coloured,
/// black, reflecting all, and barely there.
fn materials() -> Vec<Material> {
    let metal = |ior: ConductorIor, alpha, tint: Rgb| Material::Conductor {
        ior,
        roughness: Some(rough(GGX, alpha, alpha)),
        specular_reflectance: tint.into(),
    };
    let ior = |eta, k| ConductorIor {
        eta: Rgb::splat(eta),
        k: Rgb::splat(k),
    };
    let iors = [GOLD, ior(0.0, 1.0), ior(1.5, 0.0), ior(0.0, 0.0), ior(1e-20, 1e4)];
    let tint = Rgb::new(0.9, 0.3, 0.6);
    let mut all = Vec::new();
    for ior in iors {
        for alpha in [0.0, 1e-3, 0.1, 0.5, 1e6] {
            all.push(metal(ior, alpha, Rgb::ONE));
            all.push(two_sided(metal(ior, alpha, tint), None));
        }
    }
    for weight in [1e-30, 0.3, 0.75] {
        for tint in [Rgb::ZERO, Rgb::splat(1e-38), tint] {
            for albedo in [0.0, 1e-30, 0.8] {
                let metal = || metal(GOLD, 0.2, tint);
                all.push(blend(weight, diffuse(albedo), metal()));
                all.push(two_sided(blend(weight, metal(), diffuse(albedo)), None));
            }
        }
    }
    all.push(metal(GOLD, 0.1, Rgb::ZERO));
    all
}

/// Straight, grazing and usual directions above the surface.
fn above(rng: &mut CounterRng, number: usize) -> Vec3 {
    let z = [1.0, 1e-38, 1e-20, 1e-7, 1e-3, 0.5][number % 6];
    match number % 4 {
        0 => Vec3::new((1.0f32 - z * z).sqrt(), 0.0, z),
        _ => {
            let direction = UniformSphere::sample(rng.next_2d());
            Vec3::new(direction.x, direction.y, direction.z.abs())
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    SwappedUniforms,
    OtherLobe,
    TowardsBelow,
    Rougher,
}

/// Value, density, direction, weight and its density; the last three zero without a sample.
fn figures(bsdf: &Bsdf, wo: Vec3, wi: Vec3, u_lobe: f32, u: Vec2) -> ([f32; 11], Option<BsdfSample>) {
    let value = bsdf.evaluate(wo, wi);
    let sample = bsdf.sample(wo, u_lobe, u);
    let (direction, weight, pdf) = sample.map_or((Vec3::ZERO, Vec3::ZERO, 0.0), |sample| {
        (sample.wi, sample.weight, sample.pdf.value())
    });
    let mut figures = [0.0; 11];
    for (place, v) in [(0, value.value), (4, direction), (7, weight)] {
        figures[place..place + 3].copy_from_slice(&v.to_array());
    }
    (figures[3], figures[10]) = (value.pdf.value(), pdf);
    (figures, sample)
}

/// What was stored, asked for eight directions; by the values of one point where it is given.
struct EvaluateStored<'a> {
    columns: &'a GlossyColumns,
    place: usize,
    point: Option<usize>,
    asked: &'a GlossyVertices,
}

impl LaneKernel for EvaluateStored<'_> {
    type Output = ([[f32; LANES]; 3], [f32; LANES]);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let load = |rows: &[[f32; LANES]; 3]| {
            Vec3Lanes::new(L::load(&rows[0]), L::load(&rows[1]), L::load(&rows[2]))
        };
        let points = match self.point {
            Some(index) => self.columns.splat::<L>(index),
            None => self.columns.load::<L>(self.place),
        };
        let (value, pdf) = points.evaluate(load(&self.asked.outgoing), load(&self.asked.towards));
        (value.store(), pdf.store())
    }
}

#[test]
fn glossy_materials_in_lanes_are_those_alone() {
    let materials = materials();
    let rows: Vec<GlossyRow> = materials
        .iter()
        .map(|material| GlossyRow::new(material).unwrap().0)
        .collect();
    let hostile: Vec<f32> = hostile_unit_f32().collect();
    let faults = [
        Fault::SwappedUniforms,
        Fault::OtherLobe,
        Fault::TowardsBelow,
        Fault::Rougher,
    ];
    check_faults(&faults, |fault| {
        let (mut samples, mut none) = (0, 0);
        for number in 0..6000 {
            let mut rng = CounterRng::new(31, number as u32, 0);
            // Every third group is of one material and its neighbours, others are mixed.
            let mut chosen = [0; LANES];
            let mut asked = GlossyVertices {
                outgoing: [[0.0; LANES]; 3],
                towards: [[0.0; LANES]; 3],
                u_lobe: [0.0; LANES],
                u: [[0.0; LANES]; 2],
            };
            let mut places = [[Vec3::ZERO; 2]; LANES];
            for lane in 0..LANES {
                chosen[lane] = match number % 3 {
                    0 => (number + lane / 4) % materials.len(),
                    _ => rng.next_u32() as usize % materials.len(),
                };
                let wo = above(&mut rng, number + lane);
                let wi = match (number + lane) % 5 {
                    0 => Vec3::new(-wo.x, -wo.y, wo.z),
                    1 => -wo,
                    2 => above(&mut rng, lane),
                    _ => UniformSphere::sample(rng.next_2d()),
                };
                let mut random = || match (number + lane) % 7 {
                    0 => hostile[rng.next_u32() as usize % hostile.len()],
                    _ => rng.next_f32(),
                };
                (asked.u_lobe[lane], asked.u[0][lane], asked.u[1][lane]) = (random(), random(), random());
                places[lane] = [wo, wi];
                for axis in 0..3 {
                    asked.outgoing[axis][lane] = wo[axis];
                    asked.towards[axis][lane] = wi[axis];
                }
            }
            for choice in LaneChoice::all() {
                let eight = || GlossyMaterials {
                    rows: chosen.map(|material| &rows[material]),
                    textured: 0,
                    colors: [[[0.0; LANES]; 3]; 2],
                };
                let found = choice.run(ScatterGlossy {
                    materials: eight(),
                    vertices: &asked,
                });
                // Stored and asked later, all and one by one.
                let (mut columns, place) = (GlossyColumns::NONE, number % 7 * LANES);
                choice.run(StoreGlossy {
                    materials: eight(),
                    place,
                    columns: &mut columns,
                });
                let stored = |point| {
                    choice.run(EvaluateStored {
                        columns: &columns,
                        place,
                        point,
                        asked: &asked,
                    })
                };
                let (together, alone) = (stored(None), number % LANES);
                let of_one = stored(Some(place + alone));
                for lane in 0..LANES {
                    let [wo, mut wi] = places[lane];
                    let mut u_lobe = asked.u_lobe[lane];
                    let mut u = Vec2::new(asked.u[0][lane], asked.u[1][lane]);
                    let mut bsdf = materials[chosen[lane]].at(Vec2::ZERO);
                    match fault {
                        Some(Fault::SwappedUniforms) => u = Vec2::new(u.y, u.x),
                        Some(Fault::OtherLobe) => u_lobe = 1.0 - u_lobe,
                        Some(Fault::TowardsBelow) => wi.z = -wi.z,
                        Some(Fault::Rougher) => {
                            bsdf = conductor(Some(rough(GGX, 0.100_01, 0.100_01))).at(Vec2::ZERO);
                        }
                        None => {}
                    }
                    let (expected, sample) = figures(&bsdf, wo, wi, u_lobe, u);
                    let scatters = found.scatters >> lane & 1 == 1;
                    let of = |rows: &[[f32; LANES]; 3]| rows.map(|row| row[lane]);
                    let mut computed = [0.0; 11];
                    computed[..3].copy_from_slice(&of(&found.value));
                    computed[3] = found.pdf_solid_angle[lane];
                    if scatters {
                        computed[4..7].copy_from_slice(&of(&found.direction));
                        computed[7..10].copy_from_slice(&of(&found.throughput));
                        computed[10] = found.direction_pdf_solid_angle[lane];
                    }
                    let bits =
                        |x: [f32; 11]| x.map(|x| if x.is_nan() { u32::MAX } else { (x + 0.0).to_bits() });
                    let again = |(value, pdf): &([[f32; LANES]; 3], [f32; LANES])| {
                        let mut again = computed;
                        again[..3].copy_from_slice(&of(value));
                        again[3] = pdf[lane];
                        bits(again) == bits(computed)
                    };
                    if !again(&together) || (lane == alone && !again(&of_one)) {
                        return Err(format!("{}, stored at {place}", choice.name()));
                    }
                    if scatters != sample.is_some() || bits(computed) != bits(expected) {
                        return Err(format!(
                            "{}, {:?} from {wo} to {wi} by {u_lobe} {u}: {computed:?} for {expected:?}",
                            choice.name(),
                            materials[chosen[lane]],
                        ));
                    }
                    samples += i32::from(scatters);
                    none += i32::from(!scatters);
                }
            }
        }
        assert!(
            samples > 50_000 && none > 1000,
            "{samples} samples, {none} without"
        );
        Ok(())
    })
    .unwrap();
}

/// What lanes leave out where all surfaces reflect everything.
#[test]
fn an_index_of_none_reflects_everything() {
    for step in 0..=1 << 20 {
        let cos = step as f32 / (1 << 20) as f32;
        assert_eq!(fresnel::conductor(cos, Rgb::ZERO, Rgb::ONE), Rgb::ONE);
        assert_eq!(fresnel::conductor(1e-6 * cos, Rgb::ZERO, Rgb::ONE), Rgb::ONE);
    }
}

/// Only what lanes can shade has a row: no other distribution, no roughness by axis or texture, no
/// blend that a place decides, nothing with two sides of its own.
#[test]
fn other_materials_have_no_row() {
    let metal = || conductor(Some(rough(GGX, 0.2, 0.2)));
    let textured = Material::Conductor {
        ior: GOLD,
        roughness: Some(Roughness {
            distribution: GGX,
            alpha_u: crate::FloatTexture::Vertex(crate::Channel::Red),
            alpha_v: 0.2.into(),
        }),
        specular_reflectance: Rgb::ONE.into(),
    };
    let others = [
        conductor(None),
        conductor(Some(rough(BECKMANN, 0.2, 0.2))),
        conductor(Some(rough(GGX, 0.2, 0.3))),
        textured,
        blend(0.0, diffuse(0.5), metal()),
        blend(1.0, diffuse(0.5), metal()),
        blend(0.5, metal(), metal()),
        blend(0.5, two_sided(metal(), None), diffuse(0.5)),
        two_sided(metal(), Some(diffuse(0.5))),
        plastic(true, Some(rough(GGX, 0.2, 0.2))),
        dielectric(1.5, Some(rough(GGX, 0.2, 0.2))),
    ];
    for material in others {
        assert!(GlossyRow::new(&material).is_none(), "{material:?}");
    }
    let (_, look) = GlossyRow::new(&two_sided(metal(), None)).unwrap();
    assert!(look.two_sided && look.colors.is_none());
}
