//! How the allocator keeps freed memory.

/// Lets the allocator keep what one layer frees for the next. GNU's gives freed memory back to the
/// system from 128 KiB on, and asks for it again, unless it has seen a larger block come and go: a
/// fifth of a stage's time. (`c/musl.c` sets mimalloc.)
pub(crate) fn keep_freed_memory() {
    // Freeing a mapped block raises the threshold to its size, up to 32 MiB (M_MMAP_THRESHOLD in
    // mallopt(3)).
    #[cfg(not(target_env = "musl"))]
    drop(std::hint::black_box(Vec::<u8>::with_capacity(16 << 20)));
}

/// Lets the allocator give large blocks back to the system as soon as they are freed. GNU's keeps
/// them for the next one, up to 64 MiB a thread and in pieces: a command that holds many layers
/// then takes a third more memory than the layers.
pub(crate) fn give_freed_memory_back() {
    /// The bytes of a large block.
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    const LARGE: i32 = 1 << 20;
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[expect(unsafe_code, reason = "the allocator is set through a C function")]
    // SAFETY: it takes two numbers, at any time; a refusal changes nothing.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE);
    }
}
