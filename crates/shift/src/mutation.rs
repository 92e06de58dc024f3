//! Small steps of a path: its reconnection vertex moves.

use crate::domain::PathDomain;
use crate::numbers::PathNumbers;
use crate::path_shift::{Offset, Reached, approach, numbers_of, start, to_vertex};
use crate::sample::{ALL_LOBES, AnchorKind, PathSample, Technique, pack_direction};
use crate::world::{RayKind, Sight, Suffix, SuffixLight, SuffixLimits, World};
use lightshed_resampling::Mutation;
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Density, Frame, UniformCone};

/// Proposes steps of Markov chains for the paths that reservoirs hold (Sawhney et al. 2022,
/// *Decorrelating ReSTIR Samplers via MCMC Mutations*), many at a time.
///
/// **Proposal.** The direction from `y_{r−1}` to the reconnection vertex `y_r` is turned by a small
/// angle, and a ray finds the new vertex `z_r`. The vertices before it stay: they are replayed. So
/// do the lobes at both, the direction `ω_r` behind the vertex, and the random numbers of all that
/// follows. So the radiance that arrives along `ω_r` is traced anew from `z_r`. If the path ends at
/// an emitter that was sampled from `y_r`, one is sampled from `z_r` by the same numbers.
///
/// **Measure.** Turning is symmetric in solid angle, and all else stays as it is in solid angle
/// or in primary sample space. A domain's measure has the densities of its lobes, so
///
/// > `q(z → y) / q(y → z) = p(z_r) p(ω_r | z_r) / (p(y_r) p(ω_r | y_r))`
///
/// in solid angle; the second factor is absent behind a sampled emitter.
///
/// **Target.** `p̂` of the domain, which [`Mutation`] carries. A path is no longer what its own
/// seed's walk would find, but shifts do not need that.
///
/// Paths that reconnect to an emitter or nowhere, and those so long that roulette could have ended
/// them behind the reconnection vertex, get no proposal. What decides it does not change by a
/// step, so the chain stays reversible.
pub struct PathMutator<'d, W: World> {
    roulette_from: u32,
    moves: Vec<Move<'d, W>>,
    rays: Vec<W::Ray>,
    vertices: Vec<Option<W::Vertex>>,
    suffixes: Vec<Suffix<W::Ray, W::Site>>,
    /// Numbers of the moves that the suffixes belong to.
    owners: Vec<usize>,
}

/// A path on its way to a new reconnection vertex.
struct Move<'d, W: World> {
    item: usize,
    sample: PathSample,
    domain: &'d PathDomain<'d, W>,
    /// The vertex before the reconnection vertex.
    before: Reached<W::Vertex>,
    /// Density of the old vertex, in area measure, of a density of 1 in solid angle.
    old_area: f32,
    vertex: Option<W::Vertex>,
}

/// Least and largest angle of turns, in radians; their logarithm is uniform.
const TURNS: [f32; 2] = [0.01, 0.8];

/// A direction turned by an angle whose largest value is chosen by the last number.
fn turned(direction: Vec3, [u, v, size]: [f32; 3]) -> Vec3 {
    let angle = TURNS[0] * (TURNS[1] / TURNS[0]).powf(size);
    let one_minus_cos = 2.0 * (0.5 * angle).sin().powi(2);
    let local = UniformCone::from_one_minus_cos(one_minus_cos).sample([u, v]);
    Frame::from_normal(direction)
        .to_world(local)
        .normalize_or(direction)
}

impl<'d, W: World> PathMutator<'d, W> {
    /// For candidates whose walks roulette may end from vertex number `roulette_from` on, as
    /// [`TreeTracer`](crate::TreeTracer) has it.
    pub fn new(roulette_from: u32) -> Self {
        Self {
            roulette_from,
            moves: Vec::new(),
            rays: Vec::new(),
            vertices: Vec::new(),
            suffixes: Vec::new(),
            owners: Vec::new(),
        }
    }

    /// Proposes a step for each domain and path of it, by three uniform numbers. Calls `visit` with
    /// the number of the path for those that get one, in an order that depends on the paths alone.
    pub fn propose(
        &mut self,
        paths: impl IntoIterator<Item = (&'d PathDomain<'d, W>, PathSample, [f32; 3])>,
        mut visit: impl FnMut(usize, Mutation<PathSample>),
    ) {
        self.moves.clear();
        self.rays.clear();
        for (item, (domain, sample, u)) in paths.into_iter().enumerate() {
            self.depart(item, domain, sample, u);
        }
        let Some(world) = self.moves.first().map(|moved| moved.domain.world) else {
            return;
        };
        self.vertices.clear();
        self.vertices.resize(self.rays.len(), None);
        world.trace_many(&self.rays, RayKind::Path, &mut self.vertices);
        let (mut longest, mut last) = (0, 0);
        for (moved, vertex) in self.moves.iter_mut().zip(self.vertices.drain(..)) {
            let shape = moved.sample.shape();
            moved.vertex = vertex;
            if shape.lobe_at != ALL_LOBES {
                longest = longest.max(shape.length);
                last = last.max(shape.reconnection);
            } else if let Some(mutation) = to_emitter(moved) {
                visit(moved.item, mutation);
            }
        }
        for reconnection in 2..=last {
            self.leave(world, reconnection);
            let limits = SuffixLimits {
                first: reconnection + 1,
                max_length: longest,
                roulette_from: self.roulette_from,
            };
            let (owners, moves) = (&self.owners, &self.moves);
            let mut arrive = |number: usize, light: SuffixLight| {
                let moved = &moves[owners[number]];
                if let Some(mutation) = behind(moved, &light) {
                    visit(moved.item, mutation);
                }
            };
            if !world.trace_suffixes(&self.suffixes, limits, &mut arrive) {
                for (number, suffix) in self.suffixes.iter().enumerate() {
                    let mut arrive = |light| arrive(number, light);
                    crate::trace_suffix(world, suffix, limits, &mut arrive);
                }
            }
        }
    }

