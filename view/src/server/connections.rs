//! Connections: their time limits, and their number.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::Router;
use axum::http::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;
use tower_service::Service;

/// The time limit of a connection for the head of a request, and for being idle.
const PATIENCE: Duration = Duration::from_secs(20);
/// The most connections at a time: a browser has about six. Beyond it, the oldest connection
/// without an accepted request is closed.
const MOST_CONNECTIONS: usize = 256;
/// The most bytes of the head of a request.
const MOST_HEAD: usize = 16 << 10;
/// The pause when the system has no room for another connection.
const BREATH: Duration = Duration::from_millis(50);

/// Answers connections until the process ends.
pub(super) async fn answer(listener: TcpListener, routes: Router) -> io::Result<()> {
    let mut open = Open::default();
    loop {
        match listener.accept().await {
            Ok((stream, _)) => open.add(stream, routes.clone()),
            // Out of descriptors, or the other side is gone already: others may go on.
            Err(_) => tokio::time::sleep(BREATH).await,
        }
    }
}

/// Whether a connection had a request that was let in.
#[derive(Clone, Default)]
pub(super) struct Trust(Arc<AtomicBool>);

impl Trust {
    pub(super) fn gain(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn is_gained(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// The connections that are open, eldest first.
#[derive(Default)]
struct Open(VecDeque<(Trust, AbortHandle)>);

impl Open {
    fn add(&mut self, stream: TcpStream, routes: Router) {
        self.0.retain(|(_, connection)| !connection.is_finished());
        if self.0.len() >= MOST_CONNECTIONS {
            let stranger = self.0.iter().position(|(trust, _)| !trust.is_gained());
            if let Some((_, closed)) = self.0.remove(stranger.unwrap_or(0)) {
                closed.abort();
            }
        }
        // Small answers are not held back for more to send.
        let _ = stream.set_nodelay(true);
        let trust = Trust::default();
        let connection = tokio::spawn(serve(stream, routes, trust.clone()));
        self.0.push_back((trust, connection.abort_handle()));
    }
}

async fn serve(stream: TcpStream, routes: Router, trust: Trust) {
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(PATIENCE).max_buf_size(MOST_HEAD);
    let service = service_fn(|mut request: Request<Incoming>| {
        request.extensions_mut().insert(trust.clone());
        routes.clone().call(request)
    });
    // A broken connection concerns nobody else.
    let _ = http.serve_connection(TokioIo::new(stream), service).await;
}
