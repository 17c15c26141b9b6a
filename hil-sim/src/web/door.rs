//! Who may come in: the routes, and what is looked at before.

use super::client;
use super::hub::{Hub, Role};
use super::names::{Names, is_same_origin};
use super::page::Page;
use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Request, State};
use axum::http::header::{
    CACHE_CONTROL, CONNECTION, CONTENT_SECURITY_POLICY, HOST, HeaderName, HeaderValue, ORIGIN,
    REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::get;
use std::sync::Arc;
use tokio::sync::Semaphore;

/// Who watches at once.
const MAX_WATCHERS: usize = 15;
/// Who drives, and who is just being told that somebody else does or why it has to go: watchers take no place of theirs.
const MAX_DRIVERS: usize = 16;
/// No message of a client is longer, bytes.
const MAX_MESSAGE: usize = 64 << 10;
/// Where the WebSocket is.
const SOCKET: &str = "/base";
/// Bytes that are read at once: many small frames must not keep the others waiting.
const READ_AT_ONCE: usize = 4096;
/// Bytes that wait to be sent to one client, at most: answers to its pings do, too, and who never reads has no more of them kept.
const MAX_UNSENT: usize = 256 << 10;

/// What is behind the door.
pub struct House {
    /// The names it goes by.
    pub names: Names,
    /// The page.
    pub page: Page,
    /// The base.
    pub hub: Arc<Hub>,
}

#[derive(Clone)]
struct Door {
    house: Arc<House>,
    watchers: Arc<Semaphore>,
    drivers: Arc<Semaphore>,
}

/// The door of a house.
pub fn router(house: House) -> Router {
    let door = Door {
        house: Arc::new(house),
        watchers: Arc::new(Semaphore::new(MAX_WATCHERS)),
        drivers: Arc::new(Semaphore::new(MAX_DRIVERS)),
    };
    Router::new()
        .route("/", get(page))
        .route(SOCKET, get(base))
        .layer(middleware::from_fn_with_state(door.clone(), look))
        .with_state(door)
}

/// What is looked at before anything else: by which name the server was asked for, and which page asks.
async fn look(State(door): State<Door>, request: Request, next: Next) -> Response {
    let admitted = admit(&door.house.names, &request);
    let mut response = match &admitted {
        Ok(_) => next.run(request).await,
        Err(refusal) => (*refusal).into_response(),
    };
    let headers = response.headers_mut();
    // One request for each connection: none stays open that has nothing to say. A WebSocket's answer has this header already.
    headers
        .entry(CONNECTION)
        .or_insert(HeaderValue::from_static("close"));
    let fixed = [
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (X_FRAME_OPTIONS, "DENY"),
        (REFERRER_POLICY, "no-referrer"),
        (CACHE_CONTROL, "no-store"),
        (
            HeaderName::from_static("cross-origin-resource-policy"),
            "same-origin",
        ),
    ];
    for (name, value) in fixed {
        headers.insert(name, HeaderValue::from_static(value));
    }
    // The name was found to be one of ours, which has nothing that a header may not.
    if let Ok(host) = admitted
        && let Ok(policy) = HeaderValue::from_str(&door.house.page.policy(&host))
    {
        headers.insert(CONTENT_SECURITY_POLICY, policy);
    }
    response
}

/// The name by which the server was asked for, if that and the page that asks are good.
fn admit(names: &Names, request: &Request) -> Result<String, (StatusCode, &'static str)> {
    let elsewhere = (
        StatusCode::MISDIRECTED_REQUEST,
        "the simulator does not go by the name in Host\n",
    );
    let headers = request.headers();
    let host = only(headers, &HOST).ok().flatten().ok_or(elsewhere)?;
    let target = request.uri().authority().map_or(host, |name| name.as_str());
    if !names.include(host) || !names.include(target) {
        return Err(elsewhere);
    }
    let is_ours = match only(headers, &ORIGIN) {
        Ok(Some(origin)) => is_same_origin(origin, host),
        // A person who types the address has no origin, but every page that opens a WebSocket has one.
        Ok(None) => request.uri().path() != SOCKET,
        Err(()) => false,
    };
    if !is_ours {
        return Err((
            StatusCode::FORBIDDEN,
            "only the simulator's own page may ask for this\n",
        ));
    }
    Ok(host.to_owned())
}

/// The value of a header that may be there once; an error if it is there more often, or not text.
fn only<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Result<Option<&'a str>, ()> {
    let mut values = headers.get_all(name).iter();
    let first = values.next();
    if values.next().is_some() {
        return Err(());
    }
    first.map(HeaderValue::to_str).transpose().map_err(drop)
}

