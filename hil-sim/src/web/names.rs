//! Which names the page may be asked for by, and which pages may ask.
//!
//! A browser lets any page on the web open connections to this computer. What it cannot do is lie in the headers Host and Origin: a page of another
//! origin is told by its Origin, and one whose name was made to point here (DNS rebinding) by its Host.

use std::net::{IpAddr, Ipv6Addr, SocketAddr};

/// The names of the listening address.
#[derive(Clone, Debug)]
pub struct Names {
    port: u16,
    /// In lower case; an IPv6 address in brackets.
    hosts: Vec<String>,
    /// An address in digits is good, whichever: it cannot be made to point here.
    any_address: bool,
}

impl Names {
    /// Those of an address; `asked` is the host name by which it was given on the command line, if it was one.
    pub fn of(address: SocketAddr, asked: Option<&str>) -> Self {
        let mut hosts = vec!["localhost".to_owned(), in_url(address.ip())];
        if address.ip().is_loopback() {
            hosts.extend(["127.0.0.1".to_owned(), "[::1]".to_owned()]);
        }
        hosts.extend(asked.map(str::to_ascii_lowercase));
        Self {
            port: address.port(),
            hosts,
            any_address: !address.ip().is_loopback(),
        }
    }

    /// True if a Host header, or the authority of a request's target, means this server.
    pub fn include(&self, host: &str) -> bool {
        let name = match host.strip_suffix(&format!(":{}", self.port)) {
            Some(name) => name,
            // A browser leaves the usual port out.
            None if self.port == 80 => host,
            None => return false,
        };
        let name = name.to_ascii_lowercase();
        self.hosts.contains(&name) || self.any_address && is_address(&name)
    }
}

/// True if an Origin is that of pages which this host serves.
pub fn is_same_origin(origin: &str, host: &str) -> bool {
    origin
        .strip_prefix("http://")
        .is_some_and(|of| of.eq_ignore_ascii_case(host))
}

/// An address as a URL has it.
fn in_url(address: IpAddr) -> String {
    match address {
        IpAddr::V4(address) => address.to_string(),
        IpAddr::V6(address) => format!("[{address}]"),
    }
}

fn is_address(name: &str) -> bool {
    let v6 = name
        .strip_prefix('[')
        .and_then(|name| name.strip_suffix(']'));
    match v6 {
        Some(name) => name.parse::<Ipv6Addr>().is_ok(),
        None => name.parse::<std::net::Ipv4Addr>().is_ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(address: &str, asked: Option<&str>) -> Names {
        Names::of(address.parse().unwrap(), asked)
    }

    #[test]
    fn loopback_has_three_names_and_one_port() {
        let names = names("127.0.0.1:8080", None);
        for good in [
            "127.0.0.1:8080",
            "localhost:8080",
            "LocalHost:8080",
            "[::1]:8080",
        ] {
            assert!(names.include(good), "{good}");
        }
        for wrong in [
            "",
            ":8080",
            "127.0.0.1",
            "127.0.0.1:80",
            "127.0.0.1:18080",
            "127.0.0.1:8080:8080",
            "127.0.0.2:8080",
            "192.168.1.2:8080",
            "evil.example:8080",
            "localhost.evil.example:8080",
            "evil@localhost:8080",
            "localhost:8080.",
            "localhost.:8080",
            "::1:8080",
            "[::1:8080",
            " localhost:8080",
        ] {
            assert!(!names.include(wrong), "{wrong}");
        }
    }

    #[test]
    fn a_remote_address_is_known_by_digits_and_by_the_name_it_was_given() {
        let names = names("0.0.0.0:8080", Some("Robot.local"));
        for good in [
            "0.0.0.0:8080",
            "192.168.1.2:8080",
            "[fe80::1]:8080",
            "localhost:8080",
            "robot.local:8080",
        ] {
            assert!(names.include(good), "{good}");
        }
        for wrong in [
            "evil.example:8080",
            "192.168.1.2",
            "192.168.1:8080",
            "[192.168.1.2]:8080",
            "fe80::1:8080",
        ] {
            assert!(!names.include(wrong), "{wrong}");
        }
    }

    #[test]
    fn the_usual_port_may_be_left_out() {
        let names = names("127.0.0.1:80", None);
        assert!(names.include("localhost") && names.include("localhost:80"));
        assert!(!names.include("localhost:8080") && !names.include("evil.example"));
    }

    #[test]
    fn an_origin_is_the_same_to_the_letter() {
        assert!(is_same_origin("http://localhost:8080", "localhost:8080"));
        assert!(is_same_origin("http://LOCALHOST:8080", "localhost:8080"));
        for other in [
            "null",
            "",
            "http://",
            "localhost:8080",
            "https://localhost:8080",
            "http://127.0.0.1:8080",
            "http://localhost:8081",
            "http://localhost:8080/",
            "http://localhost:8080.evil.example",
            "http://evil.example",
        ] {
            assert!(!is_same_origin(other, "localhost:8080"), "{other}");
        }
    }
}
