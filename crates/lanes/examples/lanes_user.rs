//! A user's example: eight pixels of the Mandelbrot set at a time, with the same bits on any
//! machine.
//!
//! `cargo run --release -p lightshed-lanes --example lanes_user`
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, LaneMask, Lanes};

/// Steps until `z² + c` leaves the disk of radius 2, for eight `c` on a row.
struct Escape {
    re: [f32; LANES],
    im: f32,
    most: u32,
}

impl LaneKernel for Escape {
    type Output = [u32; LANES];

    // All that is called on lanes must be inlined here; a closure would not be.
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let (re, im) = (L::load(&self.re), L::splat(self.im));
        let (mut x, mut y) = (L::splat(0.0), L::splat(0.0));
        let mut steps = [0; LANES];
        for _ in 0..self.most {
            let inside = (x * x + y * y).less_equal(L::splat(4.0)).bits();
            if inside == 0 {
                break;
            }
            for (lane, steps) in steps.iter_mut().enumerate() {
                *steps += inside >> lane & 1;
            }
            (x, y) = (x * x - y * y + re, (x + x) * y + im);
        }
        steps
    }
}

fn main() {
    const SHADES: &[u8] = b" .:-=+*#%@";
    for row in 0..24 {
        let mut line = String::new();
        for column in (0..72).step_by(LANES) {
            let escape = |choice: LaneChoice| {
                choice.run(Escape {
                    re: std::array::from_fn(|lane| (column + lane) as f32 / 24.0 - 2.2),
                    im: row as f32 / 10.0 - 1.2,
                    most: 200,
                })
            };
            let steps = escape(LaneChoice::best());
            assert_eq!(
                steps,
                escape(LaneChoice::ARRAY),
                "plain arrays give the same bits"
            );
            for steps in steps {
                let shade = (f64::from(steps).ln() / 200f64.ln() * 9.0).max(0.0) as usize;
                line.push(char::from(SHADES[shade.min(9)]));
            }
        }
        println!("{line}");
    }
}
