//! A simulated base, whatever its controller runs on: the library on this computer, or the image on an emulated board.

use crate::faults::Fault;
use crate::plant::Plant;
use crate::rig::Rig;
use crate::trace::Row;
use anyhow::Result;
use vehicle_controller::controller::State;
use vehicle_controller::time::Instant;

/// A base that can be driven, watched and meddled with.
pub trait Base {
    /// Puts bytes on the line to the base; they arrive at 115 200 baud.
    ///
    /// # Errors
    /// If the simulation cannot go on.
    fn send(&mut self, bytes: &[u8]) -> Result<()>;

    /// Takes what has arrived from the base.
    fn receive(&mut self) -> Vec<u8>;

    /// Bytes that have not reached the base yet.
    fn backlog(&self) -> usize;

    /// Pushes the base for some seconds: N along it, N·m about it.
    fn push(&mut self, force: f64, torque: f64, seconds: f64);

    /// Opens the emergency-stop circuit, or closes it.
    ///
    /// # Errors
    /// If the simulation cannot go on.
    fn set_estop(&mut self, open: bool) -> Result<()>;

    /// Lets something go wrong from here on, in place of what was wrong with the same part.
    ///
    /// # Errors
    /// If this base has no such part.
    fn inject(&mut self, fault: Fault) -> Result<()>;

    /// All that was wrong is well. The encoders count on from where they are.
    ///
    /// # Errors
    /// If the simulation cannot go on.
    fn clear_faults(&mut self) -> Result<()>;

    /// Power fails after so many further bytes written to the flash of the parameters, or milliseconds of an erase of it; the base then starts anew.
    ///
    /// # Errors
    /// If the simulation cannot go on.
    fn cut_flash(&mut self, bytes: u64) -> Result<()>;

    /// The board's power fails and comes back; what is broken stays so.
    ///
    /// # Errors
    /// If the simulation cannot go on.
    fn power_cycle(&mut self) -> Result<()>;

    /// The simulated time.
    fn now(&self) -> Instant;

    /// The controller's own clock, s: that of its telemetry. It begins anew with each start of the board.
    ///
    /// # Errors
    /// If what the controller knows cannot be read.
    fn clock(&self) -> Result<f64>;

    /// The truth.
    fn plant(&self) -> &Plant;

    /// The truth, to meddle with.
    fn plant_mut(&mut self) -> &mut Plant;

    /// One period of the control loop.
    ///
    /// # Errors
    /// If the simulation cannot go on.
    fn tick(&mut self) -> Result<()>;

    /// Both axes are in the state HOLD.
    ///
    /// # Errors
    /// If what the controller knows cannot be read.
    fn holds(&self) -> Result<bool>;

    /// A row of the trace.
    ///
    /// # Errors
    /// If what the controller knows cannot be read.
    fn row(&self) -> Result<Row>;
}

impl Base for Rig {
    fn send(&mut self, bytes: &[u8]) -> Result<()> {
        Rig::send(self, bytes);
        Ok(())
    }

    fn receive(&mut self) -> Vec<u8> {
        Rig::receive(self)
    }

    fn backlog(&self) -> usize {
        Rig::backlog(self)
    }

    fn push(&mut self, force: f64, torque: f64, seconds: f64) {
        Rig::push(self, force, torque, seconds);
    }

    fn set_estop(&mut self, open: bool) -> Result<()> {
        Rig::set_estop(self, open);
        Ok(())
    }

    fn inject(&mut self, fault: Fault) -> Result<()> {
        Rig::inject(self, fault)
    }

    fn clear_faults(&mut self) -> Result<()> {
        Rig::clear_faults(self);
        Ok(())
    }

    fn cut_flash(&mut self, bytes: u64) -> Result<()> {
        Rig::cut_flash(self, bytes);
        Ok(())
    }

    fn power_cycle(&mut self) -> Result<()> {
        Rig::power_cycle(self)
    }

    fn now(&self) -> Instant {
        Rig::now(self)
    }

    fn clock(&self) -> Result<f64> {
        Ok(self.snapshot().time.ticks() as f64 * 1e-6)
    }

    fn plant(&self) -> &Plant {
        Rig::plant(self)
    }

    fn plant_mut(&mut self) -> &mut Plant {
        Rig::plant_mut(self)
    }

    fn tick(&mut self) -> Result<()> {
        Rig::tick(self);
        Ok(())
    }

    fn holds(&self) -> Result<bool> {
        let snapshot = self.snapshot();
        Ok(snapshot.translation.state == State::Hold && snapshot.rotation.state == State::Hold)
    }

    fn row(&self) -> Result<Row> {
        Ok(Rig::row(self))
    }
}
