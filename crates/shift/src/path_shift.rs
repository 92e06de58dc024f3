//! Random replay, reconnection and their hybrid as one mapping.

use crate::domain::{PathDomain, Start};
use crate::jacobian::MeasuredJacobian;
use crate::mis::{emitter_weight, scattering_weight};
use crate::numbers::PathNumbers;
use crate::sample::{ALL_LOBES, AnchorKind, PathSample, Shape, Technique};
use crate::world::{End, Endpoint, RayKind, Sight, World, max_roughness};
use lightshed_resampling::{Pulled, ShiftMapping, Shifted, Undefined};
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Area, Density, PrimarySample, luminance};

/// The hybrid of random replay and reconnection (Lin 2022 §6.6.4), including its two limiting
/// cases.
///
/// A base path `x₁ x₂ … x_k` reconnects at its first connectable pair `x_{r−1}, x_r`. The
/// offset path starts at its own domain's `y₁`, draws `y₂ … y_{r−1}` with the base path's
/// random numbers, sets `y_r = x_r` with the base path's lobe and keeps the rest. Each domain
/// defines which pairs are connectable ([`Connectability`](crate::Connectability)); this selects
/// the mapping. A path without a connectable pair is replayed to its end.
///
/// **Jacobian**, in primary sample space: replayed vertices have their own random numbers as
/// coordinates, so their factor is 1. The copied vertex has factor 1 in area measure. So only the
/// ratio of densities remains (Lin 2022 eq. 6.54, including the density behind the reconnection,
/// whose incoming direction has changed):
///
/// > `|∂T/∂x̄| = p(y_{r−1} → x_r) / p(x_{r−1} → x_r) · p(ω_r | y_{r−1}) / p(ω_r | x_{r−1})`
///
/// with the first ratio in area measure and all densities joint with the choice of lobe. The second
/// ratio is omitted if `x_r` is on an emitter or the next vertex was found by emitter sampling.
///
/// **Undefined** if the offset path reconnects elsewhere, leaves the scene, or is blocked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathShift {
    jacobian_limit: f64,
}

impl Default for PathShift {
    fn default() -> Self {
        Self {
            jacobian_limit: f64::INFINITY,
        }
    }
}

/// A path as a domain sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Evaluated<R> {
    /// `F` in the domain, without occlusion.
    pub contribution: Vec3,
    /// Counterpart of the sample's density.
    pub density: f32,
    /// What must be free.
    pub ray: Option<R>,
}

impl PathShift {
    /// With a reciprocal gate: undefined if `max(J, 1/J)` exceeds `limit`. This causes no bias,
    /// because every MIS weight sees the gate.
    #[must_use]
    pub fn with_jacobian_limit(self, limit: f64) -> Self {
        Self {
            jacobian_limit: limit,
        }
    }

    /// The sample in the domain `to`, visibility tested.
    fn visible<W: World>(
        &self,
        x: &PathSample,
        to: &PathDomain<'_, W>,
    ) -> Result<(Evaluated<W::Ray>, MeasuredJacobian<PrimarySample>), Undefined> {
        let image = evaluate(x, to)?;
        let [base, offset] = [x.density, image.density].map(Density::<PrimarySample>::new);
        let jacobian = MeasuredJacobian::of_copy(base, offset)?;
        jacobian.determinant().gated(self.jacobian_limit)?;
        let contributes = image.contribution.max_element() > 0.0 && image.contribution.is_finite();
        if !contributes {
            return Err(Undefined::OutsideDomain);
        }
        match &image.ray {
            Some(ray) if to.world.occluded(ray, RayKind::Reconnection) => Err(Undefined::Occluded),
            _ => Ok((image, jacobian)),
        }
    }
}

impl<'w, W: World> ShiftMapping<PathDomain<'w, W>> for PathShift {
    fn shift(
        &self,
        x: &PathSample,
        _from: &PathDomain<'w, W>,
        to: &PathDomain<'w, W>,
    ) -> Result<Shifted<PathSample>, Undefined> {
        let (image, jacobian) = self.visible(x, to)?;
        let sample = PathSample {
            density: image.density,
            contribution: image.contribution.to_array(),
            ..*x
        };
        Ok(Shifted {
            sample,
            jacobian: jacobian.determinant(),
            target: sample.target(),
        })
    }

    fn pull(
        &self,
        y: &PathSample,
        _to: &PathDomain<'w, W>,
        from: &PathDomain<'w, W>,
    ) -> Result<Pulled, Undefined> {
        let (image, jacobian) = self.visible(y, from)?;
        Ok(Pulled {
            jacobian: jacobian.determinant(),
            proxy: f64::from(luminance(image.contribution)),
        })
    }
}

