//! The rays that a path tracer asks for, in the batches in which it does.

use lightshed::sampling::CounterRng;
use lightshed::scene::glam::Vec2;
use lightshed::scene::{HitBatch, Ray, RayBatch, Scene, SurfacePoint};

/// Rays that are asked for at once: not more than a batch holds.
#[derive(Clone)]
pub struct Batch {
    pub rays: RayBatch,
    pub count: usize,
}

impl Batch {
    const EMPTY: Self = Self {
        rays: RayBatch::NOWHERE,
        count: 0,
    };

    fn push(&mut self, ray: &Ray) {
        self.rays.set(self.count, ray);
        self.count += 1;
    }
}

/// Batches by kind, each in the order in which they are asked for.
pub struct Streams {
    /// From the camera, the samples of a pixel one after the other.
    pub camera: Vec<Batch>,
    /// In directions sampled from BSDFs.
    pub bounces: Vec<Batch>,
    /// Segments to points on emitters, or rays to emitters at infinity.
    pub shadows: Vec<Batch>,
}

/// How paths are traced.
pub struct Paths {
    /// Longest path in edges, without roulette. The last edge is not among the rays: the path
    /// tracer asks for emitters alone there.
    pub max_depth: u32,
    /// Samples a pixel.
    pub samples: u32,
    /// About how many rays of a kind are kept, in batches from all over the image.
    pub rays: usize,
}

/// Edge of the tiles in which the render loop goes through an image.
const TILE: u32 = 8;

/// Traces paths and keeps their rays.
pub fn record(scene: &Scene, paths: &Paths) -> Streams {
    let starts = samples_in_order(scene, paths.samples);
    let chunks: Vec<&[[u32; 3]]> = starts.chunks(RayBatch::CAPACITY).collect();
    let wanted = paths.rays.div_ceil(RayBatch::CAPACITY);
    let traced: Vec<Streams> = spread(&chunks, wanted)
        .map(|starts| follow(scene, starts, paths.max_depth))
        .collect();
    Streams {
        camera: gather(&traced, |streams| &streams.camera, paths.rays),
        bounces: gather(&traced, |streams| &streams.bounces, paths.rays),
        shadows: gather(&traced, |streams| &streams.shadows, paths.rays),
    }
}

/// About `wanted` rays of a kind, by all depths of some paths.
fn gather(traced: &[Streams], kind: fn(&Streams) -> &[Batch], wanted: usize) -> Vec<Batch> {
    let all: usize = traced.iter().flat_map(kind).map(|batch| batch.count).sum();
    let streams = (traced.len() * wanted).div_ceil(all.max(1));
    spread(traced, streams).flat_map(kind).cloned().collect()
}

/// `wanted` items spread evenly, or all if they are fewer.
fn spread<T>(items: &[T], wanted: usize) -> impl Iterator<Item = &T> {
    let count = wanted.min(items.len());
    (0..count).map(move |number| &items[number * items.len() / count])
}

/// Pixel and sample of each camera ray.
fn samples_in_order(scene: &Scene, samples: u32) -> Vec<[u32; 3]> {
    let (width, height) = (scene.settings().width, scene.settings().height);
    let mut order = Vec::new();
    for top in (0..height).step_by(TILE as usize) {
        for left in (0..width).step_by(TILE as usize) {
            for y in top..height.min(top + TILE) {
                for x in left..width.min(left + TILE) {
                    order.extend((0..samples).map(|sample| [x, y, sample]));
                }
            }
        }
    }
    order
}

/// Traces the paths of one batch.
fn follow(scene: &Scene, starts: &[[u32; 3]], max_depth: u32) -> Streams {
    let mut streams = Streams {
        camera: Vec::new(),
        bounces: Vec::new(),
        shadows: Vec::new(),
    };
    let mut numbers: Vec<CounterRng> = Vec::new();
    let mut batch = Batch::EMPTY;
    for &[x, y, sample] in starts {
        let mut numbers_of_path = CounterRng::new(0, y << 16 | x, sample);
        let film = Vec2::new(x as f32, y as f32) + Vec2::from(numbers_of_path.next_2d());
        batch.push(&scene.camera().ray(film, numbers_of_path.next_2d()));
        numbers.push(numbers_of_path);
    }
    let mut hits = HitBatch::NONE;
    for depth in 1..max_depth {
        if batch.count == 0 {
            break;
        }
        scene
            .accelerator()
            .intersect_batch(&batch.rays, batch.count, &mut hits);
        let (mut next, mut shadows) = (Batch::EMPTY, Batch::EMPTY);
        let mut going_on = Vec::new();
        for (index, mut numbers) in numbers.drain(..).enumerate() {
            let Some(hit) = hits.get(index) else {
                continue;
            };
            let ray = batch.rays.get(index);
            let (shadow, bounce) = scatter(scene, &ray, &scene.surface(&ray, &hit), &mut numbers);
            if let Some(shadow) = shadow {
                shadows.push(&shadow);
            }
            if let Some(bounce) = bounce {
                next.push(&bounce);
                going_on.push(numbers);
            }
        }
        match depth {
            1 => streams.camera.push(batch),
            _ => streams.bounces.push(batch),
        }
        if shadows.count > 0 {
            streams.shadows.push(shadows);
        }
        (batch, numbers) = (next, going_on);
    }
    streams
}

/// The shadow ray and the next ray at a point.
fn scatter(
    scene: &Scene,
    ray: &Ray,
    point: &SurfacePoint,
    numbers: &mut CounterRng,
) -> (Option<Ray>, Option<Ray>) {
    let bsdf = scene.bsdf(point);
    let wo = point.shading.to_local(-ray.direction);
    let (select, towards) = (numbers.next_u64(), numbers.next_2d());
    let light = scene
        .emitters_by_power()
        .sample(point.position, select, towards)
        .filter(|_| bsdf.has_non_delta())
        .filter(|light| {
            let scattered = bsdf.evaluate(wo, point.shading.to_local(light.direction));
            (scattered.value * light.weight).max_element() > 0.0
        });
    let (lobe, direction) = (numbers.next_f32(), numbers.next_2d());
    let bounce = bsdf
        .sample(wo, lobe, Vec2::from(direction))
        .map(|sample| point.spawn(point.shading.to_world(sample.wi)));
    (light.map(|light| light.shadow_ray(point)), bounce)
}
