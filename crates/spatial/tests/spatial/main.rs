//! What holds for every index, and searches against looking at every point.

mod curves;
mod hash_grid;
mod morton;
mod nearest;
mod octree;

use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_spatial::glam::{DVec3, Vec3};
use lightshed_spatial::{
    AdaptiveOctree, Bounds, CellRanges, CubicGrid, HashGrid, KEY_BITS, KeyedIndex, LevelGridOptions,
    PointGrid, PointGridError, SpatialIndex, SurfaceSite, finest_bits_below, morton30_decode, sort_by_key,
};
use lightshed_testkit::check_faults;
use std::collections::{HashMap, HashSet};

fn points(count: u32, seed: u64) -> Vec<Vec3> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(seed, i, 0);
            let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            // Half of them in a corner, some of them twice.
            if i % 2 == 0 {
                place * 0.02
            } else {
                (place * 50.0).round() / 50.0
            }
        })
        .collect()
}

/// Sites near and far, on borders of cells, and such as no scene has.
fn sites() -> Vec<SurfaceSite> {
    let mut sites: Vec<SurfaceSite> = points(2000, 3)
        .into_iter()
        .map(|p| {
            let mut rng = CounterRng::new(4, p.x.to_bits(), 0);
            SurfaceSite::new(p * 2.0 - 0.5, UniformSphere::sample(rng.next_2d()))
                .with_eye_distance(rng.next_f32())
        })
        .collect();
    for x in [
        0.0,
        -0.0,
        0.25,
        1.0,
        -1e-30,
        1e9,
        f32::MAX,
        f32::MIN,
        f32::INFINITY,
        f32::NAN,
    ] {
        for normal in [Vec3::Y, Vec3::ZERO, Vec3::NAN] {
            sites.push(SurfaceSite::new(Vec3::splat(x), normal));
            sites.push(SurfaceSite::new(Vec3::new(x, 0.5, 0.5), normal).with_eye_distance(f32::INFINITY));
        }
    }
    sites
}

/// What [`SpatialIndex`] promises: one answer for one site, none for what is not a place; and that
/// cells are small: sites of one cell are at most `diameter` apart.
fn check_index<I: SpatialIndex>(index: &I, diameter: f64) -> Result<(), String> {
    let mut members: HashMap<I::Cell, Vec<Vec3>> = HashMap::new();
    for site in sites() {
        let cell = index.locate(&site);
        if cell != index.locate(&site) || cell != (&index).locate(&site) {
            return Err(format!("{site:?} has two answers"));
        }
        match cell {
            Some(_) if !site.position.is_finite() => return Err(format!("{site:?} has a cell")),
            Some(cell) => members.entry(cell).or_default().push(site.position),
            None => (),
        }
    }
    if members.len() < 8 {
        return Err(format!("{} cells are no partition", members.len()));
    }
    for (cell, members) in &members {
        for pair in members.windows(2) {
            if pair[0].as_dvec3().distance(pair[1].as_dvec3()) > diameter * (1.0 + 1e-9) {
                return Err(format!("{pair:?} share {cell:?}"));
            }
        }
    }
    Ok(())
}

#[test]
fn indices_keep_their_promises() {
    /// An index that is wrong in one way.
    struct Faulty(CubicGrid, Fault);
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// The cast of NaN is a cell.
        NotANumber,
        /// Truncation instead of the floor: the cells around 0 are one.
        TowardsZero,
        /// One cell for everything.
        Everything,
    }
    impl SpatialIndex for Faulty {
        type Cell = [i64; 3];
        fn locate(&self, site: &SurfaceSite) -> Option<[i64; 3]> {
            let at = self.0.in_cells(site.position);
            let finite = site.position.is_finite().then_some(());
            match self.1 {
                Fault::NotANumber => Some(at.floor().to_array().map(|c| c as i64)),
                Fault::TowardsZero => finite.map(|()| at.to_array().map(|c| c as i64)),
                Fault::Everything => finite.map(|()| [0; 3]),
            }
        }
    }
    let grid = CubicGrid::new(DVec3::ZERO, 0.125);
    let faults = [Fault::NotANumber, Fault::TowardsZero, Fault::Everything];
    let diameter = 0.125 * 3.0f64.sqrt();
    check_faults(&faults, |fault| match fault {
        Some(fault) => check_index(&Faulty(grid, fault), diameter),
        None => check_index(&grid, diameter),
    })
    .expect("every fault is noticed");
    let points = PointGrid::new(&points(4000, 1), 0.1).unwrap();
    check_index(&points, points.cell_side() * 3.0f64.sqrt()).expect("a grid of points is an index");
    let bounds = Bounds::new(Vec3::splat(-0.5), Vec3::splat(1.5));
    let tree = AdaptiveOctree::new(bounds).unwrap();
    check_index(&tree, f64::from(tree.side()) * 0.5 * 3.0f64.sqrt()).expect("an octree is an index");
    let options = LevelGridOptions {
        cell: 0.125,
        growth: 0.0,
        faces: true,
        facets: false,
    };
    let mut table = HashGrid::new(options, 1 << 14).unwrap();
    check_index(&table.cells, diameter).expect("a grid of levels is an index");
    sites().iter().for_each(|site| _ = table.claim(site));
    table.table.settle(|_| ());
    check_index(&table, diameter).expect("a hash grid is an index");
}

