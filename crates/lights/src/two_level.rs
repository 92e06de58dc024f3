//! Light trees of light trees.
//!
//! Each mesh of lights has its own perfect tree, and the placed meshes, *instances*, are the leaves
//! of another tree (Lin 2022 §4.3.1). This respects meshes of very different sizes, which one
//! Morton curve through all lights cuts apart. A mesh may be placed many times at the cost of one.
//! When things move, only the tree of instances is rebuilt.

use crate::descent::{choice, descend, probability_onwards};
use crate::instance::LightInstance;
use crate::normals::NormalBall;
use crate::perfect::PerfectTree;
use crate::traversal::TraversalState;
use crate::tree::Tree;
use crate::weighing::Receiver;
use crate::{Light, LightChoice, LightError, LightSampler, OrientationCone};
use glam::Vec3;
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};
use std::f32::consts::{FRAC_PI_2, PI};
use std::fmt;

/// Why a two-level tree is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TwoLevelError {
    /// The lights of this mesh.
    Mesh(usize, LightError),
    /// The instances as lights: none, too many, not finite, or too bright together.
    Instances(LightError),
    /// This instance is of no mesh.
    NoSuchMesh(usize),
    /// The rotation, translation or scale of this instance.
    Placement(usize),
}

impl fmt::Display for TwoLevelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mesh(mesh, _) => write!(f, "light mesh {mesh} is not sound"),
            Self::Instances(_) => write!(f, "the instances of light meshes are not sound together"),
            Self::NoSuchMesh(instance) => write!(f, "instance {instance} is of a mesh that does not exist"),
            Self::Placement(instance) => write!(
                f,
                "instance {instance} needs a unit rotation, a finite translation and a positive scale"
            ),
        }
    }
}

impl std::error::Error for TwoLevelError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Mesh(_, error) | Self::Instances(error) => Some(error),
            _ => None,
        }
    }
}

/// A perfect tree of instances of perfect trees.
///
/// Lights are numbered instance by instance: those of instance 0 first, in the order of its mesh.
///
/// ```
/// use lightshed_lights::glam::Vec3;
/// use lightshed_lights::{Bounds, Light, LightInstance, LightSampler, ShadingPoint, TwoLevelTree};
///
/// let bounds = |x: f32| Bounds::of_point(Vec3::new(x, 0.0, 0.0));
/// let lamp = |x: f32| Light { bounds: bounds(x), intensity: 1.0, cone: None };
/// let chain = [lamp(0.0), lamp(1.0), lamp(2.0)];
/// let hung = |height| LightInstance {
///     translation: Vec3::new(0.0, height, 0.0),
///     ..LightInstance::at_rest(0)
/// };
/// let tree = TwoLevelTree::new(&[&chain], &[hung(3.0), hung(9.0)])?;
///
/// let at = ShadingPoint::new(Vec3::ZERO, Vec3::Y, 1.0);
/// let pmf: Vec<f32> = (0..6).map(|light| tree.pmf(&at, light)).collect();
/// assert!((pmf.iter().sum::<f32>() - 1.0).abs() < 1e-6 && pmf[0] > pmf[3]);
/// # Ok::<(), lightshed_lights::TwoLevelError>(())
/// ```
#[derive(Clone, Debug)]
pub struct TwoLevelTree {
    meshes: Vec<PerfectTree>,
    /// Each mesh as one light.
    roots: Vec<Light>,
    instances: Vec<LightInstance>,
    /// Number of the first light of each instance, and the number of all.
    first_light: Vec<u32>,
    /// Instances as lights.
    outsides: Vec<Light>,
    top: PerfectTree,
}

impl TwoLevelTree {
    /// Builds the trees of all meshes and that of the instances.
    ///
    /// # Errors
    ///
    /// See [`TwoLevelError`].
    pub fn new(meshes: &[&[Light]], instances: &[LightInstance]) -> Result<Self, TwoLevelError> {
        let build = |(index, lights): (usize, &&[Light])| {
            PerfectTree::new(lights).map_err(|error| TwoLevelError::Mesh(index, error))
        };
        let meshes: Vec<PerfectTree> = meshes.iter().enumerate().map(build).collect::<Result<_, _>>()?;
        let mut tree = Self {
            roots: meshes.iter().map(root_light).collect(),
            meshes,
            instances: Vec::new(),
            first_light: Vec::new(),
            outsides: Vec::new(),
            top: PerfectTree::default(),
        };
        tree.place(instances)?;
        Ok(tree)
    }

