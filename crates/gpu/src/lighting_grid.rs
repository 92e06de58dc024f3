//! Lighting grid hierarchies that are built on the device.

use crate::bindings::{BoundGroup, GridBuildBindings, Table};
use crate::buffer::Buffer;
use crate::device::Gpu;
use crate::kernel::Kernel;
use crate::programs::LIGHTING_GRID_BUILD;
use crate::radix_sort::{RadixSort, SortBuffers, groups};
use crate::{GpuError, Work};
use bytemuck::{Pod, Zeroable};
use lightshed_lights::{GridOptions, Levels, MAX_LIGHTS};

/// What the program binds.
pub(crate) const TABLES: [Table; 1] = [GridBuildBindings::TABLE];

/// Threads of a workgroup.
const GROUP: u32 = 256;
/// Boxes that the second reduction has to look at.
const MAX_BOXES: u32 = 1024;
/// Words of the maps that a group counts.
const TILE: u32 = 1024;
/// Greatest number of levels: a vertex has ten bits an axis.
const MAX_LEVELS: u32 = 10;
/// Places in the table of first words.
const TABLE: usize = 12;

/// Bytes of `GridFrame`, `GridLight` and `GridPoint` of the shader module `lighting_grid`.
const FRAME_BYTES: u64 = 96;
const GRID_LIGHT_BYTES: u64 = 80;
const POINT_BYTES: u64 = 48;
/// Bytes of a vertex's sums, `Moments` of `grid_moments`.
const MOMENTS_BYTES: u64 = 80;
/// Bytes of 32 places of a map: which are occupied, and the number before them.
const WORD_BYTES: u64 = 8;

/// Builds lighting grid hierarchies (Lin 2022 ch. 3) from
/// [`PointLight`](lightshed_lights::PointLight)s: the levels of
/// [`LightingGrid`](lightshed_lights::LightingGrid), vertex for vertex, their sums in `f32`.
///
/// Lights are sorted by cell with a stable radix sort; each vertex of S₁ gathers from its eight
/// cells, each of a level above from 27 of the level below. Nothing is scattered into sums and
/// nothing depends on the order of groups, so the same lights give the same bits.
pub struct LightingGridBuilder {
    bounds: Kernel,
    place_cube: Kernel,
    find_cells: Kernel,
    order_points: Kernel,
    mark_coarser: Kernel,
    count_vertices: Kernel,
    scan_tiles: Kernel,
    rank_vertices: Kernel,
    gather_lights: Kernel,
    gather_vertices: Kernel,
    sort: RadixSort,
}

