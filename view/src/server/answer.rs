//! Answers: their kinds, and the headers that all of them have.

use axum::Json;
use axum::http::header::{CONTENT_ENCODING, CONTENT_TYPE, SET_COOKIE};
use axum::http::{HeaderName, HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};

use crate::assets::Asset;
use crate::error::ViewError;

/// Policy for browsers: an answer loads nothing from elsewhere, nobody frames it, and nothing is
/// kept on disk.
const POLICY: [(&str, &str); 4] = [
    (
        "content-security-policy",
        "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    ("x-content-type-options", "nosniff"),
    ("referrer-policy", "no-referrer"),
    ("cache-control", "no-store"),
];

/// Adds the policy to an answer.
pub(super) fn with_policy(mut answer: Response) -> Response {
    for (name, value) in POLICY {
        let name = HeaderName::from_static(name);
        answer.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    answer
}

/// An answer with the reason why there is no other.
pub(super) fn refusal(status: StatusCode, why: &str) -> Response {
    with_policy((status, Json(json!({"error": why}))).into_response())
}

/// An answer of bytes of a kind.
fn bytes(kind: &'static str, bytes: impl IntoResponse) -> Response {
    let mut answer = bytes.into_response();
    answer.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(kind));
    answer
}

/// A page that forwards to the layers.
///
/// It gives a cookie that is `SameSite=Strict`. A redirect would not do: when another page led
/// here, as the file of `lamp view --open` does, browsers keep such cookies back from all redirects
/// that follow. Requests of our own page have them.
pub(super) fn welcome(cookie: &HeaderValue) -> Response {
    const PAGE: &str = r#"<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta http-equiv="refresh" content="0; url=/">
<title>lamp view</title>
<p><a href="/">Layers</a></p>
"#;
    let mut answer = bytes("text/html; charset=utf-8", PAGE);
    answer.headers_mut().insert(SET_COOKIE, cookie.clone());
    with_policy(answer)
}

pub(super) fn png(file: Vec<u8>) -> Response {
    bytes("image/png", file)
}

pub(super) fn binary(file: impl IntoResponse) -> Response {
    bytes("application/octet-stream", file)
}

pub(super) fn json_of(value: &Value) -> Response {
    Json(value).into_response()
}

pub(super) fn asset(asset: &Asset) -> Response {
    // Every browser reads gzip, so the files are kept in this form alone.
    let mut answer = bytes(asset.content_type, asset.gzip);
    answer.headers_mut().insert(CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    answer
}

impl IntoResponse for ViewError {
    fn into_response(self) -> Response {
        let status = match &self {
            Self::NoSuch(_) => StatusCode::NOT_FOUND,
            Self::Malformed(_) => StatusCode::BAD_REQUEST,
            Self::Refused(_) => StatusCode::FORBIDDEN,
            Self::Taken(_) => StatusCode::CONFLICT,
            Self::Changed(_) => StatusCode::GONE,
            Self::Unreadable(_) => StatusCode::UNPROCESSABLE_ENTITY,
            // Nobody reads it.
            Self::GivenUp => StatusCode::SERVICE_UNAVAILABLE,
        };
        refusal(status, &self.to_string())
    }
}
