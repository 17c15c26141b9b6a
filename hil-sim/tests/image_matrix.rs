//! A tenth of the fault matrix on the shipped image.

mod image;
mod matrix;

use hil_sim::base::Base;
use hil_sim::emulator::ImageBase;
use hil_sim::robot::Robot;
use image::image;
use matrix::{Case, Matrix, SEED};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// Which tenth.
const CHOICE: u64 = 4;

fn power_up(robot: &Robot) -> Box<dyn Base> {
    Box::new(ImageBase::new(&image(), robot, SEED).unwrap())
}

/// Every fourth of that tenth, so that tests can run beside each other.
fn try_quarter(quarter: usize) {
    let mut cases = Case::all();
    cases.shuffle(&mut ChaCha8Rng::seed_from_u64(CHOICE));
    cases.truncate(cases.len().div_ceil(10));
    Matrix::new(power_up).try_all(cases.into_iter().skip(quarter).step_by(4));
}

#[test]
fn the_image_finds_the_faults_of_the_first_quarter() {
    try_quarter(0);
}

#[test]
fn the_image_finds_the_faults_of_the_second_quarter() {
    try_quarter(1);
}

#[test]
fn the_image_finds_the_faults_of_the_third_quarter() {
    try_quarter(2);
}

#[test]
fn the_image_finds_the_faults_of_the_fourth_quarter() {
    try_quarter(3);
}