async fn page(State(door): State<Door>) -> Html<String> {
    Html(door.house.page.html.clone())
}

async fn base(State(door): State<Door>, upgrade: WebSocketUpgrade) -> Response {
    let role = upgrade
        .requested_protocols()
        .filter_map(|name| name.to_str().ok())
        .find_map(Role::named);
    let Some(role) = role else {
        let why = "offer the subprotocol drive or watch\n";
        return (StatusCode::BAD_REQUEST, why).into_response();
    };
    let places = match role {
        Role::Watch => &door.watchers,
        Role::Drive => &door.drivers,
    };
    let Ok(place) = Arc::clone(places).try_acquire_owned() else {
        let why = "too many pages at once\n";
        return (StatusCode::SERVICE_UNAVAILABLE, why).into_response();
    };
    let hub = Arc::clone(&door.house.hub);
    upgrade
        .protocols([role.name()])
        .max_message_size(MAX_MESSAGE)
        .max_frame_size(MAX_MESSAGE)
        .read_buffer_size(READ_AT_ONCE)
        .max_write_buffer_size(MAX_UNSENT)
        .on_upgrade(async move |socket| {
            client::serve(socket, role, hub).await;
            drop(place);
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::body::Body;

    fn admitted(target: &str, headers: &[(&str, &str)]) -> Result<String, u16> {
        let names = Names::of("127.0.0.1:8080".parse().unwrap(), None);
        let mut request = Request::builder().uri(target);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let request = request.body(Body::empty()).unwrap();
        admit(&names, &request).map_err(|(status, _)| status.as_u16())
    }

    const HOST: (&str, &str) = ("host", "localhost:8080");
    const OURS: (&str, &str) = ("origin", "http://localhost:8080");

    #[test]
    fn the_page_may_be_asked_for_by_nobody_or_by_itself() {
        let host = Ok("localhost:8080".to_owned());
        assert_eq!(admitted("/", &[HOST]), host);
        assert_eq!(admitted("/", &[HOST, OURS]), host);
        assert_eq!(admitted("http://127.0.0.1:8080/", &[HOST]), host);
        for origin in [
            "null",
            "http://evil.example",
            // The same server by another name is another origin.
            "http://127.0.0.1:8080",
        ] {
            assert_eq!(admitted("/", &[HOST, ("origin", origin)]), Err(403));
        }
        assert_eq!(admitted("/", &[HOST, OURS, OURS]), Err(403));
    }

    #[test]
    fn a_socket_must_be_asked_for_by_the_page() {
        assert!(admitted("/base", &[HOST, OURS]).is_ok());
        assert_eq!(admitted("/base", &[HOST]), Err(403));
        let evil = ("origin", "http://evil.example");
        assert_eq!(admitted("/base", &[HOST, evil]), Err(403));
        assert_eq!(admitted("/base", &[HOST, OURS, evil]), Err(403));
    }

    #[test]
    fn another_name_is_another_server() {
        let evil = ("host", "evil.example:8080");
        assert_eq!(admitted("/", &[]), Err(421));
        assert_eq!(admitted("/", &[evil]), Err(421));
        assert_eq!(admitted("/", &[HOST, evil]), Err(421));
        assert_eq!(admitted("http://evil.example:8080/", &[HOST]), Err(421));
        // As after DNS rebinding: the page's origin and the host are equal, and neither is ours.
        let origin = ("origin", "http://evil.example:8080");
        assert_eq!(admitted("/base", &[evil, origin]), Err(421));
    }
}