/// Every point is in the cell where it is located, and is found there alone.
#[test]
fn points_are_in_their_cells() {
    for (count, cell) in [(1, 1.0), (2, 1e-6), (50, 0.3), (3000, 0.01), (3000, 5.0)] {
        let points = points(count, 7);
        let grid = PointGrid::new(&points, cell).unwrap();
        assert_eq!(grid.len(), points.len());
        assert!(grid.cell_side() >= f64::from(cell));
        let mut seen = HashSet::new();
        for cell in 0..grid.cell_count() as u32 {
            assert!(grid.points_of(cell).len() > 0);
            for index in grid.points_of(cell) {
                let site = SurfaceSite::new(points[index as usize], Vec3::ZERO);
                assert_eq!(grid.locate(&site), Some(cell));
                assert!(seen.insert(index));
            }
        }
        assert_eq!(seen.len(), points.len());
        assert_eq!(grid.points_of(grid.cell_count() as u32).len(), 0);
    }
}

/// Searches of every size, also from outside, against a look at every point; a search that leaves
/// out the rim is noticed.
#[test]
fn all_points_within_a_radius_are_found() {
    for (count, cell) in [(0, 1.0), (1, 0.5), (300, 0.05), (5000, 0.02)] {
        let points = points(count, 11);
        let grid = PointGrid::new(&points, cell).unwrap();
        let faults: &[f32] = if count > 100 { &[1.0 - 1e-3] } else { &[] };
        check_faults(faults, |fault| {
            for query in 0..200 {
                let mut rng = CounterRng::new(12, query, count);
                let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                // Some of them at a point, so that others lie on the rim.
                let center = match points.get(query as usize) {
                    Some(&point) if query % 3 == 0 => point,
                    _ => place * 1.6 - 0.3,
                };
                let radius = [0.02, 0.1, 1.0 / 50.0, 0.7, 4.0][query as usize % 5];
                let mut found = Vec::new();
                grid.for_each_within(center, radius * fault.unwrap_or(1.0), |index, _| {
                    found.push(index)
                });
                found.sort_unstable();
                let within =
                    |p: &Vec3| p.as_dvec3().distance_squared(center.as_dvec3()) <= f64::from(radius).powi(2);
                let expected: Vec<u32> = (0..count).filter(|&i| within(&points[i as usize])).collect();
                if found != expected {
                    return Err(format!("{} of {} around {center}", found.len(), expected.len()));
                }
            }
            Ok(())
        })
        .expect("a smaller radius is noticed");
        let mut visited = 0;
        grid.for_each_within(Vec3::NAN, 1.0, |_, _| visited += 1);
        grid.for_each_within(Vec3::ZERO, f32::NAN, |_, _| visited += 1);
        grid.for_each_within(Vec3::ZERO, -1.0, |_, _| visited += 1);
        assert_eq!(visited, 0);
        grid.for_each_within(Vec3::ZERO, f32::INFINITY, |_, _| visited += 1);
        assert_eq!(visited, count);
    }
}

#[test]
fn impossible_grids_are_refused() {
    assert_eq!(
        PointGrid::new(&[Vec3::ZERO, Vec3::NAN], 1.0).unwrap_err(),
        PointGridError::Position(1)
    );
    for cell in [0.0, -1.0, f32::INFINITY] {
        assert_eq!(PointGrid::new(&[], cell).unwrap_err(), PointGridError::Cell(cell));
    }
    // The whole range of coordinates, and cells that are nothing beside it.
    let far = [Vec3::MIN, Vec3::MAX, Vec3::ZERO];
    let grid = PointGrid::new(&far, f32::MIN_POSITIVE).unwrap();
    assert!(
        far.iter()
            .all(|&p| grid.locate(&SurfaceSite::new(p, Vec3::ZERO)).is_some())
    );
}

/// Coarser cells are the leading bits of one key, and the finest grid below a number of cells is
/// that of counting.
#[test]
fn keys_hold_all_coarser_grids() {
    let points = points(2000, 5);
    let finest = CubicGrid::new(DVec3::ZERO, 1.0 / 1024.0);
    let mut pairs: Vec<KeyedIndex> = (0..)
        .zip(&points)
        .map(|(i, &p)| KeyedIndex::new(finest.key(p), i))
        .collect();
    sort_by_key(&mut pairs, &mut Vec::new());
    let mut ranges = CellRanges::default();
    let mut counts = Vec::new();
    for bits in 0..=KEY_BITS {
        ranges.collect(&pairs, bits);
        let side = 1u32 << bits;
        let cell_of = |p: Vec3| (p * side as f32).to_array().map(|c| (c as u32).min(side - 1));
        for (number, place) in ranges.grid().places().enumerate() {
            for pair in &pairs[ranges.items(number)] {
                assert_eq!(cell_of(points[pair.index() as usize]), place);
                assert_eq!(morton30_decode(pair.key() >> (3 * (KEY_BITS - bits))), place);
            }
        }
        let distinct: HashSet<[u32; 3]> = points.iter().map(|&p| cell_of(p)).collect();
        assert_eq!(ranges.grid().len(), distinct.len());
        counts.push(distinct.len());
    }
    for limit in [1, 2, 9, 100, 1000, 1500, usize::MAX] {
        let expected = counts
            .iter()
            .take_while(|&&count| count < limit)
            .count()
            .saturating_sub(1);
        assert_eq!(finest_bits_below(&pairs, limit) as usize, expected);
    }
}
