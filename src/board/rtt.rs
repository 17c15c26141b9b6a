//! The log: defmt frames into a ring in RAM that a debug probe reads (SEGGER RTT).
//!
//! Writing neither waits nor enters a critical section, so that a message in idle cannot delay the tick, and it cannot panic. A frame that comes while
//! another is being written (a fault in the middle of a message), or for which there is no room, is dropped whole.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

const SIZE: usize = 1024;

/// The header by which a probe finds the ring: the layout is SEGGER's.
#[repr(C)]
struct ControlBlock {
    id: [u8; 16],
    up_channels: u32,
    down_channels: u32,
    name: *const u8,
    buffer: *const UnsafeCell<[u8; SIZE]>,
    size: u32,
    write: AtomicU32,
    read: AtomicU32,
    flags: AtomicU32,
}

// SAFETY: the pointers are constants, to statics.
unsafe impl Sync for ControlBlock {}

struct Buffer(UnsafeCell<[u8; SIZE]>);

// SAFETY: only the holder of `BUSY` writes, and nobody on this side reads.
unsafe impl Sync for Buffer {}

static BUFFER: Buffer = Buffer(UnsafeCell::new([0; SIZE]));

#[unsafe(no_mangle)]
static _SEGGER_RTT: ControlBlock = ControlBlock {
    id: *b"SEGGER RTT\0\0\0\0\0\0",
    up_channels: 1,
    down_channels: 0,
    name: c"defmt".as_ptr().cast(),
    buffer: &raw const BUFFER.0,
    size: SIZE as u32,
    write: AtomicU32::new(0),
    read: AtomicU32::new(0),
    // Skip what does not fit.
    flags: AtomicU32::new(0),
};

struct Frame {
    encoder: defmt::Encoder,
    /// Where the next byte goes; the probe is told when the frame is complete.
    cursor: u32,
    complete: bool,
}

struct Writer(UnsafeCell<Frame>);

// SAFETY: only the holder of `BUSY` touches it.
unsafe impl Sync for Writer {}

static WRITER: Writer = Writer(UnsafeCell::new(Frame {
    encoder: defmt::Encoder::new(),
    cursor: 0,
    complete: true,
}));

/// Somebody writes a frame.
static BUSY: AtomicBool = AtomicBool::new(false);
/// Somebody tried meanwhile: so many calls of `release` belong to frames that are dropped.
static NESTED: AtomicU32 = AtomicU32::new(0);

#[defmt::global_logger]
struct Logger;

// SAFETY: `BUSY` is taken by one frame at a time; a nested one runs to its end before the outer one goes on, so counting it is enough.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        if BUSY.swap(true, Ordering::Acquire) {
            NESTED.fetch_add(1, Ordering::Relaxed);
            return;
        }
        // SAFETY: `BUSY` is ours.
        let frame = unsafe { &mut *WRITER.0.get() };
        frame.cursor = _SEGGER_RTT.write.load(Ordering::Relaxed);
        frame.complete = true;
        let (cursor, complete) = (&mut frame.cursor, &mut frame.complete);
        frame
            .encoder
            .start_frame(|bytes| put(bytes, cursor, complete));
    }

    unsafe fn flush() {}

    unsafe fn release() {
        if NESTED.load(Ordering::Relaxed) > 0 {
            NESTED.fetch_sub(1, Ordering::Relaxed);
            return;
        }
        // SAFETY: as above.
        let frame = unsafe { &mut *WRITER.0.get() };
        let (cursor, complete) = (&mut frame.cursor, &mut frame.complete);
        frame
            .encoder
            .end_frame(|bytes| put(bytes, cursor, complete));
        if frame.complete {
            _SEGGER_RTT.write.store(frame.cursor, Ordering::Release);
        }
        BUSY.store(false, Ordering::Release);
    }

    unsafe fn write(bytes: &[u8]) {
        if NESTED.load(Ordering::Relaxed) > 0 {
            return;
        }
        // SAFETY: as above.
        let frame = unsafe { &mut *WRITER.0.get() };
        let (cursor, complete) = (&mut frame.cursor, &mut frame.complete);
        frame
            .encoder
            .write(bytes, |bytes| put(bytes, cursor, complete));
    }
}

fn put(bytes: &[u8], cursor: &mut u32, complete: &mut bool) {
    let read = _SEGGER_RTT.read.load(Ordering::Acquire);
    // SAFETY: `BUSY` is held by whoever calls.
    let buffer = unsafe { &mut *BUFFER.0.get() };
    for byte in bytes {
        let next = if *cursor + 1 >= SIZE as u32 {
            0
        } else {
            *cursor + 1
        };
        match buffer.get_mut(*cursor as usize) {
            Some(slot) if next != read => *slot = *byte,
            _ => {
                *complete = false;
                return;
            }
        }
        *cursor = next;
    }
}
