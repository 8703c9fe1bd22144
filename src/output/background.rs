//! Files that are written while the run goes on.

use super::OutputError;
use std::{
    panic::resume_unwind,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        mpsc::{SyncSender, sync_channel},
    },
    thread::{self, JoinHandle},
};

/// Jobs that may wait for their turn.
const WAITING: usize = 4;

type Job<T> = Box<dyn FnOnce(&mut T) -> Result<(), OutputError> + Send>;

/// Files `T` that a thread of its own writes, job after job, where a core is free for it.
pub(super) struct Background<T> {
    free_core: bool,
    files: Arc<Mutex<T>>,
    writer: Option<Writer<T>>,
}

/// The thread, which ends with its queue or at the first job that fails.
struct Writer<T> {
    queue: SyncSender<Job<T>>,
    thread: JoinHandle<Result<(), OutputError>>,
}

impl<T: Send + 'static> Background<T> {
    /// Of a run on so many ranks. (As many as cores, 4, write faster by themselves: whole runs took 0.95 to
    /// 0.99 times as long, median of 6 pairs.)
    pub(super) fn new(files: T, ranks: usize) -> Self {
        let free_core = thread::available_parallelism().is_ok_and(|cores| ranks < cores.get());
        Self { free_core, files: Arc::new(Mutex::new(files)), writer: None }
    }

    /// Adds a job, once there is room for it, or does it.
    ///
    /// # Errors
    /// This job has failed, or one before: then this one is not done.
    pub(super) fn add(
        &mut self,
        job: impl FnOnce(&mut T) -> Result<(), OutputError> + Send + 'static,
    ) -> Result<(), OutputError> {
        if !self.free_core {
            return job(&mut lock(&self.files));
        }
        let writer = self.writer.get_or_insert_with(|| {
            let (queue, jobs) = sync_channel::<Job<T>>(WAITING);
            let files = self.files.clone();
            let write = move || jobs.iter().try_for_each(|job| job(&mut lock(&files)));
            Writer { queue, thread: thread::spawn(write) }
        });
        if writer.queue.send(Box::new(job)).is_err() { self.wait().map(|_| ()) } else { Ok(()) }
    }

    /// Whether all jobs went well so far.
    ///
    /// # Errors
    /// Why one did not.
    pub(super) fn check(&mut self) -> Result<(), OutputError> {
        match &self.writer {
            Some(writer) if writer.thread.is_finished() => self.wait().map(|_| ()),
            _ => Ok(()),
        }
    }

    /// The files, when all jobs are done.
    ///
    /// # Errors
    /// One has failed, and those behind it were not done.
    pub(super) fn wait(&mut self) -> Result<MutexGuard<'_, T>, OutputError> {
        if let Some(Writer { queue, thread }) = self.writer.take() {
            drop(queue);
            thread.join().unwrap_or_else(|panic| resume_unwind(panic))?;
        }
        Ok(lock(&self.files))
    }
}

fn lock<T>(files: &Mutex<T>) -> MutexGuard<'_, T> {
    files.lock().unwrap_or_else(PoisonError::into_inner)
}
