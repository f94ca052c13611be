//! Runs code with the widest instructions that the processor is known to have.

/// Calls `work`, compiled for AVX2 where the processor has it.
///
/// Results are the same bits either way: the compiler neither fuses nor reorders
/// floating-point operations.
#[inline]
pub(crate) fn wide<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn with_avx2<R>(work: impl FnOnce() -> R) -> R {
            work()
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            #[expect(
                unsafe_code,
                reason = "the compiler cannot see that the feature was asked for"
            )]
            // SAFETY: the processor has AVX2.
            return unsafe { with_avx2(work) };
        }
    }
    work()
}
