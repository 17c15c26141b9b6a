//! The image's debug information (DWARF): which statics there are, and how their types lie in memory.
//!
//! The compiler lays a Rust type out as it likes; where a member is, only the debug information of the very image says.

use anyhow::{Context, Result, anyhow};
use gimli::{AttributeValue, EndianSlice, EntriesTreeNode, LittleEndian, Operation, Unit};
use object::{Object, ObjectSection};
use std::collections::HashMap;

type Reader<'a> = EndianSlice<'a, LittleEndian>;
type Dwarf<'a> = gimli::Dwarf<Reader<'a>>;

/// Names a type: the place of its entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct TypeId(usize);

/// A type.
#[derive(Clone, Debug)]
pub(super) struct Type {
    /// With the modules that it is in.
    pub path: String,
    /// In bytes, if its entry says so.
    pub size: u64,
    /// What it is made of.
    pub shape: Shape,
}

/// What a type is made of.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// A number.
    Number(gimli::DwAte),
    /// A structure, a union, or an enum with data.
    Members {
        /// Its members.
        members: Vec<Member>,
        /// Its variants, if it is an enum.
        variants: Option<Variants>,
    },
    /// An enum without data.
    Names(Vec<(i64, String)>),
    /// An array of these.
    Array(TypeId, u64),
}

/// A member of a type.
#[derive(Clone, Debug)]
pub(super) struct Member {
    /// What it is called.
    pub name: String,
    /// Where it begins.
    pub offset: u64,
    /// What it is.
    pub id: TypeId,
}

/// The variants of an enum with data.
#[derive(Clone, Debug)]
pub(super) struct Variants {
    /// What tells them apart.
    pub tag: Member,
    /// The tag's value, if it has one of its own, and the variant as a member.
    pub variants: Vec<(Option<i64>, Member)>,
}

/// A static.
#[derive(Clone, Debug)]
pub(super) struct Static {
    /// What it is called.
    pub name: String,
    /// Where it is.
    pub address: u64,
    /// What it is.
    pub id: TypeId,
}

/// The types and statics of an image.
#[derive(Debug, Default)]
pub(super) struct DebugInfo {
    types: HashMap<TypeId, Type>,
    statics: Vec<Static>,
}

impl DebugInfo {
    /// Reads the debug information out of an ELF file.
    pub(super) fn load(elf: &[u8]) -> Result<Self> {
        let file = object::File::parse(elf).context("the image is not an ELF file")?;
        let section = |id: gimli::SectionId| -> Result<Reader<'_>> {
            let data = file
                .section_by_name(id.name())
                .map(|section| section.data());
            Ok(Reader::new(
                data.transpose()?.unwrap_or_default(),
                LittleEndian,
            ))
        };
        let dwarf = Dwarf::load(section)?;
        let mut info = Self::default();
        let mut headers = dwarf.units();
        while let Some(header) = headers.next()? {
            let unit = dwarf.unit(header)?;
            let mut tree = unit.entries_tree(None)?;
            let mut visitor = Visitor {
                dwarf: &dwarf,
                unit: &unit,
                info: &mut info,
                modules: Vec::new(),
            };
            visitor.visit(tree.root()?)?;
        }
        Ok(info)
    }

    /// A type; an error if the debug information leaves it out.
    pub(super) fn get(&self, id: TypeId) -> Result<&Type> {
        self.types
            .get(&id)
            .ok_or_else(|| anyhow!("the image's debug information leaves out a type"))
    }

    /// How long a value of a type is, in bytes; an array's entry does not say.
    pub(super) fn size(&self, id: TypeId) -> Result<u64> {
        let found = self.get(id)?;
        match found.shape {
            Shape::Array(element, count) => Ok(count * self.size(element)?),
            _ => Ok(found.size),
        }
    }

    /// The statics.
    pub(super) fn statics(&self) -> &[Static] {
        &self.statics
    }
}

struct Visitor<'a, 'd> {
    dwarf: &'d Dwarf<'a>,
    unit: &'d Unit<Reader<'a>>,
    info: &'d mut DebugInfo,
    modules: Vec<String>,
}

type Node<'abbrev, 'unit, 'tree, 'a> = EntriesTreeNode<'abbrev, 'unit, 'tree, Reader<'a>>;
type Entry<'abbrev, 'unit, 'a> = gimli::DebuggingInformationEntry<'abbrev, 'unit, Reader<'a>>;

