//! Pieces of work shared by threads, whose results come in the order of the pieces.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc;

/// Bytes of a thread's stack: a run goes as deep as its plan.
const STACK: usize = 64 << 20;

/// Does `count` pieces of work on so many threads until `cancel` is set; the results that there are, by number. `done` is
/// told how many there are.
pub fn shared<T: Send>(
    count: u64,
    jobs: usize,
    cancel: &AtomicBool,
    work: impl Fn(u64) -> T + Sync,
    done: &mut dyn FnMut(u64),
) -> Vec<T> {
    let next = AtomicU64::new(0);
    let take = || Some(next.fetch_add(1, Ordering::Relaxed)).filter(|n| *n < count && !cancel.load(Ordering::Relaxed));
    let mut results: Vec<(u64, T)> = Vec::new();
    std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        for _ in 0..jobs.max(1) {
            let sender = sender.clone();
            let (take, work) = (&take, &work);
            let thread = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, move || {
                while let Some(number) = take() {
                    if sender.send((number, work(number))).is_err() {
                        return;
                    }
                }
            });
            if thread.is_err() {
                break;
            }
        }
        drop(sender);
        for result in receiver {
            results.push(result);
            done(results.len() as u64);
        }
        // Where there is no thread to be had, this one does the work.
        while let Some(number) = take() {
            results.push((number, work(number)));
            done(results.len() as u64);
        }
    });
    results.sort_by_key(|r| r.0);
    results.into_iter().map(|r| r.1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_order_whatever_the_threads() {
        let never = AtomicBool::new(false);
        for jobs in [1, 2, 7] {
            let mut last = 0;
            let squares = shared(100, jobs, &never, |n| n * n, &mut |done| last = done);
            assert_eq!(squares, (0..100).map(|n| n * n).collect::<Vec<_>>());
            assert_eq!(last, 100);
        }
    }

    #[test]
    fn what_is_done_is_kept_when_it_is_stopped() {
        let stop = AtomicBool::new(false);
        let work = |n| {
            stop.fetch_or(n >= 10, Ordering::Relaxed);
            n
        };
        let some = shared(1000, 2, &stop, work, &mut |_| {});
        assert!((11..100).contains(&some.len()), "{}", some.len());
    }
}
