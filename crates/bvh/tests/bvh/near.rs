//! What lies near a point, against a look at everything.

use crate::builds;
use lightshed_bvh::glam::Vec3;
use lightshed_bvh::{Bounds, Bvh};
use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_spatial::{Nearest, NearestSites, SiteMetric, SurfaceSite};
use lightshed_testkit::check_faults;

/// A tree over the positions of sites.
struct Sites {
    tree: Bvh,
    sites: Vec<SurfaceSite>,
    /// The planted fault: a search that leaves out what is a little nearer than its radius.
    short: bool,
}

impl NearestSites for Sites {
    fn nearest(&self, site: &SurfaceSite, metric: SiteMetric, found: &mut Nearest) {
        found.clear();
        let factor = if self.short { 0.7 } else { 1.0 };
        self.tree
            .for_each_near(site.position, found.reach_squared() * factor, |index| {
                let other = &self.sites[index as usize];
                found.offer(index, metric.distance_squared(site, other));
                found.reach_squared() * factor
            });
    }
}

#[test]
fn the_nearest_are_those_of_a_look_at_every_site() {
    let site = |index: u32, seed: u64| {
        let mut rng = CounterRng::new(seed, index, 0);
        let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
        let place = if index.is_multiple_of(3) {
            place * 0.01
        } else {
            place
        };
        SurfaceSite::new(place, UniformSphere::sample(rng.next_2d()))
    };
    for count in [1, 2, 700] {
        let sites: Vec<SurfaceSite> = (0..count).map(|index| site(index, 3)).collect();
        let boxes: Vec<Bounds> = sites.iter().map(|site| Bounds::of_point(site.position)).collect();
        for (name, options) in builds() {
            let tree = Bvh::build(&boxes, options).unwrap();
            let faults: &[bool] = if count > 2 { &[true] } else { &[] };
            check_faults(faults, |fault| {
                let search = Sites {
                    tree: tree.clone(),
                    sites: sites.clone(),
                    short: fault == Some(true),
                };
                for query in 0..60 {
                    let (most, within) = (
                        [1, 4, 30][query as usize % 3],
                        [f32::INFINITY, 0.2][query as usize % 2],
                    );
                    let (mut found, mut expected) = (Nearest::new(most, within), Nearest::new(most, within));
                    let metric = SiteMetric::new([0.0, 0.1][query as usize / 2 % 2]).unwrap();
                    let at = site(query, 4);
                    search.nearest(&at, metric, &mut found);
                    sites.nearest(&at, metric, &mut expected);
                    if found.found() != expected.found() {
                        return Err(format!("{name}: query {query}"));
                    }
                }
                Ok(())
            })
            .unwrap();
        }
    }
}

#[test]
fn nothing_is_near_to_nowhere() {
    let boxes: Vec<Bounds> = (0..9).map(|i| Bounds::of_point(Vec3::splat(i as f32))).collect();
    let tree = Bvh::build(&boxes, builds()[0].1).unwrap();
    let visited = |point: Vec3, within: f64| {
        let mut visited = 0;
        tree.for_each_near(point, within, |_| {
            visited += 1;
            within
        });
        visited
    };
    assert_eq!(visited(Vec3::ZERO, f64::INFINITY), 9);
    assert_eq!(visited(Vec3::ZERO, 3.5), 2);
    assert_eq!(visited(Vec3::ZERO, f64::NAN), 0);
    assert_eq!(visited(Vec3::ZERO, -1.0), 0);
    Bvh::default().for_each_near(Vec3::ZERO, 1.0, |_| unreachable!("an empty tree"));
}