impl<'a> Visitor<'a, '_> {
    fn visit(&mut self, node: Node<'_, '_, '_, 'a>) -> Result<()> {
        let entry = node.entry();
        let (tag, id) = (entry.tag(), self.id_of(entry.offset()));
        if tag == gimli::DW_TAG_variable {
            self.note_static(entry)?;
            return Ok(());
        }
        let name = self.name(entry)?;
        let size = number(entry, gimli::DW_AT_byte_size)?.unwrap_or(0) as u64;
        let encoding = entry.attr_value(gimli::DW_AT_encoding)?;
        let element = self.type_of(entry)?;
        let is_module = tag == gimli::DW_TAG_namespace || is_type(tag);
        let path = [self.modules.as_slice(), std::slice::from_ref(&name)]
            .concat()
            .join("::");
        if is_module {
            self.modules.push(name);
        }
        let mut parts = Parts::default();
        let mut children = node.children();
        while let Some(child) = children.next()? {
            match child.entry().tag() {
                gimli::DW_TAG_member => parts.members.extend(self.member(child.entry())?),
                gimli::DW_TAG_variant_part => parts.variants = self.variants(child)?,
                gimli::DW_TAG_enumerator => {
                    let value = number(child.entry(), gimli::DW_AT_const_value)?.unwrap_or(0);
                    parts.names.push((value, self.name(child.entry())?));
                }
                gimli::DW_TAG_subrange_type => {
                    parts.count = number(child.entry(), gimli::DW_AT_count)?.unwrap_or(0) as u64;
                }
                _ => self.visit(child)?,
            }
        }
        if is_module {
            self.modules.pop();
        }
        let shape = match (tag, encoding) {
            (gimli::DW_TAG_base_type, Some(AttributeValue::Encoding(encoding))) => {
                Shape::Number(encoding)
            }
            (gimli::DW_TAG_structure_type | gimli::DW_TAG_union_type, _) => Shape::Members {
                members: parts.members,
                variants: parts.variants,
            },
            (gimli::DW_TAG_enumeration_type, _) => Shape::Names(parts.names),
            (gimli::DW_TAG_array_type, _) => match element {
                Some(element) => Shape::Array(element, parts.count),
                None => return Ok(()),
            },
            _ => return Ok(()),
        };
        let found = Type { path, size, shape };
        self.info.types.insert(id, found);
        Ok(())
    }

    fn id_of(&self, offset: gimli::UnitOffset) -> TypeId {
        let section = offset.to_debug_info_offset(&self.unit.header);
        TypeId(section.map_or(offset.0, |section| section.0))
    }

    fn name(&self, entry: &Entry<'_, '_, 'a>) -> Result<String> {
        let Some(value) = entry.attr_value(gimli::DW_AT_name)? else {
            return Ok(String::new());
        };
        Ok(self
            .dwarf
            .attr_string(self.unit, value)?
            .to_string_lossy()
            .into_owned())
    }

    fn type_of(&self, entry: &Entry<'_, '_, 'a>) -> Result<Option<TypeId>> {
        Ok(match entry.attr_value(gimli::DW_AT_type)? {
            Some(AttributeValue::UnitRef(offset)) => Some(self.id_of(offset)),
            Some(AttributeValue::DebugInfoRef(offset)) => Some(TypeId(offset.0)),
            _ => None,
        })
    }

    fn member(&self, entry: &Entry<'_, '_, 'a>) -> Result<Option<Member>> {
        let Some(id) = self.type_of(entry)? else {
            return Ok(None);
        };
        let offset = number(entry, gimli::DW_AT_data_member_location)?.unwrap_or(0) as u64;
        let name = self.name(entry)?;
        Ok(Some(Member { name, offset, id }))
    }

    fn variants(&self, part: Node<'_, '_, '_, 'a>) -> Result<Option<Variants>> {
        let Some(AttributeValue::UnitRef(discriminant)) =
            part.entry().attr_value(gimli::DW_AT_discr)?
        else {
            // An enum of one variant has nothing to tell apart.
            return Ok(None);
        };
        let (mut tag, mut variants) = (None, Vec::new());
        let mut children = part.children();
        while let Some(child) = children.next()? {
            let entry = child.entry();
            if entry.offset() == discriminant {
                tag = self.member(entry)?;
            } else if entry.tag() == gimli::DW_TAG_variant {
                let value = number(entry, gimli::DW_AT_discr_value)?;
                let mut members = child.children();
                while let Some(member) = members.next()? {
                    if let Some(member) = self.member(member.entry())? {
                        variants.push((value, member));
                    }
                }
            }
        }
        Ok(tag.map(|tag| Variants { tag, variants }))
    }

    fn note_static(&mut self, entry: &Entry<'_, '_, 'a>) -> Result<()> {
        let Some(AttributeValue::Exprloc(expression)) = entry.attr_value(gimli::DW_AT_location)?
        else {
            return Ok(());
        };
        let mut operations = expression.operations(self.unit.encoding());
        let (Some(Operation::Address { address }), Some(id)) =
            (operations.next()?, self.type_of(entry)?)
        else {
            return Ok(());
        };
        if operations.next()?.is_none() {
            let name = self.name(entry)?;
            self.info.statics.push(Static { name, address, id });
        }
        Ok(())
    }
}

#[derive(Default)]
struct Parts {
    members: Vec<Member>,
    variants: Option<Variants>,
    names: Vec<(i64, String)>,
    count: u64,
}

fn is_type(tag: gimli::DwTag) -> bool {
    matches!(
        tag,
        gimli::DW_TAG_structure_type | gimli::DW_TAG_union_type | gimli::DW_TAG_enumeration_type
    )
}

fn number(entry: &Entry<'_, '_, '_>, attribute: gimli::DwAt) -> Result<Option<i64>> {
    let value = entry.attr_value(attribute)?;
    Ok(value.and_then(|value| match value {
        AttributeValue::Data1(value) => Some(value.into()),
        AttributeValue::Data2(value) => Some(value.into()),
        AttributeValue::Data4(value) => Some(value.into()),
        AttributeValue::Data8(value) | AttributeValue::Udata(value) => Some(value as i64),
        AttributeValue::Sdata(value) => Some(value),
        _ => None,
    }))
}
