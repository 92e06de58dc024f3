//! Sorts points along two curves and compares how near neighbours in the order are; then looks for
//! neighbours in space.
//!
//! `cargo run -p lightshed-spatial --example spatial_user`
use lightshed_sampling::CounterRng;
use lightshed_spatial::glam::Vec3;
use lightshed_spatial::{Bounds, Curve, CurveOrder, PointGrid, PointGridError, SpatialIndex, SurfaceSite};

const COUNT: u32 = 100_000;

fn main() -> Result<(), PointGridError> {
    // A cloud of points, denser in the middle.
    let points: Vec<Vec3> = (0..COUNT)
        .map(|i| {
            let mut rng = CounterRng::new(1, i, 0);
            let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0;
            place * place.length_squared()
        })
        .collect();

    println!("half area of the boxes of eight consecutive points, summed over {COUNT} points");
    let boxes = |order: &mut dyn Iterator<Item = usize>| {
        let order: Vec<usize> = order.collect();
        let area = |eight: &[usize]| Bounds::of_points(eight.iter().map(|&i| points[i])).half_area();
        order.chunks(8).map(area).sum::<f32>()
    };
    println!("  as they come  {:>10.1}", boxes(&mut (0..points.len())));
    let mut order = CurveOrder::default();
    for curve in [Curve::Morton, Curve::Hilbert] {
        order.encode(&points, |&point| Bounds::of_point(point), curve);
        println!(
            "  {:<12}  {:>10.1}",
            format!("{curve:?}"),
            boxes(&mut order.sort().iter())
        );
    }

    let grid = PointGrid::new(&points, 0.05)?;
    println!(
        "\n{} of its cells of side {:.3} are occupied; points within 0.05 of",
        grid.cell_count(),
        grid.cell_side()
    );
    for x in [0.0, 0.25, 0.5, 1.0, 2.0] {
        let center = Vec3::new(x, 0.0, 0.0);
        let (mut near, mut nearest) = (0, f64::INFINITY);
        grid.for_each_within(center, 0.05, |_, distance_squared| {
            near += 1;
            nearest = nearest.min(distance_squared);
        });
        let cell = grid.locate(&SurfaceSite::new(center, Vec3::Y));
        let own = cell.map_or(0, |cell| grid.points_of(cell).len());
        println!(
            "  x = {x:.2}: {near:>6}, the nearest at {:.4}; {own} in its cell",
            nearest.sqrt()
        );
    }
    Ok(())
}
