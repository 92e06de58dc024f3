//! A job array of Slurm.

use super::job::Job;

/// Name and content of the batch script, and the command that submits it.
pub fn files(job: &Job) -> (&'static str, String, String) {
    let (folder, name, last, threads) = (job.quoted_folder(), &job.name, job.tasks() - 1, job.threads);
    let script = format!(
        "#!/usr/bin/env bash\n#SBATCH --job-name={name}\n#SBATCH --array=0-{last}\n#SBATCH --cpus-per-task={threads}\n\
         #SBATCH --requeue\n#SBATCH --open-mode=append\n#SBATCH --output={log}/log/%a.txt\n\
         # A node that fails requeues its tasks (--requeue); a task that fails is tried three times more here.\n\
         for attempt in 1 2 3 4; do\n    {folder}/task.sh \"$SLURM_ARRAY_TASK_ID\" && exit 0\n    \
         echo \"task $SLURM_ARRAY_TASK_ID: attempt $attempt ended with status $?\" >&2\ndone\nexit 1\n",
        log = job.folder.display(),
    );
    ("job.sbatch", script, format!("sbatch {folder}/job.sbatch"))
}
