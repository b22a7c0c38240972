//! Memory to work in: a few things on the stack, as those of most arms are, more of them on the heap.
//!
//! An inner loop of half a microsecond would spend a tenth of it on every piece of memory that it asks for.

/// As many moving frames are few.
pub(super) const FEW: usize = 8;

/// Returns `n` things to work with, from `few` where they are enough.
#[inline]
pub(super) fn scratch<'s, T: Copy + Default, const N: usize>(
    n: usize,
    few: &'s mut [T; N],
    many: &'s mut Vec<T>,
) -> &'s mut [T] {
    if n <= N {
        &mut few[..n]
    } else {
        many.resize(n, T::default());
        many
    }
}
