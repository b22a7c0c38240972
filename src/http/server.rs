//! A server of HTTP/1.1 for two things: the page on this machine and the emulated cell's camera. One request a
//! connection, each answered whole.
//!
//! The protocol is `hyper`'s, on one thread; handlers run on threads of their own, so many at once and no more. A
//! client has so long for the head of its request, so long for its body, and so long for all of it, however slowly it
//! sends. No encryption and no connections kept open: nothing here is meant for a network that is not trusted. What a
//! request may ask for is the handler's business; see [`Request::is_local`] for the part that every handler on this
//! machine should check.

use std::convert::Infallible;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use http_body_util::{BodyExt, Full, LengthLimitError, Limited};
use hyper::body::{Body, Bytes, Incoming};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::net::{TcpListener as Listener, TcpStream as Stream};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};
use tokio::time::{sleep, timeout};

use super::error::Refusal;
use super::message::{Request, Response};

/// The longest head of a request that is read, bytes.
const LONGEST_HEAD: usize = 16 << 10;
/// The longest body of a request that is read, bytes: a form, never a file.
const LONGEST_BODY: usize = 16 << 10;
/// How many requests are answered at once, each on a thread.
const MOST_ANSWERS: usize = 64;
/// How many connections there are at once; more wait their turn in the system's queue.
const MOST_CONNECTIONS: usize = 256;
/// How long it is waited before a connection is taken again that could not be: while too many files are open.
const BREATH: Duration = Duration::from_millis(50);

/// How long a client may take.
#[derive(Debug, Clone, Copy)]
struct Patience {
    /// To send the head of its request.
    head: Duration,
    /// To send its body.
    body: Duration,
    /// For everything, the answer included.
    whole: Duration,
}

const PATIENCE: Patience = Patience {
    head: Duration::from_secs(3),
    body: Duration::from_secs(3),
    whole: Duration::from_mins(1),
};

/// Answers requests.
pub type Handler = Arc<dyn Fn(&Request) -> Response + Send + Sync>;

/// Answers until it is dropped.
pub struct Server {
    end: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
    address: SocketAddr,
}

impl Server {
    /// Listens at an address; port 0 takes any that is free.
    ///
    /// # Errors
    ///
    /// When the port is taken.
    pub fn serve(address: SocketAddr, handler: Handler) -> io::Result<Self> {
        Self::serve_patiently(address, handler, PATIENCE)
    }

