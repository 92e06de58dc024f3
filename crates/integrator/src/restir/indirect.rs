//! Indirect light as ReSTIR GI models it: points that send the same radiance in all directions.
//!
//! The sample of a pixel is `z = (x₂, L̂)`: the end of a ray from the pixel's `x₁`, and an
//! estimate of the radiance reflected there towards `x₁`. Its domain is measured by solid angle
//! at `x₁` and has the target `p̂(z) = Y(L̂)` (Ouyang et al. 2021, the simpler of their two: it
//! favours samples that other pixels can use, too). The shift reconnects: `x₂` and `L̂` stay,
//! with
//!
//! > `|∂T/∂ω| = |cos φ'| / |cos φ| · d² / d'²`,
//!
//! `φ` and `d` the angle at `x₂` and the distance to `x₁`, primed those of the pixel shifted
//! to.

use super::primary::{Outlook, Primary};
use lightshed_film::{RayKind, RayTally};
use lightshed_resampling::{Domain, DomainReservoir, Jacobian, ShiftMapping, Shifted, Undefined};
use lightshed_sampling::SolidAngle;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Rgb, Scene, SurfacePoint, luminance};

/// A point that sends the same radiance in all directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sender {
    pub point: SurfacePoint,
    pub radiance: Rgb,
}

impl Sender {
    pub fn target(&self) -> f64 {
        f64::from(luminance(self.radiance))
    }

    /// `|cos φ| / d²` as seen from a point.
    fn solid_angle_per_area(&self, from: Vec3) -> f64 {
        let between = (from - self.point.position).as_dvec3();
        let distance_squared = between.length_squared();
        let cosine = self.point.geometric_normal.as_dvec3().dot(between).abs();
        cosine / (distance_squared * distance_squared.sqrt())
    }
}

/// A pixel of one frame that sees a surface, as indirect light sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IndirectPixel {
    pub point: SurfacePoint,
    pub outlook: Outlook,
    /// Whether the side is seen to which the geometric normal points.
    pub outward: bool,
}

impl IndirectPixel {
    pub fn new(primary: &Primary) -> Self {
        Self {
            point: primary.point,
            outlook: primary.outlook(),
            outward: primary.sees_outside(),
        }
    }

    /// Whether the two are similar enough for reuse.
    pub fn resembles(&self, other: &Self) -> bool {
        self.outlook.resembles(&other.outlook)
    }
}

impl Domain for IndirectPixel {
    type Sample = Sender;
    type Space = SolidAngle;

    fn target(&self, x: &Sender) -> f64 {
        x.target()
    }
}

/// A pixel's sender with its weight.
pub(crate) type IndirectReservoir = DomainReservoir<IndirectPixel>;

/// Reconnection to the sender.
pub(crate) struct ToSender<'a> {
    pub scene: &'a Scene,
    pub tally: &'a RayTally,
    /// Whether the new connection is traced, and the target zero if it is occluded.
    pub visibility: bool,
}

