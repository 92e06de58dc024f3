//! Tasks of Ray.

use super::job::Job;

/// Name and content of the program, and the command that runs it.
pub fn files(job: &Job) -> (&'static str, String, String) {
    let (tasks, threads) = (job.tasks(), job.threads);
    let program = format!(
        r#""""Renders all tasks on the Ray cluster that RAY_ADDRESS names, or on this machine. A task whose process or worker dies is tried again."""
import pathlib
import subprocess
import sys

import ray

SCRIPT = pathlib.Path(__file__).resolve().with_name("task.sh")
TASKS = {tasks}


@ray.remote(num_cpus={threads}, max_retries=3, retry_exceptions=True)
def render(task):
    """Renders a task, and raises if its program fails."""
    log = SCRIPT.parent / "log" / f"{{task}}.txt"
    with open(log, "ab") as output:
        subprocess.run([SCRIPT, str(task)], check=True, stdout=output, stderr=output)


def main():
    """Waits for all tasks, says which have failed, and fails if one has."""
    ray.init()
    waiting = {{render.remote(task): task for task in range(TASKS)}}
    failed = 0
    while waiting:
        done, _ = ray.wait(list(waiting))
        for reference in done:
            task = waiting.pop(reference)
            try:
                ray.get(reference)
            except ray.exceptions.RayError as error:
                failed += 1
                print(f"task {{task}}: {{error}}", file=sys.stderr)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
"#
    );
    (
        "job.py",
        program,
        format!("python3 {}/job.py", job.quoted_folder()),
    )
}
