//! A template of Open Job Description (version 2023-09).

use super::job::Job;
use serde_json::json;

/// Name and content of the template, and a command that runs it on this machine.
pub fn files(job: &Job) -> (&'static str, String, String) {
    let last = job.tasks() - 1;
    let script = job.folder.join("task.sh");
    let template = json!({
        "specificationVersion": "jobtemplate-2023-09",
        "name": job.name,
        "steps": [{
            "name": "Render",
            "parameterSpace": {
                "taskParameterDefinitions": [{"name": "Task", "type": "INT", "range": format!("0-{last}")}]
            },
            "hostRequirements": {
                "amounts": [{"name": "amount.worker.vcpu", "min": job.threads}]
            },
            "script": {
                "actions": {"onRun": {"command": script, "args": ["{{Task.Param.Task}}"]}}
            }
        }]
    });
    // A value made of texts and numbers has a text.
    let text = serde_json::to_string_pretty(&template).unwrap_or_default();
    let command = format!("openjd run {}/template.json --step Render", job.quoted_folder());
    ("template.json", text + "\n", command)
}
