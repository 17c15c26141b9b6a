//! Pins and registers, without a program.

use super::*;
use rigless::mcu::Operate;
use rigless::soc::Width;

const NOW: VirtualNanos = VirtualNanos(0);
const RCC: u64 = 0x4002_3800;
const GPIOA: u64 = 0x4002_0000;
const GPIOB: u64 = 0x4002_0400;
const GPIOC: u64 = 0x4002_0800;
const GPIOE: u64 = 0x4002_1000;
const TIM2: u64 = 0x4000_0000;
const TIM8: u64 = 0x4001_0400;
const TIM3: u64 = 0x4000_0400;

fn board() -> Nucleo {
    let mut board = Nucleo::new(Flash::default(), 32_000).unwrap();
    board.connect(NOW);
    // The clocks of the ports A to E, of TIM2 and TIM3, and of TIM8.
    write(&mut board, RCC + 0x30, 0x1F);
    write(&mut board, RCC + 0x40, 1 << 1 | 1 << 0);
    write(&mut board, RCC + 0x44, 1 << 1);
    board
}

fn write(board: &mut Nucleo, address: u64, value: u64) {
    board.part.write(NOW, address, Width::W32, value).unwrap();
}

fn read(board: &mut Nucleo, address: u64) -> u64 {
    board.part.read(NOW, address, Width::W32).unwrap()
}

#[test]
fn drivers_are_off_until_their_pins_are_high() {
    let mut board = board();
    assert!(board.bridges(NOW).iter().all(Bridge::is_off));
    // PE12 an output and high, PE9 an output and high, PE8 an output and low.
    write(&mut board, GPIOE, 1 << 24 | 1 << 18 | 1 << 16);
    write(&mut board, GPIOE + 0x14, 1 << 12 | 1 << 9);
    let [left, right] = board.bridges(NOW);
    assert_eq!(
        (left.enabled, left.duty),
        (true, -1.0),
        "a level is a duty of one"
    );
    assert!(right.is_off());
}

#[test]
fn an_encoder_counts_both_ways() {
    let mut board = board();
    // PC6 and PC7 on alternate function 2, TIM3 in encoder mode 3, inputs direct.
    write(&mut board, GPIOC, 2 << 12 | 2 << 14);
    write(&mut board, GPIOC + 0x20, 2 << 24 | 2 << 28);
    write(&mut board, TIM3 + 0x18, 0x0101);
    write(&mut board, TIM3 + 0x08, 3);
    write(&mut board, TIM3, 1);
    for count in 1..=10 {
        board.turn(VirtualNanos(count * 1000), 0, count as i64);
    }
    assert_eq!(read(&mut board, TIM3 + 0x24), 10);
    for count in (-3..10).rev() {
        board.turn(VirtualNanos(20_000), 0, count);
    }
    assert_eq!(read(&mut board, TIM3 + 0x24), 0xFFFD);
}

#[test]
fn a_servo_is_told_by_the_width_of_its_pulses() {
    let mut board = board();
    // TIM8: 16 MHz after a reset, so a count is a microsecond; channel 3 in PWM mode 1, MOE.
    write(&mut board, TIM8 + 0x28, 15);
    write(&mut board, TIM8 + 0x2C, 19_999);
    write(&mut board, TIM8 + 0x1C, 0x68);
    write(&mut board, TIM8 + 0x20, 1 << 8);
    write(&mut board, TIM8 + 0x44, 1 << 15);
    let pulse = |board: &mut Nucleo, microseconds| {
        write(board, TIM8 + 0x3C, microseconds);
        // The preloads take effect with an update.
        write(board, TIM8 + 0x14, 1);
        write(board, TIM8, 1);
        board.servo(NOW)
    };
    assert_eq!(pulse(&mut board, 1500), None, "PC8 is not the timer's");
    write(&mut board, GPIOC, 2 << 16);
    write(&mut board, GPIOC + 0x24, 3);
    assert_eq!(pulse(&mut board, 1500), Some(1.5e-3));
    assert_eq!(pulse(&mut board, 0), None, "no pulses");
}

#[test]
fn the_steering_has_an_encoder_of_its_own() {
    let mut board = board();
    // PA15 and PB3, which are on alternate function 0 after a reset, on 1; TIM2 in encoder mode 3, inputs direct.
    write(&mut board, GPIOA + 0x24, 1 << 28);
    write(&mut board, GPIOB + 0x20, 1 << 12);
    write(&mut board, TIM2 + 0x18, 0x0101);
    write(&mut board, TIM2 + 0x08, 3);
    write(&mut board, TIM2, 1);
    for count in (-7..0).rev() {
        board.turn(NOW, 2, count);
    }
    assert_eq!(read(&mut board, TIM2 + 0x24), 0xFFFF_FFF9);
}

#[test]
fn switches_reach_their_pins() {
    let mut board = board();
    // PE13 with a pull-up, as the firmware has it.
    write(&mut board, GPIOE + 0x0C, 1 << 26);
    let levels = |board: &mut Nucleo| {
        let estop = read(board, GPIOE + 0x10) >> 13 & 1;
        let button = read(board, GPIOC + 0x10) >> 13 & 1;
        (estop, button)
    };
    assert_eq!(levels(&mut board), (0, 0));
    board.set_estop(NOW, true);
    board.press(NOW, true);
    assert_eq!(levels(&mut board), (1, 1));
}
