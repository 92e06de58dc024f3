//! Guided, observed and ended paths in batches against the same paths alone.

use super::PathTracer;
use super::ending::{EndingVertex, PathEnding, VertexEnding};
use super::guide::{DirectionGuide, GuidedVertex};
use super::observer::{ObservedPath, PathContribution, PathObserver, PathVertex};
use lightshed_film::{MAX_BATCH, PixelEstimator, SampleId};
use lightshed_lanes::LaneChoice;
use lightshed_sampling::{CounterRng, Density, DirectionDistribution, SolidAngle, VonMisesFisher};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Rgb, Scene, SceneDescription, builtin};
use std::sync::Mutex;

/// A lobe upwards that has no sample for some numbers.
struct Upwards(VonMisesFisher);

impl DirectionDistribution for Upwards {
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let sample = DirectionDistribution::sample(&self.0, u)?;
        (u[0] >= 0.2).then_some(sample)
    }

    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        self.0.pdf(direction)
    }
}

/// Guides in most places, with shares of all kinds.
struct Patchy;

impl DirectionGuide for Patchy {
    type Distribution<'g> = Upwards;

    fn guide(&self, vertex: &GuidedVertex) -> Option<(Upwards, f32)> {
        let place = (vertex.position.x * 40.0).floor() as i32;
        let share = [0.7, f32::NAN, 0.3, 0.0, 2.0, -1.0][place.rem_euclid(6) as usize];
        let axis = (Vec3::Y + 0.3 * vertex.outgoing).normalize();
        (place % 7 != 0).then(|| (Upwards(VonMisesFisher::new(axis, 4.0)), share))
    }
}

/// Ends a third of the paths at each vertex behind the first and weakens another third.
struct Sometimes;

impl PathEnding for Sometimes {
    type Path = u32;

    fn at(&self, vertices: &mut u32, vertex: &EndingVertex) -> VertexEnding {
        *vertices += 1;
        assert_eq!(*vertices, vertex.depth, "vertices come in order");
        let u = CounterRng::at(
            vertex.seed,
            vertex.id.y << 16 | vertex.id.x,
            vertex.id.index,
            1 << 31 | vertex.depth,
        );
        let place = vertex.position + vertex.normal + vertex.distance * vertex.cos_theta;
        VertexEnding {
            radiance: place.abs() * vertex.throughput,
            goes_on: [0.0, 0.6, 1.0][u as usize % 3],
        }
    }
}

type Seen = (SampleId, Rgb, Vec<PathVertex>, Vec<PathContribution>);

/// Writes down three in four of the paths.
#[derive(Default)]
struct Watch(Mutex<Vec<Seen>>);

impl PathObserver for Watch {
    fn wants(&self, id: SampleId, _seed: u64) -> bool {
        !id.index.is_multiple_of(4)
    }

    fn observe(&self, path: &ObservedPath<'_>) {
        let seen = (
            path.id,
            path.radiance,
            path.vertices.to_vec(),
            path.contributions.to_vec(),
        );
        self.0.lock().unwrap().push(seen);
    }
}

impl Watch {
    fn take(&self) -> Vec<Seen> {
        std::mem::take(&mut *self.0.lock().unwrap())
    }
}

/// Values and everything that observers see, bit for bit, on all kinds of lanes and in batches of
/// several sizes: with a guide, with an ending, with both, and with neither.
fn does_not_depend_on_its_batch(description: &SceneDescription) {
    let mut description = description.clone();
    (description.settings.width, description.settings.height) = (8, 8);
    let scene = Scene::new(&description).unwrap();
    let ids: Vec<SampleId> = (0..512)
        .map(|i| SampleId {
            x: i % 8,
            y: i / 8 % 8,
            index: i / 8,
        })
        .collect();
    let watch = Watch::default();
    let plain = || PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(6), 4);
    let held = |sample: &dyn PixelEstimator, batches: &[&dyn PixelEstimator]| {
        let alone: Vec<Rgb> = ids
            .iter()
            .map(|id| sample.sample(id.x, id.y, id.index, 5))
            .collect();
        let expected = watch.take();
        assert_eq!(expected.len(), 3 * ids.len() / 4);
        assert!(expected.iter().any(|(_, _, vertices, _)| vertices.len() > 2));
        for (size, tracer) in [7, MAX_BATCH]
            .iter()
            .flat_map(|size| batches.iter().map(move |t| (size, t)))
        {
            let mut together = vec![Rgb::NAN; ids.len()];
            for (ids, values) in ids.chunks(*size).zip(together.chunks_mut(*size)) {
                tracer.sample_many(ids, 5, values);
            }
            assert_eq!(alone, together, "batches of {size}");
            assert!(expected == watch.take(), "what is seen in batches of {size}");
        }
    };
    macro_rules! held {
        ($tracer:expr) => {{
            let (tracer, mut on_arrays) = ($tracer, $tracer);
            on_arrays.transport.lanes = LaneChoice::ARRAY;
            held(&tracer, &[&tracer, &on_arrays]);
        }};
    }
    held!(plain().with_observer(&watch));
    held!(plain().with_guide(Patchy).with_observer(&watch));
    held!(plain().with_ending(Sometimes).with_observer(&watch));
    held!(
        plain()
            .with_guide(Patchy)
            .with_ending(Sometimes)
            .with_observer(&watch)
    );
}

#[test]
fn guided_and_ended_paths_and_what_is_seen_of_them_do_not_depend_on_their_batch() {
    for description in [
        builtin::cornell(),
        builtin::cornell_glossy(),
        builtin::lighthouse(),
    ] {
        does_not_depend_on_its_batch(&description);
    }
}
