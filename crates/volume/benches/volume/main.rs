//! What trackers gain, and what forms of grids cost. (What trackers cost is the bench `trackers`.)
//!
//! ```sh
//! cargo bench -p lightshed-volume --bench volume
//! cargo bench -p lightshed-volume --bench volume -- forms
//! ```
//!
//! - `forms`: size, error and speed of a grid's forms: dense, sparse, 8 and 4 bits a value, coarser
//!   levels;
//! - `variance`: variance times lookups of each estimate of transmittance, in four media. The
//!   fourth is the Disney cloud, read from the folder `LIGHTSHED_SCENES`;
//! - `lamps`: variance of a lamp's light scattered once, by free flights and by equal angles.
//!
//! Times are CPU time of the threads that work, the least of several turns: what other processes
//! take does not count.

mod clock;
mod fields;
mod forms;
mod lamps;
mod variance;

fn main() {
    let wanted = |part: &str| {
        let mut given = std::env::args()
            .skip(1)
            .filter(|a| !a.starts_with('-'))
            .peekable();
        given.peek().is_none() || given.any(|g| g == part)
    };
    if wanted("forms") {
        forms::run();
    }
    if wanted("variance") {
        variance::run();
    }
    if wanted("lamps") {
        lamps::run();
    }
}
