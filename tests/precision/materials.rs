//! `lightshed-scene`: materials, textures, cameras, skies.

use crate::worst::{Kind, Row, Worst, direction, log_uniform, rng};
use lightshed::sampling::CounterRng;
use lightshed::scene::glam::{Affine2, Affine3A, DVec3, Quat, Vec2, Vec3};
use lightshed::scene::{
    AxisWrap, Bsdf, Camera, CameraDescription, ColorTexture, ConductorIor, Filter, FloatTexture, FovAxis,
    Image, ImageTexture, Material, Microfacet, Projection, Rgb, Roughness, Wrap, luminance,
};
use std::f64::consts::PI;
use std::sync::Arc;

const PART: &str = "lightshed-scene";

fn worst(function: &'static str, inputs: &'static str, kind: Kind, fill: impl FnOnce(&mut Worst)) -> Row {
    Worst::row(PART, function, inputs, kind, fill)
}

pub fn rows() -> Vec<Row> {
    [fresnel(), lobes(), textures(), cameras()].concat()
}

fn white() -> ColorTexture {
    ColorTexture::Constant(Rgb::ONE)
}

/// A unit direction in the shading frame, to 10⁻⁶ of grazing.
fn grazing(rng: &mut CounterRng) -> Vec3 {
    let z = log_uniform(rng, 1e-6, 1.0);
    Vec3::new(((1.0 - z) * (1.0 + z)).sqrt(), 0.0, z)
}

/// Fresnel's reflectance by Snell's angle, in `f64`: `η` beyond over here.
fn dielectric(cos: f64, eta: f64) -> f64 {
    let sin2 = (1.0 - cos) * (1.0 + cos) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let t = (1.0 - sin2).sqrt();
    let s = (cos - eta * t) / (cos + eta * t);
    let p = (eta * cos - t) / (eta * cos + t);
    0.5 * (s * s + p * p)
}

/// The same of an absorbing material, by complex amplitudes.
fn conductor(cos: f64, eta: f64, k: f64) -> f64 {
    type C = (f64, f64);
    let mul = |a: C, b: C| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    let norm = |a: C| a.0 * a.0 + a.1 * a.1;
    let index = (eta, k);
    let squared = mul(index, index);
    // n cos θ_t = √(n² − sin² θ).
    let radicand: C = (squared.0 - (1.0 - cos * cos), squared.1);
    let size = norm(radicand).sqrt();
    let re = (0.5 * (size + radicand.0)).max(0.0).sqrt();
    let root: C = if re > 1e-8 {
        (re, 0.5 * radicand.1 / re)
    } else {
        (re, (0.5 * (size - radicand.0)).max(0.0).sqrt())
    };
    let s = norm((cos - root.0, -root.1)) / norm((cos + root.0, root.1));
    let far = (squared.0 * cos, squared.1 * cos);
    let p = norm((far.0 - root.0, far.1 - root.1)) / norm((far.0 + root.0, far.1 + root.1));
    0.5 * (s + p)
}

