//! Work on many layers at once without changing their order.

use std::collections::VecDeque;

use rayon::prelude::*;

/// Maps the items of `input` through `work` on all threads of the current
/// rayon pool, in order. After an error nothing more is taken from `input`.
///
/// Two items a thread are held at once, so memory does not grow with the
/// length of `input`.
pub fn map_in_order<I, T, U, E>(
    input: I,
    work: impl Fn(T) -> Result<U, E> + Sync,
) -> impl Iterator<Item = Result<U, E>>
where
    I: Iterator<Item = Result<T, E>>,
    T: Send,
    U: Send,
    E: Send,
{
    let batch = 2 * rayon::current_num_threads();
    let mut input = input.fuse();
    let mut failed = false;
    let mut ready = VecDeque::new();
    std::iter::from_fn(move || {
        if ready.is_empty() && !failed {
            let taken: Vec<_> = input.by_ref().take(batch).collect();
            ready = taken.into_par_iter().map(|item| item.and_then(&work)).collect();
        }
        let next: Option<Result<U, E>> = ready.pop_front();
        if matches!(next, Some(Err(_))) {
            failed = true;
            ready.clear();
        }
        next
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
