//! Where clients and the simulation meet: who is connected, and what each is to be told.
//!
//! The simulation's thread tells, the web's thread asks. Neither ever waits for the other: every queue has an end, and who does not empty theirs is sent
//! away.

use super::lines::{is_line, is_stop};
use super::requests::{self, Request};
use super::seat::{Id, Seat};
use super::streams::Streams;
use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, close_code};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::{mpsc, oneshot};

/// Messages that wait for one client, at most: some seconds of telemetry.
const MAX_UNREAD: usize = 1024;
/// What breaks the rules of the line is not passed on; a client that does so this often is broken itself.
const MAX_VIOLATIONS: u32 = 1000;

/// What a client does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Sends lines, and has the simulated world do things.
    Drive,
    /// Looks on.
    Watch,
}

impl Role {
    /// The subprotocol that asks for it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drive => "drive",
            Self::Watch => "watch",
        }
    }

    /// The role that a subprotocol asks for.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Drive, Self::Watch]
            .into_iter()
            .find(|role| role.name() == name)
    }
}

/// Something that the simulated world is to do, and who wants to know that it has.
#[derive(Debug)]
pub struct Asked {
    /// Who asked.
    pub client: Id,
    /// What it calls it.
    pub id: u64,
    /// What.
    pub request: Request,
}

/// A line, and who has said it.
#[derive(Debug)]
pub struct Said {
    client: Id,
    line: String,
}

/// Where what clients send goes to.
#[derive(Debug)]
pub struct ToBase {
    /// Lines, without their ends.
    pub lines: SyncSender<Said>,
    /// What the simulated world is asked.
    pub asked: SyncSender<Asked>,
}

/// Why a client is sent away: a code of RFC 6455 section 7.4, and a reason.
pub type Farewell = CloseFrame;

/// Somebody else sits in the driver's seat.
const SEAT_TAKEN: u16 = 4409;

/// A farewell.
pub fn farewell(code: u16, reason: &'static str) -> Farewell {
    CloseFrame {
        code,
        reason: Utf8Bytes::from_static(reason),
    }
}

fn over() -> Farewell {
    farewell(close_code::AWAY, "the simulator ends")
}

fn deaf_one() -> Farewell {
    farewell(close_code::POLICY, "reads too slowly")
}

/// A client's place among the others.
#[derive(Debug)]
pub struct Place {
    /// What it is told apart by.
    pub id: Id,
    /// What it is to be told.
    pub told: mpsc::Receiver<Message>,
    /// That it is to go.
    pub dismissed: oneshot::Receiver<Farewell>,
}

/// The meeting place.
#[derive(Debug)]
pub struct Hub {
    /// What every client is told of this base.
    hello: Value,
    to_base: ToBase,
    company: Mutex<Company>,
    /// One more for each connection that is not closed.
    visits: Arc<()>,
}

/// Who is there.
#[derive(Debug, Default)]
struct Company {
    clients: BTreeMap<Id, Client>,
    seat: Seat,
    streams: Streams,
    last_id: Id,
    is_over: bool,
}

#[derive(Debug)]
struct Client {
    role: Role,
    violations: u32,
    tell: mpsc::Sender<Message>,
    dismiss: oneshot::Sender<Farewell>,
}

impl Hub {
    /// Nobody is there. `hello` is an object: what a client is told first.
    pub fn new(hello: Value, to_base: ToBase) -> Self {
        Self {
            hello,
            to_base,
            company: Mutex::default(),
            visits: Arc::default(),
        }
    }

    fn company(&self) -> MutexGuard<'_, Company> {
        // Nothing in here is half done when a panic could come.
        self.company.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// To be kept by a connection until it is closed.
    pub fn visit(&self) -> Arc<()> {
        Arc::clone(&self.visits)
    }

    /// Some connections are not closed yet.
    pub fn is_visited(&self) -> bool {
        Arc::strong_count(&self.visits) > 1
    }

    /// Somebody comes.
    ///
    /// # Errors
    /// A farewell, if the seat that it wants is taken.
    pub fn join(&self, role: Role) -> Result<Place, Farewell> {
        let mut company = self.company();
        if company.is_over {
            return Err(over());
        }
        let id = company.last_id + 1;
        if role == Role::Drive && !company.seat.take(id) {
            return Err(farewell(SEAT_TAKEN, "another page drives"));
        }
        company.last_id = id;
        if role == Role::Drive {
            company.tell_seat();
        }
        let (tell, told) = mpsc::channel(MAX_UNREAD);
        let (dismiss, dismissed) = oneshot::channel();
        let mut first = vec![self.hello(role, company.seat.state())];
        if role == Role::Watch {
            first.extend(company.streams.to_tell().map(sent));
        }
        for message in first {
            // There is room: it is new.
            let _ = tell.try_send(message);
        }
        let client = Client {
            role,
            violations: 0,
            tell,
            dismiss,
        };
        company.clients.insert(id, client);
        Ok(Place {
            id,
            told,
            dismissed,
        })
    }

    fn hello(&self, role: Role, seat: &str) -> Message {
        let mut hello = self.hello.clone();
        hello["role"] = json!(role.name());
        hello["seat"] = json!(seat);
        world_message(&json!({ "hello": hello }))
    }

    /// Somebody has gone, or is as good as gone.
    pub fn leave(&self, id: Id) {
        self.company().remove(id);
    }