/// A lighting grid hierarchy on the device: the data that the shader module `lighting_grid` needs
/// from its host.
pub struct GpuLightingGrid {
    /// `GridFrame`, one.
    pub frame: Buffer,
    /// `array<vec2u>`: 32 places of the maps, and how many occupied ones are before them; one more
    /// at the end.
    pub words: Buffer,
    /// `array<GridLight>`: lights of the occupied vertices, the finest level's first.
    pub grid_lights: Buffer,
    /// `array<GridPoint>`: the lights, row of cells by row.
    pub points: Buffer,
    /// `array<u32>`: the cell of each of those.
    pub keys: Buffer,
    lights: u32,
    levels: u32,
    first_word: [u32; TABLE],
    settings: Buffer,
    /// The number of each level, 1 first.
    level_numbers: Vec<Buffer>,
    boxes: Buffer,
    tiles: Buffer,
    vertices: Buffer,
    /// Of each vertex: `array<Moments>`.
    pub(crate) moments: Buffer,
    sort: SortBuffers,
    box_count: u32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Settings {
    lights: u32,
    levels: u32,
    boxes: u32,
    alpha: f32,
    low: [f32; 3],
    capacity: u32,
    high: [f32; 3],
    words: u32,
    first_word: [u32; TABLE],
}

// As in the shader; a test compares them.
const _: () = assert!(size_of::<Settings>() == 96);

/// Places along an axis of level ℓ of so many.
fn side(levels: u32, level: u32) -> u64 {
    (1 << (levels - level)) + 1
}

/// Words of the map of a level: rows of whole words, with room for one place more.
fn map_words(levels: u32, level: u32) -> u64 {
    let side = side(levels, level);
    side * side * (side / 32 + 1)
}

/// Most occupied places of a level.
fn most_vertices(levels: u32, level: u32, lights: u32) -> u64 {
    side(levels, level).pow(3).min(8 * u64::from(lights))
}

impl GpuLightingGrid {
    /// Memory for the hierarchy of this number of lights, clamped to 1 to [`MAX_LIGHTS`]. `options`
    /// give the number of levels, at most 10; [`Levels::Auto`] is refused, because its result
    /// depends on the lights, which only the device knows.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for options that the library refuses, [`Levels::Auto`] or more than
    /// 10 levels; [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, lights: usize, options: &GridOptions) -> Result<Self, GpuError> {
        let refused = |message: String| Err(GpuError::Settings(message.into()));
        if let Err(error) = options.check() {
            return refused(error.to_string());
        }
        let levels = match options.levels {
            Levels::Count(levels) if levels <= MAX_LEVELS => levels,
            _ => return refused(format!("levels must be counted, between 1 and {MAX_LEVELS}")),
        };
        let lights = lights.clamp(1, MAX_LIGHTS) as u32;
        let mut first_word = [0; TABLE];
        let (mut words, mut capacity) = (0, 0);
        for level in 1..=levels {
            first_word[level as usize - 1] = words as u32;
            words += map_words(levels, level);
            capacity += most_vertices(levels, level, lights);
        }
        first_word[levels as usize] = words as u32;
        let box_count = lights.div_ceil(GROUP).min(MAX_BOXES);
        let (low, high) = match &options.bounds {
            Some(bounds) => (bounds.min.to_array(), bounds.max.to_array()),
            None => ([f32::MAX; 3], [-f32::MAX; 3]),
        };
        let settings = Settings {
            lights,
            levels,
            boxes: box_count,
            alpha: options.alpha,
            low,
            capacity: capacity as u32,
            high,
            words: words as u32,
            first_word,
        };
        let number = |level: u32| gpu.buffer("lighting grid: level", &[level]);
        Ok(Self {
            frame: gpu.zeros("lighting grid: frame", FRAME_BYTES)?,
            words: gpu.zeros("lighting grid: maps", WORD_BYTES * (words + 1))?,
            grid_lights: gpu.zeros("lighting grid: lights of vertices", GRID_LIGHT_BYTES * capacity)?,
            points: gpu.zeros("lighting grid: lights", POINT_BYTES * u64::from(lights))?,
            keys: gpu.zeros("lighting grid: cells of lights", 4 * u64::from(lights))?,
            lights,
            levels,
            first_word,
            settings: gpu.buffer("lighting grid: settings", &[settings])?,
            level_numbers: (1..=levels).map(number).collect::<Result<_, _>>()?,
            boxes: gpu.zeros("lighting grid: boxes", 32 * u64::from(box_count))?,
            tiles: gpu.zeros("lighting grid: tiles", 4 * words.div_ceil(u64::from(TILE)))?,
            vertices: gpu.zeros("lighting grid: vertices", 4 * capacity)?,
            moments: gpu.zeros("lighting grid: moments", MOMENTS_BYTES * capacity)?,
            sort: SortBuffers::new(gpu, lights, 3 * (levels - 1))?,
            box_count,
        })
    }

    /// Lights.
    pub fn lights(&self) -> u32 {
        self.lights
    }

    /// Levels above the lights, ℓ_max.
    pub fn level_count(&self) -> u32 {
        self.levels
    }

    /// The light, by the order in which they were given, at each place of [`points`](Self::points).
    pub fn order(&self) -> &Buffer {
        &self.sort.indices
    }

    /// Where each occupied vertex is in its level: `x + 2¹⁰ y + 2²⁰ z`, in the order of
    /// [`grid_lights`](Self::grid_lights).
    pub fn vertices(&self) -> &Buffer {
        &self.vertices
    }

    /// Bytes on the device that look-ups need.
    pub fn bytes(&self) -> u64 {
        [
            &self.frame,
            &self.words,
            &self.grid_lights,
            &self.points,
            &self.keys,
        ]
        .map(Buffer::bytes)
        .iter()
        .sum()
    }

