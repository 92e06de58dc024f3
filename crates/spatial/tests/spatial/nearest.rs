//! The nearest sites, against a look at every one.

use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_spatial::glam::Vec3;
use lightshed_spatial::{
    Nearest, NearestSites, Neighbour, PointGridError, SiteGrid, SiteMetric, SiteTree, SiteTreeError,
    SurfaceSite,
};
use lightshed_testkit::check_faults;

/// Sites on a plane, in a dense corner, some of them several times.
fn sites(count: u32, seed: u64) -> Vec<SurfaceSite> {
    (0..count)
        .map(|index| {
            // Some have the position of the one before.
            let mut rng = CounterRng::new(seed, index - index % 7 / 6, 0);
            let mut place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            match index % 3 {
                0 => place.y = 0.25,
                1 => place *= 0.01,
                _ => (),
            }
            let mut rng = CounterRng::new(seed + 1, index, 0);
            SurfaceSite::new(place, UniformSphere::sample(rng.next_2d()))
        })
        .collect()
}

/// What searches may get wrong.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// The search is cut off at a hundredth less.
    TooNear,
    /// Normals are not looked at.
    NoNormals,
}

fn agrees(search: &dyn NearestSites, sites: &[SurfaceSite], fault: Option<Fault>) -> Result<(), String> {
    let mut expected = Nearest::new(0, 0.0);
    for query in 0..120u32 {
        let mut rng = CounterRng::new(77, query, 0);
        let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 1.6 - 0.3;
        let place = match query % 4 {
            0 => place * 0.02,
            1 => sites[query as usize % sites.len()].position,
            _ => place,
        };
        let site = SurfaceSite::new(place, UniformSphere::sample(rng.next_2d()));
        let within = [f32::INFINITY, 0.3, 0.02, 0.0][query as usize / 4 % 4];
        let scale = [0.0, 0.05, 1.0][query as usize % 3];
        let metric = SiteMetric::new(scale).unwrap();
        let count = [1, 3, 9, 200, 0][query as usize % 5];
        let too_near = matches!(fault, Some(Fault::TooNear));
        let mut found = Nearest::new(count, within * if too_near { 0.99 } else { 1.0 });
        // What was there before is forgotten.
        found.offer(12345, 0.0);
        let blind = matches!(fault, Some(Fault::NoNormals));
        search.nearest(
            &site,
            if blind { SiteMetric::POSITION } else { metric },
            &mut found,
        );
        expected.clone_from(&Nearest::new(count, within));
        sites.nearest(&site, metric, &mut expected);
        if found.found() != expected.found() {
            return Err(format!(
                "query {query}: {:?}, not {:?}",
                found.found(),
                expected.found()
            ));
        }
    }
    Ok(())
}

#[test]
fn searches_find_what_a_look_at_every_site_finds() {
    for count in [1, 2, 8, 9, 60, 4000] {
        let sites = sites(count, 5);
        let searches: [&dyn NearestSites; 2] =
            [&SiteGrid::new(&sites).unwrap(), &SiteTree::new(&sites).unwrap()];
        for search in searches {
            let faults: &[Fault] = if count > 100 {
                &[Fault::TooNear, Fault::NoNormals]
            } else {
                &[]
            };
            check_faults(faults, |fault| agrees(search, &sites, fault)).unwrap();
        }
    }
}

/// The list itself, against sorting.
#[test]
fn the_list_keeps_the_nearest_in_order() {
    for (most, within) in [
        (0, 1.0),
        (1, 1.0),
        (4, 1.0),
        (4, 0.5),
        (50, 0.7),
        (3, f32::NAN),
        (3, -1.0),
    ] {
        let mut nearest = Nearest::new(most, within);
        let mut all = Vec::new();
        for index in 0..40u32 {
            // Every distance twice, in no order.
            let distance_squared = f64::from(index * 7 % 20) / 20.0;
            nearest.offer(index, distance_squared);
            all.push(Neighbour {
                index,
                distance_squared,
            });
        }
        nearest.offer(99, f64::NAN);
        let within = f64::from(within);
        all.retain(|site| within >= 0.0 && site.distance_squared <= within * within);
        all.sort_by(|a, b| {
            (a.distance_squared, a.index)
                .partial_cmp(&(b.distance_squared, b.index))
                .unwrap()
        });
        all.truncate(most);
        assert_eq!(nearest.found(), all, "{most} within {within}");
    }
}

