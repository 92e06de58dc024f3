//! The nearest surface sites by a tree that the device built are those of a linear scan.

use crate::tests::parity::harness::{Shader, floats};
use crate::tests::support::exact_gpu;
use crate::{BvhBuilder, Gpu, GpuBvh};
use glam::Vec3;
use lightshed_integrator::spatial::{Bounds, Nearest, SiteMetric, SurfaceSite};
use lightshed_sampling::{CounterRng, UniformSphere};

const SITES: usize = 4096;
const QUERIES: usize = 1 << 13;
const WITHIN: f32 = 0.4;
const NORMAL_SCALE: f32 = 0.2;
/// Every so many sites one may not be found.
const GAP: usize = 7;

/// Position, normal, and how many sites are wanted.
type Query = [u32; 7];
/// How many there are, their numbers and their squared distances.
type Found = [u32; 17];

const HOST: &str = "import package::lightshed::nearest_sites::{SiteNode, SurfaceSite};
    @group(0) @binding(2) var<storage, read> tree: array<SiteNode>;
    @group(0) @binding(3) var<storage, read> order: array<u32>;
    @group(0) @binding(4) var<storage, read> sites: array<vec4f>;
    fn load_site_node(index: u32) -> SiteNode { return tree[index]; }
    fn load_surface_site(place: u32) -> SurfaceSite {
        let site = order[place];
        return SurfaceSite(sites[2u * site].xyz, site, sites[2u * site + 1u].xyz, site % 7u != 3u);
    }";

/// Sites on some planes and a ball, many of them in one place, and others anywhere.
fn sites(rng: &mut CounterRng) -> Vec<SurfaceSite> {
    (0..SITES)
        .map(|i| {
            let at = Vec3::from_array([(); 3].map(|()| 2.0 * rng.next_f32() - 1.0));
            let direction = UniformSphere::sample(rng.next_2d());
            match i % 8 {
                0 => SurfaceSite::new(at, direction),
                1 => SurfaceSite::new(Vec3::new(0.25, -0.5, 0.125), Vec3::X),
                2 | 3 => SurfaceSite::new(0.5 * direction, direction),
                // As a camera sees them: dense near by.
                4 => SurfaceSite::new(at * at.x * at.x * 0.1, -Vec3::Y),
                _ => SurfaceSite::new(at.with_z(-1.0), Vec3::Z),
            }
        })
        .collect()
}

fn queries(rng: &mut CounterRng, sites: &[SurfaceSite]) -> Vec<Query> {
    (0..QUERIES)
        .map(|i| {
            let site = sites[rng.next_u32() as usize % SITES];
            let by = [0.0, 0.01, 0.3, 3.0][i % 4];
            let position = site.position + by * UniformSphere::sample(rng.next_2d());
            let normal = match rng.next_u32() % 3 {
                0 => -site.normal,
                1 => UniformSphere::sample(rng.next_2d()),
                _ => site.normal,
            };
            let [x, y, z] = position.to_array().map(f32::to_bits);
            let [nx, ny, nz] = normal.to_array().map(f32::to_bits);
            [x, y, z, nx, ny, nz, [0, 1, 3, 8, 20][i % 5]]
        })
        .collect()
}

/// Whether the device finds what a scan over all sites finds. Where two sites are equally far but
/// for rounding, either may be first.
fn agrees(gpu: &Gpu, shader: &Shader<'_>) -> Result<(), String> {
    let mut rng = CounterRng::new(0x6e65_6172, 0, 0);
    let sites = sites(&mut rng);
    let queries = queries(&mut rng, &sites);
    let boxes: Vec<Bounds> = sites.iter().map(|site| Bounds::of_point(site.position)).collect();
    let rows: Vec<[f32; 8]> = sites
        .iter()
        .map(|site| {
            let ([x, y, z], [nx, ny, nz]) = (site.position.to_array(), site.normal.to_array());
            [x, y, z, 0.0, nx, ny, nz, 0.0]
        })
        .collect();
    let builder = BvhBuilder::new(gpu).expect("it is sound");
    let tree = GpuBvh::new(gpu, SITES).expect("it is small");
    let boxes = gpu.buffer("boxes", &boxes).expect("they are few");
    let mut work = gpu.work();
    builder.build(&mut work, &boxes, &tree);
    work.submit();
    let rows = gpu.buffer("sites", &rows).expect("they are few");
    let shader = Shader {
        buffers: &[&tree.nodes, &tree.order, &rows],
        host: HOST,
        ..*shader
    };
    let found: Vec<Found> = shader.run(gpu, &queries);
    let metric = SiteMetric::new(NORMAL_SCALE).expect("it is finite");
    let (mut count, mut swapped) = (0, 0);
    for (query, found) in queries.iter().zip(&found) {
        let [x, y, z, nx, ny, nz, _] = floats(query);
        let site = SurfaceSite::new(Vec3::new(x, y, z), Vec3::new(nx, ny, nz));
        let mut truth = Nearest::new(query[6].min(8) as usize, WITHIN);
        for (index, other) in (0..).zip(&sites) {
            if index as usize % GAP != 3 {
                truth.offer(index, metric.distance_squared(&site, other));
            }
        }
        let truth = truth.found();
        if truth.len() != found[0] as usize {
            return Err(format!("{} sites for {}", found[0], truth.len()));
        }
        for (place, truth) in truth.iter().enumerate() {
            let (index, squared) = (found[1 + place], f64::from(f32::from_bits(found[9 + place])));
            let rounding = 1e-5 * truth.distance_squared + 1e-12;
            let own = metric.distance_squared(&site, &sites[index as usize]);
            let is_swapped = own != truth.distance_squared && (own - truth.distance_squared).abs() < rounding;
            if !(index == truth.index || is_swapped) || (squared - own).abs() > rounding {
                return Err(format!("{index} at {squared} for {truth:?}"));
            }
            count += 1;
            swapped += u32::from(is_swapped && index != truth.index);
        }
    }
    println!("{count} sites, {swapped} of them swapped with one that is equally far");
    assert!(count > QUERIES && swapped < count as u32 / 500);
    Ok(())
}

#[test]
fn nearest_sites_are_those_of_a_scan() {
    let Some(gpu) = exact_gpu() else { return };
    let body = format!(
        "let found = nearest_sites(
            vec3f(number(0u), number(1u), number(2u)), vec3f(number(3u), number(4u), number(5u)), {SITES}u, word(6u),
            {WITHIN:?}, {NORMAL_SCALE:?},
        );
        put(0u, found.count);
        for (var k = 0u; k < 8u; k++) {{ put(1u + k, found.indices[k]); put_f(9u + k, found.squared[k]); }}"
    );
    let shader = Shader::new("import package::lightshed::nearest_sites::nearest_sites;", &body);
    shader.check_with_faults(
        &[
            // A part of the tree is left out.
            ["next.squared > reach", "next.squared > 0.7 * reach"],
            // The second child is taken for the one behind the first.
            ["2u * left.count", "2u * left.count - 1u"],
            // Normals do not count.
            ["+ scale_squared * ", "+ 0.0 * "],
            // Sites equally far lie as they come.
            [
                "found.indices[place - 1u] > index",
                "found.indices[place - 1u] < index",
            ],
            // A site that is none is found.
            ["!site.is_there", "false"],
        ],
        |shader| agrees(gpu, shader),
    );
}
