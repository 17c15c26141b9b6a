//! `base-bridge`: a base on a ROS 2 network.

mod options;
mod print;

use anyhow::{Result, ensure};
use base_bridge::app::App;
use base_bridge::aside::{Aside, Words, tell};
use base_bridge::log::Log;
use base_bridge::network::Network;
use clap::Parser;
use options::Options;
use print::Print;
use std::io::Write;
use std::time::{Duration, Instant};

/// The base has been told to stop, and what is logged has its end, long before this.
const PATIENCE: Duration = Duration::from_millis(1500);

fn main() -> Result<()> {
    let options = Options::parse();
    let params = options.params()?;
    if options.list_params {
        std::io::stdout().write_all(params.file().as_bytes())?;
        return Ok(());
    }
    let door = options.door(&params)?;
    let app = App::new(params);
    let quit = app.quit();
    let mut asked: Option<Instant> = None;
    ctrlc::set_handler(move || {
        // Who asks again after a while does not want to wait. A terminal that closes, or a script that passes on what its terminal says, asks twice at once.
        if asked.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
            std::process::exit(1);
        }
        quit.quit();
    })?;
    let names = app.params().names(options.namespace(), options.name());
    // Who is on the network is told first that this is the end: files may have to wait.
    let mut networks: Vec<Box<dyn Network>> = join(&options, &app)?.into_iter().collect();
    if options.print {
        networks.push(Box::new(Aside::new(Print)?));
    }
    if let Some(file) = &options.mcap {
        let log = Log::create(file, names.clone())?;
        tell(&format!("log: {}", log.path().display()));
        networks.push(Box::new(Aside::new(log)?));
    }
    #[cfg(feature = "foxglove")]
    if let Some(address) = options.foxglove {
        let foxglove = base_bridge::foxglove::Foxglove::serve(address, names)?;
        networks.push(Box::new(foxglove));
        tell(&format!("Foxglove: ws://{address}"));
    }
    ensure!(
        !networks.is_empty(),
        "nobody to publish to: --print or --mcap, or a build with the feature `dds` (cargo bridge)"
    );
    let mut words = Words::new()?;
    app.run(door, networks, |said| words.tell(said))
}

/// The node on the network, unless that is not wished.
#[cfg(feature = "node")]
fn join(options: &Options, app: &App) -> Result<Option<Box<dyn Network>>> {
    use base_bridge::dds::Dds;
    use base_bridge::dds::environment::{self, Environment};
    if options.offline {
        return Ok(None);
    }
    for remark in environment::remarks(app.params().service_mapping()) {
        tell(&remark);
    }
    let mut environment = Environment::of_process()?;
    environment.localhost_only |= options.localhost_only;
    let dds = Dds::join(
        options.namespace(),
        options.name(),
        app.params(),
        &environment,
        &app.inbox(),
    )?;
    tell(&format!(
        "node {} on the network of ROS_DOMAIN_ID {}{}",
        options.node(),
        environment.domain,
        if environment.localhost_only {
            ", this computer only"
        } else {
            ""
        }
    ));
    Ok(Some(Box::new(dds)))
}

/// This build has no network.
#[cfg(not(feature = "node"))]
#[allow(
    clippy::unnecessary_wraps,
    reason = "with the network, there is something to go wrong"
)]
fn join(_: &Options, _: &App) -> Result<Option<Box<dyn Network>>> {
    Ok(None)
}
