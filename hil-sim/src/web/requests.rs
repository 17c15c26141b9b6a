//! What a driver may ask of the simulated world, as it says it.

use anyhow::{Result, bail, ensure};
use hil_sim::faults::Fault;
use serde_json::{Map, Value};

/// Nothing that a page asks is longer.
const MAX_LENGTH: usize = 4096;
/// Strongest push, N and N·m: a car of 300 kg is thrown about by it.
const MAX_PUSH: f64 = 10_000.0;
/// Longest push, s.
const MAX_SECONDS: f64 = 60.0;
/// Highest voltage of a battery.
const MAX_VOLTS: f64 = 1000.0;
/// Numbers that JavaScript counts without gaps.
const MAX_ID: u64 = (1 << 53) - 1;

/// Something that the simulated world can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request {
    /// Pushes the base: N along it, N·m about it, for so many seconds.
    Push([f64; 3]),
    /// Lets something go wrong.
    Fault(Fault),
    /// All that was wrong is well.
    Clear,
    /// Opens the emergency-stop circuit, or closes it.
    Estop(bool),
    /// The board's power fails and comes back.
    PowerCycle,
}

/// Reads a message: its number, and what it asks or why that cannot be asked. None if it is no request at all.
pub fn read(bytes: &[u8]) -> Option<(u64, Result<Request>)> {
    if bytes.len() > MAX_LENGTH {
        return None;
    }
    let Ok(Value::Object(mut fields)) = serde_json::from_slice(bytes) else {
        return None;
    };
    let id = fields.remove("id")?.as_u64().filter(|id| *id <= MAX_ID)?;
    Some((id, request(&fields)))
}

fn request(fields: &Map<String, Value>) -> Result<Request> {
    let mut each = fields.iter();
    let (Some((what, how)), None) = (each.next(), each.next()) else {
        bail!("a request is one of push, fault, clear, estop and power");
    };
    match (what.as_str(), how) {
        ("push", Value::Array(numbers)) => push(numbers),
        ("fault", Value::String(words)) => {
            let words: Vec<&str> = words.split_whitespace().collect();
            let fault = Fault::parse(&words)?;
            if let Fault::Battery(volts) = fault {
                ensure!(volts <= MAX_VOLTS, "a battery has {MAX_VOLTS} V at most");
            }
            Ok(Request::Fault(fault))
        }
        ("clear", Value::Bool(true)) => Ok(Request::Clear),
        ("estop", Value::Bool(open)) => Ok(Request::Estop(*open)),
        ("power", Value::String(word)) if word == "cycle" => Ok(Request::PowerCycle),
        ("push", _) => bail!("push takes [N along, N·m about, s]"),
        ("fault", _) => bail!("fault takes the words that follow `!fault` in a script"),
        ("clear", _) => bail!("clear takes true"),
        ("estop", _) => bail!("estop takes true (open) or false"),
        ("power", _) => bail!("power takes \"cycle\""),
        (other, _) => {
            let other: String = other.chars().take(40).collect();
            bail!("no request `{other}`: there are push, fault, clear, estop and power")
        }
    }
}

fn push(numbers: &[Value]) -> Result<Request> {
    let numbers: Vec<f64> = numbers.iter().filter_map(Value::as_f64).collect();
    let [force, torque, seconds] = numbers[..] else {
        bail!("push takes [N along, N·m about, s]");
    };
    ensure!(
        force.abs() <= MAX_PUSH && torque.abs() <= MAX_PUSH,
        "a push has {MAX_PUSH} N and N·m at most"
    );
    ensure!(
        (0.0..=MAX_SECONDS).contains(&seconds),
        "a push lasts 0 to {MAX_SECONDS} s"
    );
    Ok(Request::Push([force, torque, seconds]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim::faults::{MotorFault, Side};

    #[test]
    fn requests_are_read() {
        let weak = Fault::Motor(Side::Left, MotorFault::Weak(0.5));
        for (text, request) in [
            (
                r#"{"id":1,"push":[5,-0.5,0.2]}"#,
                Request::Push([5.0, -0.5, 0.2]),
            ),
            (
                r#"{"fault":" left motor  weak 0.5","id":2}"#,
                Request::Fault(weak),
            ),
            (r#"{"id":3,"clear":true}"#, Request::Clear),
            (r#"{"id":4,"estop":true}"#, Request::Estop(true)),
            (r#"{"id":5,"estop":false}"#, Request::Estop(false)),
            (r#"{"id":6,"power":"cycle"}"#, Request::PowerCycle),
        ] {
            let (_, read) = read(text.as_bytes()).unwrap();
            assert_eq!(read.unwrap(), request, "{text}");
        }
    }

    #[test]
    fn what_has_no_number_is_no_request() {
        let long = format!(r#"{{"id":1,"fault":"{}"}}"#, "x".repeat(5000));
        let deep = format!(r#"{{"id":1,"push":{}}}"#, "[".repeat(2000));
        for text in [
            "",
            "1",
            "[]",
            "{}",
            r#"{"clear":true}"#,
            r#"{"id":-1,"clear":true}"#,
            r#"{"id":1.5,"clear":true}"#,
            r#"{"id":9007199254740992,"clear":true}"#,
            r#"{"id":"1","clear":true}"#,
            r#"{"id":1,"clear":true"#,
            &long,
            &deep,
        ] {
            assert!(read(text.as_bytes()).is_none(), "{text}");
        }
        assert!(read(b"{\"id\":1,\"fault\":\"\xff\"}").is_none());
    }

    #[test]
    fn mistakes_are_told() {
        for (text, message) in [
            (r#"{"id":1}"#, "a request is one of"),
            (
                r#"{"id":1,"clear":true,"estop":true}"#,
                "a request is one of",
            ),
            (r#"{"id":1,"jump":true}"#, "no request `jump`"),
            (r#"{"id":1,"push":[1,2]}"#, "push takes"),
            (r#"{"id":1,"push":[1,2,"3"]}"#, "push takes"),
            (r#"{"id":1,"push":3}"#, "push takes"),
            (r#"{"id":1,"push":[1e5,0,1]}"#, "a push has 10000 N"),
            (r#"{"id":1,"push":[0,-1e300,1]}"#, "a push has 10000 N"),
            (r#"{"id":1,"push":[1,0,-1]}"#, "a push lasts 0 to 60 s"),
            (r#"{"id":1,"push":[1,0,61]}"#, "a push lasts 0 to 60 s"),
            (r#"{"id":1,"fault":"left motor tired"}"#, "a motor's fault"),
            (
                r#"{"id":1,"fault":"battery 1001"}"#,
                "a battery has 1000 V at most",
            ),
            (r#"{"id":1,"fault":7}"#, "fault takes"),
            (r#"{"id":1,"clear":false}"#, "clear takes true"),
            (r#"{"id":1,"estop":1}"#, "estop takes"),
            (r#"{"id":1,"power":"off"}"#, "power takes"),
        ] {
            let (id, read) = read(text.as_bytes()).unwrap();
            let error = read.unwrap_err().to_string();
            assert!(id == 1 && error.starts_with(message), "{text}: {error}");
        }
    }
}
