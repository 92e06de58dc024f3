//! What trackers cost and what they gain.
//!
//! ```sh
//! cargo bench -p lightshed-volume --bench volume
//! cargo bench -p lightshed-volume --bench volume -- steps
//! ```
//!
//! - `steps`: nanoseconds per lookup of each tracker on a grid of 256³, and lookups per second on two cores;
//! - `forms`: size, error and speed of a grid's forms: dense, sparse, 8 and 4 bits a value, coarser levels;
//! - `variance`: variance times lookups of each estimate of transmittance, in four media. The fourth is the Disney cloud, read
//!   from the folder `LIGHTSHED_SCENES`;
//! - `lamps`: variance of a lamp's light scattered once, by free flights and by equal angles.
//!
//! Times are CPU time of the threads that work, the least of several turns: what other processes take does not count.

mod forms;
mod lamps;
mod steps;
mod support;
mod variance;

fn main() {
    let wanted = |part: &str| {
        let mut given = std::env::args()
            .skip(1)
            .filter(|a| !a.starts_with('-'))
            .peekable();
        given.peek().is_none() || given.any(|g| g == part)
    };
    if wanted("steps") {
        steps::run();
    }
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
