//! A network namespace for a test: it starts itself again in there, so that tests beside it are not heard.

use std::io::Write;
use std::process::Command;

/// Set inside.
const INSIDE: &str = "BASE_BRIDGE_ALONE";

/// Loopback, and a cable to nowhere by which multicasts would leave. IPv6 would say things by itself.
const PREPARE: &str = "set -e
for all in /proc/sys/net/ipv6/conf/*/disable_ipv6; do if [ -e $all ]; then echo 1 > $all; fi; done
ip link set lo up
ip link add name cable type veth peer name nowhere
ip addr add 10.77.0.1/24 dev cable
ip link set cable up
ip link set nowhere up
ip route add default via 10.77.0.2
exec \"$@\"";

/// What is left out is said past the capture of the test's output.
pub fn left_out(why: &str) {
    let _ = writeln!(std::io::stderr(), "LEFT OUT: {why}");
}

/// Runs a test, by its full name, in a network of its own. Where that is not permitted it is left out.
pub fn alone(test: &str, run: impl FnOnce()) {
    if std::env::var_os("ROS_PYTHON").is_none() {
        return left_out("no Python with cyclonedds in ROS_PYTHON (`cargo xtask test` makes one)");
    }
    if std::env::var_os(INSIDE).is_some() {
        return run();
    }
    let unshared = |command: &[&str]| {
        let mut unshare = Command::new("unshare");
        unshare.args(["--map-root-user", "--net", "sh", "-c", PREPARE, "sh"]);
        unshare.args(command).env(INSIDE, "1");
        unshare
    };
    let permitted = unshared(&["true"]).output();
    if !permitted.is_ok_and(|output| output.status.success()) {
        return left_out(
            "no network namespace: `unshare --map-root-user --net` and `ip` are needed",
        );
    }
    let own = std::env::current_exe().unwrap();
    let mut inside = unshared(&[
        own.to_str().unwrap(),
        test,
        "--exact",
        "--nocapture",
        "--include-ignored",
    ]);
    assert!(inside.status().unwrap().success(), "see above");
}

/// Packets that went out by an interface.
pub fn sent_by(interface: &str) -> u64 {
    let all = std::fs::read_to_string("/proc/thread-self/net/dev").unwrap();
    let line = all
        .lines()
        .find_map(|line| line.trim().strip_prefix(interface)?.strip_prefix(':'));
    // Bytes, packets and six more that came in, bytes and packets that went out.
    line.unwrap()
        .split_ascii_whitespace()
        .nth(9)
        .unwrap()
        .parse()
        .unwrap()
}
