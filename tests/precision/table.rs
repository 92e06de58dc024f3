//! The table of worst errors, and how it differs from a file.

use crate::worst::Row;
use crate::{distributions, elsewhere, emitters, film, flights, grid, inverses, lights, materials, medium};
use crate::{resampling, sampling, scene, shift, volume};

const HEAD: &str = "# Precision

The tables have the worst errors found, against `f64` or a closed form of the same inputs. Inputs are hostile numbers (zeros, subnormals, the neighbours
of one, numbers whose squares over- or underflow, extremes of every parameter) and some hundred thousand random ones. Made by

```sh
LIGHTSHED_PRECISION=docs/precision.md cargo test --release --test precision
```

A test compares new measurements with the tables and allows twice these errors. *Relative* errors are `|found − truth| / |truth|`, *absolute* ones
`|found − truth|`. Every function below also returned finite numbers for all of its inputs. An error of 0 is exact: the property held without
exception. A row that names several functions in its inputs measures these as well.

";

const ELSEWHERE_HEAD: &str = "## Without a row

These are all other public functions that take or return real numbers, and the tests that check them. A test finds the public functions in the sources;
it fails if one of them is neither in a table nor here.
";

/// Measures all functions.
pub fn rows() -> Vec<Row> {
    [
        sampling::rows(),
        inverses::rows(),
        distributions::rows(),
        resampling::rows(),
        shift::rows(),
        lights::rows(),
        grid::rows(),
        volume::rows(),
        medium::rows(),
        flights::rows(),
        scene::rows(),
        materials::rows(),
        emitters::rows(),
        film::rows(),
    ]
    .concat()
}

/// The file's text.
pub fn table(rows: &[Row]) -> String {
    let mut text = HEAD.to_owned();
    let mut part = "";
    for row in rows {
        if row.part != part {
            part = row.part;
            text += &format!("## `{part}`\n\n| function | inputs | error | worst |\n|---|---|---|---|\n");
        }
        text += &format!("{}\n", row.line());
        if rows.iter().rfind(|last| last.part == part) == Some(row) {
            text += "\n";
        }
    }
    text + &without_a_row()
}

/// The functions that have none.
fn without_a_row() -> String {
    let mut text = ELSEWHERE_HEAD.to_owned();
    let mut part = "";
    for &(next, reason, functions) in elsewhere::ELSEWHERE {
        if next != part {
            part = next;
            text += &format!("\n### `{part}`\n\n");
        }
        let functions: Vec<String> = functions.split_whitespace().map(|f| format!("`{f}`")).collect();
        text += &format!("- {reason}: {}\n", functions.join(", "));
    }
    text
}

/// Missing and left-over functions, and errors more than twice what the file says (functions of the
/// platform's own, `exp` and the like, differ by a little).
pub fn compare(rows: &[Row], text: &str) -> Vec<String> {
    let stated: Vec<(String, f64)> = text
        .lines()
        .filter_map(|line| {
            let cells: Vec<&str> = line.strip_prefix("| `")?.split(" | ").collect();
            let worst = cells.last()?.trim_end_matches(" |").parse().ok()?;
            Some((format!("`{} | {}", cells.first()?, cells.get(1)?), worst))
        })
        .collect();
    let name = |row: &Row| format!("`{}` | {}", row.function, row.inputs);
    let mut differences: Vec<String> = stated
        .iter()
        .filter(|(stated, _)| !rows.iter().any(|row| name(row) == *stated))
        .map(|(stated, _)| format!("{stated} is in the file alone"))
        .collect();
    for row in rows {
        match stated.iter().find(|(stated, _)| *stated == name(row)) {
            None => differences.push(format!("{} is missing", name(row))),
            Some(&(_, worst)) if row.worst > 2.0 * worst => {
                differences.push(format!(
                    "{}: {:.1e}, the file says {worst:.1e}",
                    name(row),
                    row.worst
                ));
            }
            Some(_) => (),
        }
        if !row.worst.is_finite() {
            differences.push(format!("{}: not finite", name(row)));
        }
    }
    if !text.contains(&without_a_row()) {
        differences.push("the functions without a row are others".to_owned());
    }
    differences
}
