//! Which line of which file an instruction comes from, through everything that was inlined.

use std::path::PathBuf;

use addr2line::Context;
use addr2line::gimli::{Dwarf, EndianSlice, LittleEndian};
use anyhow::Result;
use object::{Object, ObjectSection};

use super::elf::Image;

/// The image's debug information.
pub struct Sources<'a> {
    context: Context<EndianSlice<'a, LittleEndian>>,
    root: PathBuf,
}

/// A function and the line it is at, innermost first where one is inlined into the next.
pub struct Place {
    pub function: Option<String>,
    pub line: String,
}

impl<'a> Sources<'a> {
    /// File names below `root` are shown relative to it.
    pub fn new(image: &'a Image, root: PathBuf) -> Result<Self> {
        let file = object::File::parse(&*image.file)?;
        let dwarf = Dwarf::load(|section| {
            let data = file
                .section_by_name(section.name())
                .and_then(|section| section.data().ok());
            Ok::<_, anyhow::Error>(EndianSlice::new(data.unwrap_or_default(), LittleEndian))
        })?;
        Ok(Self {
            context: Context::from_dwarf(dwarf)?,
            root,
        })
    }

    /// None where nothing is known: debug information may be missing.
    pub fn places(&self, address: u32) -> Vec<Place> {
        let mut places = Vec::new();
        let Ok(mut frames) = self
            .context
            .find_frames(u64::from(address))
            .skip_all_loads()
        else {
            return places;
        };
        while let Ok(Some(frame)) = frames.next() {
            let function = frame.function.and_then(|function| {
                let name = function.raw_name().ok()?;
                Some(format!("{:#}", rustc_demangle::demangle(&name)))
            });
            let Some(location) = frame.location else {
                continue;
            };
            places.push(Place {
                function,
                line: format!(
                    "{}:{}",
                    self.shortened(location.file.unwrap_or("?")),
                    location.line.unwrap_or(0)
                ),
            });
        }
        places
    }

    /// The innermost line that is the project's own, or else the innermost.
    pub fn line(&self, address: u32) -> String {
        let places = self.places(address);
        let own = places
            .iter()
            .find(|place| !place.line.starts_with('<') && !place.line.ends_with(":0"));
        own.or(places.first())
            .map_or_else(|| format!("{address:#010x}"), |place| place.line.clone())
    }

    /// A path without what is the same for every file of a library, which is shown as `<library>/…`.
    fn shortened(&self, file: &str) -> String {
        let own = self.root.to_string_lossy();
        if let Some(own) = file.strip_prefix(&*own) {
            return own.trim_start_matches(['/', '\\']).to_owned();
        }
        for (folder, skipped) in [("/registry/src/", 1), ("/library/", 0)] {
            if let Some((_, rest)) = file.split_once(folder) {
                let parts: Vec<_> = rest.split('/').skip(skipped).collect();
                if let Some((library, rest)) = parts.split_first() {
                    return format!("<{library}>/{}", rest.join("/"));
                }
            }
        }
        file.to_owned()
    }
}
