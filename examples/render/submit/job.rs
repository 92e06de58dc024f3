//! What is to be done, whoever schedules it.

use crate::arguments::Arguments;
use crate::failure::Failure;
use crate::shards::default_out;
use crate::submit::Work;
use lightshed::integrator::MethodRequest;
use std::env;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Options that choose tasks, with whether they have a value: each task has its own.
const OF_THE_JOB: [(&str, bool); 9] = [
    ("--submit", true),
    ("--job", true),
    ("--per-task", true),
    ("--shards", true),
    ("--shard", true),
    ("--frames", true),
    ("--out", true),
    ("--threads", true),
    ("--again", false),
];

/// Options that say how a method is to be chosen and for how much work, in the same way.
const CHOSEN: [(&str, bool); 3] = [("--method", true), ("--adaptive", false), ("--spp", true)];

/// Tasks, numbered from 0, `n = ⌈shards / per_task⌉` of each frame: the shards from
/// `per_task · (t mod n)` on of frame `first + ⌊t / n⌋`.
pub struct Job {
    /// Where everything about it is.
    pub folder: PathBuf,
    /// The scene's name, for schedulers that show one.
    pub name: String,
    /// In words.
    pub what: String,
    /// A paragraph about reading the scene, or nothing.
    pub advice: String,
    /// Threads of a task.
    pub threads: u32,
    /// Shards of a frame.
    shards: u32,
    /// Shards of a task; the last of a frame may have fewer.
    per_task: u32,
    frames: Option<Range<u32>>,
    /// The program and its arguments, as a shell reads them.
    command: String,
    program: PathBuf,
    directory: String,
    out: PathBuf,
}

impl Job {
    pub fn new(arguments: &Arguments, samples: u32, work: Work) -> Result<Self, Failure> {
        let shards = arguments.shards.unwrap_or(1);
        if shards > samples {
            return Err(Failure::new(format_args!(
                "{samples} samples cannot be divided into {shards} shards"
            )));
        }
        let out = arguments.out.clone().unwrap_or_else(|| default_out(arguments));
        if out
            .extension()
            .is_none_or(|extension| !extension.eq_ignore_ascii_case("exr"))
        {
            return Err(Failure::new("a shard is an OpenEXR file: --out must end in .exr"));
        }
        let directory = env::current_dir().map_err(|error| Failure::because("no current folder", &error))?;
        let program =
            env::current_exe().map_err(|error| Failure::because("no path of this program", &error))?;
        let frames = arguments.sequence_frames();
        let out = directory.join(out);
        let folder = match &arguments.job {
            Some(folder) => directory.join(folder),
            None => out.with_extension("job"),
        };
        let threads = arguments.threads.max(1);
        let mut words = vec![text(program.as_os_str())?];
        words.extend(own_words(arguments)?);
        // `--frames N`, which is among the options left out, is a number of samples; of a method
        // that was chosen it is what the work is worth.
        let is_chosen = matches!(arguments.request, MethodRequest::Auto(_)) && frames.is_none();
        let spp = match is_chosen {
            true => Some(samples),
            false => arguments.samples().filter(|_| arguments.spp.is_none()),
        };
        words.extend(
            spp.iter()
                .flat_map(|samples| ["--spp".to_owned(), samples.to_string()]),
        );
        words.extend([
            "--threads".to_owned(),
            threads.to_string(),
            "--out".to_owned(),
            text(out.as_os_str())?,
        ]);
        let count = frames.as_ref().map_or(1, ExactSizeIterator::len);
        if count as u64 * u64::from(shards) > u64::from(u32::MAX) {
            return Err(Failure::new("there are more tasks than numbers"));
        }
        let mut what = match &frames {
            Some(frames) => format!("frames {}..{}, {shards} shards each", frames.start, frames.end),
            None => format!("{shards} shards of {samples} samples"),
        };
        let per_task = arguments
            .per_task
            .unwrap_or_else(|| work.per_task(shards, count as u32));
        if per_task > 1 {
            what += &format!(", {per_task} in a task");
        }
        let advice = work.too_much_reading(shards, per_task).map(|share| {
            format!(
                "\nReading the scene takes {:.2} processor seconds of each task, about {:.0} % of it: more shards in a task (`--per-task`)\n\
                 or longer ones (fewer `--shards`) make that less.\n",
                work.reading,
                100.0 * share
            )
        });
        Ok(Self {
            name: Path::new(&arguments.scene)
                .file_stem()
                .map_or("render".into(), |stem| stem.to_string_lossy().into_owned()),
            command: words
                .iter()
                .map(|word| quoted(word))
                .collect::<Vec<_>>()
                .join(" "),
            directory: quoted(&text(directory.as_os_str())?),
            folder,
            what,
            advice: advice.unwrap_or_default(),
            threads,
            shards,
            per_task,
            frames,
            program,
            out,
        })
    }

