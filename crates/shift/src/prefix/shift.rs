//! The shift of prefixes between pixels.

use super::domain::PrefixDomain;
use super::sample::PrefixSample;
use crate::domain::Start;
use crate::jacobian::MeasuredJacobian;
use crate::numbers::PathNumbers;
use crate::world::{RayKind, Sight, World};
use lightshed_resampling::{ShiftMapping, Shifted, Undefined};
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Density, PrimarySample};

/// Random replay up to the vertex before the last, and reconnection to the last.
///
/// **Jacobian**, in primary sample space: `p(y_{m−1} → x_m) / p(x_{m−1} → x_m)`, densities
/// of the lobe in area measure, as for [`PathShift`](crate::PathShift).
///
/// **Undefined** if the offset prefix would end at another vertex, leaves the scene, or is blocked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrefixShift;

impl<'w, W: World> ShiftMapping<PrefixDomain<'w, W>> for PrefixShift {
    fn shift(
        &self,
        x: &PrefixSample,
        _from: &PrefixDomain<'w, W>,
        to: &PrefixDomain<'w, W>,
    ) -> Result<Shifted<PrefixSample>, Undefined> {
        let (sample, ray) = evaluate(x, to)?;
        let [base, offset] = [x.density, sample.density].map(Density::<PrimarySample>::new);
        let jacobian = MeasuredJacobian::of_copy(base, offset)?;
        if !(sample.throughput.max_element() > 0.0 && sample.throughput.is_finite()) {
            return Err(Undefined::OutsideDomain);
        }
        if to.world().occluded(&ray, RayKind::Reconnection) {
            return Err(Undefined::Occluded);
        }
        Ok(Shifted {
            sample,
            jacobian: jacobian.determinant(),
            target: sample.target(),
        })
    }
}

/// The prefix in the domain `to`, and the segment that must be free.
fn evaluate<W: World>(
    x: &PrefixSample,
    to: &PrefixDomain<'_, W>,
) -> Result<(PrefixSample, W::Ray), Undefined> {
    let world = to.world();
    // Behind the last vertex there must be room for an edge.
    if x.index >= to.max_length() {
        return Err(Undefined::OutsideDomain);
    }
    let mut numbers = PathNumbers::new(x.seed);
    let (mut vertex, mut wo) = match to.start() {
        Start::Vertex { first, wo } => (first.clone(), *wo),
        Start::Sensor(sensor) => {
            let (ray, direction) = world
                .sensor_ray(sensor, numbers.sensor())
                .ok_or(Undefined::OutsideDomain)?;
            let seen = world.trace(&ray, RayKind::Sensor);
            (seen.ok_or(Undefined::OutsideDomain)?, -direction)
        }
    };
    let (mut throughput, mut before) = (Vec3::ONE, None);
    for index in 1..x.index - 1 {
        if to.ends(before, &vertex) {
            return Err(Undefined::NotInvertible);
        }
        let scatter = numbers.scatter(index);
        let sampled = world
            .sample_lobe(&vertex, wo, scatter.lobe, scatter.direction)
            .ok_or(Undefined::OutsideDomain)?;
        throughput *= sampled.scattering.weight();
        before = Some((
            world.position(&vertex),
            world.lobe_roughness(&vertex, sampled.lobe),
        ));
        let next = world.trace(&world.ray(&vertex, sampled.wi), RayKind::Replay);
        vertex = next.ok_or(Undefined::OutsideDomain)?;
        wo = -sampled.wi;
    }
    if to.ends(before, &vertex) {
        return Err(Undefined::NotInvertible);
    }
    let kept = world.vertex(&x.place);
    let left = (world.position(&vertex), world.lobe_roughness(&vertex, x.lobe));
    if !to.rough(left.1) || !to.ends(Some(left), &kept) {
        return Err(Undefined::NotConnectable);
    }
    let sight = Sight::of(world, left.0, &kept);
    let scattering = world.evaluate_lobe(&vertex, wo, sight.direction, x.lobe);
    let sample = PrefixSample {
        density: sight.to_area(scattering.pdf).value(),
        throughput: throughput * scattering.weight(),
        wo: -sight.direction,
        ..*x
    };
    Ok((sample, world.segment(&vertex, &kept)))
}
