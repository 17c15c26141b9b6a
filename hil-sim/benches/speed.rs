//! How long a tick of the controller, a step of the plant and a period of the whole base take.

use criterion::{Criterion, criterion_group, criterion_main};
use hil_sim::peripherals::Harness;
use hil_sim::plant::{Command, Input, Plant, Push};
use hil_sim::rig::{PERIOD, Rig};
use hil_sim::robot::Robot;
use hil_sim::vehicle::vehicle;
use std::f64::consts::PI;
use std::hint::black_box;
use vehicle_controller::controller::{Action, AxisCommand, Controller, Inputs, State};
use vehicle_controller::params::Id;
use vehicle_controller::time::{self, Instant};

/// A robot that goes on and on: nobody shows signs of life, and its wheels roll whatever its motors are given.
fn robot() -> Robot {
    let mut robot = Robot::load("default").expect("a preset loads");
    let values = [(Id::Deadman, 0.0), (Id::MotorTolerance, 10.0)];
    robot.params.set_all(&values).expect("both are in range");
    robot
}

/// The control loop alone, while both axes move; the wheels roll as if they followed.
fn tick(c: &mut Criterion) {
    let robot = robot();
    let harness = Harness::default();
    let vehicle = vehicle(&harness, &robot, &robot.params).expect("fakes do not refuse");
    let mut controller = Controller::new(vehicle, robot.params.build(PERIOD), None);
    let without_end = |speed: f32, acceleration: f32| AxisCommand {
        distance: f32::INFINITY,
        speed,
        acceleration,
    };
    for request in [
        Action::Move(without_end(0.2, 0.5)),
        Action::Turn(without_end(0.5, 2.0)),
    ] {
        controller.request(request).expect("there is room for four");
    }
    let physics = &robot.physics;
    let per_metre = physics.encoder.counts_per_turn / (PI * physics.wheels.diameter_left);
    let mut now = Instant::from_ticks(0);
    let mut rolled = [0.0; 2];
    let inputs = Inputs {
        battery: Some(12.0 / 11.0),
        ..Inputs::default()
    };
    let mut period = || {
        now = time::after(now, PERIOD);
        let seconds = now.ticks() as f64 * 1e-6;
        let (forward, aside) = ((0.5 * seconds).min(0.2), 0.1 * (2.0 * seconds).min(0.5));
        let speeds = [forward - aside, forward + aside];
        for ((wires, rolled), speed) in harness.wheels.iter().zip(&mut rolled).zip(speeds) {
            *rolled += speed * per_metre * 1e-3;
            wires.edges.set(*rolled as i64);
        }
        black_box(controller.tick(black_box(now), &inputs));
        controller.snapshot()
    };
    for _ in 0..2000 {
        period();
    }
    let snapshot = period();
    assert_eq!(snapshot.translation.state, State::Move);
    assert_eq!(snapshot.rotation.state, State::Move);
    c.bench_function("tick and snapshot", |b| b.iter(&mut period));
}

/// The plant alone, driving a curve.
fn plant_step(c: &mut Criterion) {
    let mut plant = Plant::new(&robot().physics, 1);
    let input = Input {
        command: Command::duty([0.3, 0.4]),
        push: Push::default(),
        steering: None,
    };
    for _ in 0..8000 {
        plant.step(250e-6, &input);
    }
    assert!(plant.speed().0 > 0.1, "it drives");
    c.bench_function("plant step", |b| {
        b.iter(|| plant.step(black_box(250e-6), black_box(&input)));
    });
}

/// A millisecond of everything.
fn rig_tick(c: &mut Criterion) {
    let mut rig = Rig::new(&robot(), 1).expect("fakes do not refuse");
    rig.send(b"SetParam deadman 0\nm inf 0.2\nt inf 30\nStream 0.1\n");
    for _ in 0..2000 {
        rig.tick();
    }
    assert_eq!(rig.snapshot().translation.state, State::Move);
    rig.receive();
    c.bench_function("rig tick", |b| {
        b.iter(|| {
            rig.tick();
            black_box(rig.receive())
        });
    });
}

/// Without pictures: Criterion's would need a font, and `plotters` has here only those that hil-sim brings.
fn plain() -> Criterion {
    Criterion::default().without_plots()
}

criterion_group! {
    name = benches;
    config = plain();
    targets = tick, plant_step, rig_tick
}
criterion_main!(benches);
