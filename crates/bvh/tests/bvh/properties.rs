//! A hundred thousand random inputs.

use crate::builds;
use lightshed_bvh::glam::Vec3;
use lightshed_bvh::{Bounds, BuildError, Bvh};
use lightshed_sampling::CounterRng;

/// A coordinate: usual, one of a few, or any bits.
fn coordinate(rng: &mut CounterRng, kind: u32) -> f32 {
    const SPECIAL: [f32; 12] = [
        0.0,
        -0.0,
        1.0,
        1e-38,
        1e38,
        -1e38,
        f32::MAX,
        f32::MIN,
        f32::MIN_POSITIVE,
        1e-45,
        16_777_217.0,
        -1.0,
    ];
    match kind {
        0 => rng.next_f32(),
        1 => SPECIAL[rng.next_u32() as usize % SPECIAL.len()],
        2 => (rng.next_f32() * 3.0).floor(),
        3 => f32::from_bits(rng.next_u32()),
        _ => rng.next_f32() * 10f32.powi((rng.next_u32() % 76) as i32 - 38),
    }
}

/// Trees are trees, and what has no box is named: the first such primitive, and only if there is
/// one.
#[test]
fn any_boxes_make_a_tree_or_an_error() {
    let builds = builds();
    let (mut refused, mut built) = (0, 0);
    for input in 0..100_000 {
        let mut rng = CounterRng::new(1, input, 0);
        let count = 1 + rng.next_u32() % if input % 100 == 0 { 200 } else { 14 };
        let kind = rng.next_u32() % 5;
        let boxes: Vec<Bounds> = (0..count)
            .map(|_| {
                let mut corner = || Vec3::from([0; 3].map(|_| coordinate(&mut rng, kind)));
                let (a, b) = (corner(), corner());
                match rng.next_u32() % 8 {
                    0 => Bounds::of_point(a),
                    _ => Bounds::new(a.min(b), a.max(b)),
                }
            })
            .collect();
        let (name, options) = &builds[input as usize % builds.len()];
        let wrong = boxes.iter().position(|b| !b.is_valid());
        match (Bvh::build(&boxes, *options), wrong) {
            (Ok(tree), None) => {
                built += 1;
                tree.check(&boxes)
                    .unwrap_or_else(|fault| panic!("{name}, input {input}: {fault}"));
            }
            (Err(BuildError::Bounds(index)), Some(wrong)) => {
                refused += 1;
                assert_eq!(index as usize, wrong);
            }
            (found, wrong) => panic!("{name}, input {input}: {:?}, {wrong:?}", found.err()),
        }
    }
    assert!(
        refused > 1000 && built > 50_000,
        "{refused} refused, {built} built"
    );
}
