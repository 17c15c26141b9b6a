//! Messages as bytes, and bytes as messages.

mod common;

use common::Sample;
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use ros_messages::diagnostic_msgs::DiagnosticArray;
use ros_messages::geometry_msgs::{Twist, Vector3};
use ros_messages::services::{SetBoolRequest, SetBoolResponse, TriggerRequest, TriggerResponse};
use ros_messages::{CdrError, RosMessage, from_cdr, to_cdr};

/// A message comes back as it was, bit by bit: NaN is not equal to itself, so it is its bytes that are compared.
fn comes_back<M: RosMessage + Sample>() {
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    for _ in 0..200 {
        let bytes = to_cdr(&M::sample(&mut rng));
        let back: M = from_cdr(&bytes).unwrap();
        assert_eq!(to_cdr(&back), bytes, "{}", M::NAME);
        // Filled up to four bytes, as some writers do; and not by more.
        let filled = [bytes.as_slice(), &[0; 3]].concat();
        assert_eq!(to_cdr(&from_cdr::<M>(&filled).unwrap()), bytes);
        let long = [bytes.as_slice(), &[0; 4]].concat();
        assert!(matches!(from_cdr::<M>(&long), Err(CdrError::Excess(4))));
        for cut in [0, 3, 4, bytes.len() / 2, bytes.len() - 1] {
            assert!(
                from_cdr::<M>(&bytes[..cut]).is_err(),
                "{} cut at {cut}",
                M::NAME
            );
        }
    }
}

#[test]
fn messages_come_back_as_they_were() {
    macro_rules! check {
        ($($kind:ty),*) => { $(comes_back::<$kind>();)* };
    }
    for_each_message!(check);
}

#[test]
fn the_bytes_are_those_of_the_specification() {
    let twist = Twist {
        linear: Vector3 {
            x: 1.0,
            ..Vector3::default()
        },
        ..Twist::default()
    };
    let mut expected = vec![0, 1, 0, 0];
    expected.extend([0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
    expected.extend([0; 40]);
    assert_eq!(to_cdr(&twist), expected);
    assert_eq!(to_cdr(&TriggerRequest::default()), [0, 1, 0, 0, 0]);
    assert_eq!(to_cdr(&SetBoolRequest { data: true }), [0, 1, 0, 0, 1]);
    // Alignment counts from behind the header; a string has its length, and a zero at its end.
    let response = TriggerResponse {
        success: true,
        message: "ok".into(),
    };
    assert_eq!(
        to_cdr(&response),
        [0, 1, 0, 0, 1, 0, 0, 0, 3, 0, 0, 0, b'o', b'k', 0]
    );
    let big = [0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 3, b'o', b'k', 0];
    assert_eq!(from_cdr::<TriggerResponse>(&big).unwrap(), response);
    assert_eq!(
        from_cdr::<SetBoolResponse>(&[0, 3, 0, 0, 1]),
        Err(CdrError::Encapsulation)
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Whatever comes from a network is a message or an error.
    #[test]
    fn garbage_is_refused(mut bytes in proptest::collection::vec(any::<u8>(), 0..400), announced in any::<bool>()) {
        if announced && bytes.len() >= 4 {
            bytes[..4].copy_from_slice(&[0, 1, 0, 0]);
        }
        macro_rules! read {
            ($($kind:ty),*) => { $(let _ = from_cdr::<$kind>(&bytes);)* };
        }
        for_each_message!(read);
    }

    /// One that is damaged, too.
    #[test]
    fn damage_is_survived(seed in any::<u64>(), at in any::<prop::sample::Index>(), to in any::<u8>()) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut bytes = to_cdr(&DiagnosticArray::sample(&mut rng));
        let place = at.index(bytes.len());
        bytes[place] = to;
        let _ = from_cdr::<DiagnosticArray>(&bytes);
    }
}
