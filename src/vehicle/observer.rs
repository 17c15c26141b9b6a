//! Wheel speed from counts: a third-order tracking observer.

/// Gains of the observer for one sampling interval.
///
/// A fading-memory filter: three equal poles p = e^(−ω dt). With x̂ predicted from (x, v, a) and r the innovation,
///
/// ```text
///     x := x̂ + (1 − p³) r      v := v̂ + 3/2 (1 − p)² (1 + p) r / dt      a := a + (1 − p)³ r / dt²
/// ```
///
/// stable for any ω dt. The third order is needed for the acceleration: a second-order one changes it by ω² per count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    position: f32,
    speed: f32,
    acceleration: f32,
    dt: f32,
}

impl Gains {
    /// Gains for a bandwidth ω in rad/s and an interval `dt` > 0 in seconds.
    #[must_use]
    pub fn new(bandwidth: f32, dt: f32) -> Self {
        let x = bandwidth * dt;
        // e^−x by its reciprocal's series: within 0.1 % up to x = 1 and well-behaved beyond, where the exact pole does not matter.
        let p = 1.0 / (1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x / 24.0))));
        let q = 1.0 - p;
        Self {
            position: 1.0 - p * p * p,
            speed: 1.5 * q * q * (1.0 + p) / dt,
            acceleration: q * q * q / (dt * dt),
            dt,
        }
    }
}

/// Speed and acceleration of one wheel's circumference, tracked from its displacements.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Observer {
    /// Measured minus estimated position, m: the position itself is never needed, so it cannot run out of digits.
    lag: f32,
    speed: f32,
    acceleration: f32,
}

impl Observer {
    /// After so long, s, the speed is taken from what has been rolled meanwhile. The filter is stable at any interval, but not while long ones come and
    /// go: it would carry the acceleration of a millisecond on over a second.
    pub const GAP: f32 = 0.05;
    /// Below this the state is rest (m/s): decaying further only costs denormal arithmetic.
    const REST: f32 = 1e-9;

    /// Begins anew, at this speed (m/s).
    pub fn restart(&mut self, speed: f32) {
        *self = Self {
            speed,
            ..Self::default()
        };
    }

    /// Takes in a displacement in metres that happened over the gains' interval.
    pub fn update(&mut self, moved: f32, gains: &Gains) {
        let dt = gains.dt;
        // r = measured − (x + v dt + a dt²/2)
        let innovation = self.lag + moved - dt * (self.speed + 0.5 * dt * self.acceleration);
        self.speed += dt * self.acceleration + gains.speed * innovation;
        self.acceleration += gains.acceleration * innovation;
        self.lag = (1.0 - gains.position) * innovation;
        if self.speed.abs() < Self::REST && self.acceleration.abs() < Self::REST {
            *self = Self::default();
        }
    }

    /// Takes in a displacement for which no time has passed.
    pub fn update_at_once(&mut self, moved: f32) {
        self.lag += moved;
    }

    /// m/s.
    #[must_use]
    pub fn speed(&self) -> f32 {
        self.speed
    }

    /// m/s².
    #[must_use]
    pub fn acceleration(&self) -> f32 {
        self.acceleration
    }
}

/// The observers of a vehicle's wheels, which share their gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Observers<const N: usize> {
    /// One for each wheel.
    pub(super) each: [Observer; N],
    bandwidth: f32,
    gains: Gains,
    dt: f32,
}

impl<const N: usize> Observers<N> {
    /// Observers at rest, of this bandwidth (rad/s).
    pub(super) fn new(bandwidth: f32) -> Self {
        let nominal_dt = 1e-3;
        Self {
            each: [Observer::default(); N],
            bandwidth,
            gains: Gains::new(bandwidth, nominal_dt),
            dt: nominal_dt,
        }
    }

    /// Takes another bandwidth over, rad/s.
    pub(super) fn configure(&mut self, bandwidth: f32) {
        self.bandwidth = bandwidth;
        self.gains = Gains::new(bandwidth, self.dt);
    }

    /// Takes in how far each wheel has rolled in `dt` seconds, m.
    #[inline]
    pub(super) fn update(&mut self, metres: [f32; N], dt: f32) {
        if dt > 0.0 {
            if dt != self.dt {
                self.retune(metres, dt);
            }
            for (observer, moved) in self.each.iter_mut().zip(metres) {
                observer.update(moved, &self.gains);
            }
        } else {
            for (observer, moved) in self.each.iter_mut().zip(metres) {
                observer.update_at_once(moved);
            }
        }
    }

    /// Another interval than before. After a gap there is no telling how the speed came about.
    #[cold]
    #[inline(never)]
    fn retune(&mut self, metres: [f32; N], dt: f32) {
        self.gains = Gains::new(self.bandwidth, dt);
        self.dt = dt;
        if dt > Observer::GAP {
            for (observer, moved) in self.each.iter_mut().zip(metres) {
                observer.restart(moved / dt);
            }
        }
    }

    /// m/s.
    #[inline]
    pub(super) fn speeds(&self) -> [f32; N] {
        self.each.map(|observer| observer.speed())
    }

    /// m/s².
    #[inline]
    pub(super) fn accelerations(&self) -> [f32; N] {
        self.each.map(|observer| observer.acceleration())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The counts of a wheel, 0.1 mm each, that follows `position(t)`.
    fn track(position: impl Fn(f64) -> f64, seconds: f64, dt: f64) -> Observer {
        let gains = Gains::new(125.0, dt as f32);
        let mut observer = Observer::default();
        let mut last = 0.0;
        for k in 1..=(seconds / dt) as u32 {
            let count = (position(f64::from(k) * dt) / 1e-4).floor();
            observer.update(((count - last) * 1e-4) as f32, &gains);
            last = count;
        }
        observer
    }

    #[test]
    fn ramp_without_lag() {
        // A third-order tracker follows a constant acceleration without error; what remains is quantisation.
        let observer = track(|t| 0.25 * t * t, 1.0, 1e-3);
        assert!(
            (observer.speed() - 0.5).abs() < 0.006,
            "{}",
            observer.speed()
        );
        assert!((observer.acceleration() - 0.5).abs() < 0.5);
    }

    #[test]
    fn any_interval_is_stable() {
        for dt in [1e-4, 1e-3, 5e-3, 2e-2, 0.1] {
            let speed = track(|t| 0.3 * t, 3.0, dt).speed();
            // One count in the innovation is up to 10 mm/s where ω dt is of the order of 1.
            assert!((speed - 0.3).abs() < 0.012, "dt {dt}: {speed}");
        }
    }

    #[test]
    fn comes_to_exact_rest() {
        let observer = track(|t| t.min(0.5) * 0.4, 2.0, 1e-3);
        assert_eq!(observer, Observer::default());
    }
}
