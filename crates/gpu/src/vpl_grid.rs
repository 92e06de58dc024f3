//! Virtual point lights by a lighting grid on the device.

use crate::bindings::{
    BoundGroup, FilterBindings, GatherBindings, LightingGridBindings, SceneBindings, Table,
};
use crate::path_tracer::groups_of;
use crate::programs::{SHADOW_FILTER, VPL_GRID};
use crate::scene::Settings;
use crate::{
    BegunFrame, Buffer, Gpu, GpuError, GpuLightingGrid, GpuMethod, GpuScene, Kernel, LightingGridBuilder,
};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::{ShadowTargets, VplGrid, VplGridOptions, VplSet};
use lightshed_lights::{GridOptions, Levels, LightingGrid};
use lightshed_scene::Scene;

/// Direct light, and indirect light of virtual point lights by a lighting grid hierarchy: the
/// method of `lightshed_integrator::VplGrid`.
///
/// Light paths are the library's, traced by the host; the hierarchy over the lights they leave is
/// built on the device, which gathers, tests shadows and filters them. Random numbers are the
/// host's, sums of weights are `f32`: choices of lights are the host's but where two are close, and
/// values the same to what look-ups round.
///
/// With [`Levels::Auto`] the levels are those that the library takes for the lights of the first
/// frame. Blocks of pixels are not interleaved.
pub struct GpuVplGrid<'a> {
    gpu: &'a Gpu,
    scene: &'a Scene,
    on_device: &'a GpuScene,
    bound: BoundGroup,
    options: VplGridOptions,
    set: VplSet,
    builder: LightingGridBuilder,
    grid: Option<GpuLightingGrid>,
    lights: Option<Buffer>,
    gather: Kernel,
    filter: Kernel,
    combine: Kernel,
    memory: Memory,
    /// What each iteration of the filter is told.
    taps: Vec<Buffer>,
}

/// What the programs bind.
pub(crate) const GATHER_TABLES: [Table; 3] = [
    SceneBindings::TABLE,
    LightingGridBindings::TABLE,
    GatherBindings::TABLE,
];
pub(crate) const FILTER_TABLES: [Table; 1] = [FilterBindings::TABLE];

struct Memory {
    settings: Buffer,
    pixels: Buffer,
    visibility: [Buffer; 2],
    image: Buffer,
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Asked {
    frame: u32,
    first_level: u32,
    shadow_samples: u32,
    spread: u32,
    least_distance_squared: f32,
    has_lights: u32,
    padding: [u32; 2],
}

// As in the shader; held to it by a test.
const _: () = assert!(size_of::<Asked>() == 32);

/// Bytes of a pixel between the passes.
const PIXEL_BYTES: u64 = 64;
/// Bytes of the share of lights that a pixel sees.
const VISIBILITY_BYTES: u64 = 4;
/// Bytes of a pixel of the image.
const IMAGE_BYTES: u64 = 16;
/// Most levels of a hierarchy on the device.
const MAX_LEVELS: u32 = 10;

impl<'a> GpuVplGrid<'a> {
    /// Bytes on the device for each pixel: what it sees, the share of lights twice, and the image.
    /// The lights and [their hierarchy](GpuLightingGrid::bytes) come on top.
    pub const BYTES_PER_PIXEL: u64 = PIXEL_BYTES + 2 * VISIBILITY_BYTES + IMAGE_BYTES;

    /// For a scene and its copy on the device.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for options that the library refuses, interleaving, or more than 10
    /// levels; [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn new(
        gpu: &'a Gpu,
        scene: &'a Scene,
        on_device: &'a GpuScene,
        options: VplGridOptions,
    ) -> Result<Self, GpuError> {
        Self::of_programs(gpu, scene, on_device, options, [VPL_GRID, SHADOW_FILTER])
    }

