//! The gear's backlash: a gap, with a stiff and damped contact on either side of it.

use super::params::MotorParams;

/// Which flanks of the teeth touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Contact {
    /// None: the motor turns within the gap.
    Apart,
    /// The motor is ahead of the wheel and pushes it forward.
    Ahead,
    /// The motor is behind the wheel and pushes it backward.
    Behind,
}

/// A gear with backlash.
#[derive(Clone, Debug)]
pub(super) struct Gear {
    /// Half of the backlash \[rad\].
    pub half_gap: f64,
    /// Stiffness of the contact \[N·m/rad\].
    pub stiffness: f64,
    /// Damping of the contact \[N·m·s/rad\].
    pub damping: f64,
}

/// The impulse that the gear passes from motor to wheel in one step: `fixed + rate·(ω_m' − ω_w')`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mesh {
    /// \[N·m·s\].
    pub fixed: f64,
    /// \[N·m·s²/rad\].
    pub rate: f64,
}

impl Gear {
    /// A gear with these parameters.
    pub(super) fn new(params: &MotorParams) -> Self {
        Self {
            half_gap: 0.5 * params.backlash,
            stiffness: params.gear_stiffness,
            damping: params.gear_damping,
        }
    }

    /// Which flanks touch at a twist (motor angle less wheel angle) \[rad\].
    #[inline]
    pub(super) fn contact(&self, twist: f64) -> Contact {
        if twist > self.half_gap {
            Contact::Ahead
        } else if twist < -self.half_gap {
            Contact::Behind
        } else {
            Contact::Apart
        }
    }

    /// How far the flanks of a contact overlap at a twist; negative for [`Contact::Behind`]
    /// \[rad\].
    #[inline]
    pub(super) fn excess(&self, contact: Contact, twist: f64) -> f64 {
        match contact {
            Contact::Apart => 0.0,
            Contact::Ahead => twist - self.half_gap,
            Contact::Behind => twist + self.half_gap,
        }
    }

    /// The impulse of a step of `dt` \[s\] that starts at a twist, with the contact given.
    ///
    /// The torque is taken at the end of the step: that takes energy out of the contact, never puts
    /// any in, however stiff it is.
    #[inline]
    pub(super) fn mesh(&self, contact: Contact, twist: f64, dt: f64) -> Mesh {
        if contact == Contact::Apart {
            return Mesh {
                fixed: 0.0,
                rate: 0.0,
            };
        }
        // T' = k·(e + dt·Δω') + c·Δω', and the impulse is dt·T'
        Mesh {
            fixed: dt * self.stiffness * self.excess(contact, twist),
            rate: dt * (self.damping + self.stiffness * dt),
        }
    }

    /// The contact that a step ought to have had, when it was made with `contact`, started at
    /// `twist` and ended with a motor that turns faster than the wheel by `relative` \[rad/s\].
    #[inline]
    pub(super) fn judge(&self, contact: Contact, twist: f64, relative: f64, dt: f64) -> Contact {
        // The contact can push, but not pull: the sign of its impulse decides.
        let pushes = |side: Contact, sign: f64| {
            let mesh = self.mesh(side, twist, dt);
            sign * (mesh.fixed + mesh.rate * relative) >= 0.0
        };
        match contact {
            Contact::Ahead if !pushes(contact, 1.0) => Contact::Apart,
            Contact::Behind if !pushes(contact, -1.0) => Contact::Apart,
            Contact::Apart => match self.contact(twist + dt * relative) {
                Contact::Ahead if pushes(Contact::Ahead, 1.0) => Contact::Ahead,
                Contact::Behind if pushes(Contact::Behind, -1.0) => Contact::Behind,
                _ => Contact::Apart,
            },
            kept => kept,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 250e-6;

    fn gear() -> Gear {
        Gear {
            half_gap: 0.002,
            stiffness: 1000.0,
            damping: 0.5,
        }
    }

    #[test]
    fn the_gap_passes_nothing() {
        let mesh = gear().mesh(gear().contact(0.001), 0.001, DT);
        assert_eq!((mesh.fixed, mesh.rate), (0.0, 0.0));
    }

    #[test]
    fn both_flanks_push_away() {
        let gear = gear();
        assert!(gear.mesh(gear.contact(0.003), 0.003, DT).fixed > 0.0);
        assert!(gear.mesh(gear.contact(-0.003), -0.003, DT).fixed < 0.0);
    }

    #[test]
    fn a_parting_contact_does_not_pull() {
        let gear = gear();
        // The damping alone would pull with 0.5·10 N·m, against 1000·0.001 N·m of the spring.
        assert_eq!(gear.judge(Contact::Ahead, 0.003, -10.0, DT), Contact::Apart);
        assert_eq!(gear.judge(Contact::Apart, 0.003, -10.0, DT), Contact::Apart);
        assert_eq!(gear.judge(Contact::Ahead, 0.003, -0.1, DT), Contact::Ahead);
    }

    #[test]
    fn a_step_that_closes_the_gap_is_one_with_contact() {
        let gear = gear();
        assert_eq!(gear.judge(Contact::Apart, 0.0019, 1.0, DT), Contact::Ahead);
        assert_eq!(
            gear.judge(Contact::Apart, -0.0019, -1.0, DT),
            Contact::Behind
        );
        assert_eq!(gear.judge(Contact::Apart, 0.0, 1.0, DT), Contact::Apart);
    }
}
