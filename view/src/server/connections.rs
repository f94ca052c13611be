//! Connections: how long they may wait, and how many there are.

use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;

/// How long a connection may take for the head of a request, or be idle.
const PATIENCE: Duration = Duration::from_secs(20);
/// The most connections at a time: a browser has about six. Beyond, the eldest is closed.
const MOST_CONNECTIONS: usize = 256;
/// The most bytes of the head of a request.
const MOST_HEAD: usize = 16 << 10;
/// How long to wait when the system has no room for another connection.
const BREATH: Duration = Duration::from_millis(50);

/// Answers connections until the process ends.
pub(super) async fn answer(listener: TcpListener, routes: Router) -> io::Result<()> {
    let open = Arc::new(Open::default());
    loop {
        match listener.accept().await {
            Ok((stream, _)) => open.add(stream, routes.clone()),
            // Out of descriptors, or the other side is gone already: others may go on.
            Err(_) => tokio::time::sleep(BREATH).await,
        }
    }
}

/// The connections that are open, eldest first.
#[derive(Default)]
struct Open(Mutex<VecDeque<AbortHandle>>);

impl Open {
    fn add(&self, stream: TcpStream, routes: Router) {
        let mut open = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        open.retain(|connection| !connection.is_finished());
        if open.len() >= MOST_CONNECTIONS
            && let Some(eldest) = open.pop_front()
        {
            eldest.abort();
        }
        // Small answers are not held back for more to send.
        let _ = stream.set_nodelay(true);
        open.push_back(tokio::spawn(serve(stream, routes)).abort_handle());
    }
}

async fn serve(stream: TcpStream, routes: Router) {
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(PATIENCE).max_buf_size(MOST_HEAD);
    let connection = http.serve_connection(TokioIo::new(stream), TowerToHyperService::new(routes));
    // A connection that breaks off concerns nobody else.
    let _ = connection.await;
}