    fn of_programs(
        gpu: &'a Gpu,
        scene: &'a Scene,
        on_device: &'a GpuScene,
        options: VplGridOptions,
        [gathering, filtering]: [&str; 2],
    ) -> Result<Self, GpuError> {
        on_device.refuse_media()?;
        on_device.refuse_part_of_a_sky("vpl-grid")?;
        on_device.refuse_deltas("vpl-grid")?;
        on_device.refuse_dielectrics("vpl-grid")?;
        // The library's own checks.
        if let Err(error) = VplGrid::new(scene, scene.emitters_by_power(), options) {
            return Err(GpuError::Settings(error.to_string().into()));
        }
        if options.interleaving != 1 {
            return Err(GpuError::Settings("pixels cannot be interleaved".into()));
        }
        if matches!(options.grid.levels, Levels::Count(levels) if levels > MAX_LEVELS) {
            return Err(GpuError::Settings("at most 10 levels are possible".into()));
        }
        let kernel = |entry: &str| {
            gpu.kernel_of_tables(
                &format!("vpl-grid {entry}"),
                filtering,
                entry,
                &FILTER_TABLES,
                &[],
            )
        };
        let size = on_device.size();
        let pixels = size.map(u64::from).iter().product::<u64>();
        let visibility = || gpu.zeros("visibility", VISIBILITY_BYTES * pixels);
        let [width, height] = size;
        let taps = |iteration: u32| gpu.buffer("taps", &[[width, height, 1 << iteration, 0]]);
        Ok(Self {
            gpu,
            scene,
            on_device,
            bound: gpu.bind(&[&on_device.bindings()]),
            options,
            set: VplSet::default(),
            builder: LightingGridBuilder::new(gpu)?,
            grid: None,
            lights: None,
            gather: gpu.kernel_of_tables(
                "vpl-grid gather",
                gathering,
                "gather",
                &GATHER_TABLES,
                &on_device.constants(gathering, &[]),
            )?,
            filter: kernel("filter_shadows")?,
            combine: kernel("combine")?,
            memory: Memory {
                settings: gpu.zeros("settings", size_of::<Settings>() as u64)?,
                pixels: gpu.zeros("pixels", PIXEL_BYTES * pixels)?,
                visibility: [visibility()?, visibility()?],
                image: gpu.zeros("image", IMAGE_BYTES * pixels)?,
            },
            taps: (0..=options.filter_iterations)
                .map(taps)
                .collect::<Result<_, _>>()?,
        })
    }

    /// Bytes on the device, the scene's, the lights' and the hierarchy's apart.
    pub fn bytes(&self) -> u64 {
        let Memory {
            settings: _,
            pixels,
            visibility: [visibility, filtered],
            image,
        } = &self.memory;
        let buffers = [pixels, visibility, filtered, image];
        buffers.map(Buffer::bytes).iter().sum()
    }

    /// The hierarchy of the last frame; `None` before the first, and where no light arrived
    /// anywhere.
    pub fn grid(&self) -> Option<&GpuLightingGrid> {
        self.grid.as_ref().filter(|_| !self.set.lights().is_empty())
    }

    /// Lights of a frame, and memory for their hierarchy; whether that has to be built.
    fn prepare(&mut self, frame: u32, seed: u64) -> Result<bool, GpuError> {
        let fixed = self.options.fixed_lights;
        if fixed && self.grid.is_some() {
            return Ok(false);
        }
        let seed = VplSet::seed_of_frame(seed, if fixed { 0 } else { frame });
        let refused = |message: String| GpuError::Settings(message.into());
        self.set
            .trace(self.scene, &self.options.lights, seed)
            .map_err(|error| refused(error.to_string()))?;
        let lights = self.set.lights();
        let levels = match (self.options.grid.levels, &self.grid) {
            (Levels::Count(levels), _) => levels,
            (Levels::Auto, Some(grid)) => grid.level_count(),
            (Levels::Auto, None) if lights.is_empty() => 1,
            (Levels::Auto, None) => LightingGrid::new(lights, &self.options.grid)
                .map_err(|error| refused(error.to_string()))?
                .level_count()
                .min(MAX_LEVELS),
        };
        if self.grid.as_ref().map(GpuLightingGrid::lights) != Some(lights.len().max(1) as u32) {
            let options = GridOptions {
                levels: Levels::Count(levels),
                ..self.options.grid
            };
            self.grid = Some(GpuLightingGrid::new(self.gpu, lights.len(), &options)?);
        }
        self.lights = match lights {
            [] => None,
            lights => Some(self.gpu.buffer("virtual point lights", lights)?),
        };
        Ok(self.lights.is_some())
    }
}