#[test]
fn places_that_are_none_are_refused_and_found_nowhere() {
    let nowhere = SurfaceSite::new(Vec3::new(0.0, f32::NAN, 0.0), Vec3::Y);
    let far = SurfaceSite::new(Vec3::MAX, Vec3::Y);
    let fine = SurfaceSite::new(Vec3::ZERO, Vec3::Y);
    assert_eq!(
        SiteTree::new(&[fine, nowhere]).unwrap_err(),
        SiteTreeError::Position(1)
    );
    assert_eq!(
        SiteGrid::new(&[fine, nowhere]).unwrap_err(),
        PointGridError::Position(1)
    );
    assert_eq!(SiteMetric::new(-1.0), None);
    assert_eq!(SiteMetric::new(f32::INFINITY), None);
    let sites = [fine, far];
    let mut found = Nearest::new(3, f32::INFINITY);
    let searches: [&dyn NearestSites; 2] = [&SiteGrid::new(&sites).unwrap(), &SiteTree::new(&sites).unwrap()];
    for search in searches {
        search.nearest(&nowhere, SiteMetric::POSITION, &mut found);
        assert!(found.found().is_empty());
        search.nearest(&far, SiteMetric::POSITION, &mut found);
        assert_eq!(found.found()[0].index, 1);
    }
    let empty: [&dyn NearestSites; 2] = [&SiteGrid::default(), &SiteTree::default()];
    for search in empty {
        search.nearest(&fine, SiteMetric::POSITION, &mut found);
        assert!(found.found().is_empty());
    }
}

/// A search of few leaves finds what it looks at, in order, and little farther than the nearest.
#[test]
fn few_leaves_find_near_sites() {
    let sites: Vec<SurfaceSite> = (0..4000)
        .map(|index| {
            let mut rng = CounterRng::new(9, index, 0);
            let place = Vec3::new(rng.next_f32(), rng.next_f32(), 0.0);
            SurfaceSite::new(place, UniformSphere::sample(rng.next_2d()))
        })
        .collect();
    let tree = SiteTree::new(&sites).unwrap();
    let metric = SiteMetric::new(0.01).unwrap();
    let (mut few, mut all) = (Nearest::new(3, 1.0), Nearest::new(3, 1.0));
    let mut means = [0.0; 4];
    for query in 0..400 {
        let mut rng = CounterRng::new(10, query, 0);
        let place = Vec3::new(rng.next_f32(), rng.next_f32(), 0.01);
        let site = SurfaceSite::new(place, UniformSphere::sample(rng.next_2d()));
        tree.nearest(&site, metric, &mut all);
        let mut before = f64::INFINITY;
        for (mean, leaves) in means.iter_mut().zip([1, 2, 4, u32::MAX]) {
            few.offer(12345, 0.0);
            tree.near(&site, metric, leaves, &mut few);
            assert_eq!(few.found().len(), 3);
            for neighbour in few.found() {
                let distance = metric.distance_squared(&site, &sites[neighbour.index as usize]);
                assert_eq!(neighbour.distance_squared, distance);
            }
            let last = few.found()[2].distance_squared;
            assert!(last <= before && last >= all.found()[2].distance_squared);
            (*mean, before) = (*mean + last.sqrt() / 400.0, last);
        }
        assert_eq!(few.found(), all.found());
    }
    assert!(means[0] > means[1] && means[0] < 1.6 * means[3], "{means:?}");
    tree.near(&sites[0], metric, 0, &mut few);
    assert!(few.found().is_empty());
}
