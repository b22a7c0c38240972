//! A web address, told from its text alone.

use std::fmt;
use std::str::FromStr;

use ::http::Uri;

use super::error::NoAddress;

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
