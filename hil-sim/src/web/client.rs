//! One WebSocket, from its first message to its last.

use super::hub::{Farewell, Hub, Place, Role, farewell};
use super::pulse::{PERIOD, Pulse};
use super::seat::Id;
use axum::extract::ws::{Message, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::mpsc;
use tokio::time::{Instant, interval_at, sleep_until, timeout};

/// What is sent beside pings and closing frames waits here: a few pings at most.
const MAX_PINGS: usize = 8;
/// Messages that are said without a look at whether it is time for a ping.
const AT_ONCE: usize = 64;
/// A client that is sent away has so long to hear why.
const LEAVE_TAKING: Duration = Duration::from_secs(1);

/// Serves a client until it leaves, is sent away or does not answer any more.
pub async fn serve(socket: WebSocket, role: Role, hub: Arc<Hub>) {
    let _visit = hub.visit();
    let (mut sink, mut stream) = socket.split();
    let parting = match hub.join(role) {
        Ok(place) => {
            let id = place.id;
            let parting = attend(place, &mut sink, &mut stream, &hub).await;
            // At once: whatever remains to be said to it, it drives no more.
            hub.leave(id);
            parting
        }
        Err(farewell) => Some(farewell),
    };
    if let Some(farewell) = parting {
        take_leave(sink, stream, farewell).await;
    }
}

/// The conversation; what is to be said at its end, if anybody is there to hear it.
async fn attend(
    place: Place,
    sink: &mut SplitSink<WebSocket, Message>,
    stream: &mut SplitStream<WebSocket>,
    hub: &Hub,
) -> Option<Farewell> {
    let Place {
        id,
        told,
        dismissed,
    } = place;
    let (ping, pings) = mpsc::channel(MAX_PINGS);
    // In this order: who has been sent away is told why, not that what it has said since is wrong.
    tokio::select! {
        biased;
        parting = dismissed => parting.ok(),
        parting = listen(id, stream, &ping, hub) => parting,
        () = speak(sink, told, pings) => None,
    }
}

/// Says what is to be said, in as few packets as there can be.
async fn speak(
    sink: &mut SplitSink<WebSocket, Message>,
    mut told: mpsc::Receiver<Message>,
    mut pings: mpsc::Receiver<Message>,
) {
    loop {
        let message = tokio::select! {
            Some(message) = told.recv() => message,
            Some(message) = pings.recv() => message,
            else => return,
        };
        if sink.feed(message).await.is_err() {
            return;
        }
        for _ in 0..AT_ONCE {
            let Ok(message) = told.try_recv() else {
                break;
            };
            if sink.feed(message).await.is_err() {
                return;
            }
        }
        if sink.flush().await.is_err() {
            return;
        }
    }
}

/// Hears what the client says, and whether it is still there. It goes on while nothing can be said to the client: a Stop must come through.
async fn listen(
    id: Id,
    stream: &mut SplitStream<WebSocket>,
    ping: &mpsc::Sender<Message>,
    hub: &Hub,
) -> Option<Farewell> {
    let began = Instant::now();
    let mut pulse = Pulse::default();
    let mut next_ping = interval_at(began + PERIOD, PERIOD);
    loop {
        let patience = async {
            match pulse.deadline() {
                Some(deadline) => sleep_until(began + deadline).await,
                None => std::future::pending().await,
            }
        };
        let message = tokio::select! {
            biased;
            () = patience => return Some(farewell(close_code::POLICY, "no pong")),
            _ = next_ping.tick() => {
                let question = pulse.ask(began.elapsed());
                // There is room: patience ends before there are so many.
                let _ = ping.try_send(Message::Ping(question.to_vec().into()));
                continue;
            }
            message = stream.next() => message,
        };
        // Many small frames arrive in one packet: the others have their turn, too.
        tokio::task::consume_budget().await;
        let heard = match message? {
            Ok(Message::Text(text)) => hub.hear_text(id, &text),
            Ok(Message::Binary(bytes)) => hub.hear_request(id, &bytes),
            Ok(Message::Pong(carried)) => {
                pulse.answered(&carried);
                Ok(())
            }
            Ok(Message::Ping(_)) => Ok(()),
            Ok(Message::Close(_)) => return None,
            Err(error) => return reason(error),
        };
        if let Err(farewell) = heard {
            return Some(farewell);
        }
    }
}

/// What to say to a client that broke the rules of WebSockets; nothing if it is gone.
fn reason(error: axum::Error) -> Option<Farewell> {
    use tungstenite::Error;
    use tungstenite::error::ProtocolError;
    let error = error.into_inner().downcast::<Error>().ok()?;
    match *error {
        Error::Capacity(_) => Some(farewell(close_code::SIZE, "too long")),
        Error::Utf8(_) => Some(farewell(close_code::INVALID, "not UTF-8")),
        Error::Protocol(ProtocolError::ResetWithoutClosingHandshake) => None,
        Error::Protocol(_) => Some(farewell(close_code::PROTOCOL, "broken frame")),
        _ => None,
    }
}

/// Tells a client why it has to go. What it still sends is thrown away: if that were left unread, the system would reset the connection, and the reason
/// could be lost on its way.
async fn take_leave(
    mut sink: SplitSink<WebSocket, Message>,
    mut stream: SplitStream<WebSocket>,
    farewell: Farewell,
) {
    let taken = async {
        if sink.send(Message::Close(Some(farewell))).await.is_ok() {
            while let Some(Ok(_)) = stream.next().await {
                tokio::task::consume_budget().await;
            }
        }
    };
    // Who does not hear it in time is gone anyway.
    let _ = timeout(LEAVE_TAKING, taken).await;
}
