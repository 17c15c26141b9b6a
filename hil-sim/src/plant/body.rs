//! The body: a rigid body in the plane, with casters, on two wheels.

use super::Push;
use super::params::BodyParams;
use super::wheel::{Trial, flush};

/// Acceleration of gravity \[m/s²\].
pub(super) const GRAVITY: f64 = 9.806_65;
/// Speed below which the casters' drag fades \[m/s\].
const CASTER_FADE: f64 = 1e-3;

/// The body and its motion. Velocities are in its own frame, of its centre of mass: for a
/// differential drive the point midway between the wheels.
#[derive(Clone, Debug)]
pub(super) struct Body {
    /// \[kg\].
    pub mass: f64,
    /// \[kg·m²\].
    pub yaw_inertia: f64,
    /// Half of the wheel base \[m\].
    pub half_base: f64,
    /// Position of the casters ahead of the axle or, where there is more than one, of the centre of
    /// mass \[m\].
    pub caster: f64,
    /// Drag of the casters \[N\].
    drag: f64,
    /// x, y \[m\] and θ \[rad\], not wrapped.
    pub pose: [f64; 3],
    /// What rotates and moves.
    pub velocity: Velocity,
}

/// A velocity in the plane, in the body's frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Velocity {
    /// Forward \[m/s\].
    pub forward: f64,
    /// To the left \[m/s\].
    pub lateral: f64,
    /// Yaw rate, counterclockwise \[rad/s\].
    pub yaw: f64,
}

impl Body {
    /// A body with these parameters at rest at the origin, on wheels `base` apart \[m\].
    pub(super) fn new(params: &BodyParams, base: f64) -> Self {
        Self {
            mass: params.mass,
            yaw_inertia: params.yaw_inertia,
            half_base: 0.5 * base,
            caster: params.caster_position,
            drag: params.caster_friction * (1.0 - params.load_share) * params.mass * GRAVITY,
            pose: [0.0; 3],
            velocity: Velocity::default(),
        }
    }

    /// The same body with its centre of mass, which its motion is that of, so far ahead of the rear
    /// axle, and with its reference point, so far ahead of it too, at the origin \[m\].
    pub(super) fn centred(mut self, centre_of_mass: f64, reference: f64) -> Self {
        self.caster -= centre_of_mass;
        self.pose[0] = centre_of_mass - reference;
        self
    }

    /// Speeds over ground where the left and the right tyre touch \[m/s\].
    #[inline]
    pub(super) fn ground(&self, velocity: Velocity) -> [f64; 2] {
        // v_c = u ∓ r·b/2
        let swing = velocity.yaw * self.half_base;
        [velocity.forward - swing, velocity.forward + swing]
    }

    /// The velocity, not moved through the world, in the frame as it is after it turned for `dt`
    /// \[s\].
    ///
    /// This is the centripetal term of the equations of motion, u̇ = … + r·v and v̇ = … − r·u. A
    /// rational rotation (Cayley) keeps the speed's magnitude exactly; taken as forces, these terms
    /// would feed energy in.
    #[inline]
    pub(super) fn turned(&self, dt: f64) -> Velocity {
        let Velocity {
            forward,
            lateral,
            yaw,
        } = self.velocity;
        // t = r·dt/2, cos = (1 − t²)/(1 + t²), sin = 2t/(1 + t²)
        let t = 0.5 * yaw * dt;
        let inverse = 1.0 / (1.0 + t * t);
        let (sin, cos) = (2.0 * t * inverse, (1.0 - t * t) * inverse);
        Velocity {
            forward: cos * forward + sin * lateral,
            lateral: cos * lateral - sin * forward,
            yaw,
        }
    }

    /// The casters' drag as a damping, F_d/(|w| + w_0), at a velocity \[N·s/m\].
    #[inline]
    pub(super) fn caster_damping(&self, velocity: Velocity) -> f64 {
        let sideways = velocity.lateral + velocity.yaw * self.caster;
        let speed = (velocity.forward * velocity.forward + sideways * sideways).sqrt();
        self.drag / (speed + CASTER_FADE)
    }

