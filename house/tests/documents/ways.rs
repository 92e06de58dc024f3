//! The ways through the crates in `docs/architecture.md`: steps that name their files.

/// A step of a way.
pub struct Step {
    /// Its heading and number.
    pub name: String,
    /// Files or folders, below `crates`.
    pub paths: Vec<String>,
    /// What is to be found there.
    pub words: Vec<String>,
}

/// The numbered steps under each heading that starts with "From".
pub fn ways(text: &str) -> Vec<Vec<Step>> {
    let mut ways = Vec::new();
    for section in text.split("\n## ").filter(|section| section.starts_with("From ")) {
        let heading = section.lines().next().unwrap_or_default();
        let mut items: Vec<String> = Vec::new();
        for line in section.lines() {
            if line
                .split_once(". ")
                .is_some_and(|(number, _)| number.parse::<u32>().is_ok())
            {
                items.push(line.to_owned());
            } else if let (true, Some(item)) = (line.starts_with("   "), items.last_mut()) {
                item.push(' ');
                item.push_str(line);
            }
        }
        ways.push(
            (1..)
                .zip(&items)
                .map(|(number, item)| step(format!("{heading}, {number}"), item))
                .collect(),
        );
    }
    ways
}

fn step(name: String, item: &str) -> Step {
    let (mut paths, mut words): (Vec<String>, Vec<String>) = Default::default();
    for code in item.split('`').skip(1).step_by(2) {
        if code.contains('/') {
            paths.push(code.to_owned());
        } else if code.ends_with(".rs") {
            // Beside the file before it.
            let folder = paths.last().and_then(|path| path.rsplit_once('/'));
            paths.push(folder.map_or(code.to_owned(), |(folder, _)| format!("{folder}/{code}")));
        } else {
            words.extend(code.split("::").map(str::to_owned));
        }
    }
    Step { name, paths, words }
}