/// An offset path on its way. It stays where it is created: vertices are large.
pub(crate) struct Offset<'a, V> {
    /// The vertex `y₁`.
    first: &'a V,
    /// The latest two vertices behind it: `y_m` at `m % 2`.
    own: [Option<V>; 2],
    /// `m`, the number of the latest vertex.
    last: u32,
    wo: Vec3,
    throughput: Vec3,
    before: Option<Before>,
    /// As of a walk.
    specular: bool,
}

/// The vertex `y_m` that an offset path has reached, by reference or by value, and what the path
/// carries there.
pub(crate) struct Reached<V> {
    pub vertex: V,
    pub wo: Vec3,
    pub throughput: Vec3,
}

impl<V> Reached<V> {
    pub fn by_ref(&self) -> Reached<&V> {
        Reached {
            vertex: &self.vertex,
            wo: self.wo,
            throughput: self.throughput,
        }
    }
}

/// How an offset path left its previous vertex.
struct Before {
    position: Vec3,
    wo: Vec3,
    lobe: u8,
    /// Width of the lobe.
    roughness: f32,
}

impl<'a, V> Offset<'a, V> {
    /// A path that is at its first vertex, seen from `wo`.
    #[inline(always)]
    pub fn at(first: &'a V, wo: Vec3) -> Self {
        Self {
            first,
            own: [None, None],
            last: 1,
            wo,
            throughput: Vec3::ONE,
            before: None,
            specular: false,
        }
    }

    /// The current vertex, `y_m`.
    #[inline(always)]
    fn vertex(&self) -> &V {
        self.own[self.last as usize % 2].as_ref().unwrap_or(self.first)
    }

    /// The vertex before it.
    #[inline(always)]
    fn previous(&self) -> &V {
        self.own[(self.last as usize + 1) % 2]
            .as_ref()
            .unwrap_or(self.first)
    }

    /// The next vertex.
    #[inline(always)]
    pub fn arrive(&mut self, next: Option<V>) {
        self.last += 1;
        self.own[self.last as usize % 2] = next;
    }

    #[inline(always)]
    pub fn reached(&self) -> Reached<&V> {
        Reached {
            vertex: self.vertex(),
            wo: self.wo,
            throughput: self.throughput,
        }
    }

    /// Whether the pair of the previous vertex and the current one, `y_m`, could be reconnected if
    /// the lobe of the current one is `roughness` wide.
    fn connectable<W: World<Vertex = V>>(&self, to: &PathDomain<'_, W>, m: u32, roughness: f32) -> bool {
        let rules = &to.connectability;
        self.before.as_ref().is_some_and(|before| {
            let position = to.world.position(self.vertex());
            let offset = position - before.position;
            let spreads = || {
                let density = before.density(to.world, self.previous(), self.vertex());
                rules.spreads(density)
            };
            rules.reaches(m)
                && rules.rough(before.roughness)
                && rules.returns(roughness, offset.length_squared())
                && rules.far(position, offset)
                && (rules.footprint().is_none() || spreads())
        })
    }
}

impl Before {
    /// With what density the lobe that left `previous` leads to `vertex`.
    fn density<W: World>(&self, world: &W, previous: &W::Vertex, vertex: &W::Vertex) -> Density<Area> {
        let sight = Sight::of(world, self.position, vertex);
        let towards = world.evaluate_lobe(previous, self.wo, sight.direction, self.lobe);
        sight.to_area(towards.pdf)
    }
}

/// Width of a lobe, or of the widest.
fn roughness<W: World>(world: &W, vertex: &W::Vertex, lobe: u8) -> f32 {
    if lobe == ALL_LOBES {
        max_roughness(world, vertex)
    } else {
        world.lobe_roughness(vertex, lobe)
    }
}

