//! Who drives: one at a time, the others watch.

/// What a client is told apart by.
pub type Id = u64;

/// The driver's seat.
#[derive(Debug, Default)]
pub struct Seat {
    driver: Option<Id>,
}

impl Seat {
    /// Takes the seat if it is free; whether it was.
    pub fn take(&mut self, client: Id) -> bool {
        let free = self.driver.is_none();
        if free {
            self.driver = Some(client);
        }
        free
    }

    /// Leaves the seat; whether it was this client's.
    pub fn leave(&mut self, client: Id) -> bool {
        let sat = self.is_of(client);
        if sat {
            self.driver = None;
        }
        sat
    }

    /// True if this client drives.
    pub fn is_of(&self, client: Id) -> bool {
        self.driver == Some(client)
    }

    /// As the page is told.
    pub fn state(&self) -> &'static str {
        if self.driver.is_some() {
            "taken"
        } else {
            "free"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Seat;

    #[test]
    fn one_drives_and_nobody_else_can_end_that() {
        let mut seat = Seat::default();
        assert_eq!(seat.state(), "free");
        assert!(seat.take(1));
        assert!(!seat.take(2));
        assert!(!seat.take(1), "twice by the same client");
        assert!(!seat.leave(2));
        assert!(seat.is_of(1) && !seat.is_of(2));
        assert_eq!(seat.state(), "taken");
        assert!(seat.leave(1));
        assert!(!seat.leave(1));
        assert!(seat.take(2));
    }
}
