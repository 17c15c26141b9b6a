//! 500 tours of twelve places: no place that is found again is excluded, and a landmark is worth what it should be.

use hil_sim::map::tour::{PLACES, Tour, tour};
use hil_sim::robot::Robot;
use rayon::prelude::*;

const TOURS: u64 = 500;

fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = numbers.collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

#[test]
fn no_place_that_is_found_again_is_excluded_and_circles_halve() {
    let robot = Robot::load("uncalibrated").unwrap();
    let tours: Vec<Tour> = (1..=TOURS)
        .into_par_iter()
        .map(|seed| tour(&robot, seed).unwrap_or_else(|error| panic!("tour {seed}: {error:#}")))
        .collect();
    let sum = |of: fn(&Tour) -> u32| tours.iter().map(of).sum::<u32>();
    let circles = |which: usize| {
        let all = tours
            .iter()
            .flat_map(move |tour| tour.circles[which].clone());
        median(all)
    };
    let (before, after) = (circles(0), circles(1));
    let found: Vec<u32> = (0..PLACES)
        .map(|ways| tours.iter().map(|tour| tour.found[ways]).sum())
        .collect();
    let [told, unsure] =
        [0, 1].map(|which| tours.iter().map(|tour| tour.alike[which]).sum::<u32>());
    println!(
        "found again after 1 to {PLACES} ways {found:?}, false no {}, elsewhere {} of which excluded {}, broken bounds {} of {} arcs",
        sum(|tour| tour.false_no),
        sum(|tour| tour.elsewhere[0]),
        sum(|tour| tour.elsewhere[1]),
        sum(|tour| tour.broken),
        sum(|tour| tour.arcs as u32),
    );
    println!(
        "of two alike, told which {told}, unsure {unsure}; median circle {before:.3} m before, {after:.3} m after"
    );
    for place in 1..PLACES {
        let [before, after] =
            [0, 1].map(|which| median(tours.iter().map(|tour| tour.circles[which][place - 1])));
        println!("p{place}: {before:.2} m before, {after:.2} m after");
    }
    assert_eq!(found.iter().sum::<u32>(), TOURS as u32 * PLACES as u32);
    // After a whole round, and after some ways without a landmark.
    assert_eq!(found[PLACES - 1], TOURS as u32);
    assert!(found[1..4].iter().all(|found| *found > 100));
    assert_eq!(sum(|tour| tour.false_no), 0);
    assert_eq!(sum(|tour| tour.broken), 0);
    assert!(after <= 0.5 * before, "{before} {after}");
    // It is no map that excludes nothing.
    assert!(sum(|tour| tour.elsewhere[1]) > sum(|tour| tour.elsewhere[0]) / 4);
    assert!(told > 1000 && unsure > 0);
}
