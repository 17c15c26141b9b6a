//! The linked image: what is loaded where, which functions there are, and which bytes are code.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use object::{
    Endianness, Object, ObjectSection, ObjectSymbol, SectionFlags, SectionIndex, SymbolKind, elf,
};

/// A function symbol: where its code ends, and its name as one would write it.
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    pub name: String,
    pub end: u32,
}

/// A section that takes memory on the board.
pub struct Section {
    pub name: String,
    pub address: u32,
    pub size: u32,
    /// Whether it stands in flash, itself or as the initial value of what it holds in RAM.
    pub in_flash: bool,
    pub in_ram: bool,
}

/// A variable, constant or function with a size of its own.
pub struct Symbol {
    pub name: String,
    pub size: u32,
    pub section: String,
}

/// Bytes that are programmed, at the address where they are programmed.
pub struct Segment {
    pub physical: u32,
    address: u32,
    pub bytes: Vec<u8>,
}

pub struct Image {
    pub entry: u32,
    pub segments: Vec<Segment>,
    pub sections: Vec<Section>,
    pub symbols: Vec<Symbol>,
    /// By the address of their first instruction.
    pub functions: BTreeMap<u32, Function>,
    /// What the linker's script and the runtime define.
    addresses: BTreeMap<String, u32>,
    /// The stretches of instructions between the tables and constants.
    pub code: Vec<Range<u32>>,
    /// The file itself, for its debug information.
    pub file: Vec<u8>,
}

impl Image {
    pub fn read(path: &Path) -> Result<Self> {
        let file = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(file).with_context(|| path.display().to_string())
    }

    fn parse(file: Vec<u8>) -> Result<Self> {
        let elf = ElfFile32::<Endianness>::parse(&*file)?;
        ensure!(
            elf.elf_header().e_machine(elf.endian()) == elf::EM_ARM,
            "not an ELF file for ARM"
        );
        let segments = segments(&elf)?;
        let sections = sections(&elf, &segments)?;
        let code = code(&elf)?;
        let functions = functions(&elf)?;
        let mut symbols = Vec::new();
        let mut addresses = BTreeMap::new();
        for symbol in elf.symbols() {
            let (Ok(name), address) = (symbol.name(), address(symbol.address())?) else {
                continue;
            };
            if symbol.is_global() {
                addresses.insert(name.to_owned(), address);
            }
            let section = symbol
                .section_index()
                .and_then(|index| elf.section_by_index(index).ok())
                .and_then(|section| section.name().ok().map(str::to_owned));
            if let (Some(section), 1..) = (section, symbol.size()) {
                symbols.push(Symbol {
                    name: demangled(name),
                    size: address_size(symbol.size())?,
                    section,
                });
            }
        }
        let entry = address(elf.entry())? & !1;
        Ok(Self {
            entry,
            segments,
            sections,
            symbols,
            functions,
            addresses,
            code,
            file,
        })
    }

    /// The address of a global symbol.
    pub fn address_of(&self, symbol: &str) -> Option<u32> {
        self.addresses.get(symbol).copied()
    }

    /// Programmed bytes; none if any of them is not in the image or may change while the program runs.
    pub fn constant(&self, address: u32, length: u32) -> Option<&[u8]> {
        let segment = self
            .segments
            .iter()
            .filter(|segment| segment.address == segment.physical)
            .find(|segment| segment.contains(address))?;
        let start = (address - segment.address) as usize;
        segment.bytes.get(start..start + length as usize)
    }

    /// A constant word, such as one of a literal pool.
    pub fn word(&self, address: u32) -> Option<u32> {
        let bytes = self.constant(address, 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    }

    /// The start and the symbol of the function an address is in.
    pub fn function_at(&self, address: u32) -> Option<(u32, &Function)> {
        let (start, function) = self.functions.range(..=address).next_back()?;
        (address < function.end).then_some((*start, function))
    }

    /// A function's name, or the nearest thing to one.
    pub fn name(&self, address: u32) -> String {
        match self.function_at(address) {
            Some((start, function)) if start == address => function.name.clone(),
            Some((start, function)) => format!("{}+{:#x}", function.name, address - start),
            None => format!("{address:#010x}"),
        }
    }

    /// Where the handlers of the vector table stand, by exception number from 2: number 1 is the reset.
    pub fn handlers(&self) -> Result<BTreeMap<u32, Vec<u32>>> {
        let table = self
            .sections
            .iter()
            .find(|section| section.name == ".vector_table")
            .context("no section .vector_table")?;
        let mut handlers: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for number in 2..table.size / 4 {
            let vector = self
                .word(table.address + 4 * number)
                .context("the vector table is cut short")?;
            if vector != 0 {
                ensure!(vector & 1 == 1, "vector {number} is not Thumb code");
                handlers.entry(vector & !1).or_default().push(number);
            }
        }
        Ok(handlers)
    }
}

impl Segment {
    fn contains(&self, address: u32) -> bool {
        address >= self.address && ((address - self.address) as usize) < self.bytes.len()
    }
}

/// A symbol's name without the hash.
fn demangled(name: &str) -> String {
    format!("{:#}", rustc_demangle::demangle(name))
}

fn address(address: u64) -> Result<u32> {
    u32::try_from(address).context("an address beyond 32 bits")
}

fn address_size(size: u64) -> Result<u32> {
    u32::try_from(size).context("a size beyond 32 bits")
}

fn segments(elf: &ElfFile32<Endianness>) -> Result<Vec<Segment>> {
    let endian = elf.endian();
    let mut segments = Vec::new();
    for header in elf.elf_program_headers() {
        if header.p_type(endian) != PT_LOAD || header.p_filesz(endian) == 0 {
            continue;
        }
        let Ok(bytes) = header.data(endian, elf.data()) else {
            bail!("a segment lies outside the file");
        };
        segments.push(Segment {
            physical: header.p_paddr(endian),
            address: header.p_vaddr(endian),
            bytes: bytes.to_vec(),
        });
    }
    segments.sort_by_key(|segment| segment.physical);
    ensure!(!segments.is_empty(), "nothing to program");
    Ok(segments)
}

fn sections(elf: &ElfFile32<Endianness>, segments: &[Segment]) -> Result<Vec<Section>> {
    let mut sections = Vec::new();
    for section in elf.sections() {
        if !has(&section, elf::SHF_ALLOC) || section.size() == 0 {
            continue;
        }
        let address = address(section.address())?;
        sections.push(Section {
            name: section.name()?.to_owned(),
            address,
            size: address_size(section.size())?,
            in_flash: segments.iter().any(|segment| segment.contains(address)),
            in_ram: has(&section, elf::SHF_WRITE),
        });
    }
    Ok(sections)
}

/// Whether a section has instructions in it.
fn is_code(elf: &ElfFile32<Endianness>, index: SectionIndex) -> bool {
    elf.section_by_index(index)
        .is_ok_and(|section| has(&section, elf::SHF_EXECINSTR))
}

fn has<'data>(section: &impl ObjectSection<'data>, flag: elf::SectionFlags) -> bool {
    matches!(section.flags(), SectionFlags::Elf { sh_flags, .. } if sh_flags.contains(flag))
}

