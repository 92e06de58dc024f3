//! Renders a built-in scene, a Mitsuba 3 XML file or a glTF file, and compares it with a reference
//! image.
//!
//! ```text
//! cargo run --release --example render -- cornell --spp 256 --out cornell.exr
//! ```
//!
//! `--shard` renders a part of the samples, for the program `merge`, and `--submit` writes what a
//! scheduler needs for all parts: see `docs/distribution.md`. `--help` lists the options. The exit
//! status is 0 if all went well, 1 if the scene could not be rendered or the image not be written,
//! 2 if the command line is wrong, and 130 after an interruption (SIGINT, SIGTERM, SIGHUP), which
//! writes the whole passes done so far. Whatever can be known to fail fails before rendering, with
//! one line on the standard error stream. A scene's file is taken for untrusted: what reading it
//! may cost and which folders it may read have limits, which `--load-limit` and `--allow-folder`
//! widen.

mod arguments;
mod chosen;
mod emptiness;
#[path = "../common/error_chain.rs"]
mod error_chain;
mod explain;
mod failure;
mod gpu;
mod interruption;
mod motion;
mod progress;
mod rendered;
mod report;
mod session;
mod shards;
#[path = "../common/streams.rs"]
mod streams;
mod submit;

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = match arguments::parse(std::env::args_os()) {
        Ok(arguments) => arguments,
        Err(exit) => return exit,
    };
    match session::run(&arguments) {
        Ok(exit) => exit,
        Err(failure) => {
            streams::complain(format_args!("error: {failure}"));
            ExitCode::FAILURE
        }
    }
}
