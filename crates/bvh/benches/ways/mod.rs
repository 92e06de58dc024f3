//! Ways to build that a command asks for.

use lightshed_bvh::{BuildOptions, Method, Reinsertion, SubsetOptions};

/// Those of `ALSO=method/share/passes,…`.
pub fn asked_for() -> Vec<(String, BuildOptions)> {
    let also = std::env::var("ALSO").unwrap_or_default();
    also.split(',').filter(|text| !text.is_empty()).map(way).collect()
}

/// `curve`, `subset`, `binned`, or `ploc` and a radius; and re-insertion. With `twins-` before it,
/// neighbours are built as one.
fn way(text: &str) -> (String, BuildOptions) {
    let (twins, rest) = match text.strip_prefix("twins-") {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let [name, share, passes] = rest.split('/').collect::<Vec<_>>()[..] else {
        panic!("{text}: method/share/passes");
    };
    let method = match (name.strip_prefix("ploc"), name) {
        (Some(radius), _) => Method::Ploc {
            radius: radius.parse().expect("a radius"),
        },
        (None, "curve") => Method::Curve,
        (None, "subset") => Method::Subset(SubsetOptions::default()),
        (None, "binned") => Method::Binned,
        _ => panic!("{name}: curve, subset, binned, or ploc and a radius"),
    };
    let reinsertion = Reinsertion {
        share: share.parse().expect("a share"),
        passes: passes.parse().expect("a number of passes"),
    };
    let reinsertion = (reinsertion.passes > 0).then_some(reinsertion);
    let options = BuildOptions {
        method,
        reinsertion,
        twins,
    };
    (text.to_owned(), options)
}