/// Follows the sample in the domain `to`.
pub(crate) fn evaluate<W: World>(
    x: &PathSample,
    to: &PathDomain<'_, W>,
) -> Result<Evaluated<W::Ray>, Undefined> {
    let (shape, rules, world) = (x.shape(), &to.connectability, to.world);
    if shape.length > to.max_length || shape.length < to.part.least_length() {
        return Err(Undefined::OutsideDomain);
    }
    let anchored = shape.anchor != AnchorKind::None;
    if anchored && !rules.reaches(shape.reconnection) {
        return Err(Undefined::NotConnectable);
    }
    // The last vertex of the offset path's own.
    let last = if anchored {
        shape.reconnection - 1
    } else {
        shape.length - 1
    };
    let replays = !anchored || last > 1;
    if replays && !rules.replays() {
        return Err(Undefined::NotConnectable);
    }
    let (mut seen, mut numbers) = (None, numbers_of(x, to, replays));
    let (first, wo) = start(to, &mut numbers, &mut seen)?;
    let offset = &mut Offset::at(first, wo);
    approach(to, offset, last, &mut numbers)?;
    // No delta lobe leads to what is copied or sampled; a replayed lobe is yet to come.
    let is_decided = anchored || shape.technique == Technique::Emitter;
    if is_decided && !to.part.has(offset.specular) {
        return Err(Undefined::OutsideDomain);
    }
    if let (false, Some(numbers)) = (anchored, &mut numbers) {
        return match shape.technique {
            Technique::Emitter => replayed_emitter(to, offset, shape, numbers),
            Technique::Scattering => replayed_scattering(to, offset, shape, numbers),
        };
    }
    let rough = roughness(world, offset.vertex(), shape.lobe_before);
    if offset.connectable(to, last, rough) {
        return Err(Undefined::NotInvertible);
    }
    if !rules.rough(rough) {
        return Err(Undefined::NotConnectable);
    }
    let reached = &offset.reached();
    match (shape.anchor, shape.technique) {
        (AnchorKind::Vertex, _) => to_vertex(x, to, reached, shape),
        (_, Technique::Emitter) => to_sampled_emitter(x, to, reached),
        (_, Technique::Scattering) => to_met_emitter(x, to, reached, shape),
    }
}

/// The random numbers of the base path, if the offset path takes any.
pub(crate) fn numbers_of<W: World>(
    x: &PathSample,
    to: &PathDomain<'_, W>,
    replays: bool,
) -> Option<PathNumbers> {
    let from_sensor = matches!(to.start, Start::Sensor(_));
    (replays || from_sensor).then(|| PathNumbers::new(x.seed))
}

/// The first vertex of an offset path, and the direction to the viewer. `seen` keeps the vertex if
/// the domain's is a sensor.
#[inline(always)]
pub(crate) fn start<'a, W: World>(
    to: &'a PathDomain<'_, W>,
    numbers: &mut Option<PathNumbers>,
    seen: &'a mut Option<W::Vertex>,
) -> Result<(&'a W::Vertex, Vec3), Undefined> {
    match (&to.start, numbers) {
        (Start::Vertex { first, wo }, _) => Ok((first, *wo)),
        (Start::Sensor(sensor), Some(numbers)) => {
            let (ray, direction) = to
                .world
                .sensor_ray(sensor, numbers.sensor())
                .ok_or(Undefined::OutsideDomain)?;
            *seen = to.world.trace(&ray, RayKind::Sensor);
            let seen = seen.as_ref().ok_or(Undefined::OutsideDomain)?;
            Ok((seen, -direction))
        }
        (Start::Sensor(_), None) => Err(Undefined::OutsideDomain),
    }
}

/// Follows the offset path to its vertex `y_last` by the random numbers of the base path. A path
/// that takes none is there.
pub(crate) fn approach<W: World>(
    to: &PathDomain<'_, W>,
    offset: &mut Offset<'_, W::Vertex>,
    last: u32,
    numbers: &mut Option<PathNumbers>,
) -> Result<(), Undefined> {
    let Some(numbers) = numbers else { return Ok(()) };
    for m in 1..last {
        let ((ray, _), _) = replay(to, offset, m, numbers)?;
        let next = to.world.trace(&ray, RayKind::Replay);
        if next.is_none() {
            return Err(Undefined::OutsideDomain);
        }
        offset.arrive(next);
    }
    Ok(())
}

/// The lobe by which an offset path left a vertex.
pub(crate) struct Left {
    pub total_pdf: Density<lightshed_sampling::SolidAngle>,
    roughness: f32,
    pub is_delta: bool,
}

