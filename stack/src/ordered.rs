//! Maps layers on many threads, in order.

use std::collections::VecDeque;

use rayon::prelude::*;

/// A queued item whose memory size can be estimated.
pub trait MemorySize {
    /// Returns the approximate number of bytes that the item takes, or will take when decoded.
    fn bytes(&self) -> usize;
}

impl<T: MemorySize, U> MemorySize for (T, U) {
    fn bytes(&self) -> usize {
        self.0.bytes()
    }
}

/// The largest batch in items per thread: enough to make the cost of scheduling small.
const MAX_A_THREAD: usize = 16;
/// The batch size in bytes from which a batch has at most one item per thread.
const ENOUGH_BYTES: usize = 32 << 20;

/// Maps the items of `input` through `work` on all threads of the current rayon pool, in
/// order, and stops after an error.
///
/// Items are taken in batches of up to sixteen per thread, or one per thread if they are
/// large, so memory does not grow with the length of `input`.
pub fn map_in_order<I, T, U, E>(
    input: I,
    work: impl Fn(T) -> Result<U, E> + Sync,
) -> impl Iterator<Item = Result<U, E>>
where
    I: Iterator<Item = Result<T, E>>,
    T: MemorySize + Send,
    U: Send,
    E: Send,
{
    let threads = rayon::current_num_threads();
    // Batches ask again behind the end, where an iterator may start over.
    let mut input = input.fuse();
    let mut failed = false;
    let mut ready = VecDeque::new();
    std::iter::from_fn(move || {
        if ready.is_empty() && !failed {
            ready = map_batch(take_batch(&mut input, threads), &work);
        }
        let next: Option<Result<U, E>> = ready.pop_front();
        // One thread alone would stop here, so no result behind the error counts.
        if matches!(next, Some(Err(_))) {
            failed = true;
            ready.clear();
        }
        next
    })
}

/// Maps a batch on all threads. `work` is behind a pointer, so that rayon's code is compiled
/// once for each kind of item: as part of its type, every chain of stages took 400 kB of names.
fn map_batch<T: Send, U: Send, E: Send>(
    batch: Vec<Result<T, E>>,
    work: &(dyn Fn(T) -> Result<U, E> + Sync),
) -> VecDeque<Result<U, E>> {
    batch.into_par_iter().map(|item| item.and_then(work)).collect()
}

/// Takes the next items to work on at once: up to sixteen per thread, or one per thread if they
/// are large. None are left if it returns none.
pub fn take_batch<T: MemorySize, E>(
    input: &mut impl Iterator<Item = Result<T, E>>,
    threads: usize,
) -> Vec<Result<T, E>> {
    let mut batch = Vec::new();
    let mut bytes = 0;
    while batch.len() < threads || (batch.len() < MAX_A_THREAD * threads && bytes < ENOUGH_BYTES) {
        let Some(item) = input.next() else { break };
        // An error fills the batch, for nothing behind it is used.
        bytes += item.as_ref().map_or(ENOUGH_BYTES, MemorySize::bytes);
        batch.push(item);
    }
    batch
}

#[cfg(test)]
mod tests {
    use super::*;

    impl MemorySize for usize {
        fn bytes(&self) -> usize {
            *self
        }
    }

    #[test]
    fn a_batch_of_large_items_is_one_a_thread() {
        let items = |bytes: usize| std::iter::repeat(Ok::<_, ()>(bytes));
        assert_eq!(take_batch(&mut items(1), 3).len(), 48);
        assert_eq!(take_batch(&mut items(1 << 30), 3).len(), 3);
        assert_eq!(take_batch(&mut items(1 << 22), 3).len(), 8);
        assert_eq!(take_batch(&mut items(1).take(5), 3).len(), 5);
    }

    #[test]
    fn order_is_kept_and_an_error_ends_the_stream() {
        let input = (0..100).map(|n| if n == 60 { Err("cut") } else { Ok(n) });
        let out: Vec<_> = map_in_order(input, |n| Ok(n * 2)).collect();
        assert_eq!(out.len(), 61);
        assert!(out[..60].iter().enumerate().all(|(n, out)| *out == Ok(2 * n)));
        assert_eq!(out[60], Err("cut"));
    }

    #[test]
    fn an_error_of_the_work_comes_in_its_place() {
        let work = |n| if n == 7 { Err(n) } else { Ok(n) };
        let out: Vec<_> = map_in_order((0..100).map(Ok), work).collect();
        assert_eq!(out.len(), 8);
        assert_eq!(out[7], Err(7));
    }
}
