//! A user's example: a ball of fog, and three estimates of how much light comes through it.
//!
//! `cargo run --release -p lightshed-volume --example volume_user`
use lightshed_sampling::CounterRng;
use lightshed_volume::glam::Vec3;
use lightshed_volume::{
    Control, DenseGrid, DensityField, FieldRay, Filter, Interval, MajorantGrid, delta_tracking,
    ratio_tracking, regular_depth, residual_ratio_tracking,
};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    // 32³ voxels, bounds of the density in super-voxels of 8.
    let grid = DenseGrid::from_fn([32; 3], Filter::Trilinear, |[x, y, z]| {
        let from_center = Vec3::new(x as f32, y as f32, z as f32) - 15.5;
        (1.0 - from_center.length() / 16.0).max(0.0)
    })?;
    let majorants = MajorantGrid::new(&grid, 8.0)?;
    let (k, endless) = (0.15, Interval { t0: 0.0, t1: 100.0 });
    const SHADES: &[u8] = b"@%#*+=-:. ";
    for row in 0..16 {
        let shade = |column: usize| {
            let from = Vec3::new(column as f32 + 0.5, 2.0 * row as f32 + 0.5, -1.0);
            let through = regular_depth(&grid, &FieldRay::new(from, Vec3::Z), endless).transmittance(k);
            char::from(SHADES[((through * 9.9) as usize).min(9)])
        };
        println!("{}", (0..32).map(shade).collect::<String>());
    }

    let ray = FieldRay::new(Vec3::new(12.3, 15.2, -1.0), Vec3::Z);
    let exact = f64::from(regular_depth(&grid, &ray, endless).transmittance(k));
    println!("transmittance {exact:.6}; relative error and density lookups of a mean over n");
    println!(
        "{:>6} {:>22} {:>22} {:>22}",
        "n", "delta tracking", "ratio tracking", "residual ratio"
    );
    for n in [16, 256, 4096, 65536] {
        let mean = |estimate: &dyn Fn(&mut CounterRng) -> (f32, u32)| {
            let (mut sum, mut lookups) = (0.0, 0u64);
            for i in 0..n {
                let (value, cost) = estimate(&mut CounterRng::new(1, n, i));
                (sum, lookups) = (sum + f64::from(value), lookups + u64::from(cost));
            }
            format!(
                "{:>12.5} {:>9}",
                (sum / f64::from(n) / exact - 1.0).abs(),
                lookups
            )
        };
        let segments = || majorants.segments(&ray, endless);
        let delta = mean(&|rng| {
            let flight = delta_tracking(&mut grid.accessor(), &ray, segments(), k, rng);
            (f32::from(u8::from(flight.distance.is_none())), flight.lookups)
        });
        let ratio = mean(&|rng| {
            let through = ratio_tracking(&mut grid.accessor(), &ray, segments(), k, rng);
            (through.value, through.lookups)
        });
        let residual = mean(&|rng| {
            let through =
                residual_ratio_tracking(&mut grid.accessor(), &ray, segments(), k, Control::Minorant, rng);
            (through.value, through.lookups)
        });
        println!("{n:>6} {delta} {ratio} {residual}");
    }
    Ok(())
}