fn fresnel() -> Vec<Row> {
    vec![
        worst(
            "Bsdf::lobe_probability",
            "smooth dielectric, indices 0.4 to 2.5 and 1 ± 10⁻³, to 10⁻⁶ of grazing, from both sides: reflectance",
            Kind::Absolute,
            |w| {
                let mut rng = rng(400);
                for i in 0..100_000 {
                    let eta = if i % 3 == 0 {
                        1.0 + 1e-3 * (rng.next_f32() - 0.5)
                    } else {
                        log_uniform(&mut rng, 0.4, 2.5)
                    };
                    if eta == 1.0 {
                        continue;
                    }
                    let material = Material::Dielectric {
                        eta,
                        roughness: None,
                        specular_reflectance: white(),
                        specular_transmittance: white(),
                    };
                    let bsdf = material.at(Vec2::ZERO);
                    let (wo, inside) = (grazing(&mut rng), i % 2 == 0);
                    let (wo, relative) = if inside {
                        (-wo, 1.0 / f64::from(eta))
                    } else {
                        (wo, f64::from(eta))
                    };
                    let cos = f64::from(wo.z.abs());
                    // Near the angle of total reflection rounding an angle to `f32` is worth more
                    // than itself.
                    let radicand = 1.0 - (1.0 - cos * cos) / (relative * relative);
                    if radicand.abs() > 1e-3 {
                        w.add(f64::from(bsdf.lobe_probability(0, wo)), dielectric(cos, relative));
                    }
                    let all: f32 = (0..bsdf.lobe_count())
                        .map(|lobe| bsdf.lobe_probability(lobe, wo))
                        .sum();
                    w.add(f64::from(all), 1.0);
                }
            },
        ),
        worst(
            "Bsdf::sample",
            "smooth conductor, η from 0.05 to 5, k from 10⁻³ to 10, to 10⁻⁶ of grazing: reflectance",
            Kind::Absolute,
            |w| {
                let mut rng = rng(401);
                for _ in 0..100_000 {
                    let (eta, k) = (
                        log_uniform(&mut rng, 0.05, 5.0),
                        log_uniform(&mut rng, 1e-3, 10.0),
                    );
                    let material = Material::Conductor {
                        ior: ConductorIor {
                            eta: Rgb::splat(eta),
                            k: Rgb::splat(k),
                        },
                        roughness: None,
                        specular_reflectance: white(),
                    };
                    let wo = grazing(&mut rng);
                    let sample = material
                        .at(Vec2::ZERO)
                        .sample(wo, rng.next_f32(), rng.next_2d().into());
                    let truth = conductor(f64::from(wo.z), f64::from(eta), f64::from(k));
                    w.add(sample.map_or(f64::NAN, |s| f64::from(s.weight.x)), truth);
                    w.exactly(sample.is_some_and(|s| s.is_delta && s.wi == Vec3::new(-wo.x, -wo.y, wo.z)));
                }
            },
        ),
        worst(
            "Bsdf::sample",
            "smooth dielectric, indices 0.4 to 2.5: Snell's law, sin θ_t against sin θ_i/η",
            Kind::Absolute,
            |w| {
                let mut rng = rng(402);
                for _ in 0..100_000 {
                    let eta = log_uniform(&mut rng, 0.4, 2.5);
                    let material = Material::Dielectric {
                        eta,
                        roughness: None,
                        specular_reflectance: white(),
                        specular_transmittance: white(),
                    };
                    let wo = grazing(&mut rng);
                    if let Some(sample) = material
                        .at(Vec2::ZERO)
                        .sample(wo, 0.999_999, rng.next_2d().into())
                        && sample.wi.z < 0.0
                    {
                        w.add(f64::from(-sample.wi.x), f64::from(wo.x) / f64::from(eta));
                        w.add(sample.wi.as_dvec3().length(), 1.0);
                        w.add(f64::from(sample.eta), f64::from(eta));
                    }
                }
            },
        ),
    ]
}

/// A material of any kind but the smooth and the empty ones.
fn material(rng: &mut CounterRng) -> Material {
    let color = |rng: &mut CounterRng| {
        ColorTexture::Constant(Rgb::new(rng.next_f32(), rng.next_f32(), rng.next_f32()))
    };
    let alphas = [0; 2].map(|_| log_uniform(rng, 1e-3, 1.5));
    let rough = Roughness {
        distribution: if rng.next_u32().is_multiple_of(2) {
            Microfacet::Ggx
        } else {
            Microfacet::Beckmann
        },
        alpha_u: FloatTexture::Constant(alphas[0]),
        alpha_v: FloatTexture::Constant(alphas[1]),
    };
    let eta = log_uniform(rng, 1.05, 2.5);
    match rng.next_u32() % 6 {
        0 => Material::Diffuse {
            reflectance: color(rng),
        },
        1 => Material::Conductor {
            ior: ConductorIor {
                eta: Rgb::splat(log_uniform(rng, 0.05, 5.0)),
                k: Rgb::splat(log_uniform(rng, 1e-3, 10.0)),
            },
            roughness: Some(rough),
            specular_reflectance: color(rng),
        },
        2 => Material::Dielectric {
            eta,
            roughness: Some(rough),
            specular_reflectance: white(),
            specular_transmittance: white(),
        },
        3 => Material::Plastic {
            eta,
            diffuse_reflectance: color(rng),
            specular_reflectance: white(),
            nonlinear: rng.next_u32().is_multiple_of(2),
            roughness: if rng.next_u32().is_multiple_of(2) {
                Some(rough)
            } else {
                None
            },
        },
        4 => Material::MetallicRoughness {
            base_color: color(rng),
            metallic: FloatTexture::Constant(rng.next_f32()),
            roughness: FloatTexture::Constant(log_uniform(rng, 0.03, 1.0)),
            transmission: FloatTexture::Constant(rng.next_f32()),
            ior: eta,
        },
        _ => Material::Blend {
            weight: FloatTexture::Constant(rng.next_f32()),
            first: Box::new(Material::Diffuse {
                reflectance: color(rng),
            }),
            second: Box::new(Material::Conductor {
                ior: ConductorIor {
                    eta: Rgb::splat(0.2),
                    k: Rgb::splat(3.0),
                },
                roughness: Some(rough),
                specular_reflectance: white(),
            }),
        },
    }
}

