//! The items of a piece of code: attributes, visibility, head and body.

use crate::scan::tokens;
use crate::spacing::spaced;

/// What an item is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `fn`.
    Function,
    /// `struct`.
    Struct,
    /// `enum`.
    Enum,
    /// `union`.
    Union,
    /// `trait`.
    Trait,
    /// `type`.
    Alias,
    /// `const`.
    Constant,
    /// `static`.
    Static,
    /// `mod`.
    Module,
    /// `use`.
    Use,
    /// `impl`.
    Impl,
    /// `macro_rules!`.
    Macro,
    /// A macro that is called where an item could be.
    Invocation,
}

/// An item; an associated one, too.
#[derive(Clone, Debug)]
pub struct Item {
    /// Attributes that a user of the item sees: conditions, derived traits, `#[must_use]`, ….
    pub attributes: Vec<String>,
    /// `pub`, without a restriction.
    pub is_public: bool,
    /// What it is.
    pub kind: Kind,
    /// Empty for `impl` and `use`.
    pub name: String,
    /// What is before the body, or the whole item.
    pub head: Vec<String>,
    /// What is in its brackets, if it has any.
    pub body: Option<Vec<String>>,
}

impl Item {
    /// The head on one line, attributes before it.
    pub fn text(&self) -> String {
        let public = if self.is_public { "pub " } else { "" };
        let attributes: String = self.attributes.iter().map(|text| format!("{text} ")).collect();
        format!("{attributes}{public}{}", spaced(&self.head))
    }

    /// Attributes that are conditions.
    pub fn conditions(&self) -> impl Iterator<Item = &String> {
        self.attributes.iter().filter(|text| text.starts_with("#[cfg("))
    }

    /// The items in its body.
    pub fn items(&self) -> Vec<Item> {
        let body = self.body.as_deref().unwrap_or_default();
        read(&body.iter().map(String::as_str).collect::<Vec<_>>())
    }
}

/// The items of `code`, which has no comments.
pub fn items(code: &str) -> Vec<Item> {
    read(&tokens(code))
}

/// Attributes that belong to the interface.
const SEEN: [&str; 6] = [
    "cfg",
    "derive",
    "deprecated",
    "must_use",
    "non_exhaustive",
    "repr",
];

/// The place of the bracket that closes the one at `open`.
pub(crate) fn closing(tokens: &[&str], open: usize) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate().skip(open) {
        match *token {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => {
                depth -= 1;
                if depth == 0 {
                    return at;
                }
            }
            _ => (),
        }
    }
    tokens.len() - 1
}

/// The pieces of `tokens` between those `separators` that are in no bracket of any kind, angles
/// included.
pub(crate) fn split<'a>(tokens: &[&'a str], separator: &str) -> Vec<Vec<&'a str>> {
    let mut pieces = vec![Vec::new()];
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate() {
        let arrow = *token == ">" && at > 0 && matches!(tokens[at - 1], "-" | "=");
        match *token {
            "(" | "[" | "{" | "<" => depth += 1,
            ")" | "]" | "}" => depth -= 1,
            ">" if !arrow => depth -= 1,
            _ => (),
        }
        if depth == 0 && *token == separator {
            pieces.push(Vec::new());
        } else {
            pieces.last_mut().unwrap().push(*token);
        }
    }
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

/// The first place from `from` on of one of `ends` that is in no round or square bracket.
fn find(tokens: &[&str], from: usize, ends: &[&str]) -> usize {
    let mut at = from;
    while at < tokens.len() && !ends.contains(&tokens[at]) {
        at = match tokens[at] {
            "(" | "[" => closing(tokens, at) + 1,
            _ => at + 1,
        };
    }
    at
}

/// The attributes at the start of `tokens` that belong to the interface, and how long all are.
pub(crate) fn attributes(tokens: &[&str]) -> (Vec<String>, usize) {
    let (mut seen, mut at) = (Vec::new(), 0);
    while tokens.get(at) == Some(&"#") {
        let open = at + 1 + usize::from(tokens.get(at + 1) == Some(&"!"));
        let close = closing(tokens, open);
        let inside = &tokens[open + 1..close];
        let derives_by_feature = inside[0] == "cfg_attr" && inside.contains(&"derive");
        if open == at + 1 && (SEEN.contains(&inside[0]) || derives_by_feature) {
            seen.push(spaced(&tokens[at..=close]));
        }
        at = close + 1;
    }
    (seen, at)
}

