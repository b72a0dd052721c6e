//! Connections of a server: a limited number, of which none can be kept by who sends or takes nothing.

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, watch};
use tokio::time::sleep;
use tokio_io_timeout::TimeoutStream;

/// So many are open at a time; others wait. Most systems let a process have 1,024 files open, and each may need two.
const MOST: usize = 400;

/// The head of a request takes no longer, and so long may a connection wait for the next one.
const HEAD: Duration = Duration::from_secs(10);

/// So long may a client take no more of an answer.
const STALLED: Duration = Duration::from_secs(60);

/// How long downloads under way may take to end after Ctrl-C.
const GRACE: Duration = Duration::from_secs(5);

/// How long to wait where the system gives no connection, for instance because too many files are open.
const PAUSE: Duration = Duration::from_millis(100);

/// Answers what comes to `listener` until `stop` is true.
pub async fn serve(listener: TcpListener, router: Router, mut stop: watch::Receiver<bool>) {
    let places = Arc::new(Semaphore::new(MOST));
    let under_way = GracefulShutdown::new();
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEAD);
    let stopped = stop.wait_for(|stop| *stop);
    tokio::pin!(stopped);
    loop {
        let next = async {
            let place = Arc::clone(&places).acquire_owned().await;
            (place, listener.accept().await)
        };
        let (place, accepted) = tokio::select! {
            next = next => next,
            _ = &mut stopped => break,
        };
        let Ok((stream, _)) = accepted else {
            sleep(PAUSE).await;
            continue;
        };
        let mut stream = TimeoutStream::new(stream);
        stream.set_write_timeout(Some(STALLED));
        let service = TowerToHyperService::new(router.clone());
        let connection = under_way.watch(http.serve_connection(TokioIo::new(Box::pin(stream)), service));
        tokio::spawn(async move {
            // Clients may go away at any time.
            let _ = connection.await;
            drop(place);
        });
    }
    drop(listener);
    tokio::select! {
        () = under_way.shutdown() => {}
        () = sleep(GRACE) => {}
    }
}
