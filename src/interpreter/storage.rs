//! SaveParams and LoadParams: what takes longer than one poll. The lines behind them wait, but for what stops the base.

use super::{Address, Desk, Error, Identity, Interpreter};
use crate::params::store::{Flash, Store};
use crate::params::{Blueprint, Fallbacks, Params, Restored};

/// How far it has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// Not begun.
    Save,
    /// Under way.
    Saving,
    /// Not begun.
    Load,
    /// To be answered.
    Done(Result<(), Error>),
}

/// An errand to the store, and whom to answer.
#[derive(Clone, Copy, Debug)]
pub struct Errand {
    pub stage: Stage,
    pub address: Address,
    pub check: bool,
}

/// What the interpreter knows of the storage.
#[derive(Clone, Debug, Default)]
pub struct Storage {
    /// There is one.
    pub is_there: bool,
    /// The answer to a line waits for this.
    pub errand: Option<Errand>,
    /// What of the stored parameters is still to be told.
    pub fallbacks: Fallbacks,
}

impl Interpreter {
    /// An interpreter for a base that keeps its parameters: it begins with what was `found` there, and ResetParams returns to the `defaults`. Call
    /// [`attend`](Self::attend) as often as [`poll`](Self::poll).
    #[must_use]
    pub fn with_storage(identity: Identity, defaults: &Params, found: &Restored) -> Self {
        let storage = Storage {
            is_there: true,
            errand: None,
            fallbacks: found.fallbacks,
        };
        Self::begin(identity, defaults, &found.params, storage)
    }

    /// Does a step of what was asked of the store.
    pub fn attend<F: Flash, C: Blueprint>(&mut self, store: &mut Store<F>, desk: &mut Desk<C>) {
        let Some(errand) = &mut self.storage.errand else {
            return;
        };
        let result = match errand.stage {
            Stage::Save => {
                store.start_save();
                errand.stage = Stage::Saving;
                return;
            }
            Stage::Saving => match store.poll(&self.params) {
                Some(result) => result.map_err(Error::Store),
                None => return,
            },
            // An emergency stop may be on its way.
            Stage::Load if desk.is_idle() => self.load(store, desk),
            Stage::Load | Stage::Done(_) => return,
        };
        if let Some(errand) = &mut self.storage.errand {
            errand.stage = Stage::Done(result);
        }
    }

    #[inline(never)]
    fn load<F: Flash, C: Blueprint>(
        &mut self,
        store: &mut Store<F>,
        desk: &mut Desk<C>,
    ) -> Result<(), Error> {
        let restored = store.load(&self.defaults).map_err(Error::Store)?;
        self.take_params(desk, &restored.params, true)?;
        self.storage.fallbacks = restored.fallbacks;
        Ok(())
    }

    /// Goes to the store; it is answered when the errand is done.
    pub(super) fn send_to_store<C: Blueprint>(
        &mut self,
        stage: Stage,
        desk: &Desk<C>,
    ) -> Result<(), Error> {
        if desk.snapshot().is_moving() {
            return Err(Error::Moving);
        }
        if !self.storage.is_there {
            return Err(Error::Storage);
        }
        self.storage.errand = Some(Errand {
            stage,
            address: Address::default(),
            check: false,
        });
        Ok(())
    }
}
