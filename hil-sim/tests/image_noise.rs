//! A line with a million bytes of noise on it, and commands in between: each of them is answered.

mod image;

use hil_sim::base::Base;
use hil_sim::emulator::Setup;
use image::{Client, emulated};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NOISE_BYTES: usize = 1_000_000;
/// Between two commands there is up to this much noise.
const BURST: usize = 2000;
const SEED: u64 = 20;

/// A burst of noise: any bytes, or such as nearly make sense.
fn noise(random: &mut ChaCha8Rng, length: usize) -> Vec<u8> {
    const NEARLY: &[u8] = b"m move t turn 0.1 -inf 1e9 @7 *12AB GetEstPos EStop SetParam \r\n,,;~!";
    let mut bytes = vec![0; length];
    if random.random_bool(0.5) {
        random.fill_bytes(&mut bytes);
    } else {
        bytes.fill_with(|| NEARLY[random.random_range(0..NEARLY.len())]);
    }
    bytes
}

#[test]
fn every_command_after_noise_is_answered() {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut client = Client::new(emulated(&Setup::default()));
    client.wait_for("! boot", 100);
    let (mut sent, mut commands) = (0, 0_u16);
    while sent < NOISE_BYTES {
        let length = random.random_range(1..=BURST);
        client.base.send(&noise(&mut random, length)).unwrap();
        sent += length;
        // The line end that ends the noise may end up to four lines that wait for their answers: they come first.
        client.base.send(b"\n").unwrap();
        while client.base.backlog() > 0 {
            client.tick();
        }
        client.run(60);
        let tag = commands;
        client.send(&format!("@{tag} GetTime"));
        client.wait_for(&format!("@{tag} Time "), 200);
        commands = commands.wrapping_add(1);
        client.lines.clear();
    }
    println!("{sent} bytes of noise, {commands} commands answered");
    assert!(client.base.outcome().unwrap().resets.is_empty());
}
