//! The viewer on the loopback address.

mod answer;
mod connections;
mod guard;
mod routes;
mod ticket;
mod token;
mod transfer;
mod work;

use std::io;
use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;

use guard::Guard;
pub use ticket::Ticket;
pub use token::Token;
use work::Workers;

use crate::viewer::Viewer;
use crate::work_folder::WorkFolder;

/// A port of the loopback address where the viewer will answer.
pub struct Address {
    listener: TcpListener,
    port: u16,
}

impl Address {
    /// Takes a port of the loopback address; any free one if it is 0.
    ///
    /// # Errors
    /// Returns an error if the port is not free.
    pub fn new(port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        listener.set_nonblocking(true)?;
        let port = listener.local_addr()?.port();
        Ok(Self { listener, port })
    }

    /// Returns an address that opens the page once, if [`serve`] gets a ticket of the token. It is
    /// only for the person who started the viewer.
    pub fn with(&self, token: &Token) -> String {
        format!("http://127.0.0.1:{}/?token={token}", self.port)
    }
}

/// Answers at an address until the process ends, with at most so many threads at work. The browser
/// that shows a ticket gets a cookie for everything else. With a folder, the page may add files to it
/// and have them made into builds.
///
/// # Errors
/// Returns an error if the system does not let it start, or has no random numbers for the cookie.
pub fn serve(
    viewer: Arc<Viewer>,
    address: Address,
    folder: Option<WorkFolder>,
    tickets: Vec<Ticket>,
    threads: usize,
) -> io::Result<()> {
    let cookie = Token::new()?;
    let mut runtime = tokio::runtime::Builder::new_current_thread();
    // Threads keep memory: so no more threads than work at a time.
    let runtime = runtime.enable_all().max_blocking_threads(threads.max(1)).build()?;
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(address.listener)?;
        let guard = Arc::new(Guard::new(tickets, cookie, address.port, folder.is_some()));
        let workers = Arc::new(Workers::new(viewer, folder, threads));
        connections::answer(listener, routes::routes(workers, guard)).await
    })
}