impl GpuMethod for GpuVplGrid<'_> {
    fn size(&self) -> [u32; 2] {
        self.on_device.size()
    }

    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        let is_new = self.prepare(frame, seed)?;
        let Memory {
            settings,
            pixels,
            visibility,
            image,
        } = &self.memory;
        let asked = self.on_device.kernel_settings(seed, u32::MAX, u32::MAX);
        self.gpu.write(settings, &[asked]);
        let asked = Asked {
            frame,
            first_level: self.options.first_level,
            shadow_samples: self.options.shadow_samples,
            spread: u32::from(self.options.shadow_targets == ShadowTargets::Spread),
            least_distance_squared: self.options.min_distance * self.options.min_distance,
            has_lights: u32::from(self.lights.is_some()),
            padding: [0; 2],
        };
        let asked = self.gpu.buffer("vpl-grid", &[asked])?;
        let mut work = self.gpu.timed_work();
        let groups = {
            let [width, height] = self.size();
            groups_of(width * height)
        };
        if let Some(grid) = &self.grid {
            if let (true, Some(lights)) = (is_new, &self.lights) {
                self.builder.build(&mut work, lights, grid);
            }
            let of_grid = self.gpu.bind(&[&LightingGridBindings {
                lighting_frame: &grid.frame,
                grid_words: &grid.words,
                grid_lights: &grid.grid_lights,
                grid_points: &grid.points,
                grid_keys: &grid.keys,
                grid_vertices: grid.vertices(),
                grid_moments: &grid.moments,
            }]);
            let method = self.gpu.bind(&[&GatherBindings {
                settings,
                pixels,
                visibility: &visibility[0],
                asked: &asked,
            }]);
            work.dispatch_bound(&self.gather, &[&self.bound, &of_grid, &method], groups);
        }
        let filtering = |taps, latest: usize| {
            self.gpu.bind(&[&FilterBindings {
                taps,
                pixels,
                values: &visibility[latest],
                filtered: &visibility[1 - latest],
                image,
            }])
        };
        let mut latest = 0;
        for taps in &self.taps[..self.options.filter_iterations as usize] {
            work.dispatch_bound(&self.filter, &[&filtering(taps, latest)], groups);
            latest = 1 - latest;
        }
        work.dispatch_bound(&self.combine, &[&filtering(&self.taps[0], latest)], groups);
        Ok(work
            .begin_image(image, self.size())
            .with_path_rays(self.set.rays()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::{Likeness, gpu, under_the_sky};
    use lightshed_film::FrameMethod;
    use lightshed_integrator::VplOptions;
    use lightshed_scene::glam::Vec3;
    use lightshed_scene::{Material, Rgb, SceneDescription, builtin, luminance};
    use lightshed_testkit::{ImageMoments, StatisticsError, TileOptions, check_faults, compare_tiles};
    use std::sync::atomic::AtomicBool;

    const SIZE: [u32; 2] = [32, 24];

    fn options(scene: &Scene, filter_iterations: u32) -> VplGridOptions {
        VplGridOptions {
            lights: VplOptions {
                paths: 300,
                bounces: 3,
            },
            grid: GridOptions {
                levels: Levels::Count(6),
                ..GridOptions::default()
            },
            filter_iterations,
            ..VplGridOptions::new(0.01 * scene.extent())
        }
    }

    /// A mirror behind, one blended with paint, and a sky with a sun in it that comes in at the
    /// open side.
    fn mirrors() -> SceneDescription {
        let mut description = under_the_sky(builtin::cornell_glossy());
        let mirror = Material::Mirror {
            reflectance: Rgb::new(0.9, 0.8, 0.7).into(),
        };
        let paint = description.materials[0].clone();
        let first = description.materials.len() as u32;
        description.materials.push(mirror.clone());
        description.materials.push(Material::Blend {
            weight: 0.3.into(),
            first: Box::new(paint),
            second: Box::new(mirror),
        });
        description.shapes[2].material = first;
        description.shapes[0].material = first + 1;
        description
    }

    fn scene(mut description: SceneDescription) -> Scene {
        [description.settings.width, description.settings.height] = SIZE;
        Scene::new(&description).expect("it is sound")
    }

    /// Pairs of what the device and the host give for each pixel of each frame.
    fn frames(
        gpu: &Gpu,
        scene: &Scene,
        options: VplGridOptions,
        programs: [&str; 2],
        count: u32,
    ) -> Vec<Vec<[Rgb; 2]>> {
        let on_device = GpuScene::new(gpu, scene).expect("it is flat");
        let mut device = GpuVplGrid::of_programs(gpu, scene, &on_device, options, programs)
            .expect("the programs are sound");
        let pixels = SIZE[0] * SIZE[1];
        assert_eq!(device.bytes(), GpuVplGrid::BYTES_PER_PIXEL * u64::from(pixels));
        let mut host = VplGrid::new(scene, scene.emitters_by_power(), options).expect("options are sound");
        let mut truth = vec![Rgb::ZERO; pixels as usize];
        (0..count)
            .map(|frame| {
                let (found, _) = device.frame(frame, 7).expect("the device answers");
                host.render_frame(frame, 7, &mut truth, &AtomicBool::new(false));
                let pairs = found.into_iter().zip(&truth);
                pairs.map(|(value, &truth)| [value.into(), truth]).collect()
            })
            .collect()
    }

    /// Without shadow rays there is nothing to choose: the share of the values that are the host's
    /// within 10⁻⁴.
    fn share_alike(gpu: &Gpu, scene: &Scene, options: VplGridOptions, program: &str) -> f64 {
        let options = VplGridOptions {
            shadow_samples: 0,
            ..options
        };
        let pairs = frames(gpu, scene, options, [program, SHADOW_FILTER], 2).concat();
        let mut likeness = Likeness::default();
        for [value, truth] in pairs {
            likeness.push(value, truth);
        }
        likeness.share()
    }

    /// What is seen of emitters, and what the hierarchy gives, are the host's. Faults in either are
    /// noticed.
    #[test]
    fn light_without_shadows_is_the_hosts() {
        let Some(gpu) = gpu() else { return };
        let of_device = if gpu.is_exact() { 1.0 } else { 0.8 };
        let cornell = scene(builtin::cornell());
        let mirrors = scene(mirrors());
        let usual = |scene| options(scene, 0);
        for (name, scene, options) in [
            ("cornell", &cornell, usual(&cornell)),
            ("mirrors", &mirrors, usual(&mirrors)),
            (
                "the lights themselves",
                &cornell,
                VplGridOptions {
                    first_level: 0,
                    ..usual(&cornell)
                },
            ),
            (
                "as many levels as it takes",
                &cornell,
                VplGridOptions {
                    grid: GridOptions::default(),
                    fixed_lights: true,
                    ..usual(&cornell)
                },
            ),
        ] {
            let alike = share_alike(gpu, scene, options, VPL_GRID);
            println!("{name}: {alike:.4} alike");
            assert!(alike > 0.97 * of_device, "{name}");
        }
        if !gpu.is_exact() {
            return;
        }
        for (right, planted) in [
            // What lies near shines without bound.
            (
                "max(influence.distance_squared, package_gathering_gatherer.least_distance_squared)",
                "influence.distance_squared",
            ),
            // Mirrors count as if lights saw them.
            ("1.0 - mirrors", "1.0"),
            // What a mirror throws at a lamp counts half.
            ("bounce.exists && !bounce.is_delta", "bounce.exists"),
        ] {
            assert!(VPL_GRID.contains(right), "{right}");
            let options = VplGridOptions {
                min_distance: 0.3,
                ..usual(&mirrors)
            };
            let fewer = share_alike(gpu, &mirrors, options, &VPL_GRID.replace(right, planted));
            println!("{planted}: {fewer:.4} alike");
            assert!(fewer < 0.99 * of_device, "{planted}");
        }
    }

    /// Whether means over frames with the same lights are the host's, tile by tile and in all, at
    /// 1e-4; without the filter, so that pixels are independent.
    fn shadows(
        gpu: &Gpu,
        scene: &Scene,
        options: VplGridOptions,
        programs: [&str; 2],
    ) -> Result<(), StatisticsError> {
        const FRAMES: u32 = 16;
        let options = VplGridOptions {
            fixed_lights: true,
            ..options
        };
        let frames = frames(gpu, scene, options, programs, FRAMES);
        let of_frames = f64::from(FRAMES);
        let (mut found, mut variance, mut truth) = (Vec::new(), Vec::new(), Vec::new());
        for pixel in 0..frames[0].len() {
            let values = frames
                .iter()
                .map(|frame| frame[pixel].map(luminance).map(f64::from));
            let [a, b] = values
                .clone()
                .fold([0.0; 2], |[a, b], [x, y]| [a + x / of_frames, b + y / of_frames]);
            let spread: f64 = values.map(|[x, y]| ((x - y) - (a - b)).powi(2)).sum();
            found.push(a);
            truth.push(b);
            variance.push(spread / (of_frames - 1.0) / of_frames);
        }
        let moments = |mean, variance_of_mean| ImageMoments {
            width: SIZE[0] as usize,
            channels: 1,
            mean,
            variance_of_mean,
            samples_per_pixel: u64::from(FRAMES),
        };
        let options = TileOptions {
            tile_size: 8,
            // Where all is seen, or nothing, what is left is rounding.
            relative_tolerance: 1e-4,
            ..TileOptions::default()
        };
        compare_tiles(&moments(&found, &variance), &moments(&truth, &[]), &options)?.verdict()
    }

    /// Random numbers are used up when a choice changes, which rounding decides now and then:
    /// choices have the host's probabilities. Faults in them, and in where shadow rays end, are
    /// noticed.
    #[test]
    fn shadows_are_the_hosts() {
        let Some(gpu) = gpu() else { return };
        let scene = scene(mirrors());
        let usual = options(&scene, 0);
        let sound = [VPL_GRID, SHADOW_FILTER];
        let spread = VplGridOptions {
            shadow_targets: ShadowTargets::Spread,
            ..usual
        };
        shadows(gpu, &scene, spread, sound).unwrap();
        let faults = [
            // The first light that comes is kept.
            (
                "next.threshold = min(selection.weight_sum / u, ",
                "next.threshold = max(selection.weight_sum / u, ",
            ),
            // Finer vertices have a share whatever shines there.
            ("* package_memory__1lighting_grid__2load_grid_weight(found.y)", ""),
            // What shines the other way is as good a target.
            (
                "(emission + package_lightshed__1grid_shadow__1LEAST_EMISSION)",
                "1.0",
            ),
        ];
        for (right, _) in faults {
            assert!(VPL_GRID.contains(right), "{right}");
        }
        check_faults(&faults, |fault| {
            let program = match fault {
                Some((right, planted)) => VPL_GRID.replace(right, planted),
                None => VPL_GRID.to_owned(),
            };
            shadows(gpu, &scene, usual, [&program, SHADOW_FILTER])
        })
        .unwrap();
    }

    /// A floor and a wall with shares of lights, one pixel that shows nothing: position, distance
    /// and normal of each.
    fn corner() -> Vec<(Vec3, f32, Vec3)> {
        let [columns, rows] = SIZE;
        (0..columns * rows)
            .map(|i| {
                let (x, y) = (i % columns, i / columns);
                let [u, v] = [x, y].map(|side| side as f32 * 0.02);
                let distance = 2.0 + 0.1 * v;
                match (i, 2 * x < columns) {
                    (100, _) => (Vec3::ZERO, 1.0, Vec3::ZERO),
                    (_, true) => (Vec3::new(u, 0.0, v), distance, Vec3::Y),
                    _ => (Vec3::new(0.32, u - 0.3, v), distance, Vec3::new(-0.8, 0.6, 0.0)),
                }
            })
            .collect()
    }

    /// An iteration of the filter from its definition, in `f64`.
    fn filtered(values: &[f64], guides: &[(Vec3, f32, Vec3)], step: i32) -> Vec<f64> {
        let [columns, rows] = SIZE.map(|side| side as i32);
        let similarity = |a: &(Vec3, f32, Vec3), b: &(Vec3, f32, Vec3)| {
            let between = (b.0 - a.0).as_dvec3();
            let off_plane = [a.2, b.2].map(|normal| normal.as_dvec3().dot(between).abs());
            let scale = 0.01 * f64::from(a.1.min(b.1));
            let cosine = a.2.as_dvec3().dot(b.2.as_dvec3()).clamp(0.0, 1.0);
            cosine.powi(32) * (-off_plane[0].max(off_plane[1]) / scale).exp()
        };
        let spline = [1.0 / 16.0, 1.0 / 4.0, 3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
        (0..columns * rows)
            .map(|i| {
                let (mut sum, mut weights) = (0.0, 0.0);
                for tap in 0..25 {
                    let (x, y) = (
                        i % columns + (tap % 5 - 2) * step,
                        i / columns + (tap / 5 - 2) * step,
                    );
                    if (0..columns).contains(&x) && (0..rows).contains(&y) {
                        let place = (y * columns + x) as usize;
                        let weight = spline[tap as usize % 5]
                            * spline[tap as usize / 5]
                            * similarity(&guides[i as usize], &guides[place]);
                        sum += weight * values[place];
                        weights += weight;
                    }
                }
                if weights > 0.0 {
                    sum / weights
                } else {
                    values[i as usize]
                }
            })
            .collect()
    }

    /// Three iterations against the definition, to 2·10⁻⁶. Faults are noticed.
    #[test]
    fn filters_are_what_they_are_defined_to_be() {
        let Some(gpu) = gpu() else { return };
        let guides = corner();
        let rows: Vec<[f32; 16]> = guides
            .iter()
            .map(|&(p, distance, n)| {
                let mut row = [0.0; 16];
                row[3] = distance;
                row[8..11].copy_from_slice(&p.to_array());
                row[12..15].copy_from_slice(&n.to_array());
                row
            })
            .collect();
        let values: Vec<f32> = (0..rows.len()).map(|i| (i * i % 5) as f32 / 4.0).collect();
        let mut truth: Vec<f64> = values.iter().map(|&value| f64::from(value)).collect();
        for step in [1, 2, 4] {
            truth = filtered(&truth, &guides, step);
        }
        let run = |program: &str| -> f64 {
            let kernel = gpu
                .kernel_of_tables("filter", program, "filter_shadows", &FILTER_TABLES, &[])
                .expect("the program is sound");
            let pixels = gpu.buffer("pixels", &rows).expect("they are few");
            let mut from = gpu.buffer("values", &values).expect("they are few");
            let image = gpu.zeros("image", 16).expect("it is small");
            for step in [1, 2, 4] {
                let taps = gpu
                    .buffer("taps", &[[SIZE[0], SIZE[1], step, 0]])
                    .expect("it is small");
                let to = gpu.zeros("filtered", from.bytes()).expect("they are few");
                let mut work = gpu.work();
                let bound = work.bind(&FilterBindings {
                    taps: &taps,
                    pixels: &pixels,
                    values: &from,
                    filtered: &to,
                    image: &image,
                });
                work.dispatch_bound(&kernel, &[&bound], groups_of(rows.len() as u32));
                work.submit();
                from = to;
            }
            let found: Vec<f32> = gpu.read(&from, rows.len()).expect("the device answers");
            let errors = found.iter().zip(&truth).map(|(&a, b)| (f64::from(a) - b).abs());
            errors.fold(0.0, f64::max)
        };
        let worst = run(SHADOW_FILTER);
        println!("off by {worst:.1e}");
        assert!(worst < 2e-6);
        for (right, planted) in [
            // Corners are filtered across.
            ("c16 * c16 * exp", "exp"),
            // So are steps.
            ("exp(-off_plane", "exp(0.0 * -off_plane"),
            // Taps stay where they were.
            (" * i32(taps.step)", ""),
            // Far taps weigh a little more.
            ("0.0625", "0.0626"),
        ] {
            assert!(SHADOW_FILTER.contains(right), "{right}");
            let worst = run(&SHADOW_FILTER.replace(right, planted));
            println!("{planted}: off by {worst:.1e}");
            assert!(worst > 1e-5, "{planted}");
        }
    }

    #[test]
    fn impossible_options_are_refused() {
        let Some(gpu) = gpu() else { return };
        let scene = scene(builtin::cornell());
        let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
        let usual = options(&scene, 0);
        for options in [
            VplGridOptions {
                interleaving: 2,
                ..usual
            },
            VplGridOptions {
                shadow_samples: 17,
                ..usual
            },
            VplGridOptions {
                grid: GridOptions {
                    levels: Levels::Count(11),
                    ..usual.grid
                },
                ..usual
            },
        ] {
            let refused = GpuVplGrid::new(gpu, &scene, &on_device, options).err();
            assert!(
                matches!(refused, Some(GpuError::Settings(_))),
                "{options:?}: {refused:?}"
            );
        }
    }
}
