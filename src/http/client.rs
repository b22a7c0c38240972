//! One request to a web address, with a limit on time and on size. Redirections are answers, not followed:
//! what is sent goes to the address that was named and nowhere else.

use std::time::Duration;

use super::error::{Broken, Trouble, Unreachable};
use super::{Address, Answer, Limits};

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
        came: Result<::http::Response<ureq::Body>, ureq::Error>,
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
