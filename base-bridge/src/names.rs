//! Names of topics and services, as ROS 2 makes them whole.

/// A name as it is in the whole network: one with a slash in front is whole already, others are in the node's namespace.
pub fn whole(namespace: &str, name: &str) -> String {
    if name.starts_with('/') {
        return name.to_owned();
    }
    match namespace.trim_matches('/') {
        "" => format!("/{name}"),
        namespace => format!("/{namespace}/{name}"),
    }
}

#[cfg(test)]
mod tests {
    use super::whole;

    #[test]
    fn names_are_made_whole() {
        assert_eq!(whole("", "odom"), "/odom");
        assert_eq!(whole("/", "odom"), "/odom");
        assert_eq!(whole("r1", "odom"), "/r1/odom");
        assert_eq!(whole("/fleet/r1/", "odom"), "/fleet/r1/odom");
        assert_eq!(whole("r1", "/tf"), "/tf");
    }
}