    /// Bytes on the device that only building needs.
    pub fn scratch_bytes(&self) -> u64 {
        let own = [
            &self.settings,
            &self.boxes,
            &self.tiles,
            &self.vertices,
            &self.moments,
        ];
        let own: u64 = own
            .into_iter()
            .chain(&self.level_numbers)
            .map(Buffer::bytes)
            .sum();
        own + self.sort.bytes()
    }
}

impl LightingGridBuilder {
    /// The kernels.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`] if the device does not take them.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Self::of_program(gpu, LIGHTING_GRID_BUILD)
    }

    fn of_program(gpu: &Gpu, program: &str) -> Result<Self, GpuError> {
        let kernel = |entry: &str| {
            gpu.kernel_of_tables(&format!("lighting grid: {entry}"), program, entry, &TABLES, &[])
        };
        Ok(Self {
            bounds: kernel("bounds")?,
            place_cube: kernel("place_cube")?,
            find_cells: kernel("find_cells")?,
            order_points: kernel("order_points")?,
            mark_coarser: kernel("mark_coarser")?,
            count_vertices: kernel("count_vertices")?,
            scan_tiles: kernel("scan_tiles")?,
            rank_vertices: kernel("rank_vertices")?,
            gather_lights: kernel("gather_lights")?,
            gather_vertices: kernel("gather_vertices")?,
            sort: RadixSort::new(gpu)?,
        })
    }

    /// Records the building of `grid` from the [`PointLight`](lightshed_lights::PointLight)s in
    /// `lights`, as many as it has room for. The same lights give the same hierarchy, whatever it
    /// was before. Intensities whose sums exceed what `f32` holds, or whose luminances fall below
    /// its normal numbers, are beyond its means.
    pub fn build(&self, work: &mut Work, lights: &Buffer, grid: &GpuLightingGrid) {
        let levels = grid.levels;
        let threads = |count: u64| groups(count.div_ceil(u64::from(GROUP)) as u32);
        let all = threads(u64::from(grid.lights));
        let SortBuffers { codes, indices, .. } = &grid.sort;
        // Levels of the hierarchy begin with number 1.
        let of_level: Vec<BoundGroup> = grid
            .level_numbers
            .iter()
            .map(|level| {
                work.bind(&GridBuildBindings {
                    settings: &grid.settings,
                    lights,
                    boxes: &grid.boxes,
                    lighting_frame: &grid.frame,
                    codes,
                    indices,
                    grid_points: &grid.points,
                    grid_keys: &grid.keys,
                    marks: &grid.words,
                    grid_words: &grid.words,
                    tiles: &grid.tiles,
                    grid_vertices: &grid.vertices,
                    level,
                    grid_moments: &grid.moments,
                    grid_lights: &grid.grid_lights,
                })
            })
            .collect();
        let bound = [&of_level[0]];
        work.dispatch_bound(&self.bounds, &bound, [grid.box_count, 1, 1]);
        work.dispatch_bound(&self.place_cube, &bound, [1, 1, 1]);
        work.dispatch_bound(&self.find_cells, &bound, all);
        self.sort.sort(work, &grid.sort);
        work.clear(&grid.words, grid.words.bytes());
        work.dispatch_bound(&self.order_points, &bound, all);
        for level in 2..=levels {
            let finer = threads(map_words(levels, level - 1));
            work.dispatch_bound(&self.mark_coarser, &[&of_level[level as usize - 1]], finer);
        }
        let tile_groups = groups(grid.first_word[levels as usize].div_ceil(TILE));
        work.dispatch_bound(&self.count_vertices, &bound, tile_groups);
        work.dispatch_bound(&self.scan_tiles, &bound, [1, 1, 1]);
        work.dispatch_bound(&self.rank_vertices, &bound, tile_groups);
        for level in 1..=levels {
            let kernel = match level {
                1 => &self.gather_lights,
                _ => &self.gather_vertices,
            };
            let most = threads(most_vertices(levels, level, grid.lights));
            work.dispatch_bound(kernel, &[&of_level[level as usize - 1]], most);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::gpu;
    use lightshed_lights::glam::Vec3;
    use lightshed_lights::{Bounds, GridLight, LightingGrid, PointLight};
    use lightshed_testkit::check_faults;

    /// Lights on walls and in the air, near each other and off.
    fn point_lights(count: usize) -> Vec<PointLight> {
        // A plain sequence of numbers in [0, 1).
        let mut state = count as u32 | 1;
        let mut next = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
            (word >> 8) as f32 / (1 << 24) as f32
        };
        (0..count)
            .map(|i| {
                let mut position = Vec3::new(next(), next(), next()) * Vec3::new(10.0, 7.0, 4.0) - 3.0;
                let mut normal = Vec3::new(next(), next(), next()) - 0.5;
                match i % 8 {
                    0..4 => {
                        position[i % 3] = -3.0;
                        normal = Vec3::AXES[i % 3];
                    }
                    4 => position *= 1e-3,
                    5 => normal = Vec3::ZERO,
                    _ => {}
                }
                PointLight {
                    position,
                    intensity: Vec3::new(next(), next(), next()) * if i % 17 == 3 { 0.0 } else { 3.0 },
                    normal: normal.normalize_or_zero(),
                }
            })
            .collect()
    }

    /// A light as the shader has it, for comparison.
    fn rows(light: &[f32; 20]) -> GridLight {
        let of = |i: usize| Vec3::new(light[4 * i], light[4 * i + 1], light[4 * i + 2]);
        GridLight {
            position: of(0),
            isotropic: light[3],
            intensity: of(1),
            mean_normal: of(2),
            spread: of(3),
            normal_moment: [light[7], light[11], light[15], light[16], light[17], light[18]],
        }
    }

    /// Whether the device's hierarchy is the host's: vertices exactly, lights by their bounds. The
    /// greatest differences in units of these.
    fn like_the_host(
        gpu: &Gpu,
        builder: &LightingGridBuilder,
        lights: &[PointLight],
        options: &GridOptions,
    ) -> Result<f32, String> {
        let grid = GpuLightingGrid::new(gpu, lights.len(), options).expect("it is small");
        let on_device = gpu.buffer("lights", lights).expect("they are few");
        let mut work = gpu.work();
        // Twice, as a hierarchy must not depend on what it was.
        builder.build(&mut work, &on_device, &grid);
        builder.build(&mut work, &on_device, &grid);
        work.submit();
        let read = |buffer: &Buffer| -> Vec<u32> {
            gpu.read(buffer, (buffer.bytes() / 4) as usize)
                .expect("the device answers")
        };
        let (words, vertices) = (read(&grid.words), read(grid.vertices()));
        let places: Vec<[f32; 20]> = gpu
            .read(
                &grid.grid_lights,
                (grid.grid_lights.bytes() / GRID_LIGHT_BYTES) as usize,
            )
            .expect("the device answers");
        let mut order = read(grid.order());
        order.truncate(lights.len());
        order.sort_unstable();
        if order.iter().enumerate().any(|(i, &light)| i as u32 != light) {
            return Err("lights are lost on the way".to_owned());
        }
        let host = LightingGrid::new(lights, options).expect("lights are sound");
        let mut place = 0;
        let mut worst = 0.0f32;
        for level in 1..=grid.level_count() {
            let first = words[2 * grid.first_word[level as usize - 1] as usize + 1];
            if first as usize != place {
                return Err(format!("level {level} begins at {first} instead of {place}"));
            }
            let cell = host.cell_size(level);
            for ([x, y, z], truth) in host.vertices(level).zip(host.grid_lights(level)) {
                let named = vertices[place];
                if named != (x | y << 10 | z << 20) {
                    return Err(format!(
                        "level {level}: vertex {named:#x} instead of {x}, {y}, {z}"
                    ));
                }
                let found = rows(&places[place]);
                place += 1;
                let off = |a: Vec3, b: Vec3| (a - b).abs().max_element();
                let variance = |spread: Vec3| spread * spread / (cell * cell);
                let moments = found.normal_moment.iter().zip(&truth.normal_moment);
                // Shares are as good as places within a cell are; where they are small that shows.
                let share = truth.intensity.max_element() / 3.0;
                let slack = 2e-5 * (1.0 + 0.01 / share.max(1e-30));
                let differences = [
                    off(found.position, truth.position) / (slack * cell + 1e-6 * truth.position.length()),
                    off(found.intensity, truth.intensity)
                        / (slack * truth.intensity.max_element()).max(1e-30),
                    off(variance(found.spread), variance(truth.spread)) / slack,
                    off(found.mean_normal, truth.mean_normal) / slack,
                    (found.isotropic - truth.isotropic).abs() / slack,
                    moments.fold(0.0, |most, (a, b)| (a - b).abs().max(most)) / slack,
                ];
                let most = differences
                    .iter()
                    .fold(0.0f32, |a, &b| if b > a || b.is_nan() { b } else { a });
                if !(most <= 1.0) {
                    return Err(format!(
                        "level {level}: {found:?} instead of {truth:?}: {differences:?}"
                    ));
                }
                worst = worst.max(most);
            }
        }
        let end = words[2 * grid.first_word[grid.levels as usize] as usize + 1];
        if end as usize != place {
            return Err(format!("{end} vertices instead of {place}"));
        }
        Ok(worst)
    }

    /// Vertex for vertex, lights within rounding: intensities, normals and their moments within
    /// 2·10⁻⁵, centres in cells and variances of places in squared cells as well; a vertex
    /// that has but a share `s` of one light may be off by `2·10⁻⁷ / s` more. A light that is
    /// lost, a level whose shares are off, and a vertex that is not seen are noticed.
    #[test]
    fn levels_are_the_hosts() {
        let Some(gpu) = gpu() else { return };
        let usual = GridOptions::default();
        let boxed = Bounds::new(Vec3::splat(-20.0), Vec3::splat(9.0));
        let sets = [
            (1, 1, None),
            (3, 4, None),
            (1000, 5, None),
            (1000, 6, Some(boxed)),
            (20_000, 7, None),
            (100_000, 7, None),
        ];
        let sound = LightingGridBuilder::new(gpu).expect("the program is sound");
        for (count, levels, bounds) in sets {
            let options = GridOptions {
                levels: Levels::Count(levels),
                bounds,
                ..usual
            };
            let worst = like_the_host(gpu, &sound, &point_lights(count), &options);
            println!("{count} lights, {levels} levels: {worst:?} of the bounds");
            assert!(worst.is_ok(), "{worst:?}");
        }
        let faults = [
            // Lights of the last cell of each row are lost.
            ("min(vertex.x + 1u, cells)", "vertex.x"),
            // Finer vertices count as if they were a whole cell away.
            ("let s = 0.5 * vec3f(half_steps);", "let s = vec3f(half_steps);"),
            // A vertex is not seen.
            ("dx <= 1", "dx < 1"),
            // Vertices between two of the coarser grid reach one of them.
            ("cx <= (x + 1u) / 2u", "cx <= x / 2u"),
        ];
        let lights = point_lights(1000);
        let options = GridOptions {
            levels: Levels::Count(5),
            ..usual
        };
        check_faults(&faults, |fault| {
            let program = match fault {
                None => LIGHTING_GRID_BUILD.to_owned(),
                Some((right, planted)) => {
                    assert!(LIGHTING_GRID_BUILD.contains(right), "{right}");
                    LIGHTING_GRID_BUILD.replace(right, planted)
                }
            };
            let builder = LightingGridBuilder::of_program(gpu, &program).expect("the program is valid");
            like_the_host(gpu, &builder, &lights, &options).map(drop)
        })
        .unwrap_or_else(|error| panic!("{error:?}"));
    }

    #[test]
    fn impossible_options_are_refused_and_memory_is_counted() {
        let Some(gpu) = gpu() else { return };
        let usual = GridOptions {
            levels: Levels::Count(4),
            ..GridOptions::default()
        };
        for options in [
            GridOptions::default(),
            GridOptions { alpha: 0.0, ..usual },
            GridOptions {
                levels: Levels::Count(11),
                ..usual
            },
        ] {
            let refused = GpuLightingGrid::new(gpu, 10, &options).err();
            assert!(
                matches!(refused, Some(GpuError::Settings(_))),
                "{options:?}: {refused:?}"
            );
        }
        // Maps of 9², 5², 3² and 2² rows of one word; vertices at most 8 a light, and all there
        // are.
        let grid = GpuLightingGrid::new(gpu, 10, &usual).expect("it is small");
        let words = 81 + 25 + 9 + 4;
        let vertices = 80 + 80 + 27 + 8;
        let look_up =
            FRAME_BYTES + WORD_BYTES * (words + 1) + GRID_LIGHT_BYTES * vertices + (POINT_BYTES + 4) * 10;
        assert_eq!(grid.bytes(), look_up);
    }
}