    /// Number of tasks.
    pub fn tasks(&self) -> u32 {
        self.frames.as_ref().map_or(1, |frames| frames.end - frames.start) * self.tasks_of_frame()
    }

    fn tasks_of_frame(&self) -> u32 {
        self.shards.div_ceil(self.per_task)
    }

    /// The folder, as a shell reads it.
    pub fn quoted_folder(&self) -> String {
        quoted(&self.folder.to_string_lossy())
    }

    /// Renders one task.
    pub fn task_script(&self) -> String {
        let (shards, tasks, per_task) = (self.shards, self.tasks_of_frame(), self.per_task);
        let frame = match &self.frames {
            Some(frames) => format!(
                " --frames \"$(({first} + $1 / {tasks}))..$(({first} + $1 / {tasks} + 1))\"",
                first = frames.start
            ),
            None => String::new(),
        };
        let numbers = match per_task {
            1 => format!("$(($1 % {shards}))"),
            _ => {
                let first = format!("$1 % {tasks} * {per_task}");
                let end = format!("{first} + {per_task}");
                format!("$(({first}))..$(({end} < {shards} ? {end} : {shards}))")
            }
        };
        let last = self.tasks() - 1;
        format!(
            "#!/usr/bin/env bash\n# Renders task $1 of 0 to {last}. A task that is done ends at once.\nset -euo pipefail\ncd {}\n\
             exec {}{frame} --shard \"{numbers}/{shards}\"\n",
            self.directory, self.command
        )
    }

    /// Merges what is there.
    pub fn merge_script(&self) -> String {
        let merge = self
            .program
            .with_file_name(format!("merge{}", env::consts::EXE_SUFFIX));
        let stem = self.out.with_extension("");
        format!(
            "#!/usr/bin/env bash\n# Merges all shards; --status says which are there, --allow-missing takes these.\nset -euo pipefail\n\
             exec {} --out {} \"$@\" {}*.shard-*-of-{}.exr\n",
            quoted(&merge.to_string_lossy()),
            quoted(&self.out.to_string_lossy()),
            quoted(&stem.to_string_lossy()),
            self.shards
        )
    }
}

/// The arguments as they were given, without those that choose tasks; in place of `auto` what was
/// chosen, so that tasks need not choose again.
fn own_words(arguments: &Arguments) -> Result<Vec<String>, Failure> {
    let mut words = Vec::new();
    let auto = match &arguments.request {
        MethodRequest::Auto(auto) => Some(auto),
        MethodRequest::Method(_) => None,
    };
    let mut given = arguments.words.iter();
    while let Some(word) = given.next() {
        let word = text(word)?;
        let name = word.split('=').next().unwrap_or_default();
        let chosen = CHOSEN.iter().filter(|_| auto.is_some());
        match OF_THE_JOB
            .iter()
            .chain(chosen)
            .find(|(option, _)| *option == name)
        {
            // A value of its own, unless it came with the option.
            Some((_, true)) if word == name => drop(given.next()),
            Some(_) => (),
            None => words.push(word),
        }
    }
    if let Some(auto) = auto {
        words.extend(["--method".to_owned(), arguments.method.name().to_owned()]);
        for (option, value) in arguments.method.options() {
            // Others stand among the words.
            if auto.given().iter().all(|(given, _)| given != option.name) {
                words.extend([format!("--{}", option.name), value.to_owned()]);
            }
        }
    }
    Ok(words)
}

fn text(word: &std::ffi::OsStr) -> Result<String, Failure> {
    word.to_str()
        .map(str::to_owned)
        .ok_or_else(|| Failure::new(format_args!("{} is no text", word.display())))
}

/// A word as a shell reads it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}
