//! Cells of surface sites: keys, slots, and sites that are moved.

use crate::radiance_cache::LevelGridRow;
use crate::tests::parity::harness::{COUNT, HOSTILE, Shader, Tier, bits, compare, floats, gpu, held};
use glam::Vec3;
use lightshed_integrator::spatial::{HashGrid, LevelGridOptions, SpatialIndex, SurfaceSite};
use lightshed_sampling::{CounterRng, UniformSphere};

const INPUTS: usize = 10;
type Input = [u32; INPUTS];

/// Sites: position, normal, distance from the eye, two numbers that move them, and whether a path
/// may reach them: those are moved. A quarter has hostile words; the others are near cells'
/// borders, far away, and have normals along axes, diagonals, or none.
fn sites(cell: f32) -> Vec<Input> {
    let mut rng = CounterRng::new(60, cell.to_bits(), 0);
    (0..COUNT)
        .map(|i| {
            let far = [1.0, 30.0, 1e4, 1e6, 1e9, 3e14][rng.next_u32() as usize % 6] * cell;
            let mut place = || {
                let x = far * (rng.next_f32() - 0.5);
                match rng.next_u32() % 4 {
                    // On a border, and the number below it.
                    0 => (x / cell).round() * cell,
                    1 => f32::from_bits(((x / cell).round() * cell).to_bits().wrapping_sub(1)),
                    _ => x,
                }
            };
            let [x, y, z] = [place(), place(), place()];
            let normal = match rng.next_u32() % 8 {
                0 => Vec3::ZERO,
                1 => Vec3::AXES[rng.next_u32() as usize % 3],
                2 => -Vec3::AXES[rng.next_u32() as usize % 3],
                3 => Vec3::new(1.0, -1.0, 1.0) * (1.0 / 3.0f32.sqrt()),
                _ => UniformSphere::sample(rng.next_2d()),
            };
            let distance = match rng.next_u32() % 4 {
                0 => 0.0,
                1 => rng.next_f32(),
                _ => 1e5 * rng.next_f32() * rng.next_f32(),
            };
            let [nx, ny, nz] = normal.to_array();
            let numbers = [x, y, z, nx, ny, nz, distance, rng.next_f32(), rng.next_f32()];
            let mut words = [1; INPUTS];
            words[..9].copy_from_slice(&numbers.map(f32::to_bits));
            if i % 4 == 0 {
                words[9] = 0;
                for word in &mut words[..7] {
                    if rng.next_u32().is_multiple_of(3) {
                        *word = HOSTILE[rng.next_u32() as usize % HOSTILE.len()];
                    }
                }
            }
            words
        })
        .collect()
}

fn site(words: &Input) -> (SurfaceSite, [f32; 2]) {
    let [x, y, z, nx, ny, nz, distance, u, v, _] = floats(words);
    let site = SurfaceSite::new(Vec3::new(x, y, z), Vec3::new(nx, ny, nz)).with_eye_distance(distance);
    (site, [u, v])
}

/// A grid in which every second site has asked for a cell, most of the cells more than once.
fn grid(options: LevelGridOptions, slots: usize, sites: &[Input]) -> HashGrid {
    let mut grid = HashGrid::new(options, slots).expect("options are sound");
    for words in sites.iter().step_by(2) {
        grid.claim(&site(words).0);
    }
    grid.table.settle(|_| ());
    grid
}

/// Whether keys, slots and moved sites of a grid have the library's bits.
fn agrees(shader: &Shader<'_>, grid: &HashGrid, inputs: &[Input]) -> Result<(), String> {
    let Some(gpu) = gpu() else { return Ok(()) };
    let row = LevelGridRow::new(&grid.cells, grid.table.slots());
    let words: Vec<u64> = grid.table.words().collect();
    let row = gpu.buffer("grid", &[row]).expect("it is small");
    let words = gpu.buffer("words", &words).expect("it is small");
    let shader = Shader {
        buffers: &[&row, &words],
        ..*shader
    };
    let found = shader.run::<INPUTS, 8>(gpu, inputs);
    let first = |all: &[u32; 8]| -> [u32; 5] { core::array::from_fn(|k| all[k]) };
    let last = |all: &[u32; 8]| -> [u32; 3] { core::array::from_fn(|k| all[5 + k]) };
    let slots: Vec<_> = found.iter().map(first).collect();
    compare("slots", Tier::Words, inputs, &slots, |words| {
        let (site, u) = site(words);
        let key = grid.cells.locate(&site).map(|key| key.bits());
        let slot = |site: &SurfaceSite| grid.locate(site).unwrap_or(u32::MAX);
        let moved = match words[9] {
            1 => slot(&grid.cells.jittered(&site, u)),
            _ => u32::MAX,
        };
        let bits = key.unwrap_or(0);
        [
            u32::from(key.is_some()),
            bits as u32,
            (bits >> 32) as u32,
            slot(&site),
            moved,
        ]
    })?;
    let moved: Vec<_> = found.iter().map(last).collect();
    compare("moved", Tier::Exact, inputs, &moved, |words| {
        let (site, u) = site(words);
        match words[9] {
            1 => bits(grid.cells.jittered(&site, u).position.to_array()),
            _ => [0; 3],
        }
    })
}