fn read(tokens: &[&str]) -> Vec<Item> {
    let owned = |tokens: &[&str]| tokens.iter().map(|&token| token.to_owned()).collect::<Vec<_>>();
    let (mut items, mut at) = (Vec::new(), 0);
    while at < tokens.len() {
        // A repetition in a macro: its items, once.
        if tokens[at] == "$" && tokens.get(at + 1) == Some(&"(") {
            let close = closing(tokens, at + 1);
            items.extend(read(&tokens[at + 2..close]));
            at = close + 1;
            while tokens.get(at).is_some_and(|next| !["*", "+", "?"].contains(next)) {
                at += 1;
            }
            at += 1;
            continue;
        }
        let (attributes, length) = attributes(&tokens[at..]);
        at += length;
        let mut is_public = false;
        if tokens.get(at) == Some(&"pub") {
            is_public = tokens.get(at + 1) != Some(&"(");
            at = if is_public {
                at + 1
            } else {
                closing(tokens, at + 1) + 1
            };
        }
        if at >= tokens.len() {
            break;
        }
        let start = at;
        let Some((kind, word)) = kind(tokens, at) else {
            // A stray semicolon, or what only a macro can make sense of.
            at += 1;
            continue;
        };
        let name = || {
            tokens
                .get(word + 1)
                .map_or(String::new(), |&name| name.to_owned())
        };
        let mut item = Item {
            attributes,
            is_public,
            kind,
            name: String::new(),
            head: Vec::new(),
            body: None,
        };
        match kind {
            Kind::Use => {
                let end = (at..tokens.len())
                    .find(|&at| tokens[at] == ";")
                    .unwrap_or(tokens.len());
                item.head = owned(&tokens[start..end]);
                at = end + 1;
            }
            Kind::Alias | Kind::Constant | Kind::Static => {
                item.name = name();
                let mut end = find(tokens, at, &[";", "{"]);
                while tokens.get(end) == Some(&"{") {
                    end = find(tokens, closing(tokens, end) + 1, &[";", "{"]);
                }
                // The value of a constant is not shown: it may be longer than the file.
                let value = match kind {
                    Kind::Alias => end,
                    _ => start + split(&tokens[start..end], "=")[0].len(),
                };
                item.head = owned(&tokens[start..value]);
                at = end + 1;
            }
            Kind::Macro | Kind::Invocation => {
                let open = find_any(tokens, word, &["(", "[", "{"]);
                let close = closing(tokens, open);
                item.name = tokens[if kind == Kind::Macro { word + 2 } else { word }].to_owned();
                item.head = owned(&tokens[start..open]);
                item.body = Some(owned(&tokens[(open + 1).min(close)..close]));
                at = close + 1 + usize::from(tokens.get(close + 1) == Some(&";"));
            }
            _ => {
                if kind != Kind::Impl {
                    item.name = name();
                }
                let tuple = after_generics(tokens, word + 2);
                if kind == Kind::Struct && tokens.get(tuple) == Some(&"(") {
                    let close = closing(tokens, tuple);
                    let end = find(tokens, close, &[";"]);
                    item.body = Some(owned(&tokens[tuple..=close]));
                    item.head = owned(&tokens[start..tuple]);
                    item.head.extend(owned(&tokens[close + 1..end]));
                    at = end + 1;
                } else {
                    let end = find(tokens, at, &["{", ";"]);
                    item.head = owned(&tokens[start..end]);
                    at = end + 1;
                    if tokens.get(end) == Some(&"{") {
                        let close = closing(tokens, end);
                        item.body = Some(owned(&tokens[end + 1..close]));
                        at = close + 1;
                    }
                }
            }
        }
        items.push(item);
    }
    items
}

fn find_any(tokens: &[&str], from: usize, ends: &[&str]) -> usize {
    (from..tokens.len())
        .find(|&at| ends.contains(&tokens[at]))
        .unwrap_or(tokens.len() - 1)
}

/// The place behind the generic parameters that may be at `at`.
pub(crate) fn after_generics(tokens: &[&str], at: usize) -> usize {
    let mut depth = 0;
    for place in at..tokens.len() {
        match tokens[place] {
            "<" => depth += 1,
            ">" if !matches!(tokens[place - 1], "-" | "=") => depth -= 1,
            _ if depth == 0 => return place,
            _ => (),
        }
    }
    tokens.len()
}

/// The kind of the item at `at`, and the place of the word that says so.
fn kind(tokens: &[&str], at: usize) -> Option<(Kind, usize)> {
    let mut place = at;
    loop {
        let next = *tokens.get(place + 1)?;
        let kind = match tokens[place] {
            "fn" => Kind::Function,
            "struct" => Kind::Struct,
            "enum" => Kind::Enum,
            "union" => Kind::Union,
            "trait" => Kind::Trait,
            "type" => Kind::Alias,
            "static" => Kind::Static,
            "mod" => Kind::Module,
            "use" => Kind::Use,
            "impl" => Kind::Impl,
            "macro_rules" => Kind::Macro,
            "const" if !["fn", "unsafe", "extern", "async"].contains(&next) => Kind::Constant,
            "const" | "unsafe" | "extern" | "async" | "auto" | "\"" => {
                place += 1;
                continue;
            }
            _ if next == "!" => Kind::Invocation,
            _ => return None,
        };
        return Some((kind, place));
    }
}

#[cfg(test)]
mod tests {
    use super::{Kind, items};

    #[test]
    fn items_are_read() {
        let code = "
            use a::{B, c};
            #[derive(Clone)] #[inline] pub struct S<T: Fn(u8)>(pub T, u8) where T: Copy;
            pub(crate) struct Hidden { pub a: u32 }
            pub const X: Option<[u8; 2]> = Some({ let a = 1; [a, a] });
            impl<T> S<T> { pub const fn f(&self) -> u32 { if x { 1 } else { 2 } } fn g() {} }
            measure! { A, B }
            macro_rules! m { ($a:ty) => { impl X for $a {} } }
            pub trait T { type A: Copy; fn f(&self); fn g(&self) {} }
            unsafe extern \"C\" { }
            pub type A<T> = Option<T>;";
        let found = items(code);
        let kinds: Vec<Kind> = found.iter().map(|item| item.kind).collect();
        use Kind::*;
        assert_eq!(
            kinds,
            [
                Use, Struct, Struct, Constant, Impl, Invocation, Macro, Trait, Alias
            ]
        );
        assert_eq!(
            found[1].text(),
            "#[derive(Clone)] pub struct S<T: Fn(u8)> where T: Copy"
        );
        assert!(!found[2].is_public);
        assert_eq!(found[3].text(), "pub const X: Option<[u8; 2]>");
        let methods = found[4].items();
        assert_eq!(methods[0].text(), "pub const fn f(&self) -> u32");
        assert_eq!((methods.len(), methods[1].is_public), (2, false));
        assert_eq!(found[7].items().len(), 3);
        assert_eq!(found[8].text(), "pub type A<T> = Option<T>");
    }
}
