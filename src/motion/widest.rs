//! The same sums with the widest instructions that the processor has.
//!
//! Everything is built for any processor of its kind, which on x86-64 means registers of two numbers. [`widest`] runs a
//! piece of work as built for AVX2 where that is there: what is inlined into it needs fewer instructions, three operands each. No
//! product is fused with a sum, so all machines find the same bits. Eight single numbers at once are [`super::lanes`].

/// Does some work with what the processor at hand has. What it calls must be inlined to gain by it.
#[expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]
#[inline(always)]
pub(crate) fn widest<T>(work: impl FnOnce() -> T) -> T {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return simd.vectorize(work);
    }
    work()
}
