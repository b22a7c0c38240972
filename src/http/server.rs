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
use hyper::header::{HeaderName, HeaderValue};
use hyper::http::request::Parts;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::net::{TcpListener as Listener, TcpStream as Stream};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};
use tokio::time::{sleep, timeout};

/// The longest head of a request that is read, bytes.
const LONGEST_HEAD: usize = 16 << 10;
/// The longest body of a request that is read, bytes: a form, never a file.
const LONGEST_BODY: usize = 16 << 10;
/// How many requests are answered at once, each on a thread.
const MOST_ANSWERS: usize = 64;
/// How many connections there are at once: those beyond the answers are told to come again. More wait their turn in
/// the system's queue.
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

/// What a client asks for.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Request {
    /// `GET`, `HEAD` or `POST`.
    pub method: String,
    /// The path with its percent signs resolved, without the query.
    pub path: String,
    /// The port it came in at.
    pub port: u16,
    query: String,
    headers: Vec<(String, String)>,
    body: Vec<u8>,
}

impl Request {
    /// Returns a header by its name in lower case.
    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// Returns a value of the query.
    pub fn asked(&self, name: &str) -> Option<String> {
        field(&self.query, name)
    }

    /// Returns a value of a form that was sent.
    pub fn sent(&self, name: &str) -> Option<String> {
        field(std::str::from_utf8(&self.body).ok()?, name)
    }

    /// Whether it comes from this machine's own page: its `Host` is a loopback name with its port, and an
    /// `Origin`, where there is one, is that same page. A page from elsewhere that has its name point at
    /// this machine fails the first, a form on another page the second.
    pub fn is_local(&self) -> bool {
        let names = ["127.0.0.1", "localhost", "[::1]"];
        let hosts = names.map(|name| format!("{name}:{}", self.port));
        let host = self.header("host").unwrap_or_default();
        let is_here = hosts.iter().any(|known| known.eq_ignore_ascii_case(host));
        let same = |origin: &str| origin.strip_prefix("http://") == Some(host);
        is_here && self.header("origin").is_none_or(same)
    }

    /// Reads a request whose body has been read.
    fn read(head: &Parts, body: &Bytes, port: u16) -> Result<Self, Refusal> {
        let method = head.method.as_str();
        if !matches!(method, "GET" | "HEAD" | "POST") {
            return Err((405, "only GET, HEAD and POST are answered"));
        }
        let path = decoded(head.uri.path(), false).filter(|path| path.starts_with('/'));
        let path = path.filter(|_| head.uri.authority().is_none());
        let path = path.ok_or((400, "the path cannot be read"))?;
        let twice = |name: &str| head.headers.get_all(name).iter().count() > 1;
        if ["host", "origin", "content-length"].into_iter().any(twice) {
            return Err((400, "a header that may stand once stands twice"));
        }
        let text = |value: &HeaderValue| String::from_utf8_lossy(value.as_bytes()).into_owned();
        let headers = head.headers.iter().map(|(name, value)| (name.to_string(), text(value)));
        Ok(Self {
            method: method.to_owned(),
            path,
            port,
            query: head.uri.query().unwrap_or_default().to_owned(),
            headers: headers.collect(),
            body: body.to_vec(),
        })
    }
}

/// What it is answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Response {
    status: u16,
    headers: Vec<(&'static str, String)>,
    body: Vec<u8>,
}

impl Response {
    /// An answer of a media type: `text/html; charset=utf-8`.
    pub fn new(status: u16, kind: &str, body: impl Into<Vec<u8>>) -> Self {
        Self { status, headers: vec![("Content-Type", kind.to_owned())], body: body.into() }
    }

    /// A line of text, for what went wrong.
    pub fn text(status: u16, line: &str) -> Self {
        Self::new(status, "text/plain; charset=utf-8", format!("{line}\n"))
    }

    /// A JSON document.
    pub fn json(value: &serde_json::Value) -> Self {
        Self::new(200, "application/json", value.to_string())
    }

    /// Sends the client on to a path, to be read anew.
    pub fn see_other(path: &str) -> Self {
        Self { status: 303, headers: vec![("Location", path.to_owned())], body: Vec::new() }
    }

    /// Adds a header; what would end its line is left out.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: &str) -> Self {
        self.headers.push((name, value.to_owned()));
        self
    }

    /// Returns it as `hyper` sends it.
    fn whole(self) -> hyper::Response<Full<Bytes>> {
        let mut whole = hyper::Response::new(Full::new(Bytes::from(self.body)));
        *whole.status_mut() = hyper::StatusCode::from_u16(self.status).unwrap_or_default();
        for (name, value) in &self.headers {
            let value: String = value.chars().filter(|c| !c.is_control()).collect();
            let named = HeaderName::from_bytes(name.as_bytes());
            if let (Ok(name), Ok(value)) = (named, HeaderValue::from_bytes(value.as_bytes())) {
                whole.headers_mut().append(name, value);
            }
        }
        whole
    }
}

