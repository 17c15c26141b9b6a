//! `cargo firmware`: builds the image and writes it in the forms that flashing tools take.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use ihex::Record;

use super::elf::Image;
use super::toolchain::{TARGET, Toolchain};
use super::vehicle::Vehicle;
use crate::run::{Outcome, Session};

/// The linked program in cargo's folder, whatever its vehicle.
const PROGRAM: &str = "vehicle-controller";

/// Where the processor finds its vector table after a reset.
const FLASH: u32 = 0x0800_0000;
const ERASED: u8 = 0xff;

/// Compiles the firmware of the repository in `root`; the ELF file as the linker left it.
pub fn compile(session: &Session, vehicle: Vehicle, root: &Path) -> Result<PathBuf> {
    let toolchain = Toolchain::get(session)?;
    let mut cargo = toolchain.cargo(session, "build", &vehicle.package());
    let target = target_folder(session);
    cargo
        .args(["--profile", "firmware", "--target-dir"])
        .arg(&target)
        .current_dir(root);
    match session.run(&mut cargo)? {
        Outcome::Passed => Ok(target.join(TARGET).join("firmware").join(PROGRAM)),
        Outcome::Failed(why) | Outcome::Skipped(why) => bail!("the firmware does not build: {why}"),
    }
}

/// Compiles and writes the image, `target/firmware/vehicle-controller.{elf,bin,hex}` for the differential drive; the ELF file among them.
pub fn firmware(session: &Session, vehicle: Vehicle) -> Result<PathBuf> {
    let linked = compile(session, vehicle, &session.root)?;
    let image = Image::read(&linked)?;
    let folder = target_folder(session).join("firmware");
    fs::create_dir_all(&folder)?;
    let name = vehicle.file();
    let path = |extension: &str| folder.join(&name).with_extension(extension);
    write(&path("elf"), &image.file)?;
    write(&path("bin"), &binary(&image)?)?;
    write(&path("hex"), hex(&image)?.as_bytes())?;
    println!("wrote {}.{{elf,bin,hex}}", folder.join(&name).display());
    Ok(path("elf"))
}

/// The given image, or the one that this repository builds for a vehicle.
pub fn given_or_built(
    session: &Session,
    elf: Option<PathBuf>,
    vehicle: Vehicle,
) -> Result<PathBuf> {
    elf.map_or_else(|| firmware(session, vehicle), Ok)
}

/// Said to cargo, too: its own settings may name another.
pub fn target_folder(session: &Session) -> PathBuf {
    let folder = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    session.root.join(folder)
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// The contents of the flash from its start; gaps read as erased.
fn binary(image: &Image) -> Result<Vec<u8>> {
    let mut binary = Vec::new();
    for segment in &image.segments {
        let start = segment.physical.checked_sub(FLASH).map(|at| at as usize);
        let start = start
            .filter(|&start| start >= binary.len())
            .with_context(|| {
                format!(
                    "a segment at {:#x} overlaps or lies below the flash",
                    segment.physical
                )
            })?;
        ensure!(
            start < 0x0020_0000,
            "a segment at {:#x} lies beyond the flash",
            segment.physical
        );
        ensure!(
            start == 0 || !binary.is_empty(),
            "nothing at {FLASH:#x}: no vector table"
        );
        binary.resize(start, ERASED);
        binary.extend_from_slice(&segment.bytes);
    }
    Ok(binary)
}

/// Intel HEX: records of 16 bytes, none across a boundary of 64 KiB.
fn hex(image: &Image) -> Result<String> {
    let mut records = Vec::new();
    let mut upper = None;
    for segment in &image.segments {
        let mut at = segment.physical;
        let mut rest = &segment.bytes[..];
        while !rest.is_empty() {
            let (high, low) = ((at >> 16) as u16, at as u16);
            if upper != Some(high) {
                records.push(Record::ExtendedLinearAddress(high));
                upper = Some(high);
            }
            let (value, after) = rest.split_at(rest.len().min(16 - usize::from(low % 16)));
            records.push(Record::Data {
                offset: low,
                value: value.to_vec(),
            });
            at += value.len() as u32;
            rest = after;
        }
    }
    records.push(Record::StartLinearAddress(image.entry | 1));
    records.push(Record::EndOfFile);
    Ok(ihex::create_object_file_representation(&records)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::elf::tests::image_of;

    #[test]
    fn gaps_read_as_erased() {
        let image = image_of(&[(0x0800_0000, &[1, 2]), (0x0800_0004, &[3])]);
        assert_eq!(binary(&image).unwrap(), [1, 2, 0xff, 0xff, 3]);
    }

    #[test]
    fn an_image_starts_with_the_flash() {
        for at in [0x0800_0004, 0x2000_0000, 0x0000_0000] {
            assert!(binary(&image_of(&[(at, &[1])])).is_err());
        }
        assert!(binary(&image_of(&[(0x0800_0000, &[1, 2]), (0x0800_0001, &[3])])).is_err());
    }

    #[test]
    fn hex_records_break_at_64_kib() {
        let image = image_of(&[(0x0800_fff8, &[7; 12])]);
        let expected = ":020000040800F2\n:08FFF8000707070707070707C9\n:020000040801F1\n:0400000007070707E0\n\
                        :0400000508000001EE\n:00000001FF\n";
        assert_eq!(hex(&image).unwrap(), expected);
    }
}
