//! What hot functions cost beside what limits them on the same machine: a table made from the
//! results of the benchmarks.
//!
//! ```sh
//! cargo bench --workspace --features lightshed-lights/parallel \
//!     $(cargo run -q --example costs -- --benches) -- \
//!     --warm-up-time 0.3 --measurement-time 1 --sample-size 20
//! cargo run --release --example costs > docs/costs.md
//! ```
//!
//! A benchmark that no rule knows is an error, and so is one without a limit to hold it against.

mod limits;
mod results;
mod rules;

use limits::Limits;
use results::{Cost, read_costs};
use std::collections::BTreeMap;
use std::error::Error;
use std::path::PathBuf;

/// Benches whose results make the table.
const BENCHES: [&str; 12] = [
    "limits",
    "sampling",
    "warps",
    "resampling",
    "emitters",
    "materials",
    "rays",
    "lights",
    "lighting_grid",
    "paths",
    "film",
    "trackers",
];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [flag] if flag == "--benches" => {
            println!("{}", BENCHES.map(|name| format!("--bench {name}")).join(" "));
            return Ok(());
        }
        [] | [_] => {}
        _ => return Err("usage: costs [--benches | FOLDER of criterion's results]".into()),
    }
    let folder = match arguments.first() {
        Some(folder) => PathBuf::from(folder),
        None => {
            let program = std::env::current_exe()?;
            let target = program
                .ancestors()
                .nth(3)
                .ok_or("the program lies outside a target folder")?;
            target.join("criterion")
        }
    };
    let costs = read_costs(&folder)?;
    let limits = Limits::of(&costs)?;
    print!("{}", page(&costs, &limits)?);
    Ok(())
}

/// The table, crate by crate.
fn page(costs: &BTreeMap<String, Cost>, limits: &Limits<'_>) -> Result<String, Box<dyn Error>> {
    let mut page = String::from(HEAD);
    let mut heading = "";
    let mut sorted: Vec<(&String, &Cost)> = costs.iter().collect();
    let function = |id: &str| {
        id.rsplit_once('/')
            .map_or(id.to_owned(), |(function, _)| function.to_owned())
    };
    sorted.sort_by(|a, b| {
        function(a.0)
            .cmp(&function(b.0))
            .then(a.1.size.total_cmp(&b.1.size))
    });
    for (id, cost) in sorted {
        let (part, rest) = id.split_once('/').unwrap_or((id, ""));
        if part == "limits" {
            continue;
        }
        if part != heading {
            heading = part;
            page +=
                &format!("\n## {part}\n\n| benchmark | ns | limit | ns | times |\n|---|---|---|---|---|\n");
        }
        let rule = rules::find(id).ok_or_else(|| format!("no limit is known for {id}"))?;
        let limit =
            (rule.limit)(limits, cost.size).ok_or_else(|| format!("what limits {id} was not measured"))?;
        let times = cost.nanoseconds / limit;
        page += &format!(
            "| `{rest}` | {} | {} | {} | {} |\n",
            short(cost.nanoseconds),
            rule.what,
            short(limit),
            short(times)
        );
    }
    Ok(page)
}

const HEAD: &str = "# Costs\n
The commands at the head of `examples/costs/main.rs` make this table. Values are medians of one call, or of one element that a call processes, in
nanoseconds. Beside them is the nearest limit that was measured in the same run: random numbers, reads of a working set of the same size,
copies, or a simpler part that is always needed. Calls that take less than a nanosecond overlap with the surrounding code. If a row has a ratio
below one, its data stays in a nearer cache than its size suggests.

What builds of trees over triangles cost beside a copy of the boxes and the sort of their codes is in `docs/bvh.md`.\n";

/// Three digits.
fn short(x: f64) -> String {
    match x {
        _ if x >= 9_999.5 => format!("{:.0}", x),
        _ if x >= 99.5 => format!("{x:.0}"),
        _ if x >= 9.95 => format!("{x:.1}"),
        _ => format!("{x:.2}"),
    }
}