    /// Moves the meshes: builds the tree of instances again, reusing its memory unless there are
    /// more than ever before.
    ///
    /// # Errors
    ///
    /// See [`TwoLevelError`]; the tree is then unchanged.
    pub fn place(&mut self, instances: &[LightInstance]) -> Result<(), TwoLevelError> {
        let mut lights = 0;
        for (index, instance) in instances.iter().enumerate() {
            let Some(mesh) = self.meshes.get(instance.mesh as usize) else {
                return Err(TwoLevelError::NoSuchMesh(index));
            };
            if !instance.is_valid() {
                return Err(TwoLevelError::Placement(index));
            }
            lights += mesh.lights();
        }
        if lights > crate::MAX_LIGHTS {
            return Err(TwoLevelError::Instances(LightError::TooMany(lights)));
        }
        self.outsides.clear();
        self.outsides.extend(
            instances
                .iter()
                .map(|instance| instance.light(&self.roots[instance.mesh as usize])),
        );
        self.top
            .rebuild(&self.outsides)
            .map_err(TwoLevelError::Instances)?;
        self.instances.clear();
        self.instances.extend_from_slice(instances);
        self.first_light.clear();
        let mut first = 0;
        for instance in instances {
            self.first_light.push(first);
            first += self.meshes[instance.mesh as usize].lights() as u32;
        }
        self.first_light.push(first);
        Ok(())
    }
}

/// A mesh as one light.
fn root_light(mesh: &PerfectTree) -> Light {
    let root = mesh.root_node();
    Light {
        bounds: root.bounds,
        intensity: root.intensity,
        cone: Some(cone_of(&NormalBall::unpack(root.normals))),
    }
}

/// A cone around the unit vectors of a ball: `|n − v| ≤ ρ` is
/// `n·v ≥ (1 + |v|² − ρ²) / 2`.
fn cone_of(ball: &NormalBall) -> OrientationCone {
    let length = ball.center.length();
    let cos = (1.0 + length * length - ball.radius * ball.radius) / (2.0 * length);
    let normals_angle = if length > 1e-3 && cos < 1.0 {
        // Rounded outwards; an arc cosine is worst where it is small.
        (cos.max(-1.0).acos() + 1e-3).min(PI)
    } else if length > 1e-3 {
        1e-3
    } else {
        PI
    };
    OrientationCone {
        axis: ball.center.normalize_or(Vec3::Z),
        normals_angle,
        emission_angle: FRAC_PI_2,
    }
}

impl<R: Receiver> LightSampler<R> for TwoLevelTree {
    fn light_count(&self) -> usize {
        self.first_light.last().map_or(0, |&count| count as usize)
    }

    #[inline]
    fn sample(&self, at: &R, u: u64) -> Option<LightChoice> {
        LaneChoice::best().run(Sample { tree: self, at, u })
    }

    #[inline]
    fn pmf(&self, at: &R, light: u32) -> f32 {
        LaneChoice::best().run(Pmf {
            tree: self,
            at,
            light,
        })
    }
}

struct Sample<'a, R> {
    tree: &'a TwoLevelTree,
    at: &'a R,
    u: u64,
}

impl<R: Receiver> LaneKernel for Sample<'_, R> {
    type Output = Option<LightChoice>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { tree, at, u } = self;
        if at.is_black() {
            return None;
        }
        let mut state = TraversalState::new(u);
        let index = descend::<L, _, R>(&tree.top, at, &mut state)? as usize;
        let instance = &tree.instances[index];
        let light = descend::<L, _, R>(
            &tree.meshes[instance.mesh as usize],
            &at.in_mesh(instance),
            &mut state,
        )?;
        choice(tree.first_light[index] + light, state.probability)
    }
}

struct Pmf<'a, R> {
    tree: &'a TwoLevelTree,
    at: &'a R,
    light: u32,
}

