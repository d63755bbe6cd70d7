use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// A thread that ends with its emulator.
#[derive(Debug)]
pub(super) struct Life {
    ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Life {
    /// Runs `work` until it has nothing to do, or until the emulator is dropped: `work` asks the flag.
    pub(super) fn begin(work: impl FnOnce(&AtomicBool) + Send + 'static) -> std::io::Result<Self> {
        let ended = Arc::new(AtomicBool::new(false));
        let theirs = Arc::clone(&ended);
        let thread = std::thread::Builder::new().name("emulator".into()).spawn(move || work(&theirs))?;
        Ok(Self { ended, thread: Some(thread) })
    }
}

impl Drop for Life {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // What an emulator panicked of, its own thread has said.
            let _ = thread.join();
        }
    }
}
