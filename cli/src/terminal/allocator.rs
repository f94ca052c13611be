//! How the allocator keeps freed memory.

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
