//! Words of a pbrt file.

use crate::import::error::{ImportError, Location};
use std::path::Path;

/// A word and the line that it stands on.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Token {
    pub line: u32,
    pub word: Word,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Word {
    /// A directive, a number, `true` or `false`.
    Bare(String),
    /// What stood in quotes.
    Quoted(String),
    Open,
    Close,
}

/// Splits a file into words.
pub(super) fn tokens(bytes: &[u8], path: &Path) -> Result<Vec<Token>, ImportError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| ImportError::malformed(Location::file(path), "the file is not UTF-8 text"))?;
    let mut tokens = Vec::new();
    let mut line = 1;
    let mut rest = text.chars().peekable();
    while let Some(char) = rest.next() {
        let mut push = |word| tokens.push(Token { line, word });
        match char {
            '\n' => line += 1,
            char if char.is_whitespace() => {}
            '#' => while rest.next_if(|&char| char != '\n').is_some() {},
            '[' => push(Word::Open),
            ']' => push(Word::Close),
            '"' => {
                let (start, mut quoted) = (line, String::new());
                loop {
                    match rest.next() {
                        Some('"') => break,
                        Some('\\') => quoted.extend(match rest.next() {
                            Some('n') => Some('\n'),
                            Some('t') => Some('\t'),
                            other => other,
                        }),
                        Some('\n') | None => {
                            return Err(ImportError::malformed(
                                Location::line(path, start),
                                "a quotation without its end",
                            ));
                        }
                        Some(other) => quoted.push(other),
                    }
                }
                push(Word::Quoted(quoted));
            }
            first => {
                let mut word = String::from(first);
                let goes_on = |char: &char| !(char.is_whitespace() || "[]\"#".contains(*char));
                while let Some(char) = rest.next_if(goes_on) {
                    word.push(char);
                }
                push(Word::Bare(word));
            }
        }
    }
    Ok(tokens)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_have_their_lines() {
        let text = "Scale 1 -2e3 # a comment [\n\"float fov\"[45]Shape \"a \\\"b\\\"\"";
        let words: Vec<_> = tokens(text.as_bytes(), Path::new("s.pbrt")).unwrap();
        let bare = |word: &str| Word::Bare(word.to_owned());
        let quoted = |word: &str| Word::Quoted(word.to_owned());
        let expected = [
            (1, bare("Scale")),
            (1, bare("1")),
            (1, bare("-2e3")),
            (2, quoted("float fov")),
            (2, Word::Open),
            (2, bare("45")),
            (2, Word::Close),
            (2, bare("Shape")),
            (2, quoted("a \"b\"")),
        ];
        let found: Vec<_> = words.into_iter().map(|token| (token.line, token.word)).collect();
        assert_eq!(found, expected);
        let error = tokens(b"\n\"x\n\"", Path::new("s.pbrt")).unwrap_err();
        assert!(error.to_string().contains("s.pbrt:2"), "{error}");
    }
}
