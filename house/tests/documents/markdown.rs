//! Markdown: what is code, where links lead, what headings are called.

use std::collections::{BTreeMap, BTreeSet};

/// A block of code: what it says to be, and its lines.
pub struct Code<'a> {
    pub info: &'a str,
    pub text: String,
    /// The number of its first line.
    pub line: usize,
}

/// `text` without blocks of code, and these.
pub fn parts(text: &str) -> (String, Vec<Code<'_>>) {
    let (mut prose, mut blocks, mut open) = (String::new(), Vec::<Code>::new(), false);
    for (number, line) in text.lines().enumerate() {
        if let Some(info) = line.trim_start().strip_prefix("```") {
            if !open {
                blocks.push(Code {
                    info: info.trim(),
                    text: String::new(),
                    line: number + 2,
                });
            }
            open = !open;
        } else if open {
            let block = blocks.last_mut().unwrap();
            block.text += line;
            block.text.push('\n');
        } else {
            prose += line;
        }
        if !open {
            prose.push('\n');
        }
    }
    (prose, blocks)
}

/// `text` without code in a line.
fn without_inline_code(text: &str) -> String {
    text.split('`').step_by(2).collect::<Vec<_>>().join(" ")
}

/// Where the links of `text` lead, images included.
pub fn links(text: &str) -> Vec<String> {
    let (prose, _) = parts(text);
    // Code may be what a link is called, but no link is in code.
    let prose = without_inline_code(&prose);
    let inline = prose.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    let mut found: Vec<String> = inline
        .map(|(link, _)| link.split(' ').next().unwrap().to_owned())
        .collect();
    let definitions = prose.lines().filter(|line| line.starts_with('['));
    found.extend(definitions.filter_map(|line| Some(line.split_once("]: ")?.1.trim().to_owned())));
    found
}

/// The anchors of the headings of `text`, as forges make them.
pub fn anchors(text: &str) -> BTreeSet<String> {
    let (prose, _) = parts(text);
    let mut seen = BTreeMap::<String, u32>::new();
    let mut anchors = BTreeSet::new();
    for line in prose.lines().filter(|line| line.starts_with('#')) {
        let title = line.trim_start_matches('#').trim().to_lowercase();
        let kept = title
            .chars()
            .filter(|&c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        let slug: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect();
        let count = seen.entry(slug.clone()).or_default();
        anchors.insert(if *count == 0 {
            slug
        } else {
            format!("{slug}-{count}")
        });
        *count += 1;
    }
    anchors
}
