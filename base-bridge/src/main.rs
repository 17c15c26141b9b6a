//! `base-bridge`: a base on a ROS 2 network.

mod options;
mod print;

use anyhow::{Result, ensure};
use base_bridge::app::App;
use base_bridge::log::Log;
use base_bridge::network::Network;
use clap::Parser;
use options::Options;
use print::Print;
use std::io::Write;

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
    ctrlc::set_handler(move || quit.quit())?;
    let mut networks: Vec<Box<dyn Network>> = Vec::new();
    if options.print {
        networks.push(Box::new(Print));
    }
    if let Some(file) = &options.mcap {
        networks.push(Box::new(Log::create(
            file,
            app.params(),
            options.namespace(),
        )?));
    }
    ensure!(
        !networks.is_empty(),
        "nobody to publish to: --print or --mcap"
    );
    app.run(door, networks, |words| {
        // Somebody may have closed it; the base is driven on.
        let _ = writeln!(std::io::stderr(), "{words}");
    });
    Ok(())
}