const HOST: &str = "import package::lightshed::hash_grid::LevelGrid;
    @group(0) @binding(2) var<storage, read> grid: LevelGrid;
    @group(0) @binding(3) var<storage, read> words: array<vec2u>;
    fn the_grid() -> LevelGrid { return grid; }
    fn load_cell_word(slot: u32) -> vec2u { return words[slot]; }";
const IMPORTS: &str = "import package::host::the_grid;
    import package::lightshed::hash_grid::{SurfaceSite, moved_site, site_key, site_slot};
    import package::lightshed::ray::NOTHING;";
const BODY: &str = "let site = SurfaceSite(vec3f(number(0u), number(1u), number(2u)),
         vec3f(number(3u), number(4u), number(5u)), number(6u));
     let key = site_key(the_grid(), site);
     put(0u, select(0u, 1u, key.some)); put(1u, key.bits.x); put(2u, key.bits.y);
     put(3u, site_slot(the_grid(), site));
     put(4u, NOTHING); put(5u, 0u); put(6u, 0u); put(7u, 0u);
     if word(9u) == 1u {
         let moved = moved_site(the_grid(), site, vec2f(number(7u), number(8u)));
         put(4u, site_slot(the_grid(), moved));
         put_3(5u, moved.position);
     }";

/// The same keys, slots and moved sites, in a table with room and in one that is full, with cells
/// that grow and that do not.
#[test]
fn cells_of_sites() {
    let shader = Shader {
        host: HOST,
        ..Shader::new(IMPORTS, BODY)
    };
    let growing = LevelGridOptions {
        cell: 0.0371,
        growth: 0.1,
        faces: true,
        facets: false,
    };
    let alike = LevelGridOptions {
        faces: false,
        facets: false,
        growth: 0.0,
        ..growing
    };
    let inputs = sites(growing.cell);
    let roomy = grid(growing, 1 << 15, &inputs);
    let counted = |grid: &HashGrid| {
        let slots = inputs.iter().map(|words| grid.locate(&site(words).0));
        let [mut some, mut none] = [0, 0];
        slots.for_each(|slot| *if slot.is_some() { &mut some } else { &mut none } += 1);
        (some, none)
    };
    let (known, absent) = counted(&roomy);
    assert!(known > COUNT / 4 && absent > COUNT / 8, "{known}, {absent}");
    assert!(roomy.table.occupancy().lines[3] > 0);
    let full = grid(alike, 256, &inputs);
    assert!(full.table.occupancy().load() == 1.0 && full.table.occupancy().refused > 1000);
    let (known, absent) = counted(&full);
    assert!(known > 100 && absent > COUNT / 2, "{known}, {absent}");
    let Some(gpu) = gpu() else { return };
    held(gpu, || agrees(&shader, &full, &inputs));
    let faults = [
        // A coordinate that overlaps the next, a floor towards zero, another side where two are
        // alike, a level too few, a line too few, a key that is not mixed, a cell's corner.
        ["place.z << 4u", "place.z << 5u"],
        ["select(0, 1, has_rest)", "0"],
        ["size.x >= size.z", "size.x > size.z"],
        ["level++", "level += 2u"],
        ["(word.x + next)", "(word.x + min(next, 2u))"],
        ["3605593784u", "3605593785u"],
        ["u - vec2f(0.5)", "u"],
    ];
    shader.check_with_faults(&faults, |shader| agrees(shader, &roomy, &inputs));
}