/// The ABI's mapping symbols tell code (`$t`) from data (`$d`).
fn code(elf: &ElfFile32<Endianness>) -> Result<Vec<Range<u32>>> {
    let mut marks = BTreeMap::new();
    for symbol in elf.symbols() {
        let in_code = symbol
            .section_index()
            .is_some_and(|index| is_code(elf, index));
        let Some((name, at)) = symbol.name().ok().zip(in_code.then(|| symbol.address())) else {
            continue;
        };
        let kind = name.split('.').next().unwrap_or_default();
        match kind {
            // Where code and data start at the same address, the data is of length zero.
            "$t" => _ = marks.insert(address(at)?, true),
            "$d" => _ = marks.entry(address(at)?).or_insert(false),
            "$a" => bail!("ARM instructions at {at:#x}; the processor knows only Thumb"),
            _ => {}
        }
    }
    for section in elf
        .sections()
        .filter(|section| is_code(elf, section.index()))
    {
        let end = address(section.address() + section.size())?;
        marks.entry(end).or_insert(false);
    }
    ensure!(
        marks.values().any(|&code| code),
        "no mapping symbols: the image is stripped"
    );
    let starts: Vec<_> = marks.into_iter().collect();
    let stretches = starts.windows(2).filter(|pair| pair[0].1);
    Ok(stretches.map(|pair| pair[0].0..pair[1].0).collect())
}

fn functions(elf: &ElfFile32<Endianness>) -> Result<BTreeMap<u32, Function>> {
    let mut functions: BTreeMap<u32, Function> = BTreeMap::new();
    let mut limits = Vec::new();
    for symbol in elf.symbols() {
        let index = symbol.section_index().filter(|&index| is_code(elf, index));
        let Some(section) = index.and_then(|index| elf.section_by_index(index).ok()) else {
            continue;
        };
        if symbol.kind() != SymbolKind::Text {
            continue;
        }
        let start = address(symbol.address())? & !1;
        let end = start + address_size(symbol.size())?;
        limits.push(address(section.address() + section.size())?);
        let function = Function {
            name: demangled(symbol.name()?),
            end,
        };
        // Of several names for one place, such as every unused interrupt's, the one with a size is the real one.
        let known = functions.entry(start).or_insert_with(|| function.clone());
        if end > known.end {
            *known = function;
        }
    }
    // Functions in assembler often lack a size: they end where something else begins.
    let starts: Vec<_> = functions.keys().copied().collect();
    for (start, function) in &mut functions {
        if function.end == *start {
            let next = starts.iter().copied().find(|next| next > start);
            let limit = limits.iter().copied().filter(|limit| limit > start).min();
            function.end = next.into_iter().chain(limit).min().unwrap_or(*start);
        }
    }
    Ok(functions)
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// An image of nothing but these bytes at these addresses.
    pub fn image_of(segments: &[(u32, &[u8])]) -> Image {
        let segment = |&(at, bytes): &(u32, &[u8])| Segment {
            physical: at,
            address: at,
            bytes: bytes.to_vec(),
        };
        Image {
            entry: 0x0800_0000,
            segments: segments.iter().map(segment).collect(),
            sections: Vec::new(),
            symbols: Vec::new(),
            functions: BTreeMap::new(),
            addresses: BTreeMap::new(),
            code: Vec::new(),
            file: Vec::new(),
        }
    }

    #[test]
    fn words_are_little_endian_and_whole() {
        let image = image_of(&[(0x0800_0000, &[1, 2, 3, 4, 5])]);
        assert_eq!(image.word(0x0800_0000), Some(0x0403_0201));
        assert_eq!(image.word(0x0800_0002), None);
        assert_eq!(image.word(0x2000_0000), None);
    }
}
