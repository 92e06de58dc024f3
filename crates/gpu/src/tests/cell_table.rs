//! Tables of cells on the device are the host's, and so is who brings something to a cell.

use crate::Gpu;
use crate::cell_table::{CellTableOptions, GpuCellTable};
use crate::programs::CELL_TABLE;
use crate::tests::support::{faulty, gpu};
use glam::Vec3;
use lightshed_integrator::spatial::{CellTable, LevelGrid, LevelGridOptions, SpatialIndex, SurfaceSite};
use lightshed_sampling::CounterRng;
use std::collections::{BTreeMap, BTreeSet};

const CELLS: LevelGridOptions = LevelGridOptions {
    cell: 1.0,
    growth: 0.0,
    faces: false,
    facets: false,
};
/// As the host's.
const RENEWAL_SEED: u64 = 0x776f_726c_6473_6974;

/// The words of some cells in a table.
fn cell_words(count: u32) -> Vec<u64> {
    let grid = LevelGrid::new(CELLS).expect("options are sound");
    let words = |number: u32| {
        let place = Vec3::new((number % 100) as f32, (number / 100) as f32, 0.5);
        let mut table = CellTable::new(1).expect("it is small");
        table.claim(
            grid.locate(&SurfaceSite::new(place, Vec3::Y))
                .expect("it is near"),
        );
        table.settle(|_| ());
        table.words().max().expect("there are slots")
    };
    (0..count).map(words).collect()
}

/// Frames of visitors of 500 cells: whether the table of this program has the words of the host's
/// after each, and whether those of the lowest ranks bring something to their cells.
fn tables_agree(gpu: &Gpu, program: &str, slots: usize, visitors: u32) -> Result<(), String> {
    let grid = LevelGrid::new(CELLS).expect("options are sound");
    let key = |number: u32| {
        let place = Vec3::new((number % 100) as f32, (number / 100) as f32, 0.5);
        grid.locate(&SurfaceSite::new(place, Vec3::Y))
            .expect("it is near")
    };
    let options = CellTableOptions {
        cells: CELLS,
        slots,
        visitors,
        most: 3,
        max_age: 3,
        renewal: 4,
    };
    let found = GpuCellTable::new(gpu, program, options).map_err(|error| error.to_string())?;
    let mut truth = CellTable::new(slots).expect("it is small");
    let words = cell_words(500);
    for frame in 0..20 {
        let chosen: Vec<[u32; 2]> = (0..visitors)
            .map(|i| {
                let mut rng = CounterRng::new(1, frame, i);
                // Some visit nothing; some cells are visited often.
                let number = rng.next_u32() % 600;
                [number >> (rng.next_u32() % 3), rng.next_u32()]
            })
            .collect();
        let of_visitor = |&[number, rank]: &[u32; 2]| {
            let word = words.get(number as usize).copied().unwrap_or(0);
            [word as u32, (word >> 32) as u32, rank, 0]
        };
        let rows: Vec<[u32; 4]> = chosen.iter().map(of_visitor).collect();
        gpu.write(&found.visitors, &rows);
        gpu.write(&found.sited, &vec![1u32; slots]);
        let mut work = gpu.work();
        found.visit(gpu, &mut work, frame);
        work.submit();
        chosen
            .iter()
            .filter(|[number, _]| *number < 500)
            .for_each(|&[number, _]| truth.claim(key(number)));
        let mut opened = BTreeSet::new();
        truth.settle(|slot| {
            opened.insert(slot);
        });
        truth.evict(3, |_| ());
        let on_device: Vec<u64> = gpu.read(&found.words, slots).expect("the device answers");
        if on_device != truth.words().collect::<Vec<_>>() {
            return Err(format!("{slots} slots, frame {frame}: other words"));
        }
        let mut cells: BTreeMap<u32, Vec<(u32, u32)>> = BTreeMap::new();
        for (i, &[number, rank]) in (0..).zip(&chosen) {
            let slot = (number < 500).then(|| truth.find(key(number))).flatten();
            if let Some(slot) = slot {
                cells.entry(slot).or_default().push((rank >> 16, i));
            }
        }
        let [count] = gpu
            .read::<u32>(&found.visit_count, 1)
            .expect("the device answers")[..]
        else {
            return Err("no count".to_owned());
        };
        if count as usize != cells.len() {
            return Err(format!("frame {frame}: {count} cells of {}", cells.len()));
        }
        let visits: Vec<[u32; 4]> = gpu
            .read(&found.visits, count as usize)
            .expect("the device answers");
        let indices: Vec<u32> = gpu
            .read(found.indices(), visitors as usize)
            .expect("the device answers");
        for [slot, first, bringing, moves] in visits {
            let Some(mut those) = cells.remove(&slot) else {
                return Err(format!("frame {frame}: a cell twice, or none"));
            };
            those.sort_unstable();
            those.truncate(3);
            let bring: Vec<u32> = those.into_iter().map(|(_, i)| i).collect();
            let range = first as usize..(first + bringing) as usize;
            // All cells had a site, but those that are new, and all in the first frame.
            let is_new = frame == 0 || opened.contains(&slot);
            let renewed = CounterRng::at(RENEWAL_SEED, slot, frame + 1, 0).is_multiple_of(4);
            if indices[range] != bring || (moves != 0) != (is_new || renewed) {
                return Err(format!("frame {frame}: others bring something, or a site moves"));
            }
        }
    }
    Ok(())
}

/// Words of a table with room, of one that is nearly full and of one that is overfull, over frames
/// in which cells come and go; and who brings something. Faults are noticed.
#[test]
fn cells_are_claimed_as_on_the_host() {
    let Some(gpu) = gpu() else { return };
    for (slots, visitors) in [(1024, 700), (512, 900), (64, 900)] {
        assert_eq!(tables_agree(gpu, CELL_TABLE, slots, visitors), Ok(()));
    }
    for fault in [
        // The smaller word keeps a slot; the one that lost it starts where the other was; a cell is
        // kept for a frame too long; ranks do not count; sites stay; claims are kept.
        ["a.y < b.y", "a.y > b.y"],
        ["(line - other.x)", "(line - word.x)"],
        ["table.frame + 1u - ", "table.frame - "],
        ["(visitor.rank >> (32u - RANK_BITS))", "0u"],
        [
            "random_word(RENEWAL_SEED, slot, ",
            "random_word(RENEWAL_SEED, 0u, ",
        ],
        ["atomicStore(&claims[slot], 0u);", ""],
    ] {
        let program = faulty(CELL_TABLE, fault);
        let found = tables_agree(gpu, &program, 512, 900);
        println!("  {found:?}");
        assert!(found.is_err(), "{fault:?}");
    }
}
