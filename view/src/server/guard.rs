//! Who may ask: requests for the loopback address with the cookie, or with the token for it.

use axum::extract::Request;
use axum::http::header::{COOKIE, HOST, LOCATION, SET_COOKIE};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::response::{IntoResponse, Response};

use super::answer::{refusal, with_policy};
use super::connections::Trust;
use super::token::Token;

/// Lets requests pass that may.
pub(super) struct Guard {
    token: Token,
    /// Cookies are shared by all ports of an address, so the name has the port.
    cookie: String,
    hosts: [String; 2],
}

impl Guard {
    pub(super) fn new(token: Token, port: u16) -> Self {
        let hosts = ["127.0.0.1", "localhost"].map(|host| format!("{host}:{port}"));
        Self { token, cookie: format!("lamp_view_{port}"), hosts }
    }

    /// Returns why a request is not answered, or the cookie for a token, or none if it may pass.
    pub(super) fn answer(&self, request: &Request) -> Option<Response> {
        if !self.is_for_us(request) {
            return Some(refusal(StatusCode::FORBIDDEN, "this address is not the viewer's"));
        }
        let is_get = request.method() == Method::GET;
        if self.has_cookie(request.headers()) {
            request.extensions().get().map(Trust::gain);
            let method = "the viewer answers GET alone";
            return (!is_get).then(|| {
                let mut refused = refusal(StatusCode::METHOD_NOT_ALLOWED, method);
                refused.headers_mut().insert("allow", HeaderValue::from_static("GET"));
                refused
            });
        }
        let token = request.uri().query().and_then(|query| query.strip_prefix("token="));
        if is_get && request.uri().path() == "/" && token.is_some_and(|token| self.token.is(token))
        {
            return Some(self.welcome());
        }
        let why = "open the address that lamp view printed: it has the token for this page";
        Some(refusal(StatusCode::FORBIDDEN, why))
    }

    /// Gives the cookie, and an address without the token, so that it is in no link or history.
    fn welcome(&self) -> Response {
        let cookie = format!("{}={}; Path=/; HttpOnly; SameSite=Strict", self.cookie, self.token);
        let mut answer = StatusCode::SEE_OTHER.into_response();
        let headers = answer.headers_mut();
        headers.insert(LOCATION, HeaderValue::from_static("/"));
        headers.insert(SET_COOKIE, HeaderValue::from_str(&cookie).expect("it is ASCII"));
        with_policy(answer)
    }

    /// Returns whether the request names this address: a page of another name that leads here
    /// (DNS rebinding) does not.
    fn is_for_us(&self, request: &Request) -> bool {
        let mut hosts = request.headers().get_all(HOST).iter();
        let host = hosts.next().and_then(|host| host.to_str().ok());
        let of_uri = request.uri().authority().map(axum::http::uri::Authority::as_str);
        let is_ours = |host: &str| self.hosts.iter().any(|ours| ours == host);
        hosts.next().is_none() && host.is_some_and(is_ours) && of_uri.is_none_or(is_ours)
    }

    fn has_cookie(&self, headers: &HeaderMap) -> bool {
        let texts = headers.get_all(COOKIE).iter().filter_map(|text| text.to_str().ok());
        let mut cookies = texts.flat_map(|text| text.split(';'));
        cookies.any(|cookie| {
            let (name, value) = cookie.trim().split_once('=').unwrap_or_default();
            name == self.cookie && self.token.is(value)
        })
    }
}
