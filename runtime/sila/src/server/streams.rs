//! What goes on: executions and properties, told whenever they change.

use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc as news;
use tokio_stream::{Stream, StreamExt};
use tonic::Status;

use super::News;
use super::answer::Answers;
use super::executions::{Known, State};
use crate::call::Failure;
use crate::framework::{self, Info, Real, Stage};
use crate::raw::Raw;

/// Messages as they come.
pub(super) type Streamed<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

/// How often a property that is subscribed to is looked at.
const LOOK: Duration = Duration::from_millis(500);

/// How long the end of an execution can be asked for, s; it is kept longer where few are.
pub(super) const LIFETIME: f64 = 3600.0;

/// What news makes of a state.
pub(super) fn follow(state: &mut State, news: News) {
    match news {
        News::Begun => state.begun = true,
        News::Goes(progress, remaining) => {
            (state.begun, state.progress, state.remaining) = (true, progress.clamp(0.0, 1.0), remaining);
        }
        News::Done(values) => {
            (state.begun, state.progress, state.remaining) = (true, 1.0, Some(0.0));
            state.end = Some(Ok(values));
        }
        News::Failed(failure) => state.end = Some(Err(failure)),
        News::NotNow(why) => state.end = Some(Err(Failure::Garbled(why))),
    }
}

/// How an execution stands, now and whenever that changes, until it has ended.
pub(super) fn infos(known: Known) -> Streamed<Info> {
    let all = tokio_stream::wrappers::WatchStream::new(known.state);
    let mut over = false;
    let info = move |state: State| {
        if std::mem::replace(&mut over, state.end.is_some()) {
            return None;
        }
        let stage = match &state.end {
            Some(Ok(_)) => Stage::Done,
            Some(Err(_)) => Stage::Failed,
            None if state.begun => Stage::Running,
            None => Stage::Waiting,
        };
        Some(Ok(Info {
            stage: stage as i32,
            progress: Some(Real { value: state.progress }),
            remaining: state.remaining.map(framework::Duration::of),
            lifetime: Some(framework::Duration::of(LIFETIME)),
        }))
    };
    Box::pin(all.map_while(info))
}

/// A property now and whenever it has changed.
pub(super) fn subscribed(this: Arc<Answers>, f: usize, p: usize) -> Streamed<Raw> {
    let (sender, all) = news::channel(1);
    tokio::spawn(async move {
        let mut last = None;
        loop {
            let now = this.read(f, p).await;
            let over = now.is_err();
            let fresh = match &now {
                Ok(raw) => last.replace(raw.clone()).as_ref() != Some(raw),
                Err(_) => true,
            };
            if fresh && sender.send(now).await.is_err() || over || sender.is_closed() {
                return;
            }
            tokio::time::sleep(LOOK).await;
        }
    });
    Box::pin(tokio_stream::wrappers::ReceiverStream::new(all))
}
