//! Covariances: 3×3 of the plane into the 6×6 of a message, and that of the speeds.

use super::knowledge::{Knowledge, Vehicle};
use std::f64::consts::{PI, TAU};

/// Of what a base in the plane does not measure, and of what it knows exactly: z, roll and pitch of its pose, and every speed but two, are zero because
/// wheels stand on a floor. robot_localization takes smaller variances for this one, so it is no zero to divide by; it asks not to have large ones for what is
/// not measured, but to leave that out of its configuration.
pub const CERTAIN: f64 = 1e-9;

/// Places of x, y and yaw among x y z roll pitch yaw.
const PLACES: [usize; 3] = [0, 1, 5];

/// By rows, with [`CERTAIN`] for the least variance of all six.
pub fn spatial(planar: &[[f64; 3]; 3]) -> [f64; 36] {
    let mut all = [0.0; 36];
    for (i, row) in PLACES.into_iter().enumerate() {
        for (j, column) in PLACES.into_iter().enumerate() {
            all[row * 6 + column] = planar[i][j];
        }
    }
    for place in 0..6 {
        // To raise a variance keeps the matrix positive. A pose that was just set has none.
        let variance = &mut all[place * 7];
        *variance = variance.max(CERTAIN);
    }
    all
}

/// The same covariance, of a pose in a frame that is turned by `angle` in the map.
#[must_use]
pub fn turned(c: &[[f64; 3]; 3], angle: f64) -> [[f64; 3]; 3] {
    let (sin, cos) = angle.sin_cos();
    let turn = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
    let mut turned = [[0.0; 3]; 3];
    for (i, row) in turned.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            for k in 0..3 {
                for l in 0..3 {
                    *entry += turn[i][k] * c[k][l] * turn[j][l];
                }
            }
        }
    }
    turned
}

/// Variances of v and ω, from what the base says of itself.
///
/// A speed is a distance over the time that its filter looks at, T = 1/(2π · `observer_bandwidth`). So
///
/// * the noise of the ground, `noise_s` κ_S in m² a metre, makes κ_S |v| T / T² of it, and `noise_rot` and `noise_drift` (κ_rot in rad² a radian, κ_drift in
///   rad² a metre) make (κ_rot |ω| + κ_drift |v|) / T;
/// * what is not known of the wheels makes `k_scale` v² and `k_rot` ω² + `k_drift` v²;
/// * an encoder has steps of q = π d / `counts_per_turn` metres: evenly spread, q²/12 at each end of T, 2 q²/12 / T² for a wheel. v is the mean of two wheels,
///   ω their difference over the wheel base. At rest this is what is left.
///
/// The first term is why these are larger than the jitter that one sees: they say what the base does on the floor, not what its wheels do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpeedNoise {
    /// m² a metre over T.
    move_noise: f64,
    /// rad² a radian over T.
    turn_noise: f64,
    /// rad² a metre over T.
    drift_noise: f64,
    move_scale: f64,
    turn_scale: f64,
    /// rad² a m².
    drift_scale: f64,
    move_step: f64,
    turn_step: f64,
}

impl SpeedNoise {
    /// Of a base with these parameters.
    pub fn of(base: &Knowledge) -> Self {
        let rate = TAU * base.get("observer_bandwidth").unwrap_or(30.0);
        let degree = 1_f64.to_radians();
        let diameter = base
            .get("left_diameter")
            .or_else(|| base.get("wheel_diameter"))
            .unwrap_or(0.1);
        let step = PI * diameter / base.get("counts_per_turn").unwrap_or(1000.0).max(1.0);
        let wheel = 2.0 * step * step / 12.0 * rate * rate;
        let lever = match base.vehicle() {
            Vehicle::Differential | Vehicle::Tricycle => base.or_zero("wheel_base"),
            Vehicle::Car => base.or_zero("track"),
            // The rim of what turns is as finely divided.
            Vehicle::Synchro => base.or_zero("turn_lever"),
        };
        let (move_share, turn_share) = match base.vehicle() {
            Vehicle::Differential | Vehicle::Car => (0.5, 2.0),
            Vehicle::Synchro | Vehicle::Tricycle => (1.0, 1.0),
        };
        Self {
            move_noise: base.or_zero("noise_s") * rate,
            // °² a degree is (π/180)² rad² in π/180 rad.
            turn_noise: base.or_zero("noise_rot") * degree * rate,
            drift_noise: base.or_zero("noise_drift") * degree * degree * rate,
            move_scale: base.or_zero("k_scale"),
            turn_scale: base.or_zero("k_rot"),
            drift_scale: base.or_zero("k_drift") * degree * degree,
            move_step: move_share * wheel,
            turn_step: turn_share * wheel / (lever * lever).max(1e-4),
        }
    }

