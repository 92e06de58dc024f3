//! Cells in a table of bounded size, against a map without bounds.

use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_spatial::glam::Vec3;
use lightshed_spatial::{
    CellKey, CellTable, HashGridError, LevelGrid, LevelGridOptions, SpatialIndex, SurfaceSite,
};
use lightshed_testkit::check_faults;
use std::collections::{HashMap, HashSet};

const OPTIONS: LevelGridOptions = LevelGridOptions {
    cell: 0.125,
    growth: 0.0,
    faces: true,
    facets: false,
};

fn site(number: u32) -> SurfaceSite {
    let mut rng = CounterRng::new(9, number, 0);
    let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
    SurfaceSite::new(place * 40.0 - 20.0, UniformSphere::sample(rng.next_2d()))
        .with_eye_distance(rng.next_f32() * 100.0)
}

/// The key of cell number `number`: any two are different.
fn key(number: u32) -> CellKey {
    let [x, y, z] = [number % 64, number / 64 % 64, number / 4096].map(|c| c as f32 + 0.5);
    let normal = if number.is_multiple_of(2) {
        Vec3::Y
    } else {
        Vec3::NEG_Y
    };
    let grid = LevelGrid::new(OPTIONS).unwrap();
    grid.locate(&SurfaceSite::new(0.125 * Vec3::new(x, y, z), normal))
        .unwrap()
}

/// Cells by the law in `f64`: side, place and face; what is in one cell is at most its diagonal
/// apart, and jitter stays in the plane and within half a cell.
#[test]
fn cells_grow_with_distance() {
    let growth = 0.02;
    let grid = LevelGrid::new(LevelGridOptions { growth, ..OPTIONS }).unwrap();
    for number in 0..20_000 {
        let site = site(number);
        let key = grid.locate(&site).unwrap();
        let wanted = (f64::from(growth) * f64::from(site.eye_distance) / 0.125)
            .log2()
            .floor()
            .max(0.0);
        assert_eq!(f64::from(key.level()), wanted, "{site:?}");
        let side = 0.125 * wanted.exp2();
        assert_eq!(grid.side(key.level()), side);
        for axis in 0..3 {
            let place = f64::from(site.position[axis]) / side;
            assert_eq!(f64::from(key.coordinates()[axis]), place.floor());
        }
        let axis = (key.face() / 2) as usize;
        assert_eq!(site.normal[axis].abs(), site.normal.abs().max_element());
        assert_eq!(site.normal[axis] < 0.0, key.face() % 2 == 1);

        let u = CounterRng::new(10, number, 0).next_2d();
        let moved = grid.jittered(&site, u);
        let by = moved.position - site.position;
        let largest = (u[0] - 0.5).abs().max((u[1] - 0.5).abs()) * side as f32;
        assert!(by.dot(site.normal).abs() < 1e-4, "{by} leaves the plane");
        assert!((by.length() - ((u[0] - 0.5).hypot(u[1] - 0.5)) * side as f32).abs() < 1e-4);
        assert!(by.length() <= largest * 1.4143 + 1e-4);
        assert_eq!(
            (moved.normal, moved.eye_distance),
            (site.normal, site.eye_distance)
        );
    }
    // What is far away gets larger cells until they reach.
    let far = SurfaceSite::new(Vec3::splat(1e9), Vec3::Y);
    assert!(grid.locate(&far).unwrap().level() > 10);
    assert_eq!(grid.locate(&SurfaceSite::new(Vec3::splat(1e30), Vec3::Y)), None);
    assert_eq!(grid.level(f32::NAN), 0);
    assert_eq!(grid.level(-1.0), 0);
    assert_eq!(grid.level(f32::INFINITY), 31);
}