/// A status and its reason in words.
type Refusal = (u16, &'static str);

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
        let site = Site { handler, patience, port: address.port() };
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
}

/// Takes connections for ever.
async fn accept(listener: Listener, site: Site) {
    let connections = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    let answers = Arc::new(Semaphore::new(MOST_ANSWERS));
    while let Ok(connection) = connections.clone().acquire_owned().await {
        match listener.accept().await {
            Ok((stream, _)) => {
                let answering = answers.clone().try_acquire_owned().ok();
                tokio::spawn(answer(stream, site.clone(), answering, connection));
            }
            // Too many files are open, or the client has hung up already: the next one may be taken again.
            Err(_) => sleep(BREATH).await,
        }
    }
}

/// Answers one connection; `answering` is its place among those that are, if there was one left.
async fn answer(
    stream: Stream,
    site: Site,
    answering: Option<OwnedSemaphorePermit>,
    _connection: OwnedSemaphorePermit,
) {
    let patience = site.patience;
    let has_place = answering.is_some();
    let service = service_fn(|asked| respond(asked, site.clone(), has_place));
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
    has_place: bool,
) -> Result<hyper::Response<Full<Bytes>>, Infallible> {
    let (head, body) = asked.into_parts();
    let request = match whole(body, site.patience.body).await {
        Ok(body) => Request::read(&head, &body, site.port),
        Err(refusal) => Err(refusal),
    };
    let response = match request {
        Err((status, why)) => Response::text(status, why),
        Ok(_) if !has_place => Response::text(503, "too many connections at once; try again"),
        Ok(request) => {
            let handler = site.handler;
            let answered = tokio::task::spawn_blocking(move || handler(&request)).await;
            answered.unwrap_or_else(|_| Response::text(500, "this could not be answered"))
        }
    };
    Ok(response.whole())
}

/// Reads a body to its end.
async fn whole(body: Incoming, patience: Duration) -> Result<Bytes, Refusal> {
    let too_long = (413, "the body of the request is too long");
    if body.size_hint().lower() > LONGEST_BODY as u64 {
        return Err(too_long);
    }
    match timeout(patience, Limited::new(body, LONGEST_BODY).collect()).await {
        Ok(Ok(body)) => Ok(body.to_bytes()),
        Ok(Err(error)) if error.is::<LengthLimitError>() => Err(too_long),
        Ok(Err(_)) => Err((400, "the request is cut short")),
        Err(_) => Err((408, "the body of the request came too slowly")),
    }
}

/// Returns a value of `a=1&b=2`.
fn field(form: &str, name: &str) -> Option<String> {
    let pairs = form.split('&').map(|pair| pair.split_once('=').unwrap_or((pair, "")));
    let mut named = pairs.filter(|(key, _)| decoded(key, true).as_deref() == Some(name));
    decoded(named.next()?.1, true)
}

/// Resolves percent signs, and in forms a `+` for a space; `None` where that gives no text.
fn decoded(text: &str, is_form: bool) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let mut digit = || char::from(rest.next()?).to_digit(16);
                (digit()? << 4 | digit()?) as u8
            }
            b'+' if is_form => b' ',
            other => other,
        });
    }
    String::from_utf8(bytes).ok()
}

/// Writes a text as it may stand in a path or a query.
pub fn encoded(text: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    let each = text.bytes().map(|byte| match byte {
        byte if plain(byte) => char::from(byte).to_string(),
        byte => format!("%{byte:02X}"),
    });
    each.collect()
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
    fn only_a_page_of_this_machine_is_local() {
        let of = |lines: &[(&str, &str)]| Request {
            port: 8000,
            headers: lines.iter().map(|&(name, value)| (name.into(), value.into())).collect(),
            ..Request::default()
        };
        for here in [
            &[("host", "127.0.0.1:8000")][..],
            &[("host", "LOCALHOST:8000")],
            &[("host", "[::1]:8000")],
            &[("host", "localhost:8000"), ("origin", "http://localhost:8000")],
        ] {
            assert!(of(here).is_local(), "{here:?}");
        }
        for elsewhere in [
            &[][..],
            &[("host", "127.0.0.1")],
            &[("host", "evil.example:8000")],
            &[("host", "127.0.0.1.evil.example:8000")],
            &[("host", "127.0.0.1:8000"), ("origin", "http://evil.example")],
            &[("host", "127.0.0.1:8000"), ("origin", "null")],
        ] {
            assert!(!of(elsewhere).is_local(), "{elsewhere:?}");
        }
    }

    #[test]
    fn what_is_encoded_is_decoded_to_the_same() {
        let text = "above(jar, cup) & ü/..%";
        assert_eq!(decoded(&encoded(text), false).as_deref(), Some(text));
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
        let _ = silent.read_to_end(&mut rest);
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
    fn more_connections_than_are_answered_at_once_are_told_to_come_again() {
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
