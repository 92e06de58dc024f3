//! Tokens as text, with spaces as `rustfmt` would put them.

/// Words before an opening bracket that belong to syntax, not to what is called or indexed.
const KEYWORDS: [&str; 9] = [
    "as", "const", "dyn", "for", "impl", "in", "mut", "return", "where",
];

/// `tokens` on one line. A comma before a closing bracket is left out.
pub fn spaced<T: AsRef<str>>(tokens: &[T]) -> String {
    let tokens: Vec<&str> = tokens.iter().map(AsRef::as_ref).collect();
    let kept: Vec<&str> = (0..tokens.len())
        .filter(|&i| tokens[i] != "," || !matches!(tokens.get(i + 1), Some(&(")" | "]" | ">" | "}"))))
        .map(|i| tokens[i])
        .collect();
    let mut text = String::new();
    for (i, token) in kept.iter().enumerate() {
        if i > 0 && is_apart(if i > 1 { kept[i - 2] } else { "" }, kept[i - 1], token) {
            text.push(' ');
        }
        text.push_str(token);
    }
    text.replace("= \" ", "= \"")
        .replace(" \")", "\")")
        .replace(" \",", "\",")
}

/// Whether a space is between `last` and `next`, where `before` is in front of `last`.
fn is_apart(before: &str, last: &str, next: &str) -> bool {
    let is_word = last.starts_with(|c: char| c.is_alphanumeric() || c == '_');
    let calls = is_word && !KEYWORDS.contains(&last);
    match (last, next) {
        (_, "," | ";" | ")" | "]" | ":" | "." | ">") => false,
        (">", "::") => false,
        (_, "::") => !calls,
        ("(" | "[" | "::" | "." | "&" | "'" | "#" | "!" | "$" | "?" | "<", _) => false,
        ("=", "=") => false,
        ("*", "const" | "mut" | "*" | "self") => false,
        // After an arrow.
        (">", _) if before == "-" || before == "=" => true,
        (">", "(" | "<") => false,
        (_, "(" | "[") => !calls || before == "'",
        (_, "<") => !is_word || before == "'" || last == "as",
        (_, "!") => !is_word,
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::spaced;
    use crate::scan::tokens;

    #[test]
    fn text_is_that_of_rustfmt() {
        for text in [
            "pub fn f<'a, T: Copy + ?Sized>(&'a mut self, x: &[f32; 3], g: impl Fn(u32) -> f32) -> Option<(T, u8)>",
            "impl<R: Rng, const N: usize> From<[R; N]> for &'a Boxed<dyn Lights + 'a> where R: Send",
            "type Item = <T as Domain>::Sample",
            "const fn f(self: Arc<Self>, p: *const u8) -> &'static str",
            "#[cfg(feature = \"gltf\")]",
            "struct S<'a> { items: &'a [u8] }",
            "fn f<F>(f: F) where F: for<'b> FnMut(&'b T) -> bool",
        ] {
            assert_eq!(spaced(&tokens(text)), text);
        }
        assert_eq!(spaced(&tokens("fn f(\n    a: u32,\n)")), "fn f(a: u32)");
    }
}
