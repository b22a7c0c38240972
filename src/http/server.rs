//! A server of HTTP/1.1 as small as two things need it: the page on this machine and the emulated cell's
//! camera. One request a connection, each answered whole by a thread of its own.
//!
//! No encryption, no connections kept open, no chunked bodies: nothing here is meant for a network that is
//! not trusted. What a request may ask for is the handler's business; see [`Request::is_local`] for the part
//! that every handler on this machine should check.
//!
//! Source: RFC 9112, of which it answers the part above and refuses the rest by name.

use std::fmt::Write as _;
use std::io::{self, Read, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// The longest head of a request that is read, bytes.
const LONGEST_HEAD: usize = 16 << 10;
/// The longest body of a request that is read, bytes: a form, never a file.
const LONGEST_BODY: usize = 16 << 10;
/// How many connections are answered at once.
const MOST_CONNECTIONS: usize = 64;
/// How long a silent client is waited for, and one that does not take its answer, s.
const PATIENCE: (u64, u64) = (3, 10);

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

    fn write(&self, to: &mut impl Write, head_only: bool) -> io::Result<()> {
        let mut head = format!("HTTP/1.1 {} {}\r\n", self.status, reason(self.status));
        for (name, value) in &self.headers {
            let value: String = value.chars().filter(|c| !c.is_control()).collect();
            let _ = write!(head, "{name}: {value}\r\n");
        }
        let length = self.body.len();
        let _ = write!(head, "Content-Length: {length}\r\nConnection: close\r\n\r\n");
        to.write_all(head.as_bytes())?;
        if !head_only {
            to.write_all(&self.body)?;
        }
        to.flush()
    }
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        303 => "See Other",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        409 => "Conflict",
        413 => "Content Too Large",
        431 => "Request Header Fields Too Large",
        501 => "Not Implemented",
        503 => "Service Unavailable",
        _ => "Internal Server Error",
    }
}

/// Answers requests.
pub type Handler = Arc<dyn Fn(&Request) -> Response + Send + Sync>;

/// Answers until it is dropped.
pub struct Server {
    is_over: Arc<AtomicBool>,
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
        let listener = TcpListener::bind(address)?;
        let address = listener.local_addr()?;
        let is_over = Arc::new(AtomicBool::new(false));
        let ending = is_over.clone();
        let thread = thread::spawn(move || {
            let busy = Arc::new(AtomicUsize::new(0));
            while let Ok((stream, _)) = listener.accept() {
                if ending.load(Ordering::SeqCst) {
                    return;
                }
                let place = Place::take(&busy);
                let handler = handler.clone();
                // Who hangs up meanwhile misses the answer, nobody else does.
                thread::spawn(move || {
                    let _ = answer(stream, place.as_ref().map(|_| &*handler));
                });
            }
        });
        Ok(Self { is_over, thread: Some(thread), address })
    }

    /// Returns where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::SeqCst);
        // A knock at its own door, so that it sees that it is over.
        let mut door = self.address;
        match door.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => door.set_ip(Ipv4Addr::LOCALHOST.into()),
            IpAddr::V6(ip) if ip.is_unspecified() => door.set_ip(Ipv6Addr::LOCALHOST.into()),
            _ => {}
        }
        let knocked = TcpStream::connect_timeout(&door, Duration::from_secs(1)).is_ok();
        if let Some(thread) = self.thread.take().filter(|_| knocked) {
            let _ = thread.join();
        }
    }
}

/// One of the connections that are answered at once.
struct Place(Arc<AtomicUsize>);