    fn serve_patiently(
        address: SocketAddr,
        handler: Handler,
        patience: Patience,
    ) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        let address = listener.local_addr()?;
        listener.set_nonblocking(true)?;
        let runtime = Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .max_blocking_threads(MOST_ANSWERS)
            .build()?;
        let listener = runtime.block_on(async { Listener::from_std(listener) })?;
        let (end, ending) = oneshot::channel();
        let answers = Arc::new(Semaphore::new(MOST_ANSWERS));
        let site = Site { handler, patience, port: address.port(), answers };
        let thread = thread::spawn(move || run(runtime, listener, site, ending));
        Ok(Self { end: Some(end), thread: Some(thread), address })
    }

    /// Returns where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Whoever is answered still loses the connection; a handler that runs ends by itself.
        drop(self.end.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Serves until the other end is dropped.
fn run(runtime: Runtime, listener: Listener, site: Site, ending: oneshot::Receiver<()>) {
    runtime.spawn(accept(listener, site));
    let _ = runtime.block_on(ending);
    runtime.shutdown_background();
}

/// What every connection is answered by.
#[derive(Clone)]
struct Site {
    handler: Handler,
    patience: Patience,
    port: u16,
    /// The places of requests that are answered now.
    answers: Arc<Semaphore>,
}

/// Takes connections for ever.
async fn accept(listener: Listener, site: Site) {
    let connections = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    while let Ok(connection) = connections.clone().acquire_owned().await {
        match listener.accept().await {
            Ok((stream, _)) => {
                tokio::spawn(answer(stream, site.clone(), connection));
            }
            // Too many files are open, or the client has hung up already: the next one may be taken again.
            Err(_) => sleep(BREATH).await,
        }
    }
}

/// Answers one connection.
async fn answer(stream: Stream, site: Site, _connection: OwnedSemaphorePermit) {
    let patience = site.patience;
    let service = service_fn(|asked| respond(asked, site.clone()));
    let served = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(patience.head)
        .keep_alive(false)
        .half_close(true)
        .max_buf_size(LONGEST_HEAD)
        .auto_date_header(false)
        .title_case_headers(true)
        .serve_connection(TokioIo::new(stream), service);
    // Who hangs up, or is cut off, misses the answer; nobody else does.
    let _ = timeout(patience.whole, served).await;
}

async fn respond(
    asked: hyper::Request<Incoming>,
    site: Site,
) -> Result<hyper::Response<Full<Bytes>>, Infallible> {
    let (head, body) = asked.into_parts();
    let request = match whole(body, site.patience.body).await {
        Ok(body) => Request::read(&head, &body, site.port),
        Err(refusal) => Err(refusal),
    };
    let response = match request {
        Err(why) => Response::refusal(why),
        Ok(request) => match site.answers.clone().try_acquire_owned() {
            Err(_) => Response::refusal(Refusal::TooMany),
            Ok(place) => answered(request, site.handler, place).await,
        },
    };
    Ok(response.whole())
}

/// Has a handler answer on a thread of its own, which keeps its place until it is done, whoever hangs up.
async fn answered(request: Request, handler: Handler, place: OwnedSemaphorePermit) -> Response {
    let work = tokio::task::spawn_blocking(move || {
        let _place = place;
        handler(&request)
    });
    work.await.unwrap_or_else(|_| Response::refusal(Refusal::Failed))
}

/// Reads a body to its end.
async fn whole(body: Incoming, patience: Duration) -> Result<Bytes, Refusal> {
    if body.size_hint().lower() > LONGEST_BODY as u64 {
        return Err(Refusal::BodyTooLong);
    }
    match timeout(patience, Limited::new(body, LONGEST_BODY).collect()).await {
        Ok(Ok(body)) => Ok(body.to_bytes()),
        Ok(Err(error)) if error.is::<LengthLimitError>() => Err(Refusal::BodyTooLong),
        Ok(Err(_)) => Err(Refusal::CutShort),
        Err(_) => Err(Refusal::BodyTooSlow),
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Write as _};
    use std::net::{Ipv4Addr, Shutdown, TcpStream};
    use std::sync::Mutex;
    use std::sync::mpsc::channel;

    use super::*;

    fn server(handler: impl Fn(&Request) -> Response + Send + Sync + 'static) -> Server {
        Server::serve((Ipv4Addr::LOCALHOST, 0).into(), Arc::new(handler)).unwrap()
    }

    /// A server that has no patience.
    fn hasty() -> Server {
        let short = Duration::from_millis(100);
        let patience = Patience { head: short, body: short, whole: Duration::from_mins(1) };
        let handler: Handler = Arc::new(|request| Response::text(200, &request.path));
        Server::serve_patiently((Ipv4Addr::LOCALHOST, 0).into(), handler, patience).unwrap()
    }

    fn connect(server: &Server) -> TcpStream {
        let stream = TcpStream::connect(server.address()).unwrap();
        stream.set_read_timeout(Some(Duration::from_mins(1))).unwrap();
        stream
    }

    /// Sends a text and returns what is answered until the connection ends.
    fn ask(server: &Server, text: &str) -> String {
        let mut stream = connect(server);
        // A server that has heard enough may hang up before the end.
        let _ = stream.write_all(text.as_bytes());
        let _ = stream.shutdown(Shutdown::Write);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8(answer).unwrap()
    }

    fn status(answer: &str) -> u16 {
        answer.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0)
    }

    /// Returns what a handler is handed.
    fn request(text: &str) -> Request {
        let seen = Arc::new(Mutex::new(None));
        let kept = seen.clone();
        let server = server(move |request| {
            *kept.lock().unwrap() = Some(request.clone());
            Response::text(200, "seen")
        });
        let answer = ask(&server, text);
        let seen = seen.lock().unwrap().take();
        seen.unwrap_or_else(|| panic!("{text:?}: {answer}"))
    }

    #[test]
    fn a_request_is_read_whole() {
        let text = "POST /a%20b?x=1%2B1&y HTTP/1.1\r\nHost: localhost:80\r\nContent-Length: 9\r\n\r\n\
                    who=a+%26b";
        // The length says 9, so the last byte is no part of it.
        let read = request(text);
        assert_eq!((read.method.as_str(), read.path.as_str()), ("POST", "/a b"));
        assert_eq!(read.asked("x").as_deref(), Some("1+1"));
        assert_eq!(read.asked("y").as_deref(), Some(""));
        assert_eq!(read.asked("z"), None);
        assert_eq!(read.sent("who").as_deref(), Some("a &"));
        let text = "POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n3\r\na=1\r\n0\r\n\r\n";
        assert_eq!(request(text).sent("a").as_deref(), Some("1"));
    }

    #[test]
    fn what_is_not_spoken_is_refused() {
        let server = server(|_| Response::text(200, "never"));
        for (text, expected) in [
            ("GET /\r\n\r\n", 400),
            ("GET /%zz HTTP/1.1\r\n\r\n", 400),
            ("GET http://elsewhere/ HTTP/1.1\r\n\r\n", 400),
            ("DELETE / HTTP/1.1\r\n\r\n", 405),
            ("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n", 400),
            ("POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n", 400),
            ("POST / HTTP/1.1\r\nContent-Length: 99999999\r\n\r\n", 413),
        ] {
            assert_eq!(status(&ask(&server, text)), expected, "{text:?}");
        }
        let long = format!("GET /{} HTTP/1.1\r\n\r\n", "a".repeat(2 * LONGEST_HEAD));
        assert!(matches!(status(&ask(&server, &long)), 414 | 431 | 0));
        let body = "a".repeat(LONGEST_BODY + 1);
        let chunked = format!(
            "POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n{:x}\r\n{body}\r\n0\r\n\r\n",
            body.len()
        );
        assert!(matches!(status(&ask(&server, &chunked)), 413 | 0));
        // What is cut short is answered by nothing that looks like success.
        for text in
            ["GET / HTTP/1.1\r\nHost: a\r\n", "POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\nabc"]
        {
            assert_ne!(status(&ask(&server, text)), 200, "{text:?}");
        }
    }

    #[test]
    fn a_server_answers_and_ends() {
        let server =
            server(|request| Response::text(200, &request.path).with("X-Line", "a\r\nb: c"));
        let answer = ask(&server, "GET /here HTTP/1.1\r\n\r\n");
        assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"), "{answer}");
        assert!(answer.ends_with("\r\n\r\n/here\n"), "{answer}");
        assert!(answer.contains("Content-Type: text/plain; charset=utf-8\r\n"), "{answer}");
        // What would end a header's line is left out of it.
        assert!(answer.contains("X-Line: ab: c\r\n"), "{answer}");
        let head = ask(&server, "HEAD /here HTTP/1.1\r\n\r\n");
        assert!(head.contains("Content-Length: 6\r\n") && head.ends_with("\r\n\r\n"), "{head}");
        let address = server.address();
        drop(server);
        assert!(TcpStream::connect(address).is_err());
    }

    #[test]
    fn a_silent_client_and_one_that_sends_byte_by_byte_are_cut_off() {
        let server = hasty();
        let mut silent = connect(&server);
        let mut rest = Vec::new();
        assert!(silent.read_to_end(&mut rest).is_ok(), "it still waits");
        assert_ne!(status(&String::from_utf8_lossy(&rest)), 200);
        // Every byte comes in good time, and the whole never.
        for begin in ["GET / HTTP/1.1\r\nX: ", "POST / HTTP/1.1\r\nContent-Length: 9999\r\n\r\n"] {
            let mut slow = connect(&server);
            slow.write_all(begin.as_bytes()).unwrap();
            slow.set_read_timeout(Some(Duration::from_millis(10))).unwrap();
            let mut sent = 0;
            let mut told = [0; 512];
            loop {
                let gone = slow.write_all(b"x").is_err();
                // Nothing yet is an error, too.
                if gone || slow.read(&mut told).is_ok() {
                    break;
                }
                sent += 1;
                assert!(sent < 2000, "it still listens");
            }
        }
        assert_eq!(status(&ask(&server, "GET /well HTTP/1.1\r\n\r\n")), 200);
    }

    #[test]
    fn more_requests_than_are_answered_at_once_are_told_to_come_again() {
        let (go, wait) = channel::<()>();
        let wait = Mutex::new(wait);
        let (begun, begins) = channel();
        let server = server(move |_| {
            let _ = begun.send(());
            // One after the other gets its turn, or all when the other end is gone.
            let _ = wait.lock().unwrap().recv();
            Response::text(200, "done")
        });
        let mut held: Vec<TcpStream> = (0..MOST_ANSWERS).map(|_| connect(&server)).collect();
        for stream in &mut held {
            stream.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
        }
        // Who says nothing takes nobody's place.
        let _idle: Vec<TcpStream> = (0..2 * MOST_ANSWERS).map(|_| connect(&server)).collect();
        for _ in 0..MOST_ANSWERS {
            begins.recv_timeout(Duration::from_mins(1)).unwrap();
        }
        assert_eq!(status(&ask(&server, "GET / HTTP/1.1\r\n\r\n")), 503);
        drop(go);
        for mut stream in held {
            let mut answer = String::new();
            stream.read_to_string(&mut answer).unwrap();
            assert_eq!(status(&answer), 200);
        }
        assert_eq!(status(&ask(&server, "GET / HTTP/1.1\r\n\r\n")), 200);
    }

    #[test]
    fn a_handler_that_panics_costs_its_own_answer() {
        let server = server(|request| {
            assert!(request.path != "/bad", "planted");
            Response::text(200, "well")
        });
        assert_eq!(status(&ask(&server, "GET /bad HTTP/1.1\r\n\r\n")), 500);
        assert_eq!(status(&ask(&server, "GET / HTTP/1.1\r\n\r\n")), 200);
    }
}