    /// The ray to a new reconnection vertex.
    fn depart(&mut self, item: usize, domain: &'d PathDomain<'d, W>, sample: PathSample, u: [f32; 3]) {
        let (shape, world) = (sample.shape(), domain.world);
        if shape.anchor != AnchorKind::Vertex || shape.length > self.roulette_from {
            return;
        }
        let last = shape.reconnection - 1;
        let (mut seen, mut numbers) = (None, numbers_of(&sample, domain, last > 1));
        let Ok((first, wo)) = start(domain, &mut numbers, &mut seen) else {
            return;
        };
        let offset = &mut Offset::at(first, wo);
        if approach(domain, offset, last, &mut numbers).is_err() {
            return;
        }
        let Reached {
            vertex,
            wo,
            throughput,
        } = offset.reached();
        let sight = Sight::of(world, world.position(vertex), &world.vertex(&sample.place()));
        self.rays.push(world.ray(vertex, turned(sight.direction, u)));
        self.moves.push(Move {
            item,
            sample,
            domain,
            old_area: sight.to_area(Density::new(1.0)).value(),
            before: Reached {
                vertex: vertex.clone(),
                wo,
                throughput,
            },
            vertex: None,
        });
    }

    /// The suffixes behind all new vertices of this number.
    fn leave(&mut self, world: &W, reconnection: u32) {
        self.suffixes.clear();
        self.owners.clear();
        for (number, moved) in self.moves.iter().enumerate() {
            let shape = moved.sample.shape();
            if shape.lobe_at == ALL_LOBES || shape.reconnection != reconnection {
                continue;
            }
            let Some(vertex) = &moved.vertex else { continue };
            let direction = moved.sample.incident();
            let sight = Sight::of(world, world.position(&moved.before.vertex), vertex);
            let total = world.evaluate(vertex, -sight.direction, direction);
            let lobe = world.evaluate_lobe(vertex, -sight.direction, direction, shape.lobe_at);
            if lobe.weight() == Vec3::ZERO {
                continue;
            }
            self.suffixes.push(Suffix {
                ray: world.ray(vertex, direction),
                direction,
                site: world.site(vertex),
                total_pdf: total.pdf,
                seed: moved.sample.seed(),
                importance: 1.0,
            });
            self.owners.push(number);
        }
    }
}

/// The step of a path that ends at an emitter sampled from the reconnection vertex.
fn to_emitter<W: World>(moved: &Move<'_, W>) -> Option<Mutation<PathSample>> {
    let (world, vertex) = (moved.domain.world, moved.vertex.as_ref()?);
    let shape = moved.sample.shape();
    let mut numbers = PathNumbers::new(moved.sample.seed());
    let (u_select, u) = numbers.emitter(shape.reconnection);
    let endpoint = world.sample_emitter(vertex, u_select, u)?;
    let connection = world.connect(vertex, &endpoint)?;
    let is_delta = matches!(endpoint, crate::Endpoint::Delta(_));
    let incident = connection.radiance / connection.pdf.value();
    let sample = PathSample {
        incident: pack_direction(connection.direction),
        radiance: incident.to_array(),
        emitter_pdf: if is_delta { 0.0 } else { connection.pdf.value() },
        ..moved.sample
    };
    let mutation = finish(moved, sample)?;
    (!world.occluded(&connection.ray, RayKind::Emitter)).then_some(mutation)
}

/// The step of a path for light behind its new reconnection vertex, if it is the path's.
fn behind<W: World>(moved: &Move<'_, W>, light: &SuffixLight) -> Option<Mutation<PathSample>> {
    let shape = moved.sample.shape();
    let (length, technique, radiance, emitter_pdf) = match *light {
        SuffixLight::Met {
            radiance,
            emitter_pdf,
        } => (
            shape.reconnection + 1,
            Technique::Scattering,
            radiance,
            emitter_pdf,
        ),
        SuffixLight::Scattered {
            length,
            is_sampled_emitter: true,
            radiance,
        } => (length, Technique::Emitter, radiance, Density::ZERO),
        SuffixLight::Scattered { length, radiance, .. } => {
            (length, Technique::Scattering, radiance, Density::ZERO)
        }
    };
    if (length, technique) != (shape.length, shape.technique) {
        return None;
    }
    let sample = PathSample {
        radiance: radiance.to_array(),
        emitter_pdf: emitter_pdf.value(),
        ..moved.sample
    };
    finish(moved, sample)
}

/// The path by way of its new vertex.
fn finish<W: World>(moved: &Move<'_, W>, sample: PathSample) -> Option<Mutation<PathSample>> {
    let (world, vertex) = (moved.domain.world, moved.vertex.as_ref()?);
    let sample = sample.moved_to(world.place(vertex));
    let image = to_vertex(&sample, moved.domain, &moved.before.by_ref(), sample.shape()).ok()?;
    if !(image.contribution.max_element() > 0.0 && image.contribution.is_finite()) {
        return None;
    }
    let sight = Sight::of(world, world.position(&moved.before.vertex), vertex);
    let new_area = sight.to_area(Density::new(1.0)).value();
    let solid_angle = |density: f32, area: f32| f64::from(density) / f64::from(area);
    let sample = PathSample {
        density: image.density,
        contribution: image.contribution.to_array(),
        ..sample
    };
    Some(Mutation {
        target: sample.target(),
        ratio: solid_angle(sample.density, new_area) / solid_angle(moved.sample.density, moved.old_area),
        sample,
    })
}
