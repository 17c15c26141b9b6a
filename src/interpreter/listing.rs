//! Lists: one line for each row, as there is room for it.

use super::text::Text;
use super::{Interpreter, path, reply};

/// A list under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Listing {
    /// ListParams; the next parameter.
    Params(usize),
    /// GetPath: the next posture's number, and the last one's.
    Path(u32, u32),
}

impl Interpreter {
    #[inline(never)]
    pub(super) fn list(&mut self, listing: Listing) {
        let mut text = Text::default();
        let next = match listing {
            Listing::Params(n) => self.params.ids().nth(n).map(|id| {
                reply::param_row(&mut text, &self.params, id);
                Listing::Params(n + 1)
            }),
            Listing::Path(number, last) => (number <= last).then(|| {
                path::row(&mut text, &self.pilot, number, last);
                Listing::Path(number.saturating_add(1), last)
            }),
        };
        if next.is_some() {
            self.send(&mut text);
        }
        self.listing = next;
    }
}
