//! Access: requests for the loopback address with the cookie, or once with a token for it.

use axum::extract::Request;
use axum::http::header::{COOKIE, HOST, LOCATION, ORIGIN};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::response::{IntoResponse, Response};

use super::answer::{refusal, welcome, with_policy};
use super::connections::Trust;
use super::ticket::{Ticket, TicketCheck, show};
use super::token::Token;

const NO_TOKEN: &str = "lamp view printed an address that opens this page once; for a new one, end \
                        lamp view and start it again";
const USED_TOKEN: &str = "this address was opened before, and works only once; for a new one, end \
                          lamp view and start it again";
const AHEAD: &str = "this address works only once, so do not load it ahead";

/// The start of the addresses that take more than GET.
const WORK: &str = "/api/work/";

/// Lets requests pass that may.
pub(super) struct Guard {
    tickets: Vec<Ticket>,
    secret: Token,
    /// Cookies are shared by all ports of an address, so the name has the port.
    cookie: String,
    hosts: [String; 2],
    /// Whether the page may send files and orders.
    takes_work: bool,
}

impl Guard {
    pub(super) fn new(tickets: Vec<Ticket>, secret: Token, port: u16, takes_work: bool) -> Self {
        let hosts = ["127.0.0.1", "localhost"].map(|host| format!("{host}:{port}"));
        Self { tickets, secret, cookie: format!("lamp_view_{port}"), hosts, takes_work }
    }

    /// Returns the refusal of a request, or the cookie for a token, or `None` if it may pass.
    pub(super) fn answer(&self, request: &Request) -> Option<Response> {
        if !self.is_for_us(request) {
            return Some(refusal(StatusCode::FORBIDDEN, "this address is not the viewer's"));
        }
        // A token is good once: other methods must not use it up.
        let is_get = request.method() == Method::GET;
        let token = if is_get { token_in(request) } else { None };
        let has_cookie = self.has_cookie(request.headers());
        // Before the method is looked at: strangers learn nothing about the viewer.
        if !has_cookie && token.is_none() {
            return Some(refusal(StatusCode::FORBIDDEN, NO_TOKEN));
        }
        if let Some(token) = token {
            return Some(self.answer_to_token(token, request.headers(), has_cookie));
        }
        request.extensions().get().map(Trust::gain);
        let is_work = self.takes_work && request.uri().path().starts_with(WORK);
        if is_get || is_work && self.is_of_our_page(request.headers()) {
            return None;
        }
        if is_work {
            return Some(refusal(StatusCode::FORBIDDEN, "only the viewer's own page may ask this"));
        }
        let method = "the viewer answers GET alone";
        Some({
            let mut refused = refusal(StatusCode::METHOD_NOT_ALLOWED, method);
            refused.headers_mut().insert("allow", HeaderValue::from_static("GET"));
            refused
        })
    }

    /// Exchanges a token for the cookie. A browser that has the cookie already is only forwarded;
    /// the token is used up all the same, and is in no link or history.
    fn answer_to_token(&self, token: &str, headers: &HeaderMap, has_cookie: bool) -> Response {
        if is_loaded_ahead(headers) {
            return refusal(StatusCode::FORBIDDEN, AHEAD);
        }
        match show(&self.tickets, token) {
            _ if has_cookie => {
                let mut answer = StatusCode::SEE_OTHER.into_response();
                answer.headers_mut().insert(LOCATION, HeaderValue::from_static("/"));
                with_policy(answer)
            }
            TicketCheck::Valid => {
                let (name, secret) = (&self.cookie, &self.secret);
                // Scripts cannot read it, and requests from pages of other sites do not have it.
                let cookie = format!("{name}={secret}; Path=/; HttpOnly; SameSite=Strict");
                welcome(&HeaderValue::from_str(&cookie).expect("it is ASCII"))
            }
            TicketCheck::UsedBefore => refusal(StatusCode::FORBIDDEN, USED_TOKEN),
            TicketCheck::Unknown => refusal(StatusCode::FORBIDDEN, NO_TOKEN),
        }
    }

    /// Returns whether the request names this address: a page of another name that leads here (DNS
    /// rebinding) does not.
    fn is_for_us(&self, request: &Request) -> bool {
        // Two Host headers could name two sites, and a URI in absolute form replaces the header
        // (RFC 9112, section 3.2.2): all must agree.
        let mut hosts = request.headers().get_all(HOST).iter();
        let host = hosts.next().and_then(|host| host.to_str().ok());
        let of_uri = request.uri().authority().map(axum::http::uri::Authority::as_str);
        let is_ours = |host: &str| self.hosts.iter().any(|ours| ours == host);
        hosts.next().is_none() && host.is_some_and(is_ours) && of_uri.is_none_or(is_ours)
    }

    /// Returns whether a page of this viewer sends the request. Cookies do not show it: for them,
    /// another server of this machine is the same site, whatever its port.
    fn is_of_our_page(&self, headers: &HeaderMap) -> bool {
        let mut origins = headers.get_all(ORIGIN).iter();
        let origin = origins.next().and_then(|origin| origin.to_str().ok());
        let host = origin.and_then(|origin| origin.strip_prefix("http://"));
        origins.next().is_none() && host.is_some_and(|host| self.hosts.iter().any(|it| it == host))
    }

    fn has_cookie(&self, headers: &HeaderMap) -> bool {
        let texts = headers.get_all(COOKIE).iter().filter_map(|text| text.to_str().ok());
        let mut cookies = texts.flat_map(|text| text.split(';'));
        cookies.any(|cookie| {
            let (name, value) = cookie.trim().split_once('=').unwrap_or_default();
            name == self.cookie && self.secret.is(value)
        })
    }
}

/// Returns the token that a request for the page has in its address.
fn token_in(request: &Request) -> Option<&str> {
    let uri = request.uri();
    uri.query().filter(|_| uri.path() == "/").and_then(|query| query.strip_prefix("token="))
}

/// Returns whether a browser asks before its user does, and may discard the answer: such a request
/// must not use the token up. Current browsers state so in `Sec-Purpose`, older ones in the other
/// headers.
fn is_loaded_ahead(headers: &HeaderMap) -> bool {
    let purposes = ["sec-purpose", "purpose", "x-purpose", "x-moz"].map(|name| headers.get(name));
    let mut purposes = purposes.into_iter().flatten().filter_map(|purpose| purpose.to_str().ok());
    purposes.any(|purpose| purpose.contains("prefetch") || purpose.contains("preview"))
}
