//! `docs/precision.md` is what the example `precision` makes.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The example's binary, which cargo builds beside the tests.
fn binary() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let profile = test.ancestors().nth(2).unwrap();
    profile
        .join("examples")
        .join(format!("precision{}", std::env::consts::EXE_SUFFIX))
}

fn check(file: &Path) -> (bool, String) {
    let output = Command::new(binary()).arg("--check").arg(file).output().unwrap();
    (
        output.status.success(),
        String::from_utf8_lossy(&output.stderr).into_owned(),
    )
}

/// No error is more than twice what the table says, and no function is in the one alone. A table that says less, or lacks a row, is
/// refused.
#[test]
fn errors_are_those_of_the_table() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/precision.md");
    assert_eq!(check(&file), (true, String::new()));

    let text = std::fs::read_to_string(&file).unwrap();
    let copy = std::env::temp_dir().join(format!("lightshed-precision-{}.md", std::process::id()));
    let row = text.lines().find(|line| line.starts_with("| `remap`")).unwrap();
    let (head, worst) = row.rsplit_once(" | ").unwrap();
    let smaller = text.replace(row, &format!("{head} | 1.0e-9 |"));
    assert_ne!(worst, "1.0e-9 |");
    for (planted, message) in [(smaller, "the file says"), (text.replace(row, ""), "is missing")] {
        std::fs::write(&copy, planted).unwrap();
        let (sound, said) = check(&copy);
        assert!(
            !sound && said.contains("remap") && said.contains(message),
            "{said}"
        );
    }
    std::fs::remove_file(&copy).ok();
}