const MATERIALS: &str = "all kinds of rough materials, α from 10⁻³ to 1.5, to 10⁻⁶ of grazing";

fn lobes() -> Vec<Row> {
    let each = |salt, w: &mut Worst, visit: fn(&mut Worst, &Bsdf, Vec3, &mut CounterRng)| {
        let mut rng = rng(salt);
        for i in 0..30_000 {
            let bsdf = material(&mut rng).at(Vec2::new(rng.next_f32(), rng.next_f32()));
            let mut wo = if i % 2 == 0 {
                grazing(&mut rng)
            } else {
                direction(&mut rng)
            };
            if wo.z == 0.0 {
                wo = Vec3::Z;
            }
            visit(w, &bsdf, wo, &mut rng);
        }
    };
    vec![
        worst(
            "Bsdf::evaluate",
            "diffuse: ρ cos θ/π and cos θ/π",
            Kind::Relative,
            |w| {
                let mut rng = rng(410);
                for _ in 0..50_000 {
                    let rho = rng.next_f32();
                    let material = Material::Diffuse {
                        reflectance: ColorTexture::Constant(Rgb::splat(rho)),
                    };
                    let (wo, wi) = (grazing(&mut rng), grazing(&mut rng));
                    let found = material.at(Vec2::ZERO).evaluate(wo, wi);
                    w.add(f64::from(found.pdf.value()), f64::from(wi.z) / PI);
                    w.add(f64::from(found.value.y), f64::from(rho) * f64::from(wi.z) / PI);
                }
            },
        ),
        worst(
            "Bsdf::evaluate_lobe",
            "all kinds of rough materials, α from 10⁻³ to 1.5, to 10⁻⁶ of grazing: sum over lobes against `evaluate`, finite",
            Kind::Relative,
            |w| {
                each(411, w, |w, bsdf, wo, rng| {
                    let wi = if rng.next_u32().is_multiple_of(2) {
                        grazing(rng)
                    } else {
                        direction(rng)
                    };
                    let all = bsdf.evaluate(wo, wi);
                    w.exactly(all.value.is_finite() && all.value.min_element() >= 0.0);
                    w.exactly(all.pdf.value().is_finite() && all.pdf.value() >= 0.0);
                    let (mut value, mut pdf) = (0.0, 0.0);
                    for lobe in 0..bsdf.lobe_count() {
                        let one = bsdf.evaluate_lobe(lobe, wo, wi);
                        value += f64::from(one.value.y);
                        pdf += f64::from(one.pdf.value());
                    }
                    if value > 1e-30 && pdf > 1e-30 {
                        w.add(f64::from(all.value.y), value);
                        w.add(f64::from(all.pdf.value()), pdf);
                    }
                });
            },
        ),
        worst(
            "Bsdf::sample",
            "all kinds of rough materials, α from 10⁻³ to 1.5, to 10⁻⁶ of grazing: lengths of directions; weights and densities finite",
            Kind::Absolute,
            |w| {
                each(412, w, |w, bsdf, wo, rng| {
                    if let Some(sample) = bsdf.sample(wo, rng.next_f32(), rng.next_2d().into()) {
                        w.add(sample.wi.as_dvec3().length(), 1.0);
                        w.exactly(sample.weight.is_finite() && sample.weight.min_element() >= 0.0);
                        w.exactly(
                            sample.pdf.value() > 0.0 && (sample.is_delta || sample.pdf.value().is_finite()),
                        );
                    }
                });
            },
        ),
        worst(
            "Bsdf::sample_lobe",
            "the same, cos θ from 0.05 and α from 0.1: density and value against `evaluate_lobe` there",
            Kind::Relative,
            |w| {
                let mut rng = rng(413);
                for _ in 0..30_000 {
                    let made = material(&mut rng);
                    let bsdf = made.at(Vec2::ZERO);
                    let wo = direction(&mut rng);
                    for lobe in 0..bsdf.lobe_count() {
                        if bsdf.lobe_roughness(lobe) < 0.1 || wo.z.abs() < 0.05 {
                            continue;
                        }
                        if let Some(sample) = bsdf.sample_lobe(lobe, wo, rng.next_2d().into())
                            && sample.wi.z.abs() > 0.05
                            && sample.pdf.value() > 1e-2
                        {
                            let again = bsdf.evaluate_lobe(lobe, wo, sample.wi);
                            w.add(f64::from(again.pdf.value()), f64::from(sample.pdf.value()));
                            w.exactly(sample.probability == bsdf.lobe_probability(lobe, wo));
                        }
                    }
                }
            },
        ),
        worst("Bsdf::lobe_probability", MATERIALS, Kind::Absolute, |w| {
            each(414, w, |w, bsdf, wo, _| {
                let all: f64 = (0..bsdf.lobe_count())
                    .map(|lobe| f64::from(bsdf.lobe_probability(lobe, wo)))
                    .sum();
                // Nothing is scattered by one-sided surfaces seen from behind.
                w.add(all, if all == 0.0 { 0.0 } else { 1.0 });
                w.exactly(
                    (0..bsdf.lobe_count()).all(|lobe| (0.0..=1.0).contains(&bsdf.lobe_roughness(lobe))),
                );
                w.exactly(bsdf.albedo_hint().is_finite() && bsdf.albedo_hint().min_element() >= 0.0);
            });
        }),
    ]
}

