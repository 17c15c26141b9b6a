//! From a stored set to one that can be used: a firmware with other parameters, or other ranges, may have stored it.

use super::{Id, ORDERED, Params};

/// What of a stored set could not be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Fallbacks {
    /// A bit for each parameter that has its default instead of the stored value.
    defaults: [u32; Id::COUNT.div_ceil(32)],
    /// How many entries this firmware knows nothing of.
    unknown: u16,
}

/// Something of a stored set that could not be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fallback {
    /// The stored value is out of range or at odds with another parameter.
    Default(Id),
    /// So many entries belong to no parameter.
    Unknown(u16),
}

impl Fallbacks {
    fn note(&mut self, id: Id) {
        if let Some(bits) = self.defaults.get_mut(id as usize >> 5) {
            *bits |= 1 << (id as usize & 31);
        }
    }

    /// Takes one out.
    pub fn take(&mut self) -> Option<Fallback> {
        for id in Id::ALL {
            if let Some(bits) = self.defaults.get_mut(id as usize >> 5)
                && *bits & 1 << (id as usize & 31) != 0
            {
                *bits &= !(1 << (id as usize & 31));
                return Some(Fallback::Default(id));
            }
        }
        let unknown = core::mem::take(&mut self.unknown);
        (unknown > 0).then_some(Fallback::Unknown(unknown))
    }
}

/// A set as it was stored, as far as that can be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restored {
    /// The set.
    pub params: Params,
    /// What is not as it was stored.
    pub fallbacks: Fallbacks,
    /// Something was stored, and cannot be read any more: this is an older set, or the defaults.
    pub lost: bool,
}

impl Restored {
    /// The defaults.
    pub(super) fn new(defaults: &Params) -> Self {
        Self {
            params: *defaults,
            fallbacks: Fallbacks::default(),
            lost: false,
        }
    }

    /// Takes an entry over; the defaults are there already.
    pub(super) fn take(&mut self, key: u32, value: f32) {
        let Some(id) = self.params.ids().find(|id| id.key() == key) else {
            self.fallbacks.unknown = self.fallbacks.unknown.saturating_add(1);
            return;
        };
        if id.allows(value) {
            self.params.put(id, value);
        } else {
            self.fallbacks.note(id);
        }
    }

    /// Lowers what exceeds a parameter that it must not exceed: to the default, or to that other parameter if the default exceeds it too. A limit is never
    /// widened.
    pub(super) fn resolve(&mut self, defaults: &Params) {
        // Lowering one may put another at odds with it, at most along the whole chain.
        for _ in ORDERED {
            for (small, large) in ORDERED {
                let limit = self.params.get(large);
                if self.params.get(small) > limit {
                    self.params.put(small, defaults.get(small).min(limit));
                    self.fallbacks.note(small);
                }
            }
        }
    }
}
