//! How much memory a build from a subset needs beside a binned one: at most the 32 bytes for each
//! primitive and 44 for each of the subset that Dittebrandt 2025 §8.4 needs.
//!
//! Counted by an allocator of this test's own, which is why it stands alone.
#![allow(unsafe_code, reason = "an allocator cannot be written without")]

use lightshed_bvh::glam::Vec3;
use lightshed_bvh::{Bvh, Insertion, Method, SubsetOptions};
use lightshed_sampling::CounterRng;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: all is the system allocator's; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(now, Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const COUNT: u32 = 200_000;

/// Most bytes for each primitive at any time of a build, the tree among them.
fn peak_bytes(triangles: &[[Vec3; 3]], method: Method) -> f64 {
    let before = NOW.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    let tree = Bvh::build(triangles, method).unwrap();
    let peak = PEAK.load(Ordering::Relaxed) - before;
    assert_eq!(tree.len(), triangles.len());
    peak as f64 / f64::from(COUNT)
}

#[test]
fn subsets_need_little_memory() {
    let triangles: Vec<[Vec3; 3]> = (0..COUNT)
        .map(|index| {
            let mut rng = CounterRng::new(1, index, 0);
            let mut vector = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            let (at, b, c) = (vector(), vector(), vector());
            [at, at + b * 0.01, at + c * 0.01]
        })
        .collect();
    let curve = peak_bytes(&triangles, Method::Curve);
    let binned = peak_bytes(&triangles, Method::Binned);
    println!("bytes for each primitive: along the curve {curve:.1}, binned {binned:.1}");
    // Nodes, order, and the items.
    assert!((100.0..110.0).contains(&binned), "{binned}");
    for (fraction, insertion) in [
        (0.05, Insertion::Planes),
        (0.2, Insertion::Planes),
        (0.1, Insertion::Window),
        (0.2, Insertion::Window),
    ] {
        let options = SubsetOptions {
            fraction,
            insertion,
            ..SubsetOptions::default()
        };
        let more = peak_bytes(&triangles, Method::Subset(options)) - binned;
        let allowed = 32.0 + 44.0 * f64::from(fraction);
        println!("{insertion:?}, a subset of {fraction}: {more:.1} more, {allowed:.1} allowed");
        assert!(more <= allowed, "{insertion:?}, {fraction}: {more} and {allowed}");
    }
    // The curve's codes, the tree and nothing else.
    assert!(curve < 8.0 + 68.0 + 1.0, "{curve}");
}
