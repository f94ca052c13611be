//! The addresses of the viewer.

use std::num::NonZeroU8;
use std::sync::Arc;

use axum::extract::rejection::{JsonRejection, PathRejection, QueryRejection};
use axum::extract::{DefaultBodyLimit, Path, Query, Request, State};
use axum::http::header::CONTENT_LENGTH;
use axum::http::{HeaderValue, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use serde::Deserialize;
use serde_json::Value;

use super::answer::{asset, binary, json_of, png, refusal, with_policy};
use super::guard::Guard;
use super::transfer;
use super::work::Workers;
use crate::assets;
use crate::error::ViewError;
use crate::overlay::Overlay;
use crate::tile::TileAt;
use crate::viewer::ImageKind;
use crate::work_folder::Order;

/// Returns all addresses, behind the guard.
pub(super) fn routes(workers: Arc<Workers>, guard: Arc<Guard>) -> Router {
    let shown = Arc::clone(&workers);
    Router::new()
        .route("/", get(|| async { page() }))
        .route("/assets/{name}", get(file))
        // Browsers ask for this name wherever a document has not named an icon yet.
        .route("/favicon.ico", get(|| async { asset_named("icon.svg") }))
        .route("/api/session", get(session))
        .route("/api/findings", get(findings))
        .route("/api/surface", get(surface_state))
        .route("/api/surface.bin", get(surface))
        .route("/api/stacks/{stack}/copies", get(copies))
        .route("/api/stacks/{stack}/layers", get(layers))
        .route("/api/stacks/{stack}/layers/{layer}", get(layer))
        .route("/api/stacks/{stack}/layers/{layer}/pixel", get(pixel))
        .route("/api/stacks/{stack}/layers/{layer}/edge", get(edge))
        .route("/tiles/{stack}/{layer}/{kind}/{reduction}/{x}/{file}", get(tile))
        .layer(middleware::from_fn(move |request: Request, next: Next| {
            let of_page = page_number(request.uri().query());
            let is_there = of_page.is_none_or(|number| number == shown.viewer().number());
            async move {
                match is_there {
                    true => next.run(request).await,
                    false => ViewError::Changed(OTHER_STACK.to_owned()).into_response(),
                }
            }
        }))
        // These take files and orders, and answer pages of earlier stacks, too.
        .route("/api/work", get(work))
        .route("/api/work/files/{name}", get(download).put(upload))
        .route("/api/work/make", post(make).layer(DefaultBodyLimit::max(MOST_ORDER)))
        .route("/api/work/stop", post(stop))
        .method_not_allowed_fallback(|| async {
            refusal(StatusCode::METHOD_NOT_ALLOWED, "this address does not take this method")
        })
        .fallback(|| async { ViewError::NoSuch("page") })
        .with_state(workers)
        .layer(middleware::from_fn(move |request: Request, next: Next| {
            let guard = Arc::clone(&guard);
            async move {
                match guard.answer(&request) {
                    Some(answer) => answer,
                    None => with_policy(next.run(request).await),
                }
            }
        }))
}

/// The refusal of pages that show other stacks.
const OTHER_STACK: &str = "another stack is shown: load this page again";

/// The most bytes of an order.
const MOST_ORDER: usize = 16 << 10;

/// Returns the number of the viewer that a page was made of, if the request states it.
fn page_number(query: Option<&str>) -> Option<u64> {
    query?.split('&').find_map(|pair| pair.strip_prefix("of=")?.parse().ok())
}

type Answer = Result<Response, ViewError>;
/// The names in an address. A name that is not a number, or not text, names nothing that exists.
type AddressNames<T> = Result<Path<T>, PathRejection>;
type Keys<T> = Result<Query<T>, QueryRejection>;

fn named<T>(path: AddressNames<T>) -> Result<T, ViewError> {
    path.map(|Path(names)| names).map_err(|_| ViewError::NoSuch("page"))
}

fn keys<T>(query: Keys<T>) -> Result<T, ViewError> {
    query.map(|Query(keys)| keys).map_err(|_| ViewError::Malformed("the query is not understood"))
}

fn page() -> Response {
    asset_named("index.html")
}

fn asset_named(name: &str) -> Response {
    match assets::asset(name) {
        Some(found) => asset(&found),
        None => refusal(StatusCode::NOT_FOUND, "there is no such file"),
    }
}

async fn file(path: AddressNames<String>) -> Answer {
    Ok(asset_named(&named(path)?))
}

async fn session(State(workers): State<Arc<Workers>>) -> Response {
    let mut session = workers.viewer().session();
    session["work"] = workers.has_folder().into();
    json_of(&session)
}

async fn work(State(workers): State<Arc<Workers>>) -> Answer {
    Ok(json_of(&workers.folder()?.state()?))
}

async fn download(State(workers): State<Arc<Workers>>, path: AddressNames<String>) -> Answer {
    let file = workers.folder()?.open(&named(path)?)?;
    let length = file.metadata().map(|facts| facts.len());
    let mut answer = binary(transfer::body_of(file));
    // A file that breaks off is noticed by its length.
    if let Ok(length) = length {
        answer.headers_mut().insert(CONTENT_LENGTH, HeaderValue::from(length));
    }
    Ok(answer)
}

#[derive(Deserialize)]
struct UploadKeys {
    #[serde(default)]
    replace: bool,
}

async fn upload(
    State(workers): State<Arc<Workers>>,
    path: AddressNames<String>,
    query: Keys<UploadKeys>,
    request: Request,
) -> Answer {
    let folder = Arc::clone(workers.folder()?);
    let (name, UploadKeys { replace }) = (named(path)?, keys(query)?);
    transfer::keep(folder, name, replace, request.into_body()).await?;
    work(State(workers)).await
}

async fn make(
    State(workers): State<Arc<Workers>>,
    order: Result<Json<Order>, JsonRejection>,
) -> Answer {
    let Json(order) = order.map_err(|_| ViewError::Malformed("the order is not understood"))?;
    workers.begin(order)?;
    work(State(workers)).await
}

async fn stop(State(workers): State<Arc<Workers>>) -> Answer {
    workers.folder()?.stop();
    work(State(workers)).await
}

async fn findings(State(workers): State<Arc<Workers>>) -> Answer {
    json(workers, |viewer, _| Ok(viewer.findings())).await
}

/// The surface is made at its first request.
async fn surface_state(State(workers): State<Arc<Workers>>) -> Response {
    workers.viewer().want_surface();
    json_of(&workers.viewer().surface_state())
}

async fn surface(State(workers): State<Arc<Workers>>) -> Answer {
    workers.run(|viewer, _| viewer.surface().map(binary)).await
}

async fn copies(State(workers): State<Arc<Workers>>, path: AddressNames<usize>) -> Answer {
    let stack = named(path)?;
    json(workers, move |viewer, _| Ok(viewer.stack(stack)?.copies.to_json())).await
}

async fn layers(State(workers): State<Arc<Workers>>, path: AddressNames<usize>) -> Answer {
    let stack = named(path)?;
    json(workers, move |viewer, _| viewer.layers(stack)).await
}

async fn layer(State(workers): State<Arc<Workers>>, path: AddressNames<(usize, usize)>) -> Answer {
    let (stack, layer) = named(path)?;
    let facts = json_of(&workers.viewer().layer(stack, layer)?);
    // After the layer is known to exist: wrong addresses cause no work.
    workers.expect_near(stack, layer);
    Ok(facts)
}

#[derive(Deserialize)]
struct PixelKeys {
    x: u32,
    y: u32,
    threshold: Option<NonZeroU8>,
}

async fn pixel(
    State(workers): State<Arc<Workers>>,
    path: AddressNames<(usize, usize)>,
    query: Keys<PixelKeys>,
) -> Answer {
    let (stack, layer) = named(path)?;
    let PixelKeys { x, y, threshold } = keys(query)?;
    let work = move |viewer: &crate::Viewer, given_up: &_| {
        viewer.pixel(stack, layer, [x, y], threshold, given_up)
    };
    json(workers, work).await
}

#[derive(Deserialize)]
struct EdgeKeys {
    x: f64,
    y: f64,
    radius: f64,
}

async fn edge(
    State(workers): State<Arc<Workers>>,
    path: AddressNames<(usize, usize)>,
    query: Keys<EdgeKeys>,
) -> Answer {
    let (stack, layer) = named(path)?;
    let EdgeKeys { x, y, radius } = keys(query)?;
    let work = move |viewer: &crate::Viewer, given_up: &_| {
        viewer.edge(stack, layer, [x, y], radius, given_up)
    };
    json(workers, work).await
}

#[derive(Deserialize)]
struct TileKeys {
    threshold: Option<NonZeroU8>,
}

async fn tile(
    State(workers): State<Arc<Workers>>,
    path: AddressNames<(usize, usize, String, u32, u32, String)>,
    query: Keys<TileKeys>,
) -> Answer {
    let (stack, layer, kind, reduction, x, file) = named(path)?;
    // Routes match whole segments, so the ending is part of the name.
    let y = file.strip_suffix(".png").and_then(|y| y.parse().ok());
    let y = y.ok_or(ViewError::NoSuch("tile"))?;
    let threshold = keys(query)?.threshold;
    let kind = match (kind.as_str(), threshold) {
        ("layer", None) => ImageKind::Layer,
        ("layer", Some(threshold)) => ImageKind::Cured(threshold),
        (name, _) => {
            let overlay: Result<Overlay, _> = name.parse();
            ImageKind::Over(overlay.map_err(|_| ViewError::NoSuch("overlay"))?)
        }
    };
    let at = TileAt { reduction, x, y };
    workers
        .run(move |viewer, given_up| viewer.tile(stack, layer, kind, at, given_up).map(png))
        .await
}

/// Answers with JSON that a worker makes.
async fn json(
    workers: Arc<Workers>,
    work: impl FnOnce(&crate::Viewer, &crate::viewer::GivenUp) -> Result<Value, ViewError>
    + Send
    + 'static,
) -> Answer {
    workers.run(|viewer, given_up| work(viewer, given_up).map(|value| json_of(&value))).await
}