/// Scatters at `y_m` with the base path's numbers. Updates `offset` at the same vertex with the
/// data that the next vertex needs.
pub(crate) fn replay<W: World>(
    to: &PathDomain<'_, W>,
    offset: &mut Offset<'_, W::Vertex>,
    m: u32,
    numbers: &mut PathNumbers,
) -> Result<((W::Ray, Vec3), Left), Undefined> {
    let (world, numbers) = (to.world, numbers.scatter(m));
    let vertex = offset.vertex();
    let sampled = world
        .sample_lobe(vertex, offset.wo, numbers.lobe, numbers.direction)
        .ok_or(Undefined::OutsideDomain)?;
    let specular = to
        .part
        .scattered(offset.specular, m, sampled.is_delta)
        .ok_or(Undefined::OutsideDomain)?;
    let roughness = world.lobe_roughness(vertex, sampled.lobe);
    if offset.connectable(to, m, roughness) {
        return Err(Undefined::NotInvertible);
    }
    let ray = world.ray(vertex, sampled.wi);
    let before = Before {
        position: world.position(vertex),
        wo: offset.wo,
        lobe: sampled.lobe,
        roughness,
    };
    offset.throughput *= sampled.scattering.weight();
    if !(offset.throughput.max_element() > 0.0 && offset.throughput.is_finite()) {
        return Err(Undefined::OutsideDomain);
    }
    offset.wo = -sampled.wi;
    offset.before = Some(before);
    offset.specular = specular;
    let left = Left {
        total_pdf: sampled.total_pdf,
        roughness,
        is_delta: sampled.is_delta,
    };
    Ok(((ray, sampled.wi), left))
}

/// A fully replayed path that ends at a sampled emitter.
fn replayed_emitter<W: World>(
    to: &PathDomain<'_, W>,
    offset: &Offset<'_, W::Vertex>,
    shape: Shape,
    numbers: &mut PathNumbers,
) -> Result<Evaluated<W::Ray>, Undefined> {
    let (world, rules, vertex) = (to.world, &to.connectability, offset.vertex());
    let widest = max_roughness(world, vertex);
    if offset.connectable(to, shape.length - 1, widest) {
        return Err(Undefined::NotInvertible);
    }
    let (u_select, u) = numbers.emitter(shape.length - 1);
    let endpoint = world
        .sample_emitter(vertex, u_select, u)
        .ok_or(Undefined::OutsideDomain)?;
    if rules.reaches(shape.length) && rules.rough(widest) && to.far_enough(vertex, offset.wo, &endpoint) {
        return Err(Undefined::NotInvertible);
    }
    let (contribution, _, ray) = sampled_emitter(to, &offset.reached(), &endpoint)?;
    Ok(Evaluated {
        contribution,
        density: 1.0,
        ray: Some(ray),
    })
}

/// The contribution of an emitter's endpoint to an offset path, its density in its own measure, and
/// the segment that must be free.
fn sampled_emitter<W: World>(
    to: &PathDomain<'_, W>,
    reached: &Reached<&W::Vertex>,
    endpoint: &Endpoint,
) -> Result<(Vec3, f32, W::Ray), Undefined> {
    let (world, vertex) = (to.world, reached.vertex);
    let connection = world.connect(vertex, endpoint).ok_or(Undefined::OutsideDomain)?;
    let scattering = world.evaluate(vertex, reached.wo, connection.direction);
    let is_delta = matches!(endpoint, Endpoint::Delta(_));
    let omega = emitter_weight(connection.pdf, scattering.pdf, is_delta);
    let incident = connection.radiance / connection.pdf.value();
    let contribution = reached.throughput * (scattering.value * incident * omega);
    Ok((contribution, connection.own_density.value(), connection.ray))
}

/// A fully replayed path that hits an emitter.
fn replayed_scattering<W: World>(
    to: &PathDomain<'_, W>,
    offset: &mut Offset<'_, W::Vertex>,
    shape: Shape,
    numbers: &mut PathNumbers,
) -> Result<Evaluated<W::Ray>, Undefined> {
    let (world, rules) = (to.world, &to.connectability);
    let site = world.site(offset.vertex());
    let ((ray, direction), left) = replay(to, offset, shape.length - 1, numbers)?;
    let met = world.trace(&ray, RayKind::Replay);
    let far = offset.before.as_ref().is_some_and(|before| match &met {
        Some(met) => {
            let position = world.position(met);
            rules.far(position, position - before.position)
                && (rules.footprint().is_none() || rules.spreads(before.density(world, offset.vertex(), met)))
        }
        None if rules.footprint().is_none() => true,
        None => {
            let towards = world.evaluate_lobe(offset.vertex(), before.wo, direction, before.lobe);
            rules.spreads_out(towards.pdf)
        }
    });
    if rules.reaches(shape.length) && rules.rough(left.roughness) && far {
        return Err(Undefined::NotInvertible);
    }
    let end = End::of(met.as_ref());
    let radiance = end.radiance(world, direction);
    let emitter_pdf = if left.is_delta {
        Density::ZERO
    } else {
        end.emitter_pdf(world, &site, direction, radiance)
    };
    let omega = scattering_weight(left.total_pdf, emitter_pdf);
    Ok(Evaluated {
        contribution: offset.throughput * radiance * omega,
        density: 1.0,
        ray: None,
    })
}