/// A picture of 5 × 3 texels over 30 decades.
fn picture(rng: &mut CounterRng, sign: bool) -> Arc<Image> {
    let texel = |rng: &mut CounterRng| {
        [0; 3].map(|_| {
            log_uniform(rng, 1e-15, 1e15)
                * if sign && rng.next_u32().is_multiple_of(2) {
                    -1.0
                } else {
                    1.0
                }
        })
    };
    let texels = (0..15).map(|_| texel(rng)).collect();
    Arc::new(Image::from_linear(5, 3, texels).expect("texels are finite"))
}

fn textures() -> Vec<Row> {
    vec![
        worst(
            "ImageTexture::at",
            "bilinear, 30 decades of texels, all wraps, coordinates to 10³: error over the greatest texel and the coordinate",
            Kind::Absolute,
            |w| {
                let mut rng = rng(420);
                for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                    let image = picture(&mut rng, false);
                    let greatest = image.texels().map(|t| f64::from(t.x)).fold(0.0, f64::max);
                    let texture = ImageTexture {
                        image: image.clone(),
                        to_uv: Affine2::IDENTITY,
                        filter: Filter::Bilinear,
                        wrap,
                        scale: Rgb::ONE,
                    };
                    for _ in 0..20_000 {
                        let range = log_uniform(&mut rng, 1.0, 1e3);
                        let uv = (Vec2::from(rng.next_2d()) - 0.5) * range;
                        let found = f64::from(texture.at(uv).x);
                        // Coordinates of which the texture makes `f32` numbers.
                        let (s, t) = (f64::from(uv.x), f64::from(1.0 - uv.y));
                        let truth = bilinear(&image, wrap, s, t);
                        let scale = greatest * 5.0 * (1.0 + s.abs() + t.abs());
                        w.add(found / scale, truth / scale);
                    }
                }
            },
        ),
        worst(
            "ColorTexture::mean",
            "30 decades of texels: also `Image::mean` and `FloatTexture::mean`",
            Kind::Relative,
            |w| {
                let mut rng = rng(421);
                for _ in 0..500 {
                    let image = picture(&mut rng, false);
                    let truth = image.texels().map(|t| f64::from(t.y)).sum::<f64>() / 15.0;
                    w.add(f64::from(image.mean().y), truth);
                    let texture = ImageTexture {
                        image,
                        to_uv: Affine2::IDENTITY,
                        filter: Filter::Nearest,
                        wrap: Wrap::Clamp,
                        scale: Rgb::splat(0.5),
                    };
                    w.add(
                        f64::from(ColorTexture::Image(texture.clone()).mean().y),
                        0.5 * truth,
                    );
                    let channel = lightshed::scene::Channel::Green;
                    w.add(
                        f64::from(FloatTexture::Image(texture, channel).mean()),
                        0.5 * truth,
                    );
                }
            },
        ),
        worst(
            "ColorTexture::at",
            "coordinates of any size: finite, one of the texels; also `FloatTexture::at`, `Image::texel`",
            Kind::Absolute,
            |w| {
                let mut rng = rng(422);
                for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                    let image = picture(&mut rng, true);
                    let texels: Vec<Rgb> = image.texels().collect();
                    let texture = ImageTexture {
                        image: image.clone(),
                        to_uv: Affine2::IDENTITY,
                        filter: Filter::Nearest,
                        wrap,
                        scale: Rgb::ONE,
                    };
                    for _ in 0..5_000 {
                        let mut coordinate = || {
                            log_uniform(&mut rng, 1e-38, 3e38)
                                * if rng.next_u32().is_multiple_of(2) {
                                    1.0
                                } else {
                                    -1.0
                                }
                        };
                        let uv = Vec2::new(coordinate(), coordinate());
                        let found = ColorTexture::Image(texture.clone()).at(uv);
                        w.exactly(texels.contains(&found));
                        let red = FloatTexture::Image(texture.clone(), lightshed::scene::Channel::Red).at(uv);
                        w.exactly(red == found.x);
                    }
                    w.exactly(image.texel(u32::MAX, u32::MAX) == texels[14]);
                }
            },
        ),
        worst(
            "luminance",
            "three channels over 60 decades",
            Kind::Relative,
            |w| {
                let mut rng = rng(423);
                for _ in 0..100_000 {
                    let rgb = Rgb::from_array([0; 3].map(|_| log_uniform(&mut rng, 1e-30, 1e30)));
                    let truth = 0.212_671 * f64::from(rgb.x)
                        + 0.715_160 * f64::from(rgb.y)
                        + 0.072_169 * f64::from(rgb.z);
                    w.add(f64::from(luminance(rgb)), truth);
                }
            },
        ),
    ]
}

