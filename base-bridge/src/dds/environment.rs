//! What ROS 2 reads from the environment about its network. A program that is no part of ROS has to read it by itself.

use crate::params::ServiceMapping as Mapping;
use anyhow::{Result, bail};

/// The network that is joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Environment {
    /// Networks of different numbers do not see each other.
    pub domain: u16,
    /// Nothing leaves this computer.
    pub localhost_only: bool,
}

/// Higher numbers have ports beyond those that there are.
const MAX_DOMAIN: u16 = 232;

/// What ROS 2 and its engines also read, and this does not.
const IGNORED: [&str; 7] = [
    "ROS_SECURITY_ENABLE",
    "ROS_STATIC_PEERS",
    "ROS_DISCOVERY_SERVER",
    "ROS_SUPER_CLIENT",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "FASTDDS_DEFAULT_PROFILES_FILE",
    "CYCLONEDDS_URI",
];

/// What somebody should know who has set the process's variables so, and why nobody hears him.
pub fn remarks(services: Mapping) -> Vec<String> {
    remarks_on(
        |name| std::env::var(name).ok().filter(|value| !value.is_empty()),
        services,
    )
}

fn remarks_on(variable: impl Fn(&str) -> Option<String>, services: Mapping) -> Vec<String> {
    let ignored = IGNORED.into_iter().filter(|name| variable(name).is_some());
    let mut remarks: Vec<_> = ignored
        .map(|name| format!("{name} is set, and has no effect here"))
        .collect();
    let engine = variable("RMW_IMPLEMENTATION").unwrap_or_default();
    let other = match services {
        _ if engine.starts_with("rmw_zenoh") => Some("is not DDS: its nodes do not find this one"),
        Mapping::Enhanced if engine.starts_with("rmw_cyclonedds") => {
            Some("asks for services in another way: -p services.mapping:=cyclone")
        }
        Mapping::Cyclone if engine.starts_with("rmw_fastrtps") => {
            Some("asks for services in another way: -p services.mapping:=enhanced")
        }
        _ => None,
    };
    remarks.extend(other.map(|other| format!("RMW_IMPLEMENTATION is {engine}, which {other}")));
    remarks
}

impl Environment {
    /// From the process's own variables.
    ///
    /// # Errors
    /// If one of them has a value that means nothing, or that cannot be done here.
    pub fn of_process() -> Result<Self> {
        Self::of(|name| std::env::var(name).ok().filter(|value| !value.is_empty()))
    }

    /// From these variables.
    ///
    /// # Errors
    /// As of [`Self::of_process`].
    pub fn of(variable: impl Fn(&str) -> Option<String>) -> Result<Self> {
        let domain = match variable("ROS_DOMAIN_ID") {
            None => 0,
            Some(text) => match text.parse() {
                Ok(domain) if domain <= MAX_DOMAIN => domain,
                _ => bail!("ROS_DOMAIN_ID is `{text}`: it is a number from 0 to {MAX_DOMAIN}"),
            },
        };
        // Where both are set, the older one counts, as in ROS 2.
        let range = variable("ROS_AUTOMATIC_DISCOVERY_RANGE");
        let localhost_only = match (variable("ROS_LOCALHOST_ONLY").as_deref(), range.as_deref()) {
            (Some("1"), _) | (None | Some("0"), Some("LOCALHOST")) => true,
            (None | Some("0"), None | Some("SUBNET" | "SYSTEM_DEFAULT" | "NOT_SET")) => false,
            (None | Some("0"), Some("OFF")) => bail!(
                "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF: without discovery nobody finds the base; LOCALHOST keeps it on this computer"
            ),
            (None | Some("0"), Some(range)) => bail!(
                "ROS_AUTOMATIC_DISCOVERY_RANGE is `{range}`: it is SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT"
            ),
            (Some(only), _) => bail!("ROS_LOCALHOST_ONLY is `{only}`: it is 0 or 1"),
        };
        Ok(Self {
            domain,
            localhost_only,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{Environment, remarks_on};
    use crate::params::ServiceMapping as Mapping;

    fn of(variables: &[(&str, &str)]) -> Result<Environment, String> {
        let variable = |name: &str| {
            let found = variables.iter().find(|(each, _)| *each == name)?;
            Some(found.1.to_owned())
        };
        Environment::of(variable).map_err(|error| error.to_string())
    }

    #[test]
    fn the_network_is_the_one_that_ros_would_join() {
        let network = |domain, localhost_only| {
            Ok(Environment {
                domain,
                localhost_only,
            })
        };
        let [domain, only, range] = [
            "ROS_DOMAIN_ID",
            "ROS_LOCALHOST_ONLY",
            "ROS_AUTOMATIC_DISCOVERY_RANGE",
        ];
        assert_eq!(of(&[]), network(0, false));
        assert_eq!(of(&[(domain, "42")]), network(42, false));
        assert_eq!(of(&[(only, "1")]), network(0, true));
        assert_eq!(of(&[(only, "0"), (range, "LOCALHOST")]), network(0, true));
        assert_eq!(of(&[(range, "SUBNET")]), network(0, false));
        assert_eq!(of(&[(only, "1"), (range, "SUBNET")]), network(0, true));
    }

    #[test]
    fn what_has_no_effect_is_told() {
        let told = |variables: &[(&str, &str)], services| {
            let variable = |name: &str| {
                let found = variables.iter().find(|(each, _)| *each == name)?;
                Some(found.1.to_owned())
            };
            remarks_on(variable, services).join("; ")
        };
        let set = [("ROS_DISCOVERY_SERVER", "a"), ("ROS_DOMAIN_ID", "1")];
        assert_eq!(
            told(&set, Mapping::Enhanced),
            "ROS_DISCOVERY_SERVER is set, and has no effect here"
        );
        for (engine, services, expected) in [
            ("rmw_fastrtps_cpp", Mapping::Enhanced, ""),
            ("rmw_cyclonedds_cpp", Mapping::Cyclone, ""),
            ("rmw_fastrtps_cpp", Mapping::Cyclone, "mapping:=enhanced"),
            ("rmw_cyclonedds_cpp", Mapping::Enhanced, "mapping:=cyclone"),
            ("rmw_zenoh_cpp", Mapping::Enhanced, "not DDS"),
        ] {
            let told = told(&[("RMW_IMPLEMENTATION", engine)], services);
            assert_eq!(told.is_empty(), expected.is_empty(), "{told}");
            assert!(told.contains(expected), "{told}");
        }
    }

    #[test]
    fn what_means_nothing_is_told() {
        for (name, value) in [
            ("ROS_DOMAIN_ID", "233"),
            ("ROS_DOMAIN_ID", "-1"),
            ("ROS_DOMAIN_ID", "a"),
            ("ROS_LOCALHOST_ONLY", "yes"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "near"),
        ] {
            let error = of(&[(name, value)]).unwrap_err();
            assert!(error.contains(name) && error.contains(value), "{error}");
        }
    }
}
