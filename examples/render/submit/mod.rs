//! `--submit`: a folder with what a scheduler needs to render all shards of all frames.
//!
//! Every folder has `task.sh`, which renders the task whose number it is given, `merge.sh`, which
//! merges what is there, and a `README.md` of a few lines; and what the scheduler reads. A task
//! whose shard is there ends at once, so that submitting again renders what is missing.
//!
//! Every task reads the scene. Where that would be more than a hundredth of its work, a task
//! renders several shards, as long as there are tasks enough for many machines.

mod job;
mod openjd;
mod ray;
mod slurm;
mod work;

use crate::arguments::{Arguments, Scheduler};
use crate::failure::Failure;
use job::Job;
use std::fs;
use std::path::Path;

pub use work::Work;

/// Writes the folder and says what to do with it. `work` is that of a frame.
pub fn submit(arguments: &Arguments, scheduler: Scheduler, samples: u32, work: Work) -> Result<(), Failure> {
    let job = Job::new(arguments, samples, work)?;
    fs::create_dir_all(job.folder.join("log")).map_err(|error| {
        Failure::because(
            format_args!("cannot make the folder {}", job.folder.display()),
            &error,
        )
    })?;
    let (name, content, command) = match scheduler {
        Scheduler::Slurm => slurm::files(&job),
        Scheduler::Ray => ray::files(&job),
        Scheduler::Openjd => openjd::files(&job),
    };
    let readme = format!(
        "{} tasks: {}.\n{}\n- Submit, and submit again whatever has failed: `{command}`\n- See what is there: `{}/merge.sh --status`\n\
         - Merge: `{}/merge.sh`\n",
        job.tasks(),
        job.what,
        job.advice,
        job.folder.display(),
        job.folder.display()
    );
    for (name, content, executable) in [
        ("task.sh", job.task_script(), true),
        ("merge.sh", job.merge_script(), true),
        (name, content, false),
        ("README.md", readme.clone(), false),
    ] {
        write(&job.folder.join(name), &content, executable)?;
    }
    print!("{readme}");
    Ok(())
}

fn write(path: &Path, content: &str, executable: bool) -> Result<(), Failure> {
    let failed = |error| Failure::because(format_args!("cannot write {}", path.display()), &error);
    fs::write(path, content).map_err(failed)?;
    #[cfg(unix)]
    if executable {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(path, fs::Permissions::from_mode(0o755)).map_err(failed)?;
    }
    #[cfg(not(unix))]
    let _ = executable;
    Ok(())
}