impl<R: Receiver> LaneKernel for Pmf<'_, R> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        let Self { tree, at, light } = self;
        let exists = tree.first_light.last().is_some_and(|&count| light < count);
        if at.is_black() || !exists {
            return 0.0;
        }
        let index = tree.first_light.partition_point(|&first| first <= light) - 1;
        let instance = &tree.instances[index];
        let top = probability_onwards::<L, _, R>(1.0, &tree.top, at, index as u32);
        let mesh = &tree.meshes[instance.mesh as usize];
        let within = light - tree.first_light[index];
        probability_onwards::<L, _, R>(top, mesh, &at.in_mesh(instance), within) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ShadingPoint;
    use crate::properties::enumerate;
    use crate::testing::{LAYOUTS, Layout, lights_of, points, segments};
    use crate::weighing::Sealed;
    use glam::Quat;
    use lightshed_sampling::CounterRng;

    fn instances() -> Vec<LightInstance> {
        (0..9u32)
            .map(|i| {
                let mut rng = CounterRng::new(5, i, 0);
                let mut number = || 2.0 * rng.next_f32() - 1.0;
                LightInstance {
                    mesh: i % 3,
                    rotation: Quat::from_xyzw(number(), number(), number(), number()).normalize(),
                    translation: Vec3::new(number(), number(), number()) * 3.0,
                    scale: 0.2 + number().abs(),
                }
            })
            .collect()
    }

    fn tree_of(layout: Layout) -> TwoLevelTree {
        let meshes = [1, 20, 77].map(|count| lights_of(layout, count, 3));
        TwoLevelTree::new(&[&meshes[0], &meshes[1], &meshes[2]], &instances()).unwrap()
    }

    fn check<R: Receiver>(tree: &TwoLevelTree, at: &R) {
        let count = LightSampler::<R>::light_count(tree) as u32;
        let sum: f64 = (0..count).map(|light| f64::from(tree.pmf(at, light))).sum();
        let mut found = 0u32;
        for i in 0..500u64 {
            if let Some(chosen) = tree.sample(at, (u64::MAX / 500) * i) {
                assert_eq!(chosen.pmf.to_bits(), tree.pmf(at, chosen.light).to_bits());
                found += 1;
            }
        }
        // Numbers on a grid: what finds no light is the rest of the probability, up to steps of the
        // grid.
        assert!(sum < 1.0 + 1e-6, "{sum}");
        assert!(
            (sum - f64::from(found) / 500.0).abs() < 0.03,
            "{sum}, {found} of 500"
        );
        assert_eq!(tree.pmf(at, count), 0.0);
    }

    #[test]
    fn probabilities_add_up_and_agree_with_samples() {
        for layout in LAYOUTS {
            let tree = tree_of(layout);
            let lights = lights_of(layout, 77, 3);
            points(&lights, 16, 8).iter().for_each(|at| check(&tree, at));
            segments(3, 2).iter().for_each(|at| check(&tree, at));
        }
    }

    /// With 4,096 lights: the sum over all of them and, by visiting every branch of both levels, of
    /// none is one.
    #[test]
    fn probabilities_of_lights_and_of_none_add_up() {
        for layout in LAYOUTS {
            let meshes = [1, 500, 1300].map(|count| lights_of(layout, count, 3));
            let placed: Vec<LightInstance> = instances().into_iter().take(7).collect();
            let tree = TwoLevelTree::new(&[&meshes[0], &meshes[1], &meshes[2]], &placed).unwrap();
            let count = LightSampler::<ShadingPoint>::light_count(&tree) as u32;
            assert!(count > 3600 && count <= 4096, "{count}");
            for at in points(&meshes[1], 6, 8) {
                let (instances, mut none) = enumerate(&tree.top, &at);
                let mut expected = Vec::new();
                for (instance, here) in tree.instances.iter().zip(instances) {
                    let mesh = &tree.meshes[instance.mesh as usize];
                    let (lights, dead) = enumerate(mesh, &at.in_mesh(instance));
                    expected.extend(lights.into_iter().map(|light| here * light));
                    none += here * dead;
                }
                let mut sum = 0.0;
                for (light, expected) in (0..count).zip(expected) {
                    let pmf = f64::from(tree.pmf(&at, light));
                    assert!(
                        (pmf - expected).abs() <= 1e-6 * expected + 1e-30,
                        "{pmf} is not {expected}"
                    );
                    sum += pmf;
                }
                assert!(
                    (sum + none - 1.0).abs() < 1e-6,
                    "{layout:?}: {sum} + {none} is not 1"
                );
            }
        }
    }

    /// Choices in a batch are those made alone, bit for bit.
    #[test]
    fn batches_change_no_choice() {
        let tree = tree_of(Layout::Clustered);
        let at = points(&lights_of(Layout::Clustered, 77, 3), 40, 8);
        let u: Vec<u64> = (0..40).map(|i| i * (u64::MAX / 40)).collect();
        let mut choices = vec![None; 40];
        tree.sample_each(&at, &u, &mut choices);
        for (i, at) in at.iter().enumerate() {
            assert_eq!(choices[i], tree.sample(at, u[i]));
            let mut together = vec![None; 40];
            tree.sample_many(at, &u, &mut together);
            for (&u, together) in u.iter().zip(together) {
                assert_eq!(together, tree.sample(at, u));
            }
        }
    }

    /// Within an instance, lights keep the ratios that they have at rest.
    #[test]
    fn an_instance_is_its_mesh_moved() {
        let lights = lights_of(Layout::Uniform, 50, 3);
        let (mesh, moved) = (PerfectTree::new(&lights).unwrap(), instances()[4]);
        let moved = LightInstance { mesh: 0, ..moved };
        let tree = TwoLevelTree::new(&[&lights], &[moved]).unwrap();
        for at in points(&lights, 20, 1) {
            let local = at.in_mesh(&moved);
            for light in 0..50 {
                assert_eq!(tree.pmf(&at, light), mesh.pmf(&local, light));
            }
        }
    }

    #[test]
    fn what_cannot_be_placed_is_refused() {
        let lights = lights_of(Layout::Uniform, 5, 3);
        let mut tree = TwoLevelTree::new(&[&lights], &[LightInstance::at_rest(0)]).unwrap();
        assert_eq!(
            tree.place(&[LightInstance::at_rest(1)]),
            Err(TwoLevelError::NoSuchMesh(0))
        );
        let flat = LightInstance {
            scale: 0.0,
            ..LightInstance::at_rest(0)
        };
        assert_eq!(tree.place(&[flat]), Err(TwoLevelError::Placement(0)));
        assert_eq!(tree.place(&[]), Err(TwoLevelError::Instances(LightError::Empty)));
        assert_eq!(tree.instances.len(), 1);
    }
}
