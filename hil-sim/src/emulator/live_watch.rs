//! Looks into the image's memory by the names of its members, as a debugger does.

use super::debug_info::{DebugInfo, Member, Shape, Type, TypeId};
use anyhow::{Context, Result, anyhow, bail, ensure};
use std::collections::HashMap;

/// How deep a value may lie in a static.
const MAX_DEPTH: usize = 16;

/// A value of a known type in a copy of the image's memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct View<'a> {
    info: &'a DebugInfo,
    bytes: &'a [u8],
    id: TypeId,
}

/// Where a value is in the image's memory.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// The path of members that leads to it, from the static on.
    pub path: String,
    pub address: u64,
    pub size: u64,
    pub id: TypeId,
}

/// All values of a type, by its path without generic arguments, that statics hold as members of members; not those in arrays, which come and go.
pub(super) fn find(info: &DebugInfo, wanted: &str) -> Result<Vec<Found>> {
    let mut search = Search {
        info,
        wanted,
        holds: HashMap::new(),
        found: Vec::new(),
    };
    for place in info.statics() {
        search.descend(place.id, place.address, &place.name, 0)?;
    }
    Ok(search.found)
}

struct Search<'a> {
    info: &'a DebugInfo,
    wanted: &'a str,
    /// Whether there is one in a type.
    holds: HashMap<TypeId, bool>,
    found: Vec<Found>,
}

impl Search<'_> {
    fn descend(&mut self, id: TypeId, address: u64, path: &str, depth: usize) -> Result<()> {
        if depth > MAX_DEPTH || self.holds.get(&id) == Some(&false) {
            return Ok(());
        }
        // Pointers and the like are no types of interest.
        let Ok(found) = self.info.get(id) else {
            return Ok(());
        };
        let before = self.found.len();
        let generic = found.path.split('<').next();
        if generic == Some(self.wanted) {
            self.found.push(Found {
                path: path.to_owned(),
                address,
                size: found.size,
                id,
            });
        } else if let Shape::Members { members, .. } = &found.shape {
            for member in members {
                let path = format!("{path}.{}", member.name);
                self.descend(member.id, address + member.offset, &path, depth + 1)?;
            }
        }
        self.holds.insert(id, self.found.len() > before);
        Ok(())
    }
}

impl Found {
    /// Where a member of it is.
    pub(super) fn member(&self, info: &DebugInfo, name: &str) -> Result<Self> {
        let kind = info.get(self.id)?;
        let member = kind.member(name)?;
        Ok(Self {
            path: format!("{}.{name}", self.path),
            address: self.address + member.offset,
            size: info.size(member.id)?,
            id: member.id,
        })
    }
}

impl Type {
    fn member(&self, name: &str) -> Result<&Member> {
        let Shape::Members { members, .. } = &self.shape else {
            bail!("{} has no members, so not `{name}`", self.path);
        };
        let member = members.iter().find(|member| member.name == name);
        member.ok_or_else(|| anyhow!("{} has no member `{name}`", self.path))
    }
}

impl<'a> View<'a> {
    /// A value of this type in these bytes.
    pub(super) fn new(info: &'a DebugInfo, id: TypeId, bytes: &'a [u8]) -> Self {
        Self { info, bytes, id }
    }