#[test]
fn impossible_hash_grids_are_refused() {
    for cell in [0.0, -1.0, f32::INFINITY] {
        let refused = LevelGrid::new(LevelGridOptions { cell, ..OPTIONS });
        assert_eq!(refused.unwrap_err(), HashGridError::Cell(cell));
    }
    let refused = LevelGrid::new(LevelGridOptions {
        growth: -1.0,
        ..OPTIONS
    });
    assert_eq!(refused.unwrap_err(), HashGridError::Growth(-1.0));
    for slots in [0, (1 << 28) + 1] {
        assert_eq!(CellTable::new(slots).err(), Some(HashGridError::Slots(slots)));
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Two sides of a surface are one cell.
    SharesSides,
    /// Cells that are claimed again stay as old as they were.
    DoesNotTouch,
    /// Cells are kept a pass too long.
    EvictsLate,
    /// Records of cells that come again are not begun anew.
    KeepsRecords,
}

/// A million claims, look-ups and evictions against a map.
#[test]
fn the_table_is_a_map() {
    const KEEP: u32 = 4;
    let faults = [
        Fault::SharesSides,
        Fault::DoesNotTouch,
        Fault::EvictsLate,
        Fault::KeepsRecords,
    ];
    check_faults(&faults, |fault| {
        let (passes, claims) = if fault.is_some() { (12, 500) } else { (100, 5000) };
        let mut table = CellTable::new(1 << 15).unwrap();
        let mut records = vec![u32::MAX; table.slots()];
        // Pass of the last claim, and of the first one since the cell was opened.
        let mut model: HashMap<CellKey, (u32, u32)> = HashMap::new();
        for pass in 0..passes {
            // The cells that are in use wander.
            let number = |i: u32, salt: u64| pass * 97 + CounterRng::new(salt, pass, i).next_u32() % 4096;
            for i in 0..claims {
                let wanted = key(number(i, 1));
                model.entry(wanted).or_insert((pass, pass)).0 = pass;
                match fault {
                    Some(Fault::SharesSides) => table.claim(key(number(i, 1) & !1)),
                    Some(Fault::DoesNotTouch) if table.find(wanted).is_some() => (),
                    _ => table.claim(wanted),
                }
            }
            table.settle(|slot| {
                let record = &mut records[slot as usize];
                if fault != Some(Fault::KeepsRecords) || *record == u32::MAX {
                    *record = pass;
                }
            });
            let late = u32::from(fault == Some(Fault::EvictsLate));
            table.evict(KEEP + late, |_| ());
            model.retain(|_, (last, _)| pass - *last < KEEP);
            for i in 0..claims {
                let wanted = key(number(i, 2));
                let found = table.find(wanted).map(|slot| records[slot as usize]);
                let expected = model.get(&wanted).map(|&(_, first)| first);
                if found != expected {
                    return Err(format!("pass {pass}: {wanted:?} has {found:?}, not {expected:?}"));
                }
            }
            let slots: HashSet<u32> = model.keys().filter_map(|&key| table.find(key)).collect();
            let occupancy = table.occupancy();
            if [slots.len(), occupancy.occupied] != [model.len(); 2] || occupancy.refused > 0 {
                return Err(format!("pass {pass}: {occupancy:?} for {} cells", model.len()));
            }
            if table.occupied().any(|slot| !slots.contains(&slot)) {
                return Err("a slot that no cell has".to_owned());
            }
        }
        Ok(())
    })
    .expect("all faults are noticed");
}

/// Cells with their slots after passes whose claims are dealt to `threads` threads; from the
/// middle one all claim the same cells.
fn by_threads(threads: usize) -> Vec<Option<u32>> {
    let mut table = CellTable::new(1024).unwrap();
    let mut opened = Vec::new();
    for pass in 0..6u32 {
        let keys: Vec<CellKey> = (0..1500)
            .map(|i| key(CounterRng::new(3, pass, i).next_u32() % 3000))
            .collect();
        std::thread::scope(|scope| {
            for thread in 0..threads {
                let (keys, table) = (&keys, &table);
                scope.spawn(move || {
                    let shared = pass == 3;
                    for (i, &key) in keys.iter().enumerate() {
                        if shared || i % threads == thread {
                            table.claim(key);
                        }
                    }
                });
            }
        });
        table.settle(|slot| opened.push(Some(slot)));
        table.evict(2, |slot| opened.push(Some(slot)));
        opened.push(Some(table.occupancy().refused as u32));
    }
    opened.extend((0..3000).map(|number| table.find(key(number))));
    opened
}

#[test]
fn threads_change_nothing() {
    let one = by_threads(1);
    assert!(one.iter().flatten().count() > 1000);
    for threads in [2, 3, 8] {
        assert_eq!(by_threads(threads), one, "{threads} threads");
    }
    // Two threads that claim one cell all the time.
    let mut table = CellTable::new(64).unwrap();
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| (0..100_000).for_each(|_| table.claim(key(7))));
        }
    });
    let mut opened = 0;
    table.settle(|_| opened += 1);
    assert_eq!((opened, table.occupancy().occupied), (1, 1));
}

/// A table that is full refuses the rest, says how many, and has no slot for two cells; what is
/// left makes room.
#[test]
fn a_full_table_refuses() {
    let mut table = CellTable::new(256).unwrap();
    (0..20_000).for_each(|number| table.claim(key(number)));
    table.settle(|_| ());
    let occupancy = table.occupancy();
    assert_eq!(
        (occupancy.occupied, occupancy.slots, occupancy.load()),
        (256, 256, 1.0)
    );
    assert!(occupancy.refused.abs_diff(20_000 - 256) < 400, "{occupancy:?}");
    let found: Vec<u32> = (0..20_000).filter_map(|number| table.find(key(number))).collect();
    assert_eq!(found.len(), 256);
    assert_eq!(found.iter().collect::<HashSet<_>>().len(), 256);
    // One more pass, in which others are claimed: nobody leaves.
    table.claim(key(30_000));
    table.settle(|_| panic!("there is no room"));
    assert_eq!(table.occupancy().refused, 1);
    table.evict(1, |_| ());
    assert_eq!(table.occupancy().evicted, 256);
    table.claim(key(30_000));
    table.settle(|_| ());
    assert!(table.find(key(30_000)).is_some());
    assert_eq!(table.occupancy().occupied, 1);
}

/// A quarter of a million cells have slots of their own, most of them in their first line; at half
/// load four lines are full for one in a hundred thousand cells.
#[test]
fn many_cells_do_not_collide() {
    let count = 1 << 18;
    let mut table = CellTable::new(2 * count as usize).unwrap();
    (0..count).for_each(|number| table.claim(key(number)));
    table.settle(|_| ());
    let occupancy = table.occupancy();
    assert_eq!(occupancy.occupied + occupancy.refused, count as usize);
    assert!(occupancy.refused <= 10, "{occupancy:?}");
    let slots: HashSet<u32> = (0..count).filter_map(|number| table.find(key(number))).collect();
    assert_eq!(slots.len(), occupancy.occupied);
    assert!(occupancy.lines[0] > count as usize * 95 / 100, "{occupancy:?}");
    assert_eq!(occupancy.lines.iter().sum::<usize>(), occupancy.occupied);
}
