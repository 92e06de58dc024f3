//! Huge pages for long lists that are read at random.
//!
//! Memory comes in pages of 4 KiB by default. A processor remembers where some thousand pages lie;
//! a list of 100 MB has 25,000, so that most reads at random places wait for a table too. In huge
//! pages of 2 MiB the same list has 50. `docs/performance.md` says what that brings.

/// Size and alignment of a huge page.
const HUGE_PAGE: usize = 2 << 20;

/// `MADV_COLLAPSE` of Linux 6.1: copies what lies in small pages into huge ones, now.
const COLLAPSE: libc::c_int = 25;

/// Moves a list into huge pages where the system has them, and returns how many of its bytes lie in
/// them then.
pub(super) fn move_to_huge_pages<T>(list: &[T]) -> usize {
    let Some((first, whole)) = within(list) else {
        return 0;
    };
    advise(first, whole, libc::MADV_HUGEPAGE);
    if advise(first, whole, COLLAPSE) { whole } else { 0 }
}

/// Lets memory that nothing was written to come in huge pages.
pub(super) fn come_in_huge_pages<T>(room: &[T]) {
    if let Some((first, whole)) = within(room) {
        advise(first, whole, libc::MADV_HUGEPAGE);
    }
}

/// Start and length in bytes of the huge pages that lie within a list, if there are any.
fn within<T>(list: &[T]) -> Option<(*mut libc::c_void, usize)> {
    let start = list.as_ptr().cast::<u8>().cast_mut();
    let skipped = start.align_offset(HUGE_PAGE);
    let whole = size_of_val(list).saturating_sub(skipped) / HUGE_PAGE * HUGE_PAGE;
    (whole > 0).then(|| (start.wrapping_add(skipped).cast(), whole))
}

/// Whether the system took the advice. One that does not know it refuses it, which is no error.
fn advise(first: *mut libc::c_void, bytes: usize, advice: libc::c_int) -> bool {
    // SAFETY: the pages lie within a list of a caller above. Both kinds of advice only say how the
    // system is to hold them: neither their contents nor their addresses nor the rights to them
    // change, so readers and writers do not notice.
    unsafe { libc::madvise(first, bytes, advice) == 0 }
}
