//! Jump tables behind `tbb` and `tbh`: where a `match` goes.

use std::ops::Range;

use super::decode::Code;
use super::elf::Image;

/// The targets of a table at `start`, whose entries count from `origin`, all of them instructions of the same function; none if it makes no sense as one.
///
/// A table says nowhere how long it is. It ends at the latest where code begins, where its own first target lies, or
/// where the function keeps a constant.
pub fn targets(
    image: &Image,
    code: &Code,
    range: &Range<u32>,
    start: u32,
    origin: u32,
    halfwords: bool,
) -> Option<Vec<u32>> {
    let size = if halfwords { 2 } else { 1 };
    let constants = code
        .range(range.clone())
        .filter_map(|(_, instruction)| instruction.literal);
    let next = code.range(start..).next().map(|(&address, _)| address);
    let mut end = constants
        .chain(next)
        .chain([range.end])
        .filter(|&limit| limit >= start)
        .min()?;
    let mut targets = Vec::new();
    let mut at = start;
    while at + size <= end {
        let entry = image
            .constant(at, size)?
            .iter()
            .rev()
            .fold(0, |entry, &byte| entry << 8 | u32::from(byte));
        let target = origin + 2 * entry;
        // Nobody jumps to what may lie between the jump and its table.
        if target <= start || !range.contains(&target) || !code.contains_key(&target) {
            // Up to three bytes fill the room before an aligned constant or instruction.
            if targets.is_empty() || end - at > 3 {
                return None;
            }
            break;
        }
        end = end.min(target);
        targets.push(target);
        at += size;
    }
    (!targets.is_empty()).then_some(targets)
}
