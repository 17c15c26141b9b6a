//! Connections: how many there may be, and how long one may take to say what it wants.

use anyhow::{Context, Result};
use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

/// Connections that are not a WebSocket yet; a further one is closed at once.
const MAX_CONNECTIONS: usize = 64;
/// Connections that the system keeps for us before we look.
const BACKLOG: u32 = 64;
/// A request's head must have come within this.
const HEAD: Duration = Duration::from_secs(5);
/// And the answer be taken within this.
const ANSWER: Duration = Duration::from_secs(30);
/// What is not read by a client waits in the system up to so many bytes: no more, so that who is late finds out.
const SEND_BUFFER: u32 = 64 << 10;
/// Longest head of a request, bytes.
const MAX_HEAD: usize = 16 << 10;

/// Opens the port.
///
/// # Errors
/// With the address, if it is not to be had.
pub fn bind(address: SocketAddr) -> Result<TcpListener> {
    let open = || {
        let socket = if address.is_ipv4() {
            TcpSocket::new_v4()?
        } else {
            TcpSocket::new_v6()?
        };
        // After a restart the port is still waiting for stragglers. Elsewhere than on Unix this would let somebody else have it, too.
        #[cfg(unix)]
        socket.set_reuseaddr(true)?;
        socket.set_send_buffer_size(SEND_BUFFER)?;
        socket.bind(address)?;
        socket.listen(BACKLOG)
    };
    open().with_context(|| format!("{address} is not to be had (--web 0 takes a free port)"))
}

/// Serves for ever.
pub async fn serve(listener: TcpListener, router: Router) {
    let connections = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            // Out of file descriptors: some will be free again.
            sleep(Duration::from_millis(50)).await;
            continue;
        };
        let Ok(permit) = Arc::clone(&connections).try_acquire_owned() else {
            continue;
        };
        let router = router.clone();
        tokio::spawn(async move {
            // A connection that turns into a WebSocket is at its end here.
            let _ = timeout(ANSWER, answer(stream, router)).await;
            drop(permit);
        });
    }
}

/// Answers one request.
async fn answer(stream: TcpStream, router: Router) {
    // Replies are short lines; waiting to fill a packet helps nobody.
    let _ = stream.set_nodelay(true);
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD)
        .max_buf_size(MAX_HEAD)
        .serve_connection(TokioIo::new(stream), TowerToHyperService::new(router))
        .with_upgrades();
    // What goes wrong here is the client's doing, and nobody is left to be told.
    let _ = connection.await;
}
