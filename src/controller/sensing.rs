//! What the board measures besides the encoders: from volts at its pins to volts, amperes and stop requests.

/// What the board measured. A board whose sensors speak volts and amperes gives those, with scales of 1 in [`Sensing`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Inputs {
    /// Voltage at the battery's divider, V, where there is one.
    pub battery: Option<f32>,
    /// Voltages of the motors' current sensors, left first, V, where there are some.
    pub currents: [Option<f32>; 2],
    /// The emergency-stop circuit is open: pressed, or a broken wire.
    pub estop_open: bool,
    /// A stop button on the board itself is pressed.
    pub stop_button: bool,
}

/// What the inputs mean.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sensing {
    /// Battery voltage to assume when none is measured, V.
    pub nominal_supply: f32,
    /// Battery voltage over the voltage at the divider; 0: there is no divider.
    pub battery_divider: f32,
    /// Current per voltage of the sensors, A/V; 0: there are none.
    pub current_scale: f32,
    /// Voltage of the sensors at no current, V.
    pub current_zero: f32,
    /// An emergency-stop circuit is connected.
    pub estop_input: bool,
}

/// Time constant of the supply's filter, s.
const SUPPLY_FILTER: f32 = 0.05;
/// A supply below this share of the nominal one is a broken sense wire, not a battery that still drives motors.
const SUPPLY_FLOOR: f32 = 0.5;

/// The inputs in physical units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Readings {
    /// Battery voltage, filtered, V.
    pub(super) supply: f32,
    /// The supply that duties are computed with, V: a broken sense wire must not multiply them.
    pub(super) usable: f32,
    /// Motor currents, A, where they are measured.
    pub(super) currents: [Option<f32>; 2],
    /// The emergency stop or the board's button asks for a stop.
    pub(super) estop: bool,
}

/// Volts or amperes that a sensor may well mean: not NaN, and no more than any robot has, so that nothing computed from them overflows.
fn is_plausible(reading: f32) -> bool {
    const MOST: f32 = 1e6;
    reading.abs() <= MOST
}

impl Readings {
    pub(super) fn new(sensing: &Sensing) -> Self {
        Self {
            supply: sensing.nominal_supply,
            usable: sensing.nominal_supply,
            currents: [None; 2],
            estop: false,
        }
    }

    /// Takes in what the board measured in a cycle of `period` seconds.
    pub(super) fn update(&mut self, sensing: &Sensing, inputs: &Inputs, period: f32) {
        let measured = inputs
            .battery
            .filter(|_| sensing.battery_divider > 0.0)
            .map(|volts| volts * sensing.battery_divider)
            .filter(|volts| is_plausible(*volts))
            .unwrap_or(sensing.nominal_supply);
        self.supply += (measured - self.supply) * period / (SUPPLY_FILTER + period);
        self.usable = if self.supply < SUPPLY_FLOOR * sensing.nominal_supply {
            sensing.nominal_supply
        } else {
            self.supply
        };
        self.currents = if sensing.current_scale > 0.0 {
            let current = |volts: f32| (volts - sensing.current_zero) * sensing.current_scale;
            inputs
                .currents
                .map(|volts| volts.map(current).filter(|amperes| is_plausible(*amperes)))
        } else {
            [None; 2]
        };
        self.estop = inputs.stop_button || (sensing.estop_input && inputs.estop_open);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENSING: Sensing = Sensing {
        nominal_supply: 12.0,
        battery_divider: 11.0,
        current_scale: 2.0,
        current_zero: 1.65,
        estop_input: true,
    };

    fn settled(sensing: &Sensing, inputs: &Inputs) -> Readings {
        let mut readings = Readings::new(sensing);
        for _ in 0..2000 {
            readings.update(sensing, inputs, 1e-3);
        }
        readings
    }

    #[test]
    fn volts_at_the_pins_become_volts_and_amperes() {
        let inputs = Inputs {
            battery: Some(1.0),
            currents: [Some(1.65), Some(0.65)],
            ..Inputs::default()
        };
        let readings = settled(&SENSING, &inputs);
        // 40 time constants leave e^-40 of the difference; the rest is rounding.
        assert!((readings.supply - 11.0).abs() < 1e-4);
        assert_eq!(readings.currents, [Some(0.0), Some(-2.0)]);
        let nothing = Sensing {
            battery_divider: 0.0,
            current_scale: 0.0,
            ..SENSING
        };
        let readings = settled(&nothing, &inputs);
        assert_eq!((readings.supply, readings.currents), (12.0, [None; 2]));
    }

    #[test]
    fn a_broken_sense_wire_does_not_multiply_the_duty() {
        for battery in [0.0, 0.3, f32::NAN, f32::INFINITY] {
            let inputs = Inputs {
                battery: Some(battery),
                ..Inputs::default()
            };
            assert_eq!(settled(&SENSING, &inputs).usable, 12.0);
        }
    }

    #[test]
    fn what_no_sensor_means_is_not_taken_for_a_number() {
        for volts in [f32::NAN, f32::INFINITY, f32::MAX, f32::MIN] {
            let inputs = Inputs {
                battery: Some(volts),
                currents: [Some(volts), Some(1.65)],
                ..Inputs::default()
            };
            let readings = settled(&SENSING, &inputs);
            assert_eq!(readings.supply, SENSING.nominal_supply, "{volts}");
            assert_eq!(readings.currents, [None, Some(0.0)], "{volts}");
        }
    }

    #[test]
    fn stop_requests() {
        let open = Inputs {
            estop_open: true,
            ..Inputs::default()
        };
        assert!(settled(&SENSING, &open).estop);
        let unwired = Sensing {
            estop_input: false,
            ..SENSING
        };
        assert!(!settled(&unwired, &open).estop);
        let pressed = Inputs {
            stop_button: true,
            ..Inputs::default()
        };
        assert!(settled(&unwired, &pressed).estop);
    }
}
