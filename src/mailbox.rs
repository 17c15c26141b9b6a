//! A mailbox for one message between two priorities of one core: neither side ever waits for the other.
//!
//! `heapless::spsc` would do for requests, but it divides by a length that the linker cannot see to be a constant, and the division's check is a panic.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};

/// Room for one message.
pub struct Mailbox<T> {
    full: AtomicBool,
    /// The receiver copies the message.
    reading: AtomicBool,
    message: UnsafeCell<MaybeUninit<T>>,
}

/// Puts messages in.
pub struct Sender<'a, T>(&'a Mailbox<T>);

/// Takes messages out.
pub struct Receiver<'a, T>(&'a Mailbox<T>);

// SAFETY: there is one of each, and who may touch the message is told at each place that does.
unsafe impl<T: Send> Send for Sender<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Send for Receiver<'_, T> {}

impl<T: Copy> Mailbox<T> {
    /// An empty one.
    pub const fn new() -> Self {
        Self {
            full: AtomicBool::new(false),
            reading: AtomicBool::new(false),
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

    /// Lets `write` make a new message of the last one, in place, whether that has been taken out or not: what is taken is the newest. While the receiver
    /// copies a message nothing is sent.
    ///
    /// # Safety
    /// The receiver must not run before this returns: it lives at a lower priority of the same core.
    pub unsafe fn replace_with(&mut self, write: impl FnOnce(&mut T)) {
        if self.0.reading.load(Ordering::Acquire) {
            return;
        }
        // SAFETY: the receiver does not read, and cannot begin to. `split` has written a first message.
        write(unsafe { (*self.0.message.get()).assume_init_mut() });
        self.0.full.store(true, Ordering::Release);
    }
}

impl<T: Copy> Receiver<'_, T> {
    /// Takes the message out.
    pub fn take(&mut self) -> Option<T> {
        self.take_with(|message| *message)
    }

    /// Reads the message where it lies, and takes it out.
    pub fn take_with<R>(&mut self, read: impl FnOnce(&T) -> R) -> Option<R> {
        if !self.0.full.load(Ordering::Acquire) {
            return None;
        }
        self.0.reading.swap(true, Ordering::AcqRel);
        // SAFETY: `full` is true, so `send_with` does not write; `reading` is true, so `replace_with` does not. `split` has written a first message.
        let result = read(unsafe { (*self.0.message.get()).assume_init_ref() });
        self.0.full.store(false, Ordering::Release);
        self.0.reading.store(false, Ordering::Release);
        Some(result)
    }
}
