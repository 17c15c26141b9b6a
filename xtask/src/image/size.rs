//! `cargo xtask size`: what the image takes of the flash and of the RAM, and what takes most.

use std::fmt::Write;

use anyhow::{Result, ensure};

use super::elf::{Image, Section};
use super::vehicle::Vehicle;

/// What the README promises.
const FLASH_LIMIT: u32 = 160 * 1024;
const RAM_LIMIT: u32 = 48 * 1024;

/// How many symbols are worth reading.
const LARGEST: usize = 12;

/// Bytes in flash, and bytes of variables; the stack is not among them.
pub fn totals(image: &Image) -> (u32, u32) {
    let flash = image
        .segments
        .iter()
        .map(|segment| segment.bytes.len() as u32);
    let ram = image.sections.iter().filter(|section| section.in_ram);
    (flash.sum(), ram.map(|section| section.size).sum())
}

/// A line that says it in short.
pub fn summary(image: &Image) -> String {
    let (flash, ram) = totals(image);
    format!("flash {flash} bytes, static RAM {ram} bytes")
}

/// Fails where the image has outgrown its limits.
pub fn check(image: &Image) -> Result<()> {
    let (flash, ram) = totals(image);
    ensure!(
        flash <= FLASH_LIMIT,
        "{flash} bytes of flash are more than {FLASH_LIMIT}"
    );
    ensure!(
        ram <= RAM_LIMIT,
        "{ram} bytes of static RAM are more than {RAM_LIMIT}"
    );
    Ok(())
}

/// A line for each vehicle.
pub fn table(images: &[(Vehicle, Image)]) -> String {
    let mut text = format!("{:12}  {:>8}  {:>10}\n", "vehicle", "flash", "static RAM");
    for (vehicle, image) in images {
        let (flash, ram) = totals(image);
        // Writing into a string cannot fail.
        let _ = writeln!(text, "{:12}  {flash:>8}  {ram:>10}", vehicle.name());
    }
    text
}

/// What takes how much; next to the limits, if they hold for the image.
pub fn report(image: &Image, promised: bool) -> String {
    let (flash, ram) = totals(image);
    let of = |limit: u32| {
        if promised {
            format!(" of {limit}")
        } else {
            String::new()
        }
    };
    let mut text = format!("flash: {flash}{} bytes\n", of(FLASH_LIMIT));
    part(&mut text, image, |section| section.in_flash);
    // Writing into a string cannot fail.
    let _ = writeln!(text, "static RAM: {ram}{} bytes", of(RAM_LIMIT));
    part(&mut text, image, |section| section.in_ram);
    text
}

fn part(text: &mut String, image: &Image, belongs: fn(&Section) -> bool) {
    let sections = image.sections.iter().filter(|section| belongs(section));
    for section in sections.clone() {
        let _ = writeln!(text, "{:>8}  {}", section.size, section.name);
    }
    let names: Vec<_> = sections.map(|section| &section.name).collect();
    let mut symbols: Vec<_> = image
        .symbols
        .iter()
        .filter(|symbol| names.contains(&&symbol.section))
        .collect();
    symbols.sort_by(|a, b| b.size.cmp(&a.size).then_with(|| a.name.cmp(&b.name)));
    let _ = writeln!(text, "  largest:");
    for symbol in symbols.iter().take(LARGEST) {
        let _ = writeln!(text, "{:>8}  {}", symbol.size, symbol.name);
    }
}
