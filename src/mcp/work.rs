//! Calls as pieces of work that may take long: one thread each, a few at a time, given up when time is over or nobody waits.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::sync::Semaphore;
use tokio::task::JoinHandle;
use tokio::time::sleep;

use super::answer::Answer;
use super::desk::Desk;

/// So many calls are worked on at once; others wait for their turn.
const AT_ONCE: usize = 4;
/// So many calls are there at once, those that wait with them; one more is refused.
const MOST: usize = 64;
/// How long work that is told to stop may take to do so: what `finally` says is done first, and a long run has a long report.
const GRACE: Duration = Duration::from_secs(20);

/// What a call does. The flag stops it halfway.
pub type Work = Box<dyn FnOnce(&Desk, &Arc<AtomicBool>) -> Result<Answer, String> + Send>;

/// Where work is done.
#[derive(Clone)]
pub struct Shop {
    desk: Arc<Desk>,
    turns: Arc<Semaphore>,
    places: Arc<Semaphore>,
}

impl Shop {
    /// At a desk.
    pub fn new(desk: Desk) -> Self {
        Shop { desk: Arc::new(desk), turns: Arc::new(Semaphore::new(AT_ONCE)), places: Arc::new(Semaphore::new(MOST)) }
    }

    /// Does a piece of work within a time, as long as `wanted` does not end; `Err` says in words why there is no answer.
    pub async fn perform(
        &self,
        work: Work,
        limit: Duration,
        wanted: impl Future<Output = ()>,
    ) -> Result<Answer, String> {
        let Ok(_place) = self.places.try_acquire() else {
            return Err(format!("{MOST} calls are already running or waiting: call again when one of them has ended"));
        };
        let stop = Arc::new(AtomicBool::new(false));
        let (shop, flag) = (self.clone(), stop.clone());
        let done = async move {
            let turn = shop.turns.acquire_owned().await;
            let job = tokio::task::spawn_blocking(move || {
                // Held as long as the work goes on, whether or not somebody still waits for it.
                let _turn = turn;
                work(&shop.desk, &flag)
            });
            ended(job).await
        };
        tokio::pin!(done, wanted);
        tokio::select! {
            answer = &mut done => return answer,
            () = sleep(limit) => {}
            () = &mut wanted => {
                stop.store(true, Ordering::SeqCst);
                return Err("the call was cancelled".to_string());
            }
        }
        stop.store(true, Ordering::SeqCst);
        tokio::select! {
            answer = &mut done => answer,
            () = sleep(GRACE) => Err(format!("this takes longer than {} s; use a smaller protocol or more `seconds`", limit.as_secs())),
        }
    }
}

async fn ended(job: JoinHandle<Result<Answer, String>>) -> Result<Answer, String> {
    job.await.unwrap_or_else(|_| {
        Err("this call hit a bug in the compiler; please report the text that shows it".to_string())
    })
}
