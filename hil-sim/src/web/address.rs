//! Where the page is offered, as the command line says it.

use anyhow::{Result, ensure};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, ToSocketAddrs};

/// An address to listen on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// Its digits.
    pub socket: SocketAddr,
    /// The name by which it was given, if it was one.
    pub host: Option<String>,
}

impl std::str::FromStr for Address {
    type Err = String;

    /// `127.0.0.1:8080`, `localhost:8080` or just `8080`.
    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(port) = text.parse::<u16>() {
            let socket = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
            return Ok(Self { socket, host: None });
        }
        if let Ok(socket) = text.parse() {
            return Ok(Self { socket, host: None });
        }
        let wrong = || "write an address like 127.0.0.1:8080, or a port".to_owned();
        let (host, _) = text.rsplit_once(':').ok_or_else(wrong)?;
        let mut found = text.to_socket_addrs().map_err(|_| wrong())?;
        let socket = found
            .next()
            .ok_or_else(|| format!("{text} has no address"))?;
        Ok(Self {
            socket,
            host: Some(host.to_owned()),
        })
    }
}

impl Address {
    /// Nothing, if only this computer reaches the address, or if others may.
    ///
    /// # Errors
    /// That it is not a loopback address.
    pub fn check(&self, allow_remote: bool) -> Result<()> {
        let ip: IpAddr = self.socket.ip();
        ensure!(
            ip.is_loopback() || allow_remote,
            "{} is not a loopback address: whoever reaches it can drive the base, without a password; if that is meant, add --web-allow-remote",
            self.socket
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn socket(text: &str) -> String {
        text.parse::<Address>().unwrap().socket.to_string()
    }

    #[test]
    fn addresses_are_read() {
        assert_eq!(socket("8080"), "127.0.0.1:8080");
        assert_eq!(socket("0"), "127.0.0.1:0");
        assert_eq!(socket("0.0.0.0:80"), "0.0.0.0:80");
        assert_eq!(socket("[::1]:8080"), "[::1]:8080");
        let named: Address = "localhost:8080".parse().unwrap();
        assert_eq!(named.host.as_deref(), Some("localhost"));
        assert!(named.socket.ip().is_loopback());
        for wrong in ["", "127.0.0.1", "65536", ":8080", "here"] {
            assert!(wrong.parse::<Address>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn others_must_be_allowed() {
        for (text, alone) in [
            ("127.0.0.1:1", true),
            ("127.1.2.3:1", true),
            ("[::1]:1", true),
            ("0.0.0.0:1", false),
            ("[::]:1", false),
            ("192.168.1.2:1", false),
        ] {
            let address: Address = text.parse().unwrap();
            assert_eq!(address.check(false).is_ok(), alone, "{text}");
            assert!(address.check(true).is_ok());
        }
    }
}