impl ShiftMapping<IndirectPixel> for ToSender<'_> {
    fn shift(
        &self,
        x: &Sender,
        from: &IndirectPixel,
        to: &IndirectPixel,
    ) -> Result<Shifted<Sender>, Undefined> {
        let [here, there] = [to, from].map(|pixel| x.solid_angle_per_area(pixel.point.position));
        let jacobian = Jacobian::new(here / there)?;
        let mut target = x.target();
        if self.visibility && target > 0.0 {
            self.tally.add(RayKind::Reconnection, 1);
            if self.scene.occluded(&to.point.segment_to(&x.point)) {
                target = 0.0;
            }
        }
        Ok(Shifted {
            sample: *x,
            jacobian,
            target,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_resampling::round_trip;
    use lightshed_sampling::{CounterRng, Frame, UniformSphere};
    use lightshed_scene::glam::{DVec3, Vec2};
    use lightshed_scene::{Ray, builtin};
    use lightshed_testkit::{check_faults, jacobian_determinant};

    fn pixel(scene: &Scene, film: Vec2) -> IndirectPixel {
        let point = scene.intersect(&scene.camera().ray(film, [0.5; 2])).unwrap();
        let outlook = Outlook {
            position: point.position,
            normal: point.shading.normal,
            distance: 1.0,
        };
        let outward = true;
        IndirectPixel {
            point,
            outlook,
            outward,
        }
    }

    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Fault {
        Cosines,
        Distances,
    }

    /// Against finite differences of the direction: a change of `ω` at one pixel moves `x₂` on
    /// its plane, and so the direction in which the other pixel sees it. And the way back leads
    /// back.
    #[test]
    fn jacobians_are_those_of_finite_differences() {
        let scene = Scene::new(&builtin::cornell()).unwrap();
        let tally = RayTally::default();
        let shift = ToSender {
            scene: &scene,
            tally: &tally,
            visibility: false,
        };
        check_faults(&[Fault::Cosines, Fault::Distances], |fault| {
            let mut rng = CounterRng::new(5, 0, 0);
            for _ in 0..200 {
                let film = |rng: &mut CounterRng| Vec2::from(rng.next_2d()) * 156.0 + 50.0;
                let [from, to] = [0, 1].map(|_| pixel(&scene, film(&mut rng)));
                let [a, b] = [&from, &to].map(|pixel| pixel.point.position.as_dvec3());
                let ray = Ray::new(a.as_vec3(), UniformSphere::sample(rng.next_2d()));
                let ray = from.point.spawn(ray.direction);
                let Some(point) = scene.intersect(&ray) else {
                    continue;
                };
                let sender = Sender {
                    point,
                    radiance: Rgb::ONE,
                };
                let facing = |x: DVec3| {
                    (x - point.position.as_dvec3())
                        .normalize()
                        .dot(point.geometric_normal.as_dvec3())
                        .abs()
                };
                // Edge-on nothing can be told by differences.
                if facing(a) < 0.05 || facing(b) < 0.05 {
                    continue;
                }
                let Ok(shifted) = shift.shift(&sender, &from, &to) else {
                    return Err("undefined".to_owned());
                };
                let mut found = shifted.jacobian.value();
                let distances = a.distance_squared(point.position.as_dvec3())
                    / b.distance_squared(point.position.as_dvec3());
                match fault {
                    Some(Fault::Cosines) => found = distances,
                    Some(Fault::Distances) => found /= distances,
                    None => (),
                }
                // Tangent coordinates of the directions, about those to x₂.
                let plane = (point.position.as_dvec3(), point.geometric_normal.as_dvec3());
                let frame = |x: DVec3| {
                    let frame = Frame::from_normal((plane.0 - x).normalize().as_vec3());
                    [frame.tangent, frame.bitangent, frame.normal].map(|v| v.as_dvec3().normalize())
                };
                let ([ta, sa, na], [tb, sb, nb]) = (frame(a), frame(b));
                let map = |u: [f64; 2]| {
                    let direction = na + ta * u[0] + sa * u[1];
                    let t = (plane.0 - a).dot(plane.1) / direction.dot(plane.1);
                    let seen = a + direction * t - b;
                    [seen.dot(tb) / seen.dot(nb), seen.dot(sb) / seen.dot(nb)]
                };
                let expected = jacobian_determinant(map, [0.0, 0.0], 1e-3);
                let expected = expected.value.abs();
                if (found / expected - 1.0).abs() > 2e-3 {
                    return Err(format!("{found} for {expected}"));
                }
                let same = |a: &Sender, b: &Sender| a.point.position == b.point.position;
                round_trip(&shift, &sender, &from, &to, same, 1e-6).map_err(|e| format!("{e:?}"))?;
            }
            Ok(())
        })
        .unwrap();
    }
}
