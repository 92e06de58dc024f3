//! Memory of a film: zeroed, and in large pages where the system has them.
//!
//! The crate's only module with `unsafe` code. A film of 1920×1080 pixels has 133 MB: 32,000 pages
//! of 4 KiB, each of them a page fault. Together these took 0.06 s of processor time of every
//! process that renders a shard, and zeros written by the program itself another 0.01 s
//! (`docs/performance-rays.md`). The plain counterpart is a vector of
//! [`PixelStatistics::default`].
#![allow(unsafe_code)]

use crate::PixelStatistics;
use std::alloc::{Layout, alloc_zeroed};

/// Size of a large page.
#[cfg(any(target_os = "linux", target_os = "android"))]
const LARGE_PAGE: usize = 2 << 20;

/// `count` pixels without samples; `None` if memory does not hold them.
pub fn empty_pixels(count: usize) -> Option<Vec<PixelStatistics>> {
    let layout = Layout::array::<PixelStatistics>(count).ok()?;
    if layout.size() == 0 {
        return Some(Vec::new());
    }
    // SAFETY: the layout's size is not zero.
    let memory = unsafe { alloc_zeroed(layout) };
    if memory.is_null() {
        return None;
    }
    // SAFETY: the global allocator gave the memory, with the layout of `count` pixels. All its
    // bytes are zero, which are valid `u64` and `f64`, the only fields of a pixel.
    let mut pixels = unsafe { Vec::from_raw_parts(memory.cast::<PixelStatistics>(), count, count) };
    ask_for_large_pages(&mut pixels);
    Some(pixels)
}

/// Asks the system to put memory that nobody has written into large pages. It is free to refuse:
/// everything is the same then, only slower.
#[cfg(any(target_os = "linux", target_os = "android"))]
fn ask_for_large_pages(pixels: &mut [PixelStatistics]) {
    use rustix::mm::{Advice, madvise};
    let bytes = size_of_val(pixels);
    let start = pixels.as_mut_ptr().cast::<u8>();
    // Only what lies in it wholly.
    let before = start.align_offset(LARGE_PAGE);
    let inner = bytes.saturating_sub(before) / LARGE_PAGE * LARGE_PAGE;
    if inner > 0 {
        // SAFETY: `before + inner <= bytes`, so the range lies within the slice, which is borrowed
        // mutably. The advice changes neither what memory holds nor what may be done with it.
        let _ = unsafe { madvise(start.add(before).cast(), inner, Advice::LinuxHugepage) };
    }
}

#[cfg(not(any(target_os = "linux", target_os = "android")))]
fn ask_for_large_pages(_: &mut [PixelStatistics]) {}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::Rgb;

    /// Of any size: less than a large page, several, and of memory that was in use before.
    #[test]
    fn pixels_are_those_of_the_plain_counterpart() {
        for count in [0, 1, 1000, 100_000, 100_000, 300_001] {
            let (mut first, second) = (empty_pixels(count).unwrap(), empty_pixels(count).unwrap());
            let plain = vec![PixelStatistics::default(); count];
            assert_eq!(first, plain);
            first.iter_mut().for_each(|pixel| pixel.add(Rgb::ONE));
            assert_eq!(second, plain);
            assert!(first.iter().all(|pixel| pixel.count() == 1));
            first.push(PixelStatistics::default());
            assert_eq!(first.len(), count + 1);
        }
        assert!(empty_pixels(usize::MAX / 32).is_none());
    }
}
