//! What Debian and its relatives have packages for.

use std::time::Duration;

use anyhow::{Result, bail};

use crate::run::{Session, capture, succeeds};

const PROBE: Duration = Duration::from_secs(20);

/// Installs packages, names separated by blanks, in full view. Whether that helped is for the caller to see.
///
/// # Errors
/// With what would install them, where there is no apt-get or this is not root. `missing` says what for, and `elsewhere` how else to get it.
pub fn install(session: &Session, packages: &str, missing: &str, elsewhere: &str) -> Result<()> {
    let install = format!("apt-get install --yes {packages}");
    if !succeeds(session.command("apt-get", ["--version"]), PROBE) {
        bail!("{missing}: {elsewhere}");
    }
    if !is_root(session) {
        bail!("{missing}: run `sudo {install}`");
    }
    // The lists of a fresh machine are old or missing; an update that fails may still leave good ones.
    session.run(&mut session.command("apt-get", ["update", "--quiet=2"]))?;
    let mut install = session.command("apt-get", install.split(' ').skip(1));
    install.env("DEBIAN_FRONTEND", "noninteractive");
    session.run(&mut install)?;
    Ok(())
}

fn is_root(session: &Session) -> bool {
    capture(session.command("id", ["-u"]), PROBE).is_ok_and(|(_, id)| id.trim() == "0")
}