fn bilinear(image: &Image, wrap: Wrap, s: f64, t: f64) -> f64 {
    let fold = |wrap: AxisWrap, i: f64, n: f64| match wrap {
        AxisWrap::Repeat => i.rem_euclid(n),
        AxisWrap::Mirror => {
            let j = i.rem_euclid(2.0 * n);
            if j < n { j } else { 2.0 * n - 1.0 - j }
        }
        AxisWrap::Clamp => i.clamp(0.0, n - 1.0),
    };
    let [along_s, along_t] = wrap.axes();
    let [nx, ny] = [f64::from(image.width()), f64::from(image.height())];
    let (x, y) = (s * nx - 0.5, t * ny - 0.5);
    let (fx, fy) = (x - x.floor(), y - y.floor());
    let texel = |dx: f64, dy: f64| {
        f64::from(
            image
                .texel(
                    fold(along_s, x.floor() + dx, nx) as u32,
                    fold(along_t, y.floor() + dy, ny) as u32,
                )
                .x,
        )
    };
    (1.0 - fy) * ((1.0 - fx) * texel(0.0, 0.0) + fx * texel(1.0, 0.0))
        + fy * ((1.0 - fx) * texel(0.0, 1.0) + fx * texel(1.0, 1.0))
}

fn camera(rng: &mut CounterRng) -> Option<(Camera, CameraDescription, [u32; 2])> {
    let description = CameraDescription {
        to_world: Affine3A::from_rotation_translation(
            Quat::from_axis_angle(direction(rng), 3.0 * rng.next_f32()),
            direction(rng) * log_uniform(rng, 1e-3, 1e3),
        ),
        fov_x: log_uniform(rng, 0.01, 3.0),
        projection: Projection::Pinhole,
        near_clip: 0.01,
        far_clip: 1e6,
    };
    let size = [1 + rng.next_u32() % 4000, 1 + rng.next_u32() % 4000];
    Some((
        Camera::new(&description, size[0], size[1]).ok()?,
        description,
        size,
    ))
}

