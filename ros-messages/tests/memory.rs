//! Bytes from a network that announce more than they hold take no memory for it.

use ros_messages::diagnostic_msgs::DiagnosticArray;
use ros_messages::sensor_msgs::JointState;
use ros_messages::tf2_msgs::TFMessage;
use ros_messages::{RosMessage, from_cdr};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

/// What is taken from the system, and the most that ever was.
struct Counting;

static TAKEN: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

fn take(bytes: usize) {
    let taken = TAKEN.fetch_add(bytes, Ordering::Relaxed) + bytes;
    MOST.fetch_max(taken, Ordering::Relaxed);
}

// SAFETY: everything is the system's, asked for with the same layout. `realloc` is the trait's own: it takes the new block before it gives the old one back,
// so that both are counted.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        take(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        TAKEN.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Most of the bytes that were taken at once to read this; whether it was a message.
fn read<M: RosMessage>(bytes: &[u8]) -> (usize, bool) {
    let before = TAKEN.load(Ordering::Relaxed);
    MOST.store(before, Ordering::Relaxed);
    let good = from_cdr::<M>(bytes).is_ok();
    (MOST.load(Ordering::Relaxed) - before, good)
}

/// The header of CDR, then these words.
fn words(words: &[u32]) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    bytes
}

/// A stamp, and a frame without a name.
const HEADER: [u32; 4] = [0, 0, 1, 0];
const ALL: u32 = u32::MAX;
const MIB: usize = 1 << 20;

// One test: others beside it would be counted, too.
#[test]
fn what_is_announced_and_does_not_come_takes_no_memory() {
    // Four thousand million names, transforms, parts: room is made for a MiB of them, and no more until they come.
    let announced = words(&[HEADER.as_slice(), &[ALL]].concat());
    for (most, good) in [
        read::<JointState>(&announced),
        read::<DiagnosticArray>(&announced),
        read::<TFMessage>(&words(&[ALL])),
    ] {
        assert!(!good && most <= MIB + MIB / 8, "{most}");
    }
    // And within the first part (level and three empty strings) as many values again.
    let nested = words(&[HEADER.as_slice(), &[ALL, 0, 0, 0, 0, ALL]].concat());
    let (most, good) = read::<DiagnosticArray>(&nested);
    assert!(!good && most <= 2 * MIB + MIB / 8, "{most}");
    // A text of four thousand million characters.
    let (most, good) = read::<JointState>(&words(&[0, 0, ALL, 0]));
    assert!(!good && most < 1000, "{most}");
    // What does come, and is as small as it can be (a text of no length is four bytes, and three words in memory), takes some times its length: a vector
    // that grows doubles, and the old one is there until the new one is filled.
    let count = 300_000;
    let mut long = [HEADER.as_slice(), &[count]].concat();
    long.resize(long.len() + count as usize + 3, 0);
    let bytes = words(&long);
    let (most, good) = read::<JointState>(&bytes);
    assert!(
        good && most <= 24 * bytes.len(),
        "{most} for {}",
        bytes.len()
    );
}
