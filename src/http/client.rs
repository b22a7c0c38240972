//! One request to a web address, with a limit on time and on size. Redirections are answers, not followed:
//! what is sent goes to the address that was named and nowhere else.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use ureq::http::Uri;

use super::error::{Broken, NoAddress, Trouble, Unreachable};

/// A web address that was given: `http://HOST[:PORT]/PATH` or `https://…`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address(String);

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for Address {
    type Err = NoAddress;

    fn from_str(text: &str) -> Result<Self, NoAddress> {
        let wrong = || NoAddress(text.to_owned());
        if !text.starts_with("http://") && !text.starts_with("https://") {
            return Err(wrong());
        }
        let uri: Uri = text.parse().map_err(|_| wrong())?;
        let authority = uri.authority().ok_or_else(wrong)?;
        let (host, rest) = (authority.host(), &authority.as_str()[authority.host().len()..]);
        // A port that is no number makes no authority that the crate refuses.
        let has_port = rest.is_empty() || authority.port_u16().is_some();
        if host.is_empty() || !has_port || authority.as_str().contains('@') {
            return Err(wrong());
        }
        Ok(Self(text.to_owned()))
    }
}

impl Address {
    /// Returns the address with more path after it: `…/v1` and `models` give `…/v1/models`.
    #[must_use]
    pub fn join(&self, more: &str) -> Self {
        Self(format!("{}/{more}", self.0.trim_end_matches('/')))
    }

    /// Returns the host, without its port.
    pub fn host(&self) -> String {
        let uri: Option<Uri> = self.0.parse().ok();
        let host = uri.as_ref().and_then(|uri| uri.host()).unwrap_or_default();
        host.trim_matches(['[', ']']).to_owned()
    }

    /// Whether what is sent there stays on this machine.
    pub fn is_loopback(&self) -> bool {
        let host = self.host();
        let ip = host.parse::<std::net::IpAddr>();
        host.eq_ignore_ascii_case("localhost") || ip.is_ok_and(|ip| ip.is_loopback())
    }
}

/// How long is waited and how much is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// For a connection, s.
    pub connect_s: f64,
    /// For everything: sending, waiting and reading, s.
    pub reply_s: f64,
    /// The longest answer that is read, bytes.
    pub longest: u64,
}

/// What came back, whatever its status.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// 200 is good.
    pub status: u16,
    /// All of it.
    pub body: Vec<u8>,
}

/// Asks, one request a connection.
#[derive(Debug, Clone)]
pub struct Client {
    agent: ureq::Agent,
    limits: Limits,
}

impl Client {
    /// Asks within limits. To this machine it asks directly; to others through the proxy that the
    /// environment names, if it names one.
    pub fn new(limits: Limits, to: &Address) -> Self {
        let seconds = |s: f64| Some(Duration::from_secs_f64(s));
        let mut config = ureq::Agent::config_builder()
            .http_status_as_error(false)
            .max_redirects(0)
            .max_redirects_will_error(false)
            .max_idle_connections(0)
            .user_agent(concat!("trueup/", env!("CARGO_PKG_VERSION")))
            .timeout_resolve(seconds(limits.connect_s))
            .timeout_connect(seconds(limits.connect_s))
            .timeout_global(seconds(limits.reply_s));
        if to.is_loopback() {
            config = config.proxy(None);
        }
        Self { agent: config.build().into(), limits }
    }

    /// Fetches what is at an address.
    ///
    /// # Errors
    ///
    /// Why nothing came back.
    pub fn get(&self, address: &Address, bearer: Option<&str>) -> Result<Answer, Trouble> {
        let mut request = self.agent.get(address.to_string());
        if let Some(key) = bearer {
            request = request.header("Authorization", format!("Bearer {key}"));
        }
        self.read(request.call())
    }

    /// Sends a JSON document.
    ///
    /// # Errors
    ///
    /// Why nothing came back.
    pub fn post(&self, address: &Address, json: &str, bearer: &str) -> Result<Answer, Trouble> {
        let request = self
            .agent
            .post(address.to_string())
            .header("Content-Type", "application/json")
            .header("Authorization", format!("Bearer {bearer}"));
        self.read(request.send(json))
    }

    fn read(
        &self,
        came: Result<ureq::http::Response<ureq::Body>, ureq::Error>,
    ) -> Result<Answer, Trouble> {
        let mut came = came.map_err(|error| self.trouble(&error))?;
        let body = came.body_mut().with_config().limit(self.limits.longest).read_to_vec();
        let body = body.map_err(|error| self.trouble(&error))?;
        Ok(Answer { status: came.status().as_u16(), body })
    }

    fn trouble(&self, error: &ureq::Error) -> Trouble {
        use ureq::{Error, Timeout};
        match error {
            Error::Timeout(Timeout::Connect | Timeout::Resolve) => {
                Unreachable::Slow(self.limits.connect_s).into()
            }
            Error::Timeout(_) => Trouble::Late(self.limits.reply_s),
            Error::HostNotFound => Unreachable::NoHost.into(),
            Error::Io(error) => Unreachable::System(error.to_string()).into(),
            Error::ConnectionFailed => Unreachable::Failed.into(),
            Error::BodyExceedsLimit(bytes) => Broken::TooLong(*bytes).into(),
            other => Broken::Garbled(other.to_string()).into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_says_where_and_nothing_else() {
        for good in [
            "http://127.0.0.1:8080/v1",
            "http://localhost",
            "https://models.example/v1",
            "http://[::1]:11434/v1",
        ] {
            assert_eq!(good.parse::<Address>().unwrap().to_string(), good);
        }
        for bad in [
            "",
            "camera",
            "ftp://host/x",
            "http://",
            "http:///path",
            "http://host:port/",
            "http://host/a b",
            "http://user:secret@host/",
            "http://host/\r\nX: y",
        ] {
            assert!(bad.parse::<Address>().is_err(), "{bad}");
        }
    }

    #[test]
    fn what_stays_on_this_machine_is_known() {
        let is = |text: &str| text.parse::<Address>().unwrap().is_loopback();
        assert!(is("http://127.0.0.1:8080/v1") && is("http://LOCALHOST/v1") && is("http://[::1]/"));
        assert!(!is("http://10.0.0.5/v1") && !is("https://localhost.example/v1"));
        let base: Address = "http://localhost:8080/v1/".parse().unwrap();
        assert_eq!(base.join("models").to_string(), "http://localhost:8080/v1/models");
    }
}