    fn kind(&self) -> Result<&'a Type> {
        self.info.get(self.id)
    }

    fn part(&self, offset: u64, id: TypeId) -> Result<Self> {
        let bytes = self.bytes.get(offset as usize..);
        let bytes = bytes.ok_or_else(|| anyhow!("a member lies outside of its structure"))?;
        Ok(Self { bytes, id, ..*self })
    }

    /// A member, or a member of a member: names with dots between.
    pub(super) fn member(&self, path: &str) -> Result<Self> {
        path.split('.').try_fold(*self, |view, name| {
            let member = view.kind()?.member(name)?;
            view.part(member.offset, member.id)
        })
    }

    /// An element of an array.
    pub(super) fn element(&self, index: u64) -> Result<Self> {
        let kind = self.kind()?;
        let Shape::Array(id, count) = kind.shape else {
            bail!("{} is not an array", kind.path);
        };
        ensure!(index < count, "an array of {count} has no element {index}");
        self.part(index * self.info.size(id)?, id)
    }

    /// How many elements an array has.
    pub(super) fn length(&self) -> Result<u64> {
        let kind = self.kind()?;
        match kind.shape {
            Shape::Array(_, count) => Ok(count),
            _ => bail!("{} is not an array", kind.path),
        }
    }

    fn raw(&self) -> Result<[u8; 8]> {
        let kind = self.kind()?;
        let length = kind.size as usize;
        let bytes = self.bytes.get(..length).filter(|_| length <= 8);
        let bytes = bytes.with_context(|| format!("{} is not a number", kind.path))?;
        let mut raw = [0; 8];
        raw[..length].copy_from_slice(bytes);
        Ok(raw)
    }

    /// A number, whatever kind of one it is.
    pub(super) fn number(&self) -> Result<f64> {
        let kind = self.kind()?;
        let Shape::Number(encoding) = kind.shape else {
            bail!("{} is not a number", kind.path);
        };
        let raw = self.raw()?;
        Ok(match (encoding, kind.size) {
            (gimli::DW_ATE_float, 4) => {
                f64::from(f32::from_le_bytes([raw[0], raw[1], raw[2], raw[3]]))
            }
            (gimli::DW_ATE_float, 8) => f64::from_le_bytes(raw),
            _ => self.integer()? as f64,
        })
    }

    /// A number, or the sum of the library's two-part sums.
    pub(super) fn real(&self) -> Result<f64> {
        match self.kind()?.shape {
            Shape::Number(_) => self.number(),
            _ => Ok(self.member("high")?.number()? + self.member("low")?.number()?),
        }
    }

    /// A number as an f32; it should be one.
    pub(super) fn float(&self) -> Result<f32> {
        Ok(self.number()? as f32)
    }

    /// A whole number.
    pub(super) fn integer(&self) -> Result<i64> {
        let kind = self.kind()?;
        let unsigned = i64::from_le_bytes(self.raw()?);
        let spare = 64 - 8 * kind.size.min(8) as u32;
        Ok(match kind.shape {
            Shape::Number(gimli::DW_ATE_signed | gimli::DW_ATE_signed_char) => {
                unsigned << spare >> spare
            }
            _ => unsigned,
        })
    }

    /// The name of an enum's value.
    pub(super) fn name(&self) -> Result<&'a str> {
        let kind = self.kind()?;
        let Shape::Names(names) = &kind.shape else {
            bail!("{} is not an enum without data", kind.path);
        };
        let value = self.integer()?;
        let name = names.iter().find(|(number, _)| *number == value);
        name.map(|(_, name)| name.as_str())
            .ok_or_else(|| anyhow!("{} has no value {value}", kind.path))
    }

    /// What an `Option` holds.
    pub(super) fn option(&self) -> Result<Option<Self>> {
        let kind = self.kind()?;
        let Shape::Members {
            variants: Some(variants),
            ..
        } = &kind.shape
        else {
            bail!("{} is not an enum with data", kind.path);
        };
        let tag = self.part(variants.tag.offset, variants.tag.id)?.integer()?;
        let exact = variants
            .variants
            .iter()
            .find(|(value, _)| *value == Some(tag));
        let other = || variants.variants.iter().find(|(value, _)| value.is_none());
        let (_, variant) = exact
            .or_else(other)
            .ok_or_else(|| anyhow!("{} has no variant {tag}", kind.path))?;
        match variant.name.as_str() {
            "None" => Ok(None),
            "Some" => self
                .part(variant.offset, variant.id)?
                .member("__0")
                .map(Some),
            other => bail!("{} has a variant `{other}`: it is no Option", kind.path),
        }
    }
}
