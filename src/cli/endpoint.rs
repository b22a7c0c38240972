//! The model that the arguments or the environment name, and what is said when it does not answer.

use clap::Args;

use crate::http::{Address, NoAddress};
use crate::report::{Failure, Style};
use crate::vqa::{Endpoint, Patience, Settings};

use super::clock::clock;
use super::numbers;

/// Which model is asked, and how long it is waited for.
#[derive(Debug, Args)]
pub(super) struct EndpointArgs {
    /// Where the model is, up to and including `/v1`; `TRUEUP_VQA_URL` when left out.
    #[arg(long, value_name = "URL")]
    pub(super) endpoint: Option<Address>,
    /// Its name there; `TRUEUP_VQA_MODEL` when left out, or the only one that is served.
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// How long a reply may take, s.
    #[arg(long, value_name = "S", default_value_t = 20.0, value_parser = numbers::seconds)]
    reply_timeout: f64,
    /// Ask for the probabilities of tokens as well; not every server knows how.
    #[arg(long)]
    logprobs: bool,
}

/// Returns the endpoint that was named.
pub(super) fn endpoint(args: &EndpointArgs) -> Result<Endpoint, Failure> {
    let named = match &args.endpoint {
        Some(address) => address.clone(),
        None => match variable("TRUEUP_VQA_URL") {
            Some(text) => text
                .parse()
                .map_err(|why: NoAddress| Failure::input("vqa::endpoint", why.to_string()))
                .map_err(|failure| failure.at("TRUEUP_VQA_URL"))?,
            None => {
                return Err(Failure::input("vqa::endpoint", "no model was named to ask")
                    .help("`--endpoint http://127.0.0.1:8080/v1`, or the same in TRUEUP_VQA_URL"));
            }
        },
    };
    at(named, args.model.clone(), args.reply_timeout, args.logprobs)
}

/// Returns the endpoint at an address; the model is the only one there when none is named.
pub(super) fn at(
    base: Address,
    model: Option<String>,
    reply_s: f64,
    logprobs: bool,
) -> Result<Endpoint, Failure> {
    if !(reply_s.is_finite() && reply_s > 0.0) {
        return Err(Failure::input("vqa::timeout", format!("{reply_s} s is no time to wait"))
            .help("`--reply-timeout 60` waits a minute for each reply"));
    }
    let patience = Patience { reply_s, ..Patience::default() };
    let named = model.or_else(|| variable("TRUEUP_VQA_MODEL"));
    let settings = Settings {
        base,
        model: named.clone().unwrap_or_default(),
        key: variable("TRUEUP_VQA_KEY"),
        patience,
        logprobs,
        clock,
    };
    let endpoint = Endpoint::new(settings);
    if named.is_some() {
        return Ok(endpoint);
    }
    let served = endpoint.models().map_err(|e| no_answer(&endpoint, &e.to_string()))?;
    match &served[..] {
        [one] => Ok(endpoint.with_model(one)),
        [] => Err(Failure::input("vqa::model", format!("{} lists no model", endpoint.base()))
            .help("name one with `--model NAME`")),
        several => Err(Failure::input(
            "vqa::model",
            format!("{} serves {} models", endpoint.base(), several.len()),
        )
        .help(format!("name one with `--model`: {}", several.join(", ")))),
    }
}

/// Returns a variable of the environment that is not empty.
fn variable(name: &str) -> Option<String> {
    std::env::var(name).ok().filter(|value| !value.is_empty())
}

/// Says that nobody answers at an endpoint.
pub(super) fn no_answer(endpoint: &Endpoint, why: &str) -> Failure {
    Failure::unavailable("vqa::unavailable", format!("the model does not answer: {why}"))
        .at(endpoint.base().to_string())
        .help("is the server running, and does the address end in `/v1`?")
}

/// Says once where pictures go that leave this machine.
pub(super) fn tell_where(endpoint: &Endpoint, what: &str, style: Style) {
    if !endpoint.base().is_loopback() {
        style.note(&format!("{what} leave this machine: they go to {}", endpoint.base().host()));
    }
}
