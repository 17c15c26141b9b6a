//! Wishes to stop. Each is said until the base has answered it, or has agreed to a move that was said behind it: the last command counts.
//!
//! ```text
//!                said                 answered
//!   new ───────────────────▶ said ───────────────▶ over
//!    ▲   silence, or refused: │  ▲                   ▲
//!    └────────────────────────┘  │ a move behind it  │ … is agreed to
//!                                └───────────────────┘
//! ```
//! While a move is under way behind it, it is not said again: it would end that move.

/// One, or several for which the same lines speak.
#[derive(Clone, Debug)]
struct Wish {
    numbers: Vec<u64>,
    said: Option<Said>,
}

/// Lines are known by their number among all that were sent.
#[derive(Clone, Copy, Debug)]
struct Said {
    /// The first line that speaks for it, …
    first: u64,
    /// … the last, …
    last: u64,
    /// … and when that was sent.
    at: f64,
    /// That was damaged on its way, or its answer is overdue.
    failed: bool,
}

impl Said {
    /// Is a move under way behind it? `last_move`: the last of those that are.
    fn is_followed(&self, last_move: Option<u64>) -> bool {
        last_move > Some(self.last)
    }
}

/// All of them.
#[derive(Clone, Debug)]
pub struct Stops {
    wishes: Vec<Wish>,
    patience: f64,
}

impl Stops {
    /// None yet. Each is said again when no answer has come after `patience` s.
    pub fn new(patience: f64) -> Self {
        Self {
            wishes: Vec::new(),
            patience,
        }
    }

    /// Takes one. A Stop that is on its way says as much as a second, unless the base was told to move behind it.
    pub fn add(&mut self, number: u64, last_move: Option<u64>) {
        let joins = |wish: &&mut Wish| wish.said.is_none_or(|said| !said.is_followed(last_move));
        match self.wishes.iter_mut().find(joins) {
            Some(wish) => wish.numbers.push(number),
            None => self.wishes.push(Wish {
                numbers: vec![number],
                said: None,
            }),
        }
    }

    /// Nobody wants it to stop.
    pub fn is_empty(&self) -> bool {
        self.wishes.is_empty()
    }

    /// One that has not been said yet.
    pub fn has_new(&self) -> bool {
        self.wishes.iter().any(|wish| wish.said.is_none())
    }

    /// One that the base may not have heard. Nothing else should be said until that is clear.
    pub fn has_failed(&self) -> bool {
        let failed = |wish: &Wish| wish.said.is_some_and(|said| said.failed);
        self.wishes.iter().any(failed)
    }

    /// When one is to be said, if all stays as it is.
    pub fn due(&self, last_move: Option<u64>) -> Option<f64> {
        let dues = self.wishes.iter().filter_map(|wish| match wish.said {
            None => Some(f64::NEG_INFINITY),
            Some(said) if said.is_followed(last_move) => None,
            Some(said) if said.failed => Some(f64::NEG_INFINITY),
            Some(said) => Some(said.at + self.patience),
        });
        dues.reduce(f64::min)
    }

    /// A Stop is sent as this line: it speaks for all but those that a move is under way behind.
    pub fn say(&mut self, line: u64, now: f64, last_move: Option<u64>) {
        let wishes = std::mem::take(&mut self.wishes);
        let (rest, spoken): (Vec<_>, Vec<_>) = wishes
            .into_iter()
            .partition(|wish| wish.said.is_some_and(|said| said.is_followed(last_move)));
        let firsts = spoken
            .iter()
            .filter_map(|wish| Some(wish.said.as_ref()?.first));
        let said = Said {
            first: firsts.min().unwrap_or(line),
            last: line,
            at: now,
            failed: false,
        };
        self.wishes = rest;
        self.wishes.push(Wish {
            numbers: spoken.into_iter().flat_map(|wish| wish.numbers).collect(),
            said: Some(said),
        });
    }

    /// The base has answered the Stop of this line. Returns whose wishes that fulfils.
    pub fn answered(&mut self, line: u64) -> Vec<u64> {
        self.remove(|said| (said.first..=said.last).contains(&line))
    }

    /// The base has agreed to a move that was sent as this line. Returns whose wishes it has come after. Answers come in order: there will be none to theirs.
    pub fn overtaken(&mut self, line: u64) -> Vec<u64> {
        self.remove(|said| said.last < line)
    }

    /// The Stop of this line was damaged on its way, or is not answered in time.
    pub fn failed(&mut self, line: u64) {
        for said in self.wishes.iter_mut().filter_map(|wish| wish.said.as_mut()) {
            said.failed |= said.last == line;
        }
    }

    /// The line is lost. Returns whose wishes that ends.
    pub fn lost(&mut self) -> Vec<u64> {
        let wishes = std::mem::take(&mut self.wishes);
        wishes.into_iter().flat_map(|wish| wish.numbers).collect()
    }

    fn remove(&mut self, is_over: impl Fn(Said) -> bool) -> Vec<u64> {
        let (over, rest): (Vec<_>, Vec<_>) = std::mem::take(&mut self.wishes)
            .into_iter()
            .partition(|wish| wish.said.is_some_and(&is_over));
        self.wishes = rest;
        over.into_iter().flat_map(|wish| wish.numbers).collect()
    }
}