/// Reconnects to a vertex that scatters.
pub(crate) fn to_vertex<W: World>(
    x: &PathSample,
    to: &PathDomain<'_, W>,
    reached: &Reached<&W::Vertex>,
    shape: Shape,
) -> Result<Evaluated<W::Ray>, Undefined> {
    let (world, rules, vertex) = (to.world, &to.connectability, reached.vertex);
    let kept = world.vertex(&x.place());
    let sight = Sight::of(world, world.position(vertex), &kept);
    if !rules.far(sight.position, sight.offset)
        || !rules.returns(roughness(world, &kept, shape.lobe_at), sight.distance_squared)
    {
        return Err(Undefined::NotConnectable);
    }
    let direction = sight.direction;
    let towards = world.evaluate_lobe(vertex, reached.wo, direction, shape.lobe_before);
    let area = sight.to_area(towards.pdf);
    if !rules.spreads(area) {
        return Err(Undefined::NotConnectable);
    }
    let area = area.value();
    let (incident, arriving) = (x.incident(), Vec3::from_array(x.radiance));
    let emitter_pdf = Density::new(x.emitter_pdf);
    let (here, density) = if shape.lobe_at == ALL_LOBES {
        let scattering = world.evaluate(&kept, -direction, incident);
        let omega = emitter_weight(emitter_pdf, scattering.pdf, !emitter_pdf.is_positive());
        (scattering.value * arriving * omega, area)
    } else {
        let scattering = world.evaluate_lobe(&kept, -direction, incident, shape.lobe_at);
        let ends_behind = shape.length == shape.reconnection + 1;
        let omega = if ends_behind && emitter_pdf.is_positive() {
            scattering_weight(world.evaluate(&kept, -direction, incident).pdf, emitter_pdf)
        } else {
            1.0
        };
        let density = area * scattering.pdf.value();
        (scattering.weight() * arriving * omega, density)
    };
    Ok(Evaluated {
        contribution: reached.throughput * towards.weight() * here,
        density,
        ray: Some(world.segment(vertex, &kept)),
    })
}

/// Reconnects to the end of a path that was found by emitter sampling.
fn to_sampled_emitter<W: World>(
    x: &PathSample,
    to: &PathDomain<'_, W>,
    reached: &Reached<&W::Vertex>,
) -> Result<Evaluated<W::Ray>, Undefined> {
    let endpoint = x.endpoint();
    if !to.far_enough(reached.vertex, reached.wo, &endpoint) {
        return Err(Undefined::NotConnectable);
    }
    let (contribution, density, ray) = sampled_emitter(to, reached, &endpoint)?;
    Ok(Evaluated {
        contribution,
        density,
        ray: Some(ray),
    })
}

/// Reconnects to the end of a path that hit an emitter. The density of emitter sampling is that at
/// the offset's vertex.
fn to_met_emitter<W: World>(
    x: &PathSample,
    to: &PathDomain<'_, W>,
    reached: &Reached<&W::Vertex>,
    shape: Shape,
) -> Result<Evaluated<W::Ray>, Undefined> {
    let (world, vertex) = (to.world, reached.vertex);
    let site = world.site(vertex);
    let (met, sight);
    let (direction, end, sight, ray) = match x.endpoint() {
        Endpoint::Direction(direction) => (direction, End::Environment, None, world.ray(vertex, direction)),
        Endpoint::Surface(place) => {
            met = world.vertex(&place);
            sight = Sight::of(world, world.position(vertex), &met);
            if !to.connectability.far(sight.position, sight.offset) {
                return Err(Undefined::NotConnectable);
            }
            let ray = world.segment(vertex, &met);
            (sight.direction, End::Surface(&met), Some(&sight), ray)
        }
        Endpoint::Delta(_) => return Err(Undefined::OutsideDomain),
    };
    let radiance = end.radiance(world, direction);
    let emitter_pdf = end.emitter_pdf(world, &site, direction, radiance);
    let scattering = world.evaluate_lobe(vertex, reached.wo, direction, shape.lobe_before);
    let total_pdf = world.evaluate(vertex, reached.wo, direction).pdf;
    let omega = scattering_weight(total_pdf, emitter_pdf);
    let rules = &to.connectability;
    let (spreads, density) = match sight {
        Some(sight) => {
            let area = sight.to_area(scattering.pdf);
            (rules.spreads(area), area.value())
        }
        None => (rules.spreads_out(scattering.pdf), scattering.pdf.value()),
    };
    if !spreads {
        return Err(Undefined::NotConnectable);
    }
    Ok(Evaluated {
        contribution: reached.throughput * scattering.weight() * radiance * omega,
        density,
        ray: Some(ray),
    })
}