    /// A client has sent a text: a line, if it is a driver and keeps to the rules.
    ///
    /// # Errors
    /// A farewell, if it is to go.
    pub fn hear_text(&self, id: Id, text: &str) -> Result<(), Farewell> {
        let mut company = self.company();
        company.check_driver(id)?;
        if !is_line(text) {
            return company.note_violation(id);
        }
        let said = Said {
            client: id,
            line: text.to_owned(),
        };
        if self.to_base.lines.try_send(said).is_err() {
            return Err(farewell(close_code::POLICY, "too fast"));
        }
        company.streams.sent(text);
        company.tell_if(&sent(text), |client| client.role == Role::Watch);
        Ok(())
    }

    /// A client has sent what should be a request to the simulated world.
    ///
    /// # Errors
    /// A farewell, if it is to go.
    pub fn hear_request(&self, id: Id, bytes: &[u8]) -> Result<(), Farewell> {
        let mut company = self.company();
        company.check_driver(id)?;
        let Some((number, request)) = requests::read(bytes) else {
            return company.note_violation(id);
        };
        let refused = match request {
            Err(why) => Some(format!("{why:#}")),
            Ok(request) => {
                let asked = Asked {
                    client: id,
                    id: number,
                    request,
                };
                let full = self.to_base.asked.try_send(asked).is_err();
                full.then(|| "too much at once".to_owned())
            }
        };
        if let Some(why) = refused {
            company.tell_one(id, &refusal(number, &why));
        }
        Ok(())
    }

    /// The simulated world has done what it was asked, or has not: why.
    pub fn answer(&self, client: Id, id: u64, outcome: Result<(), String>) {
        let message = match outcome {
            Ok(()) => world_message(&json!({ "done": id })),
            Err(why) => refusal(id, &why),
        };
        self.company().tell_one(client, &message);
    }

    /// A line has its turn to go to the base, with its end; nothing, if who has said it drives no more. A Stop is one, whoever has gone since.
    pub fn pass(&self, Said { client, line }: Said) -> Option<Vec<u8>> {
        let mut company = self.company();
        if !company.seat.is_of(client) && !is_stop(&line) {
            company.streams.dropped(&line);
            return None;
        }
        Some(format!("{line}\n").into())
    }

    /// The simulator ends: everybody is told, and nobody comes in any more.
    pub fn close(&self) {
        let mut company = self.company();
        company.is_over = true;
        let clients: Vec<Id> = company.clients.keys().copied().collect();
        for id in clients {
            company.dismiss(id, over());
        }
    }

    /// The base has sent a line.
    pub fn tell_line(&self, line: &str) {
        let mut company = self.company();
        company.streams.heard(line);
        company.tell_if(&Message::text(line), |_| true);
    }

    /// How the simulated world is.
    pub fn tell_world(&self, world: &Value) {
        self.company().tell_if(&world_message(world), |_| true);
    }

    /// The line to the base is whole again: what was sent while it was cut is not answered any more.
    pub fn link_mended(&self) {
        self.company().streams.forget_waiting();
    }
}

impl Company {
    /// A client that may send.
    fn check_driver(&self, id: Id) -> Result<(), Farewell> {
        if self.seat.is_of(id) {
            return Ok(());
        }
        Err(farewell(close_code::POLICY, "who watches sends nothing"))
    }

    fn note_violation(&mut self, id: Id) -> Result<(), Farewell> {
        let Some(client) = self.clients.get_mut(&id) else {
            return Ok(());
        };
        client.violations += 1;
        if client.violations < MAX_VIOLATIONS {
            return Ok(());
        }
        Err(farewell(
            close_code::POLICY,
            "this is no line-by-line client",
        ))
    }

    fn remove(&mut self, id: Id) -> Option<Client> {
        let client = self.clients.remove(&id);
        if self.seat.leave(id) {
            self.tell_seat();
        }
        client
    }

    fn tell_seat(&mut self) {
        let seat = world_message(&json!({ "seat": self.seat.state() }));
        self.tell_if(&seat, |_| true);
    }

    fn tell_one(&mut self, id: Id, message: &Message) {
        let Some(client) = self.clients.get(&id) else {
            return;
        };
        if client.is_full_after(message) {
            self.dismiss(id, deaf_one());
        }
    }

    fn tell_if(&mut self, message: &Message, mut is_meant: impl FnMut(&Client) -> bool) {
        let deaf: Vec<Id> = self
            .clients
            .iter()
            .filter(|(_, client)| is_meant(client) && client.is_full_after(message))
            .map(|(id, _)| *id)
            .collect();
        for id in deaf {
            self.dismiss(id, deaf_one());
        }
    }

    /// Sends a client away.
    fn dismiss(&mut self, id: Id, why: Farewell) {
        if let Some(client) = self.remove(id) {
            // It may just be leaving.
            let _ = client.dismiss.send(why);
        }
    }
}

impl Client {
    /// Queues a message for it; true if there was no room.
    fn is_full_after(&self, message: &Message) -> bool {
        // One that has hung up leaves by itself.
        let sent = self.tell.try_send(message.clone());
        matches!(sent, Err(mpsc::error::TrySendError::Full(_)))
    }
}

/// What is said of the simulated world is a binary message.
fn world_message(value: &Value) -> Message {
    Message::binary(value.to_string())
}

fn refusal(id: u64, why: &str) -> Message {
    world_message(&json!({ "refused": id, "why": why }))
}

fn sent(line: &str) -> Message {
    world_message(&json!({ "sent": line }))
}

#[cfg(test)]
mod tests;