impl Place {
    fn take(busy: &Arc<AtomicUsize>) -> Option<Self> {
        let place = Self(busy.clone());
        (busy.fetch_add(1, Ordering::SeqCst) < MOST_CONNECTIONS).then_some(place)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

fn answer(
    mut stream: TcpStream,
    handler: Option<&(dyn Fn(&Request) -> Response + Send + Sync)>,
) -> io::Result<()> {
    stream.set_read_timeout(Some(Duration::from_secs(PATIENCE.0)))?;
    stream.set_write_timeout(Some(Duration::from_secs(PATIENCE.1)))?;
    let mut asked = read(&mut stream)?;
    if let Ok(request) = &mut asked {
        request.port = stream.local_addr()?.port();
    }
    let head_only = asked.as_ref().is_ok_and(|request| request.method == "HEAD");
    let response = match (asked, handler) {
        (Ok(request), Some(handler)) => handler(&request),
        (Ok(_), None) => Response::text(503, "too many connections at once; try again"),
        (Err((status, why)), _) => Response::text(status, why),
    };
    response.write(&mut stream, head_only)
}

/// A status and its reason in words.
type Refusal = (u16, &'static str);

/// Reads a request whole: closing a connection with something unread in it takes back what was answered.
fn read(stream: &mut impl Read) -> io::Result<Result<Request, Refusal>> {
    let mut got = Vec::new();
    let mut part = [0; 4096];
    let end = loop {
        if let Some(at) = got.windows(4).position(|four| four == b"\r\n\r\n") {
            break at;
        }
        if got.len() > LONGEST_HEAD {
            return Ok(Err((431, "the head of the request is too long")));
        }
        match stream.read(&mut part)? {
            0 => return Ok(Err((400, "the request is cut short"))),
            n => got.extend_from_slice(&part[..n]),
        }
    };
    let (mut request, length) = match parse(&got[..end]) {
        Ok(parsed) => parsed,
        Err(refusal) => return Ok(Err(refusal)),
    };
    if length > LONGEST_BODY {
        return Ok(Err((413, "the body of the request is too long")));
    }
    request.body = got.split_off(end + 4);
    while request.body.len() < length {
        match stream.read(&mut part)? {
            0 => return Ok(Err((400, "the request is cut short"))),
            n => request.body.extend_from_slice(&part[..n]),
        }
    }
    request.body.truncate(length);
    Ok(Ok(request))
}

/// Reads the head of a request; returns the length of its body as well.
fn parse(head: &[u8]) -> Result<(Request, usize), Refusal> {
    let head = std::str::from_utf8(head).map_err(|_| (400, "the head is not text"))?;
    let mut lines = head.split("\r\n");
    let first: Vec<&str> = lines.next().unwrap_or_default().split(' ').collect();
    let [method, target, version] = first[..] else {
        return Err((400, "the first line is not `METHOD PATH HTTP/1.1`"));
    };
    if !version.starts_with("HTTP/1.") {
        return Err((400, "only HTTP/1 is spoken here"));
    }
    if !matches!(method, "GET" | "HEAD" | "POST") {
        return Err((405, "only GET, HEAD and POST are answered"));
    }
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let path = decoded(path, false).filter(|path| path.starts_with('/'));
    let path = path.ok_or((400, "the path cannot be read"))?;
    let mut headers = Vec::new();
    for line in lines {
        let (name, value) = line.split_once(':').ok_or((400, "a header has no `:`"))?;
        let name = name.to_ascii_lowercase();
        let again = headers.iter().any(|(known, _)| *known == name);
        if again && matches!(name.as_str(), "host" | "origin" | "content-length") {
            return Err((400, "a header that may stand once stands twice"));
        }
        headers.push((name, value.trim().to_owned()));
    }
    let request = Request {
        method: method.to_owned(),
        path,
        port: 0,
        query: query.to_owned(),
        headers,
        body: Vec::new(),
    };
    if request.header("transfer-encoding").is_some() {
        return Err((501, "bodies in chunks are not read"));
    }
    let length = request.header("content-length").map_or(Ok(0), str::parse);
    Ok((request, length.map_err(|_| (400, "the length of the body is not a number"))?))
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
    use super::*;

    fn request(text: &str) -> Result<Request, u16> {
        read(&mut text.as_bytes()).unwrap().map_err(|(status, _)| status)
    }

    #[test]
    fn a_request_is_read_whole() {
        let text = "POST /a%20b?x=1%2B1&y HTTP/1.1\r\nHost: localhost:80\r\nContent-Length: 9\r\n\r\n\
                    who=a+%26b";
        // The length says 9, so the last byte is no part of it.
        let read = request(text).unwrap();
        assert_eq!((read.method.as_str(), read.path.as_str()), ("POST", "/a b"));
        assert_eq!(read.asked("x").as_deref(), Some("1+1"));
        assert_eq!(read.asked("y").as_deref(), Some(""));
        assert_eq!(read.asked("z"), None);
        assert_eq!(read.sent("who").as_deref(), Some("a &"));
    }

    #[test]
    fn what_is_not_spoken_is_refused_by_name() {
        for (text, status) in [
            ("GET / HTTP/1.1\r\nHost: a\r\n", 400),
            ("GET /\r\n\r\n", 400),
            ("GET / HTTP/2\r\n\r\n", 400),
            ("GET /%zz HTTP/1.1\r\n\r\n", 400),
            ("GET http://elsewhere/ HTTP/1.1\r\n\r\n", 400),
            ("DELETE / HTTP/1.1\r\n\r\n", 405),
            ("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n", 400),
            ("POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n", 501),
            ("POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n", 400),
            ("POST / HTTP/1.1\r\nContent-Length: 99999999\r\n\r\n", 413),
            ("POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\nabc", 400),
        ] {
            assert_eq!(request(text).unwrap_err(), status, "{text:?}");
        }
        let long = format!("GET /{} HTTP/1.1\r\n", "a".repeat(2 * LONGEST_HEAD));
        assert_eq!(request(&long).unwrap_err(), 431);
    }

    #[test]
    fn only_a_page_of_this_machine_is_local() {
        let of = |headers: &str| {
            let read = request(&format!("GET / HTTP/1.1\r\n{headers}\r\n")).unwrap();
            Request { port: 8000, ..read }
        };
        for here in [
            "Host: 127.0.0.1:8000\r\n",
            "Host: LOCALHOST:8000\r\n",
            "Host: [::1]:8000\r\n",
            "Host: localhost:8000\r\nOrigin: http://localhost:8000\r\n",
        ] {
            assert!(of(here).is_local(), "{here}");
        }
        for elsewhere in [
            "",
            "Host: 127.0.0.1\r\n",
            "Host: evil.example:8000\r\n",
            "Host: 127.0.0.1.evil.example:8000\r\n",
            "Host: 127.0.0.1:8000\r\nOrigin: http://evil.example\r\n",
            "Host: 127.0.0.1:8000\r\nOrigin: null\r\n",
        ] {
            assert!(!of(elsewhere).is_local(), "{elsewhere}");
        }
    }

    #[test]
    fn what_is_encoded_is_decoded_to_the_same() {
        let text = "above(jar, cup) & ü/..%";
        assert_eq!(decoded(&encoded(text), false).as_deref(), Some(text));
    }

    #[test]
    fn a_server_answers_and_ends() {
        let handler: Handler = Arc::new(|request| Response::text(200, &request.path));
        let server = Server::serve((Ipv4Addr::LOCALHOST, 0).into(), handler).unwrap();
        let ask = |text: &str| {
            let mut stream = TcpStream::connect(server.address()).unwrap();
            stream.write_all(text.as_bytes()).unwrap();
            let mut answer = String::new();
            stream.read_to_string(&mut answer).unwrap();
            answer
        };
        let answer = ask("GET /here HTTP/1.1\r\n\r\n");
        assert!(answer.starts_with("HTTP/1.1 200 OK\r\n") && answer.ends_with("\r\n\r\n/here\n"));
        assert!(
            ask("HEAD /here HTTP/1.1\r\n\r\n")
                .ends_with("Content-Length: 6\r\nConnection: close\r\n\r\n")
        );
        let address = server.address();
        drop(server);
        assert!(TcpStream::connect(address).is_err());
    }
}
