//! Criterion's results.

use serde_json::Value;
use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::Path;

/// What a benchmark has measured.
pub struct Cost {
    /// Median time of an element, or of a call where there are none.
    pub nanoseconds: f64,
    /// The size that the benchmark's name ends with, 1 where it is no number.
    pub size: f64,
}

/// All results below a folder, by the names of the benchmarks.
pub fn read_costs(folder: &Path) -> Result<BTreeMap<String, Cost>, Box<dyn Error>> {
    let mut costs = BTreeMap::new();
    let mut pending = vec![folder.to_owned()];
    while let Some(folder) = pending.pop() {
        let entries = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        for entry in entries {
            let path = entry?.path();
            if path.ends_with("new") {
                let (id, cost) = read_cost(&path).map_err(|error| format!("{}: {error}", path.display()))?;
                costs.insert(id, cost);
            } else if path.is_dir() {
                pending.push(path);
            }
        }
    }
    Ok(costs)
}

fn read_cost(folder: &Path) -> Result<(String, Cost), Box<dyn Error>> {
    let read = |name| -> Result<Value, Box<dyn Error>> {
        Ok(serde_json::from_str(&fs::read_to_string(folder.join(name))?)?)
    };
    let (benchmark, estimates) = (read("benchmark.json")?, read("estimates.json")?);
    let id = benchmark["full_id"].as_str().ok_or("no name")?.to_owned();
    let median = estimates["median"]["point_estimate"]
        .as_f64()
        .ok_or("no median")?;
    let throughput = &benchmark["throughput"];
    let elements = throughput["Elements"].as_f64().or(throughput["Bytes"].as_f64());
    let size = id.rsplit('/').next().and_then(|size| size.parse().ok());
    let cost = Cost {
        nanoseconds: median / elements.unwrap_or(1.0),
        size: size.unwrap_or(1.0),
    };
    Ok((id, cost))
}
