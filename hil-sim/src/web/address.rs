//! Where the page is offered, as the command line says it.

use anyhow::{Context, Result, ensure};
use std::net::{Ipv4Addr, SocketAddr, ToSocketAddrs};

/// An address to listen on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// Its digits: at least one, and a name may stand for several.
    sockets: Vec<SocketAddr>,
    /// The name by which it was given, if it was one.
    pub host: Option<String>,
}

impl std::str::FromStr for Address {
    type Err = String;

    /// `127.0.0.1:8080`, `localhost:8080` or just `8080`.
    fn from_str(text: &str) -> Result<Self, String> {
        let digits = |socket| Self {
            sockets: vec![socket],
            host: None,
        };
        if let Ok(port) = text.parse::<u16>() {
            return Ok(digits(SocketAddr::from((Ipv4Addr::LOCALHOST, port))));
        }
        if let Ok(socket) = text.parse() {
            return Ok(digits(socket));
        }
        let wrong = || "write an address like 127.0.0.1:8080, or a port".to_owned();
        let (host, _) = text.rsplit_once(':').ok_or_else(wrong)?;
        let sockets: Vec<SocketAddr> = text.to_socket_addrs().map_err(|_| wrong())?.collect();
        if sockets.is_empty() {
            return Err(format!("{text} has no address"));
        }
        Ok(Self {
            sockets,
            host: Some(host.to_owned()),
        })
    }
}

impl Address {
    /// Which of them to listen on: one that only this computer reaches, or one that others reach, if they may.
    ///
    /// # Errors
    /// That there is no such one.
    pub fn choose(&self, allow_remote: bool) -> Result<SocketAddr> {
        let is_alone = |socket: &&SocketAddr| socket.ip().is_loopback();
        let alone = self.sockets.iter().find(is_alone);
        let remote = self.sockets.iter().find(|socket| !is_alone(socket));
        ensure!(
            remote.is_some() || !allow_remote || self.host.is_none(),
            "here, that name stands for this computer alone: for others, give its address in digits; else leave --web-allow-remote out"
        );
        let chosen = if allow_remote {
            remote.or(alone)
        } else {
            alone
        };
        chosen.copied().with_context(|| {
            format!(
                "{} is not a loopback address: whoever reaches it can drive the base, without a password; if that is meant, add --web-allow-remote",
                self.sockets[0]
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn socket(text: &str) -> String {
        text.parse::<Address>().unwrap().sockets[0].to_string()
    }

    #[test]
    fn addresses_are_read() {
        assert_eq!(socket("8080"), "127.0.0.1:8080");
        assert_eq!(socket("0"), "127.0.0.1:0");
        assert_eq!(socket("0.0.0.0:80"), "0.0.0.0:80");
        assert_eq!(socket("[::1]:8080"), "[::1]:8080");
        let named: Address = "localhost:8080".parse().unwrap();
        assert_eq!(named.host.as_deref(), Some("localhost"));
        assert!(named.choose(false).unwrap().ip().is_loopback());
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
            assert_eq!(address.choose(false).is_ok(), alone, "{text}");
            assert!(address.choose(true).is_ok());
        }
    }

    #[test]
    fn of_a_names_addresses_that_one_is_taken_which_is_meant() {
        let named = |digits: &[&str]| Address {
            sockets: digits.iter().map(|text| text.parse().unwrap()).collect(),
            host: Some("robot".into()),
        };
        let [alone, remote] = ["127.0.1.1:80", "192.168.1.2:80"];
        let both = named(&[alone, remote]);
        assert_eq!(both.choose(false).unwrap().to_string(), alone);
        assert_eq!(both.choose(true).unwrap().to_string(), remote);
        let message = |address: &Address, allow| format!("{}", address.choose(allow).unwrap_err());
        // As Debian has a computer's own name in /etc/hosts: nobody else would reach the page, and nobody would say why.
        assert!(message(&named(&[alone]), true).contains("this computer alone"));
        assert!(message(&named(&[remote]), false).contains("--web-allow-remote"));
    }
}
