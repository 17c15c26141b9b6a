//! The battery: an open-circuit voltage behind an internal resistance.

use super::params::BatteryParams;

/// A battery.
#[derive(Clone, Debug)]
pub(super) struct Battery {
    voltage: f64,
    /// Its voltage as the robot has it \[V\].
    own: f64,
    resistance: f64,
}

/// One motor with its bridge as the battery sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Consumer {
    /// Part of the bus voltage that the bridge passes on, −1..1.
    pub drive: f64,
    /// Part of that which reaches the winding, 0..1: the motor's strength.
    pub strength: f64,
    /// Conductance of the winding \[S\].
    pub conductance: f64,
    /// Back-EMF \[V\].
    pub emf: f64,
}

impl Battery {
    /// A battery with these parameters.
    pub(super) fn new(params: &BatteryParams) -> Self {
        Self {
            voltage: params.voltage,
            own: params.voltage,
            resistance: params.resistance,
        }
    }

    /// Another open-circuit voltage \[V\], or the robot's own.
    pub(super) fn replace(&mut self, voltage: Option<f64>) {
        self.voltage = voltage.unwrap_or(self.own);
    }

    /// Open-circuit voltage \[V\].
    pub(super) fn open_circuit(&self) -> f64 {
        self.voltage
    }

    /// Voltage of the bus with these motors connected \[V\].
    ///
    /// The voltage and the currents depend on each other; solved together there is no loop with a
    /// delay that could oscillate, whatever the internal resistance. A braking motor charges the
    /// battery.
    #[inline]
    pub(super) fn bus(&self, motors: [Consumer; 2]) -> f64 {
        let (mut short, mut back) = (0.0, 0.0);
        for m in motors {
            // The bridge, averaged over the PWM, passes power on: V_bus·I_bus = (d·V_bus)·i, so
            // I_bus = d·i with i = (d·s·V_bus − e)·G.
            short += m.drive * m.drive * m.strength * m.conductance;
            back += m.drive * m.emf * m.conductance;
        }
        // V_bus = V_0 − R_i·Σ d·(d·s·V_bus − e)·G, solved for V_bus
        (self.voltage + self.resistance * back) / (1.0 + self.resistance * short)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_stalled_motors_pull_the_bus_down() {
        let battery = Battery::new(&BatteryParams {
            voltage: 12.4,
            resistance: 0.15,
            divider: 11.0,
        });
        let stalled = Consumer {
            drive: -1.0,
            strength: 1.0,
            conductance: 1.0 / 2.2,
            emf: 0.0,
        };
        // Two windings of 2.2 Ω in parallel are 1.1 Ω: 12.4·1.1/(1.1 + 0.15). Tolerance: rounding.
        assert!((battery.bus([stalled; 2]) - 12.4 * 1.1 / 1.25).abs() < 1e-12);
    }

    #[test]
    fn nothing_driven_leaves_the_open_circuit_voltage() {
        let battery = Battery::new(&BatteryParams {
            voltage: 12.4,
            resistance: 0.15,
            divider: 11.0,
        });
        let idle = Consumer {
            drive: 0.0,
            strength: 1.0,
            conductance: 1.0,
            emf: 5.0,
        };
        assert_eq!(battery.bus([idle; 2]), battery.open_circuit());
    }
}
