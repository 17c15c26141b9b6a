//! A tenth of the link cuts on the shipped image.

mod image;
mod link_cuts;

use hil_sim::base::Base;
use hil_sim::emulator::ImageBase;
use hil_sim::robot::Robot;
use image::image;
use link_cuts::{Cut, SEED};

/// Every other one of that tenth, so that tests can run beside each other.
fn try_half(half: usize) {
    let robot = Robot::load("default").unwrap();
    for cut in Cut::random(20).iter().skip(half).step_by(2) {
        let base: Box<dyn Base> = Box::new(ImageBase::new(&image(), &robot, SEED).unwrap());
        println!("{cut:?}: {:?}", cut.try_on(base, &robot));
    }
}

#[test]
fn the_image_stops_after_the_cuts_of_the_first_half() {
    try_half(0);
}

#[test]
fn the_image_stops_after_the_cuts_of_the_second_half() {
    try_half(1);
}
