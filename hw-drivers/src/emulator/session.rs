use std::io::{ErrorKind, Read as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::life::Life;

/// What an emulator's socket stands for.
pub(super) trait Served: Send + 'static {
    /// Moves on by so many seconds.
    fn advance(&mut self, dt: f64);

    /// Whether nobody gets through to it.
    fn is_cut(&self) -> bool;
}

/// What threads share, also after one of them has panicked.
pub(super) fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Listens on loopback and serves one session at a time, the newest, until the emulator is dropped: `step` reads what has come, keeps what is
/// no whole question yet, answers, and returns `None` where the session is over. It is asked every `pause`.
pub(super) fn serve<S: Served>(
    shared: &Arc<Mutex<S>>,
    pause: Duration,
    step: impl Fn(&mut TcpStream, &mut Vec<u8>, &Mutex<S>) -> Option<()> + Send + 'static,
) -> std::io::Result<(SocketAddr, Life)> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    listener.set_nonblocking(true)?;
    let address = listener.local_addr()?;
    let shared = Arc::clone(shared);
    let life = Life::begin(move |ended| {
        let mut session: Option<(TcpStream, Vec<u8>)> = None;
        let mut last = Instant::now();
        while !ended.load(Ordering::Relaxed) {
            let cut = {
                let mut served = lock(&shared);
                served.advance(last.elapsed().as_secs_f64());
                served.is_cut()
            };
            last = Instant::now();
            if cut {
                session = None;
            } else if let Ok((stream, _)) = listener.accept() {
                session = stream.set_nonblocking(true).ok().map(|()| (stream, Vec::new()));
            }
            if let Some((stream, bytes)) = &mut session
                && step(stream, bytes, &shared).is_none()
            {
                session = None;
            }
            std::thread::sleep(pause);
        }
    })?;
    Ok((address, life))
}

/// Adds what has come to what was kept; `None` where the other side has gone.
pub(super) fn receive(stream: &mut TcpStream, bytes: &mut Vec<u8>) -> Option<()> {
    let mut more = [0; 512];
    match stream.read(&mut more) {
        Ok(0) => None,
        Ok(count) => {
            bytes.extend(&more[..count]);
            Some(())
        }
        Err(error) if error.kind() == ErrorKind::WouldBlock => Some(()),
        Err(_) => None,
    }
}
