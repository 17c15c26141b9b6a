//! The balance of impulses of a body on any number of wheels: three equations, linear in the
//! velocity at the end of a step.

use super::body::{Body, Velocity};
use super::input::Push;
use super::stance::Row;

/// A·q' = b with q = (u, v, r): A is symmetric and positive definite, as it starts with the masses
/// and whatever is added resists.
#[derive(Clone, Copy, Debug)]
pub(super) struct Balance {
    /// Upper triangle of A, by rows: masses \[kg\], inertia \[kg·m²\].
    matrix: [f64; 6],
    /// b \[N·s, N·s, N·m·s\].
    impulse: [f64; 3],
}

impl Balance {
    /// A body that had the velocity `start`, with its casters and what pushes it, but without
    /// wheels, over a step of `dt` \[s\].
    ///
    /// `heading` is the direction of the push in the body's frame as (cos, sin).
    #[inline]
    pub(super) fn new(
        body: &Body,
        start: Velocity,
        heading: [f64; 2],
        push: Push,
        dt: f64,
    ) -> Self {
        let mut balance = Self {
            matrix: [body.mass, 0.0, 0.0, body.mass, 0.0, body.yaw_inertia],
            impulse: [
                body.mass * start.forward + dt * push.force * heading[0],
                body.mass * start.lateral + dt * push.force * heading[1],
                body.yaw_inertia * start.yaw + dt * push.torque,
            ],
        };
        let damping = dt * body.caster_damping(start);
        balance.resist(&[1.0, 0.0, 0.0], damping);
        balance.resist(&[0.0, 1.0, body.caster], damping);
        balance
    }

    /// Adds an impulse along a row \[N·s\].
    #[inline]
    pub(super) fn push(&mut self, row: &Row, impulse: f64) {
        for (sum, factor) in self.impulse.iter_mut().zip(row) {
            *sum += impulse * factor;
        }
    }

    /// Adds an impulse against the speed along a row: `damping` \[N·s²/m\] times it.
    #[inline]
    pub(super) fn resist(&mut self, &[a, b, c]: &Row, damping: f64) {
        let products = [a * a, a * b, a * c, b * b, b * c, c * c];
        for (sum, product) in self.matrix.iter_mut().zip(products) {
            *sum += damping * product;
        }
    }

    /// The velocity at the end of the step.
    #[inline]
    pub(super) fn solve(&self) -> Velocity {
        // A = L·D·Lᵀ, which no positive definite matrix needs a pivot for
        let [uu, uv, ur, vv, vr, rr] = self.matrix;
        let (l_vu, l_ru) = (uv / uu, ur / uu);
        let d_v = vv - l_vu * uv;
        let rest = vr - l_vu * ur;
        let l_rv = rest / d_v;
        let d_r = rr - l_ru * ur - l_rv * rest;
        let [b_u, b_v, b_r] = self.impulse;
        let z_v = b_v - l_vu * b_u;
        let z_r = b_r - l_ru * b_u - l_rv * z_v;
        let yaw = z_r / d_r;
        let lateral = z_v / d_v - l_rv * yaw;
        Velocity {
            forward: b_u / uu - l_vu * lateral - l_ru * yaw,
            lateral,
            yaw,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::robots;
    use super::super::stance::{Stance, product};
    use super::*;

    #[test]
    fn the_solution_balances_the_impulses() {
        let body = Body::new(&robots::default().body, 0.2);
        let start = Velocity {
            forward: 0.4,
            lateral: -0.1,
            yaw: 3.0,
        };
        let push = Push {
            force: 5.0,
            torque: 0.2,
        };
        let mut balance = Balance::new(&body, start, [1.0, 0.0], push, 1e-3);
        let stances = [
            Stance::new([0.1, 0.2], 0.3),
            Stance::new([-0.2, -0.1], -1.2),
        ];
        for stance in &stances {
            balance.push(&stance.along, 0.3);
            balance.resist(&stance.along, 40.0);
            balance.resist(&stance.across, 300.0);
        }
        let end = balance.solve();
        // m·Δq less all impulses, with the casters' at rest: tolerance: rounding of sums of 100.
        let damping = 1e-3 * body.caster_damping(start);
        let sideways = damping * (end.lateral + body.caster * end.yaw);
        let mut left = [
            2.5 * (end.forward - 0.4) - 5e-3 + damping * end.forward,
            2.5 * (end.lateral + 0.1) + sideways,
            0.02 * (end.yaw - 3.0) - 2e-4 + body.caster * sideways,
        ];
        for stance in &stances {
            let along = 0.3 - 40.0 * product(&stance.along, end);
            let across = -300.0 * product(&stance.across, end);
            for (rest, (a, b)) in left.iter_mut().zip(stance.along.iter().zip(stance.across)) {
                *rest -= a * along + b * across;
            }
        }
        assert!(left.iter().all(|rest| rest.abs() < 1e-13), "{left:?}");
    }
}
