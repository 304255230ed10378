//! Work on many things that do not depend on each other, shared by all processors.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bytes of stack of a thread: what the main one has.
pub(crate) const STACK: usize = 8 << 20;

/// How many processors there are to share work.
pub(crate) fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Does two things at the same time, or one after the other where there is no thread to be had.
pub(crate) fn join<A: Send + Default, B>(one: impl FnOnce() -> A + Send, other: impl FnOnce() -> B) -> (A, B) {
    let task = Mutex::new(Some(one));
    let perform = || task.lock().ok().and_then(|mut task| task.take()).map(|one| one()).unwrap_or_default();
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, perform);
        let other = other();
        match thread.map(std::thread::ScopedJoinHandle::join) {
            Ok(Ok(one)) => (one, other),
            Ok(Err(panic)) => std::panic::resume_unwind(panic),
            Err(_) => (perform(), other),
        }
    })
}

/// What comes of each thing, in their order. Whoever is free takes the next one, so that a long one holds up nobody.
pub(crate) fn map<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let take = || {
        let mut done = Vec::new();
        while let Some((index, item)) =
            Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|i| Some((i, items.get(i)?)))
        {
            done.push((index, work(item)));
        }
        done
    };
    let others = processors().min(items.len()).saturating_sub(1);
    let mut done: BTreeMap<usize, R> = std::thread::scope(|scope| {
        // Where there is no thread to be had, this one does the work.
        let start = |_| std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, take).ok();
        let running: Vec<_> = (0..others).filter_map(start).collect();
        let own = take();
        running.into_iter().filter_map(|thread| thread.join().ok()).flatten().chain(own).collect()
    });
    items.iter().enumerate().map(|(index, item)| done.remove(&index).unwrap_or_else(|| work(item))).collect()
}
