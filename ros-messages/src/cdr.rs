//! Messages as bytes: Common Data Representation, with the four bytes before it that say so (OMG DDSI-RTPS 2.3, section 10.5).

use crate::RosMessage;
use byteorder::{BigEndian, LittleEndian};

/// `CDR_LE`, no options.
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];
/// The first two bytes of the other order.
const BIG_ENDIAN: [u8; 2] = [0, 0];

/// Why bytes are not the message that they should be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CdrError {
    /// The first four bytes do not announce plain CDR.
    Encapsulation,
    /// What follows does not hold the fields.
    Content(String),
    /// More bytes follow than alignment explains.
    Excess(usize),
}

impl std::fmt::Display for CdrError {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Encapsulation => write!(formatter, "the bytes are not plain CDR"),
            Self::Content(why) => write!(formatter, "the bytes do not hold the fields: {why}"),
            Self::Excess(bytes) => write!(formatter, "{bytes} bytes follow the last field"),
        }
    }
}

impl std::error::Error for CdrError {}

/// A message as little-endian CDR with its header, as ROS 2 has it on the network and in logs.
///
/// # Panics
/// Never: every field has a form in CDR.
pub fn to_cdr<M: RosMessage>(message: &M) -> Vec<u8> {
    let body = cdr_encoding::to_vec::<M, LittleEndian>(message);
    let body = body.expect("each field of a message has a form in CDR");
    let mut bytes = Vec::with_capacity(LITTLE_ENDIAN.len() + body.len());
    bytes.extend_from_slice(&LITTLE_ENDIAN);
    bytes.extend_from_slice(&body);
    bytes
}

/// The message that the bytes, in either order and with their header, are.
///
/// # Errors
/// If they are none. Whatever they are, this ends, and takes no more memory than some times their length, and a MiB for each sequence that lies within
/// another.
pub fn from_cdr<M: RosMessage>(bytes: &[u8]) -> Result<M, CdrError> {
    let (header, body) = bytes
        .split_first_chunk::<4>()
        .ok_or(CdrError::Encapsulation)?;
    let read = if header[..2] == LITTLE_ENDIAN[..2] {
        cdr_encoding::from_bytes::<M, LittleEndian>(body)
    } else if header[..2] == BIG_ENDIAN {
        cdr_encoding::from_bytes::<M, BigEndian>(body)
    } else {
        return Err(CdrError::Encapsulation);
    };
    let (message, used) = read.map_err(|error| CdrError::Content(error.to_string()))?;
    // Some writers fill up to the next four bytes.
    match body.len() - used {
        0..=3 => Ok(message),
        excess => Err(CdrError::Excess(excess)),
    }
}
