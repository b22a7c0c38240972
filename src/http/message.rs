//! What is asked and answered over HTTP: a request as a handler sees it, and its answer.
//!
//! Reading and sending are [`super::server`]'s.

use http_body_util::Full;
use hyper::body::Bytes;
use hyper::header::{HeaderName, HeaderValue};
use hyper::http::request::Parts;

use super::error::Refusal;

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
    pub(super) fn read(head: &Parts, body: &Bytes, port: u16) -> Result<Self, Refusal> {
        let method = head.method.as_str();
        if !matches!(method, "GET" | "HEAD" | "POST") {
            return Err(Refusal::Method);
        }
        let path = decoded(head.uri.path(), false).filter(|path| path.starts_with('/'));
        let path = path.filter(|_| head.uri.authority().is_none());
        let path = path.ok_or(Refusal::Path)?;
        let twice = |name: &str| head.headers.get_all(name).iter().count() > 1;
        if ["host", "origin", "content-length"].into_iter().any(twice) {
            return Err(Refusal::HeaderTwice);
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

    /// Says why nothing is answered.
    pub(super) fn refusal(why: Refusal) -> Self {
        Self::text(why.status(), &why.to_string())
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
    pub(super) fn whole(self) -> hyper::Response<Full<Bytes>> {
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
}
