//! A mailbox for one message between two priorities: neither side ever waits for the other.
//!
//! `heapless::spsc` would do, but it divides by a length that the linker cannot see to be a constant, and the division's check is a panic.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};

/// Room for one message.
pub struct Mailbox<T> {
    full: AtomicBool,
    message: UnsafeCell<MaybeUninit<T>>,
}

/// Puts messages in.
pub struct Sender<'a, T>(&'a Mailbox<T>);

/// Takes messages out.
pub struct Receiver<'a, T>(&'a Mailbox<T>);

// SAFETY: the message is touched by the sender while `full` is false and by the receiver while it is true, and there is one of each.
unsafe impl<T: Send> Send for Sender<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Send for Receiver<'_, T> {}

impl<T: Copy> Mailbox<T> {
    /// An empty one.
    pub const fn new() -> Self {
        Self {
            full: AtomicBool::new(false),
            message: UnsafeCell::new(MaybeUninit::uninit()),
        }
    }

    /// Its two ends; what the sender finds in it at first is `initial`.
    pub fn split(&mut self, initial: T) -> (Sender<'_, T>, Receiver<'_, T>) {
        self.message.get_mut().write(initial);
        (Sender(self), Receiver(self))
    }
}

impl<T: Copy> Sender<'_, T> {
    /// If the last message has been taken out, lets `write` make a new one of it, in place, and sends that if it says so.
    pub fn send_with(&mut self, write: impl FnOnce(&mut T) -> bool) {
        if self.0.full.load(Ordering::Acquire) {
            return;
        }
        // SAFETY: `full` is false and this is the only sender: nobody else looks. `split` has written a first message.
        let message = unsafe { (*self.0.message.get()).assume_init_mut() };
        if write(message) {
            self.0.full.store(true, Ordering::Release);
        }
    }
}

impl<T: Copy> Receiver<'_, T> {
    /// Takes the message out.
    pub fn take(&mut self) -> Option<T> {
        if !self.0.full.load(Ordering::Acquire) {
            return None;
        }
        // SAFETY: `full` is true and this is the only receiver: nobody writes. `split` has written a first message.
        let message = unsafe { (*self.0.message.get()).assume_init() };
        self.0.full.store(false, Ordering::Release);
        Some(message)
    }
}
