//! Ends a command that gets no more memory: one sentence, a status and no temporary files.
//!
//! Rust aborts a process whose allocation failed, and runs no destructors. Only the allocator
//! itself can do better before that.

#[cfg(not(target_env = "musl"))]
use std::alloc::System as Base;
use std::alloc::{GlobalAlloc, Layout};
use std::fs::File;
use std::io::{self, Cursor, Write};
use std::panic;
#[cfg(windows)]
use std::process::exit;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicI32, AtomicUsize, Ordering::Relaxed};
use std::thread;
use std::time::Duration;

use lamp_stack::remove_temporaries;
#[cfg(target_env = "musl")]
use mimalloc::MiMalloc as Base;
#[cfg(unix)]
use signal_hook::low_level::exit;

use crate::terminal::signals::say_no_more;

/// The command's name, for the message.
static COMMAND: OnceLock<String> = OnceLock::new();

/// Notes the name of the command that runs, and sets up its end where memory runs out.
pub(crate) fn note_command(name: &str) {
    COMMAND.get_or_init(|| name.to_owned());
    let usual = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        // A thread that finds no memory for its signal stack panics in the standard library.
        let why = panic.payload().downcast_ref::<String>();
        if why.is_some_and(|why| why.contains("allocate an alternative stack")) {
            end(SIGNAL_STACK_BYTES);
        }
        usual(panic);
    }));
}

/// The stack on which a thread of Linux takes signals: `SIGSTKSZ`.
const SIGNAL_STACK_BYTES: usize = 8192;

/// The status that the process ends with.
static STATUS: AtomicI32 = AtomicI32::new(1);

/// Has the process end with another status than 1.
pub(crate) fn end_with(status: i32) {
    STATUS.store(status, Relaxed);
}

/// The system's allocator, or mimalloc in place of musl's, whose one lock all threads share; except
/// that the process ends where that gives nothing.
struct GivesOrEnds;

#[global_allocator]
static ALLOCATOR: GivesOrEnds = GivesOrEnds;

// SAFETY: `Base` does all the work; `given` returns what it gave or not at all.
#[expect(unsafe_code, reason = "only the allocator learns of a failure before the process aborts")]
unsafe impl GlobalAlloc for GivesOrEnds {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: The caller keeps the same contract.
        given(unsafe { Base.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: The caller keeps the same contract.
        given(unsafe { Base.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // SAFETY: The caller keeps the same contract.
        given(unsafe { Base.realloc(memory, layout, bytes) }, bytes)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: The caller keeps the same contract.
        unsafe { Base.dealloc(memory, layout) }
    }
}

#[inline]
fn given(memory: *mut u8, bytes: usize) -> *mut u8 {
    if memory.is_null() {
        end(bytes);
    }
    memory
}

/// Ends the process, in the first thread that gets here. Takes no memory itself.
#[cold]
fn end(bytes: usize) -> ! {
    /// A thread is known by the address of a variable of its own; zero is no thread.
    static ENDS_IT: AtomicUsize = AtomicUsize::new(0);
    thread_local! { static OWN: u8 = const { 0 } }
    let thread = OWN.with(|own| std::ptr::from_ref(own).addr());
    match ENDS_IT.compare_exchange(0, thread, Relaxed, Relaxed) {
        Ok(_) => {}
        // There is not even enough to remove folders. The next command removes them.
        Err(ends_it) if ends_it == thread => exit(STATUS.load(Relaxed)),
        // Another thread ends the process, and this one cannot return without its memory.
        Err(_) => loop {
            thread::sleep(Duration::MAX);
        },
    }
    say_no_more();
    tell(bytes);
    remove_temporaries();
    exit(STATUS.load(Relaxed))
}

/// Prints the message past standard error's lock, which a thread may hold that waits in [`end`].
fn tell(bytes: usize) {
    #[cfg(unix)]
    const RAISE: &str = "raise the limit (ulimit -v), ";
    #[cfg(windows)]
    const RAISE: &str = "";
    // On the stack, as there is no memory for a string.
    let mut line = [0; 256];
    let mut cursor = Cursor::new(&mut line[..]);
    let command = COMMAND.get().map_or("lamp", String::as_str);
    let written = writeln!(
        cursor,
        "error: {command}: out of memory ({bytes} bytes more were asked for): {RAISE}end other programs, \
         or give fewer --threads"
    );
    let end = cursor.position() as usize;
    let stderr = io::stderr();
    #[cfg(unix)]
    let stderr = std::os::fd::AsFd::as_fd(&stderr).try_clone_to_owned();
    #[cfg(windows)]
    let stderr = std::os::windows::io::AsHandle::as_handle(&stderr).try_clone_to_owned();
    if let (Ok(()), Ok(stderr)) = (written, stderr) {
        // No one is left to report to.
        let _ = File::from(stderr).write_all(&line[..end]);
    }
}