fn cameras() -> Vec<Row> {
    vec![
        worst(
            "Camera::ray",
            "fields of view from 0.01 to 3 radians, to 4,000 pixels: direction against `f64`, times the tangent's square",
            Kind::Absolute,
            |w| {
                let mut rng = rng(430);
                for _ in 0..20_000 {
                    let Some((camera, description, [width, height])) = camera(&mut rng) else {
                        w.exactly(false);
                        continue;
                    };
                    let film = Vec2::from(rng.next_2d()) * Vec2::new(width as f32, height as f32);
                    let ray = camera.ray(film, [0.5; 2]);
                    let half = (0.5 * f64::from(description.fov_x)).tan();
                    let (n, m) = (f64::from(width), f64::from(height));
                    // x to the left, y up (Mitsuba's camera).
                    let local = DVec3::new(
                        half * (1.0 - 2.0 * f64::from(film.x) / n),
                        half * (1.0 - 2.0 * f64::from(film.y) / m) * m / n,
                        1.0,
                    )
                    .normalize();
                    let matrix = description.to_world.matrix3;
                    let [x, y, z] =
                        [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|a| Vec3::from(a).as_dvec3());
                    let truth = (x * local.x + y * local.y + z * local.z).normalize();
                    w.add((ray.direction.as_dvec3().normalize() - truth).length(), 0.0);
                    w.add(ray.direction.as_dvec3().length(), 1.0);
                }
            },
        ),
        worst(
            "Camera::film_position",
            "the same cameras, points on rays at 1 to 100, over the image's width: there and back, times the angle of view",
            Kind::Absolute,
            |w| {
                let mut rng = rng(431);
                for _ in 0..20_000 {
                    let Some((camera, description, [width, height])) = camera(&mut rng) else {
                        w.exactly(false);
                        continue;
                    };
                    let film = Vec2::from(rng.next_2d()) * Vec2::new(width as f32, height as f32);
                    let ray = camera.ray(film, [0.5; 2]);
                    // Far enough for the camera's place not to eat the digits.
                    let far = ray.origin.length().max(1.0) * log_uniform(&mut rng, 1.0, 100.0);
                    let along = far * description.fov_x.min(1.0);
                    let aspect = (width.max(height) / width.min(height)) as f32;
                    if let Some(found) = camera.film_position(ray.origin + ray.direction * far)
                        && description.fov_x < 2.0
                        && aspect < 4.0
                    {
                        let off = (found - film).as_dvec2().length() / f64::from(width.max(height));
                        w.add(off * f64::from(along / far), 0.0);
                    }
                }
            },
        ),
        worst(
            "FovAxis::to_horizontal",
            "angles from 10⁻⁶ to 3, aspects over 4 decades: there and back by the inverse aspect",
            Kind::Relative,
            |w| {
                let mut rng = rng(432);
                for _ in 0..50_000 {
                    let (angle, aspect) = (
                        f64::from(log_uniform(&mut rng, 1e-6, 3.0)),
                        f64::from(log_uniform(&mut rng, 1e-2, 1e2)),
                    );
                    w.add(FovAxis::X.to_horizontal(angle, aspect), angle);
                    let across = FovAxis::Y.to_horizontal(angle, aspect);
                    w.add((0.5 * across).tan() / aspect, (0.5 * angle).tan());
                    w.add(FovAxis::Smaller.to_horizontal(angle, aspect), across.max(angle));
                    w.add(FovAxis::Larger.to_horizontal(angle, aspect), across.min(angle));
                }
            },
        ),
    ]
}
