//! Files on their way between the page and the folder of its work.

use std::future::poll_fn;
use std::io::{self, Read};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::thread;
use std::time::Duration;

use axum::body::{Body, Bytes};
use hyper::body::{Body as _, Frame};
use tokio::sync::{mpsc, oneshot};
use tokio::time::timeout;

use crate::error::ViewError;
use crate::work_folder::WorkFolder;

/// The time limit for the next piece of a file.
const PATIENCE: Duration = Duration::from_secs(60);
/// The pieces on their way between a connection and a file.
const AHEAD: usize = 4;
/// The bytes of a piece that is read from a file.
const PIECE: usize = 1 << 18;

/// Keeps the body of a request as a file of the folder.
pub(super) async fn keep(
    folder: Arc<WorkFolder>,
    name: String,
    replace: bool,
    mut body: Body,
) -> Result<(), ViewError> {
    // A thread of its own: the disk must not keep other answers waiting.
    let (pieces, taken) = mpsc::channel(AHEAD);
    let (told, kept) = oneshot::channel();
    thread::spawn(move || {
        let body = Received { pieces: taken, piece: Bytes::new(), is_whole: false };
        // Nobody may wait for it any more.
        let _ = told.send(folder.keep(&name, body, replace));
    });
    loop {
        let next = poll_fn(|context| Pin::new(&mut body).poll_frame(context));
        let piece = match timeout(PATIENCE, next).await {
            Ok(Some(Ok(frame))) => frame.into_data().ok().map(Some),
            Ok(None) => Some(None),
            Ok(Some(Err(_))) | Err(_) => break,
        };
        let is_end = piece == Some(None);
        // A refused file is read to its end all the same: a browser sees no answer before.
        if let Some(piece) = piece {
            let _ = pieces.send(piece).await;
        }
        if is_end {
            break;
        }
    }
    drop(pieces);
    let failed = |_| ViewError::Unreadable("an error of the program; please report it".to_owned());
    kept.await.unwrap_or_else(|error| Err(failed(error)))
}

/// The body of a request as a reader.
struct Received {
    /// Pieces, and `None` behind the last.
    pieces: mpsc::Receiver<Option<Bytes>>,
    piece: Bytes,
    is_whole: bool,
}

impl Read for Received {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.piece.is_empty() && !self.is_whole {
            match self.pieces.blocking_recv() {
                Some(Some(piece)) => self.piece = piece,
                Some(None) => self.is_whole = true,
                None => {
                    let why = "the connection broke off before the end";
                    return Err(io::Error::new(io::ErrorKind::UnexpectedEof, why));
                }
            }
        }
        let piece = self.piece.split_to(buffer.len().min(self.piece.len()));
        buffer[..piece.len()].copy_from_slice(&piece);
        Ok(piece.len())
    }
}

/// Returns the bytes of a file as the body of an answer.
pub(super) fn body_of(mut file: impl Read + Send + 'static) -> Body {
    let (pieces, taken) = mpsc::channel(AHEAD);
    thread::spawn(move || {
        loop {
            let mut piece = Vec::with_capacity(PIECE);
            let read = file.by_ref().take(PIECE as u64).read_to_end(&mut piece);
            let is_last = read.is_err() || piece.is_empty();
            // Who does not wait for more hangs up.
            let is_sent = pieces.blocking_send(read.map(|_| Bytes::from(piece))).is_ok();
            if is_last || !is_sent {
                break;
            }
        }
    });
    Body::new(Sent(taken))
}

/// The pieces of a file that is sent.
struct Sent(mpsc::Receiver<io::Result<Bytes>>);

impl hyper::body::Body for Sent {
    type Data = Bytes;
    type Error = io::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, io::Error>>> {
        self.0.poll_recv(context).map(|piece| piece.map(|piece| piece.map(Frame::data)))
    }
}
