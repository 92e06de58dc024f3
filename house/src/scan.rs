//! Rust sources without comments, literals and tests, and the paths in them.

/// `text` with comments, strings and characters blanked out, but for the names of features.
pub fn without_comments(text: &str) -> String {
    let chars: Vec<char> = text.chars().collect();
    let mut code = String::with_capacity(text.len());
    let mut at = 0;
    let starts = |at: usize, word: &str| {
        word.chars()
            .enumerate()
            .all(|(i, c)| chars.get(at + i) == Some(&c))
    };
    while at < chars.len() {
        if starts(at, "//") {
            while at < chars.len() && chars[at] != '\n' {
                at += 1;
            }
        } else if starts(at, "/*") {
            let mut depth = 0;
            loop {
                depth += i32::from(starts(at, "/*")) - i32::from(starts(at, "*/"));
                at += if starts(at, "/*") || starts(at, "*/") {
                    2
                } else {
                    1
                };
                if depth == 0 || at >= chars.len() {
                    break;
                }
            }
        } else if let Some(length) = raw_string(&chars[at..]) {
            at += length;
            code.push_str("\"\"");
        } else if chars[at] == '"' {
            let start = at;
            at += 1;
            while at < chars.len() && chars[at] != '"' {
                at += if chars[at] == '\\' { 2 } else { 1 };
            }
            at += 1;
            // A condition on a feature keeps the feature's name.
            if code.ends_with("feature = ") {
                code.extend(&chars[start..at.min(chars.len())]);
            } else {
                code.push_str("\"\"");
            }
        } else if chars[at] == '\'' && (chars.get(at + 1) == Some(&'\\') || chars.get(at + 2) == Some(&'\''))
        {
            // A character, not a lifetime.
            at += if chars[at + 1] == '\\' { 3 } else { 2 };
            while at < chars.len() && chars[at] != '\'' {
                at += 1;
            }
            at += 1;
            code.push_str("' '");
        } else {
            code.push(chars[at]);
            at += 1;
        }
    }
    code
}

/// Length of the raw string that `chars` starts with.
fn raw_string(chars: &[char]) -> Option<usize> {
    if chars.first() != Some(&'r') {
        return None;
    }
    let hashes = chars[1..].iter().take_while(|&&c| c == '#').count();
    if chars.get(1 + hashes) != Some(&'"') {
        return None;
    }
    let end: Vec<char> = std::iter::once('"')
        .chain(std::iter::repeat_n('#', hashes))
        .collect();
    let inside = &chars[2 + hashes..];
    let length = inside.windows(end.len()).position(|window| window == end)?;
    Some(2 + hashes + length + end.len())
}

/// `code` without items under a `cfg` that asks for tests, and the names of modules in files that
/// are such items.
pub fn without_tests(code: &str) -> (String, Vec<String>) {
    let (mut kept, mut modules, mut rest) = (String::new(), Vec::new(), code);
    while let Some(start) = rest.find("#[cfg(") {
        let condition_end = start + rest[start..].find(']').map_or(rest.len() - start, |end| end + 1);
        let condition = &rest[start..condition_end];
        let is_test =
            tokens(condition).iter().any(|&t| t == "test" || t == "doctest") && !condition.contains("not(");
        kept.push_str(&rest[..if is_test { start } else { condition_end }]);
        rest = &rest[condition_end..];
        if is_test {
            let (item, after) = rest.split_at(item_length(rest));
            let words = tokens(item);
            if let Some(place) = words.iter().position(|&word| word == "mod")
                && item.trim_end().ends_with(';')
            {
                modules.push(words[place + 1].to_owned());
            }
            rest = after;
        }
    }
    (kept + rest, modules)
}

/// Length of the item that `code` starts with: to the end of its first braces outside brackets, or
/// its semicolon. A field ends where the braces around it do.
fn item_length(code: &str) -> usize {
    let (mut braces, mut others) = (0, 0);
    for (at, c) in code.char_indices() {
        match c {
            '(' | '[' => others += 1,
            ')' | ']' => others -= 1,
            '{' => braces += 1,
            '}' if braces == 0 => return at,
            '}' => braces -= 1,
            _ => (),
        }
        let ends = c == ';' && braces == 0 && others == 0 || c == '}' && braces == 0;
        // The braces of a tree of `use` are followed by the semicolon.
        if ends && !(c == '}' && code[at + 1..].trim_start().starts_with(';')) {
            return at + 1;
        }
    }
    code.len()
}

/// Words, `::`, and other characters one by one.
pub fn tokens(code: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = code.trim_start();
    while let Some(first) = rest.chars().next() {
        let length = if first.is_alphanumeric() || first == '_' {
            rest.find(|c: char| !c.is_alphanumeric() && c != '_')
                .unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            first.len_utf8()
        };
        tokens.push(&rest[..length]);
        rest = rest[length..].trim_start();
    }
    tokens
}

/// A path, and by what name a `use` makes it known; `*` for a glob. A path outside `use` has no
/// name.
#[derive(Clone, Debug, PartialEq)]
pub struct Mention {
    /// Its words.
    pub path: Vec<String>,
    /// The name that it makes known.
    pub name: Option<String>,
}

/// All paths of two or more segments, or of `use`.
pub fn mentions(code: &str) -> Vec<Mention> {
    let tokens = tokens(code);
    let (mut mentions, mut at) = (Vec::new(), 0);
    while at < tokens.len() {
        if tokens[at] == "use" {
            at += 1;
            use_tree(&tokens, &mut at, &[], &mut mentions);
        } else if is_word(tokens[at]) && tokens.get(at + 1) == Some(&"::") {
            let mut path = vec![tokens[at].to_owned()];
            at += 1;
            while tokens.get(at) == Some(&"::") && tokens.get(at + 1).is_some_and(|next| is_word(next)) {
                path.push(tokens[at + 1].to_owned());
                at += 2;
            }
            mentions.push(Mention { path, name: None });
        } else {
            at += 1;
        }
    }
    mentions
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphanumeric() || c == '_')
}

/// Reads a tree of `use` from `at` on, `prefix` before it.
fn use_tree(tokens: &[&str], at: &mut usize, prefix: &[String], mentions: &mut Vec<Mention>) {
    let mut path = prefix.to_vec();
    while let Some(&token) = tokens.get(*at) {
        *at += 1;
        match token {
            "::" => continue,
            "{" => {
                while tokens.get(*at).is_some_and(|&next| next != "}") {
                    use_tree(tokens, at, &path, mentions);
                    *at += usize::from(tokens.get(*at) == Some(&","));
                }
                *at += 1;
                return;
            }
            "*" => {
                mentions.push(Mention {
                    path,
                    name: Some("*".to_owned()),
                });
                return;
            }
            // `self` in a tree is the path so far.
            "self" if !prefix.is_empty() => (),
            word => path.push(word.to_owned()),
        }
        match tokens.get(*at) {
            Some(&"::") => (),
            Some(&"as") => {
                let name = tokens.get(*at + 1).map(|&name| name.to_owned());
                *at += 2;
                mentions.push(Mention { path, name });
                return;
            }
            _ => {
                let name = path.last().cloned();
                mentions.push(Mention { path, name });
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What follows a struct whose last field is of tests alone is kept.
    #[test]
    fn a_field_of_tests_ends_with_its_struct() {
        let code = "struct A { a: u32, #[cfg(test)] fault: [u8; 2], }\nuse crate::b::B;";
        assert_eq!(without_tests(code).0, "struct A { a: u32, }\nuse crate::b::B;");
    }
}
