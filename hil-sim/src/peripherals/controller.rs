//! The line from the board to a motor controller.

use super::Wires;
use std::cell::Cell;
use std::rc::Rc;
use vehicle_controller::vehicle::{IncrementOutput, OutputError, SpeedOutput};

/// What a motor controller is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// The motor is free.
    #[default]
    Off,
    /// The motor is shorted.
    Brake,
    /// This speed, units/s.
    Speed(i32),
    /// To move its target.
    Advance,
}

/// What is on its way to a motor controller.
#[derive(Debug, Default)]
pub struct ControllerWires {
    order: Cell<Option<Order>>,
    /// What its target is yet to be moved by, units.
    waiting: Cell<i64>,
    /// What it was sent in all since the motor was last off, units.
    sent: Cell<i64>,
}

impl ControllerWires {
    /// What has arrived since the last time, if anything: the last order, and the units of all of them.
    pub fn take(&self) -> Option<(Order, i64)> {
        let order = self.order.take()?;
        Some((order, self.waiting.take()))
    }

    /// The increments since the motor was last off, units.
    pub fn sent(&self) -> i64 {
        self.sent.get()
    }

    fn stop(&self, order: Order) {
        self.order.set(Some(order));
        self.waiting.set(0);
        self.sent.set(0);
    }
}

/// The board's end of the line.
#[derive(Debug)]
pub struct ControllerLine {
    wires: Rc<Wires>,
    /// 1/m.
    units_per_metre: f64,
}

impl ControllerLine {
    /// The line of a motor whose controller counts so many units while its circumference rolls a metre.
    pub fn new(wires: Rc<Wires>, units_per_metre: f64) -> Self {
        Self {
            wires,
            units_per_metre,
        }
    }
}

impl SpeedOutput for ControllerLine {
    fn set_speed(&mut self, speed: f32) -> Result<(), OutputError> {
        let units = (f64::from(speed) * self.units_per_metre).round() as i32;
        let controller = &self.wires.controller;
        controller.order.set(Some(Order::Speed(units)));
        Ok(())
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        self.wires.controller.stop(Order::Brake);
        Ok(())
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.wires.controller.stop(Order::Off);
        Ok(())
    }
}

impl IncrementOutput for ControllerLine {
    fn advance(&mut self, units: i32) -> Result<(), OutputError> {
        let controller = &self.wires.controller;
        controller.order.set(Some(Order::Advance));
        for sum in [&controller.waiting, &controller.sent] {
            sum.set(sum.get() + i64::from(units));
        }
        Ok(())
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        self.wires.controller.stop(Order::Brake);
        Ok(())
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.wires.controller.stop(Order::Off);
        Ok(())
    }
}