    /// The velocity at the end of a step of `dt` \[s\].
    ///
    /// `start` is the velocity at its beginning, `trials` the wheels' forces, `grip` the sum of the
    /// tyres' grips and `damping` the casters' \[N·s/m\].
    #[inline]
    pub(super) fn solve(
        &self,
        start: Velocity,
        [left, right]: &[Trial; 2],
        grip: f64,
        damping: f64,
        push: Push,
        dt: f64,
    ) -> Velocity {
        let h = self.half_base;
        // Lateral, with the casters at x_c: m·v' = m·v − dt·ΣD·v' − dt·D_c·(v' + x_c·r')
        let inverse = 1.0 / (self.mass + dt * (grip + damping));
        let arm = dt * damping * self.caster;
        let (lateral_fixed, lateral_rate) = (self.mass * start.lateral * inverse, -arm * inverse);
        // Forward: m·u' = m·u + dt·(Σ(A − B·(u' ∓ h·r')) − D_c·u' + F)
        let forward_inertia = self.mass + dt * (left.slope + right.slope + damping);
        let coupling = dt * h * (right.slope - left.slope);
        let forward_impulse =
            self.mass * start.forward + dt * (left.force + right.force + push.force);
        // Yaw: I·r' = I·r + dt·(h·(F_r − F_l) − x_c·D_c·(v' + x_c·r') + M), with v' put in
        let yaw_inertia = self.yaw_inertia
            + dt * h * h * (left.slope + right.slope)
            + arm * (self.caster + lateral_rate);
        let yaw_impulse = self.yaw_inertia * start.yaw
            + dt * (h * (right.force - left.force) + push.torque)
            - arm * lateral_fixed;
        // [forward_inertia, coupling; coupling, yaw_inertia]·[u'; r'] = impulses: symmetric and
        // positive definite
        let inverse = 1.0 / (forward_inertia * yaw_inertia - coupling * coupling);
        let forward = (forward_impulse * yaw_inertia - coupling * yaw_impulse) * inverse;
        let yaw = (forward_inertia * yaw_impulse - coupling * forward_impulse) * inverse;
        Velocity {
            forward,
            lateral: lateral_fixed + lateral_rate * yaw,
            yaw,
        }
    }

    /// Takes on a velocity and moves with it for `dt` \[s\], on the arc of a circle.
    #[inline]
    pub(super) fn travel(&mut self, velocity: Velocity, dt: f64) {
        let Velocity {
            forward,
            lateral,
            yaw,
        } = velocity;
        let [x, y, heading] = self.pose;
        // The chord of an arc: length v·dt·sin(h)/h with h = r·dt/2, in the direction θ + h
        let half = 0.5 * yaw * dt;
        let (sin, cos) = (heading + half).sin_cos();
        let reach = dt * sinc(half);
        self.pose = [
            x + reach * (forward * cos - lateral * sin),
            y + reach * (forward * sin + lateral * cos),
            heading + yaw * dt,
        ];
        self.velocity = Velocity {
            forward: flush(forward),
            lateral: flush(lateral),
            yaw: flush(yaw),
        };
    }
}

/// sin(h)/h.
#[inline]
fn sinc(h: f64) -> f64 {
    if h.abs() < 0.01 {
        // The next term, h⁶/5040, is below the rounding here.
        let square = h * h;
        1.0 - square / 6.0 * (1.0 - square / 20.0)
    } else {
        h.sin() / h
    }
}

#[cfg(test)]
mod tests {
    use super::super::robots;
    use super::*;

    #[test]
    fn sinc_is_continuous() {
        for h in [1e-9, 0.009_999, 0.010_001, 0.5, -0.009_999] {
            // Tolerance: rounding.
            assert!((sinc(h) - f64::sin(h) / h).abs() < 1e-15);
        }
    }

    #[test]
    fn an_arc_of_any_step_ends_where_the_circle_does() {
        let mut body = Body::new(&robots::default().body, 0.2);
        // Two quarter turns at 0.5 m radius, in steps of 0.05 rad and in one.
        for _ in 0..31 {
            body.travel(
                Velocity {
                    forward: 0.5,
                    lateral: 0.0,
                    yaw: 1.0,
                },
                std::f64::consts::PI / 62.0,
            );
        }
        body.travel(
            Velocity {
                forward: 0.5,
                lateral: 0.0,
                yaw: 1.0,
            },
            std::f64::consts::FRAC_PI_2,
        );
        // Tolerance: rounding over 32 steps.
        assert!(
            body.pose[0].abs() < 1e-13 && (body.pose[1] - 1.0).abs() < 1e-13,
            "{:?}",
            body.pose
        );
    }

    #[test]
    fn turning_the_frame_keeps_the_speed() {
        let mut body = Body::new(&robots::default().body, 0.2);
        body.velocity = Velocity {
            forward: 0.7,
            lateral: 0.3,
            yaw: 20.0,
        };
        let turned = body.turned(250e-6);
        // Tolerance: rounding; and t³/3 with t = 2.5e-3 for the angle of the rational rotation.
        assert!((turned.forward.hypot(turned.lateral) - 0.7f64.hypot(0.3)).abs() < 1e-15);
        let angle = 0.3f64.atan2(0.7) - turned.lateral.atan2(turned.forward);
        assert!((angle - 20.0 * 250e-6).abs() < 2e-8);
    }
}
