//! Lines of comments that are too long to be read.

/// Columns of prose.
const PROSE: usize = 100;

/// Columns of code in documentation: those of `rustfmt.toml`.
const CODE: usize = 110;

/// Lines of comments of `text` beyond their columns, with their numbers. Rows of tables cannot be
/// broken and are left out.
pub fn long(text: &str) -> Vec<String> {
    let (mut long, mut in_code) = (Vec::new(), false);
    for (number, line) in text.lines().enumerate() {
        let Some(comment) = line.trim_start().strip_prefix("//") else {
            in_code = false;
            continue;
        };
        let comment = comment.trim_start_matches(['/', '!']).trim_start();
        if comment.starts_with("```") {
            in_code = !in_code;
        }
        let limit = if in_code { CODE } else { PROSE };
        if line.chars().count() > limit && !comment.starts_with('|') {
            long.push(format!("{}: {line}", number + 1));
        }
    }
    long
}

#[test]
fn long_lines_are_found() {
    let words = "a ".repeat(49) + "b";
    let long_words = words.clone() + " c";
    let text = format!(
        "// {}\n    /// {long_words}\nlet code = 1; // {long_words}{long_words}\n//! | {long_words} |\n\
         //! ```\n//! {long_words}\n//! {long_words}{long_words}\n//! ```\n//! {long_words}\n",
        &words[..97]
    );
    let found = long(&text);
    let numbers: Vec<&str> = found.iter().map(|line| line.split(':').next().unwrap()).collect();
    assert_eq!(numbers, ["2", "7", "9"]);
}