    /// Variances of v (m²/s²) and ω (rad²/s²) at these speeds, m/s and rad/s.
    pub fn variances(&self, v: f64, omega: f64) -> [f64; 2] {
        let (v, omega) = (v.abs(), omega.abs());
        [
            self.move_noise * v + self.move_scale * v * v + self.move_step,
            self.turn_noise * omega
                + self.drift_noise * v
                + self.turn_scale * omega * omega
                + self.drift_scale * v * v
                + self.turn_step,
        ]
    }

    /// The same in a message's 36 places.
    pub fn covariance(&self, v: f64, omega: f64) -> [f64; 36] {
        let [forward, turn] = self.variances(v, omega);
        spatial(&[[forward, 0.0, 0.0], [0.0; 3], [0.0, 0.0, turn]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn base() -> Knowledge {
        let mut base = Knowledge::default();
        for row in [
            "wheel_base 0.2",
            "left_diameter 0.084",
            "counts_per_turn 2796.8",
            "noise_s 0.000005",
            "noise_drift 0.01",
            "noise_rot 0.015",
            "k_drift 0.04",
            "k_rot 0.0002",
            "k_scale 0.00005",
            "observer_bandwidth 30",
        ] {
            assert!(base.note(row));
        }
        base
    }

    #[test]
    fn each_number_finds_its_place() {
        let all = spatial(&[[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]]);
        let places = [
            (0, 1.0),
            (1, 2.0),
            (5, 3.0),
            (6, 2.0),
            (7, 4.0),
            (11, 5.0),
            (30, 3.0),
            (31, 5.0),
            (35, 6.0),
        ];
        for (at, value) in all.iter().enumerate() {
            let expected = places.iter().find(|place| place.0 == at);
            let unused = if at % 7 == 0 { CERTAIN } else { 0.0 };
            assert_eq!(*value, expected.map_or(unused, |place| place.1), "{at}");
        }
        assert_eq!(spatial(&[[0.0; 3]; 3])[0], CERTAIN);
    }

    #[test]
    fn a_covariance_turns_with_its_frame() {
        let c = [[4e-2, 1e-2, 2e-3], [1e-2, 9e-2, -3e-3], [2e-3, -3e-3, 1e-3]];
        let c = turned(&c, PI / 2.0);
        let expected = [[9e-2, -1e-2, 3e-3], [-1e-2, 4e-2, 2e-3], [3e-3, 2e-3, 1e-3]];
        for (row, expected) in c.iter().zip(expected) {
            for (value, expected) in row.iter().zip(expected) {
                assert!((value - expected).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn speeds_are_as_sure_as_their_filter_and_their_floor() {
        let noise = SpeedNoise::of(&base());
        let [v, omega] = noise.variances(0.0, 0.0);
        // A step of 94 µm in 5.3 ms: 5.1 mm/s, and over 0.2 m 0.051 rad/s.
        assert!((v.sqrt() - 5.13e-3).abs() < 1e-4, "{}", v.sqrt());
        assert!((omega.sqrt() - 0.0513).abs() < 1e-3, "{}", omega.sqrt());
        // At 0.3 m/s the floor's 5 mm²/m in 5.3 ms are 1.7 cm/s.
        let [v, _] = noise.variances(-0.3, 0.0);
        assert!((v.sqrt() - 0.0176).abs() < 5e-4, "{}", v.sqrt());
        let covariance = noise.covariance(0.3, 1.0);
        assert_eq!(covariance[0], noise.variances(0.3, 1.0)[0]);
        assert_eq!(covariance[35], noise.variances(0.3, 1.0)[1]);
        assert_eq!(covariance[7], CERTAIN);
    }
}
