//! What ROS 2 reads from the environment about its network. A program that is no part of ROS has to read it by itself.

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
const IGNORED: [&str; 6] = [
    "ROS_STATIC_PEERS",
    "ROS_DISCOVERY_SERVER",
    "ROS_SUPER_CLIENT",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "FASTDDS_DEFAULT_PROFILES_FILE",
    "CYCLONEDDS_URI",
];

/// Which of the process's variables are set and have no effect: who has set them should know.
pub fn ignored() -> Vec<&'static str> {
    ignored_of(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty()))
}

fn ignored_of(is_set: impl Fn(&str) -> bool) -> Vec<&'static str> {
    IGNORED.into_iter().filter(|name| is_set(name)).collect()
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
    use super::{Environment, ignored_of};

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
        let set = ["ROS_DISCOVERY_SERVER", "ROS_DOMAIN_ID", "CYCLONEDDS_URI"];
        let ignored = ignored_of(|name| set.contains(&name));
        assert_eq!(ignored, ["ROS_DISCOVERY_SERVER", "CYCLONEDDS_URI"]);
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
