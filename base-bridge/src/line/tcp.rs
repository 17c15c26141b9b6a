//! A base behind a TCP port: `cargo sim --tcp`, or a server of a serial port.

use super::{Door, Ends, READ_PATIENCE, WRITE_PATIENCE};
use socket2::SockRef;
use std::io::{Error, ErrorKind, Result};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// A server that is there answers in this time.
const CONNECT_PATIENCE: Duration = Duration::from_secs(1);

/// A server by its name and port.
pub struct Tcp {
    address: String,
}

impl Tcp {
    /// The server at `host:port`.
    pub fn new(address: String) -> Self {
        Self { address }
    }
}

impl Door for Tcp {
    fn open(&mut self) -> Result<Ends> {
        let mut refused = Error::new(ErrorKind::NotFound, "no such host");
        for address in self.address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, CONNECT_PATIENCE) {
                Ok(stream) => {
                    // Lines are short; to fill a packet first helps nobody.
                    stream.set_nodelay(true)?;
                    // What a connection that is given up still holds must not come out when the network is back.
                    SockRef::from(&stream).set_linger(Some(Duration::ZERO))?;
                    stream.set_read_timeout(Some(READ_PATIENCE))?;
                    stream.set_write_timeout(Some(WRITE_PATIENCE))?;
                    return Ok(Ends {
                        reader: Box::new(stream.try_clone()?),
                        writer: Box::new(stream),
                    });
                }
                Err(error) => refused = error,
            }
        }
        Err(refused)
    }

    fn name(&self) -> String {
        self.address.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};
    use std::net::TcpListener;

    #[test]
    fn what_was_on_its_way_is_dropped_with_the_connection() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut door = Tcp::new(listener.local_addr().unwrap().to_string());
        let mut ends = door.open().unwrap();
        let (mut far, _) = listener.accept().unwrap();
        // Until neither side takes any more: some of it is on this side still.
        while ends.writer.write(&vec![b'm'; 65536]).is_ok() {}
        drop(ends);
        let mut all = Vec::new();
        let end = far.read_to_end(&mut all).unwrap_err();
        assert_eq!(end.kind(), ErrorKind::ConnectionReset);
    }

    #[test]
    fn bytes_go_both_ways_and_an_end_is_seen() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut door = Tcp::new(listener.local_addr().unwrap().to_string());
        let mut ends = door.open().unwrap();
        let (mut far, _) = listener.accept().unwrap();
        ends.writer.write_all(b"m 1\n").unwrap();
        let mut bytes = [0; 4];
        far.read_exact(&mut bytes).unwrap();
        assert_eq!(&bytes, b"m 1\n");
        let nothing = ends.reader.read(&mut bytes).unwrap_err().kind();
        assert!(matches!(
            nothing,
            ErrorKind::WouldBlock | ErrorKind::TimedOut
        ));
        far.write_all(b"OK\r\n").unwrap();
        ends.reader.read_exact(&mut bytes).unwrap();
        assert_eq!(&bytes, b"OK\r\n");
        drop(far);
        assert_eq!(ends.reader.read(&mut bytes).unwrap(), 0);
        drop(listener);
        assert!(door.open().is_err());
    }
}
