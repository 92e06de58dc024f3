//! Parts of a comparison: some repeats of some scenes, measured anywhere and joined.

use crate::arguments::Arguments;
use crate::pilot::Pilot;
use crate::scenes::Subject;
use crate::{contestants, keep_images, reference};
use lightshed::film::ShardPart;
use lightshed::integrator::Stage;
use lightshed::scene::Scene;
use lightshed_evaluate::{ContestOptions, Record, run};
use std::error::Error;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Measures a part of the repeats of all scenes, one after the other. Whether it was interrupted,
/// with nothing left of the scene at work.
pub fn measure(
    arguments: &Arguments,
    part: ShardPart,
    subjects: Vec<Subject>,
    cancel: &AtomicBool,
) -> Result<bool, Box<dyn Error>> {
    let repeats = arguments.repeats;
    let share = part.of(repeats * subjects.len() as u32);
    for (place, subject) in (0u32..).zip(subjects) {
        let (first, end) = (place * repeats, (place + 1) * repeats);
        let own = share.start.clamp(first, end)..share.end.clamp(first, end);
        if own.is_empty() {
            continue;
        }
        let folder = arguments.out.join(&subject.name);
        fs::create_dir_all(&folder)?;
        let file = folder.join(format!("record-{}-of-{}.json", part.index(), part.count()));
        let scene = Scene::new(&subject.description)?;
        let pilot = Pilot::new(arguments, &subject)?;
        let stage = &Stage::new(&scene).for_samples(pilot.samples());
        let (reference, _) = reference(arguments, &subject, stage, None, cancel)?;
        let pilot = pilot.stage();
        let contestants = contestants(&subject, stage, &pilot);
        let options = ContestOptions {
            seconds: arguments.seconds,
            repeats: own.end - own.start,
            seed: arguments.seed + u64::from(own.start - first),
        };
        let mut contested = run(
            &subject.name,
            &contestants,
            &reference,
            options,
            None,
            &|_| (),
            cancel,
        )?;
        if cancel.load(Ordering::Relaxed) {
            return Ok(true);
        }
        // The last repeat's images are those that the page shows.
        if own.end == end {
            keep_images(&subject.methods, &folder, &mut contested)?;
        }
        fs::write(&file, serde_json::to_string_pretty(&contested.record)?)?;
        println!(
            "{}: repeats {}..{}, {}",
            subject.name,
            own.start - first,
            own.end - first,
            file.display()
        );
    }
    Ok(false)
}

/// What all parts have left in a folder, with the images of its last repeat beside it.
pub fn joined(folder: &Path, options: ContestOptions) -> Result<Record, Box<dyn Error>> {
    let mut records = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if name.starts_with("record-") && name.ends_with(".json") {
            let record: Result<Record, _> = serde_json::from_str(&fs::read_to_string(&path)?);
            records.push(record.map_err(|error| format!("{}: {error}", path.display()))?);
        }
    }
    let named = |error: String| format!("{}: {error}", folder.display());
    let record = Record::join(records).map_err(|error| named(error.to_string()))?;
    if (record.options.seed, record.options.repeats) != (options.seed, options.repeats) {
        let (seed, repeats) = (record.options.seed, record.options.repeats);
        return Err(named(format!(
            "{repeats} repeats from seed {seed} on are there, not {} from seed {} on",
            options.repeats, options.seed
        ))
        .into());
    }
    Ok(record)
}
