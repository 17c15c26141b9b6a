//! From four wheels and a steering angle to the middle of the rear axle and back.

use super::super::{Axle, Influence, Jacobian, Relation, STEEPEST, Scaling, Twist};
use crate::math::{limit, sign, sin_cos, sqrt};
use core::f32::consts::FRAC_PI_2;

/// f: how the rear axle is steered when the front axle is steered by φ, φ_r = f(φ) [H §II.B].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RearSteering {
    /// An ordinary car: f(φ) = 0.
    #[default]
    Fixed,
    /// The Cycab: f(φ) = −φ.
    Opposite,
}

impl RearSteering {
    /// φ_r, rad.
    #[must_use]
    pub fn angle(self, front: f32) -> f32 {
        self.slope() * front
    }

    /// f'(φ).
    #[must_use]
    pub fn slope(self) -> f32 {
        match self {
            Self::Fixed => 0.0,
            Self::Opposite => -1.0,
        }
    }
}

/// Speeds (m/s) or displacements (m) of the four wheels, left first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Wheels {
    /// Of the rear axle.
    pub rear: [f32; 2],
    /// Of the front axle.
    pub front: [f32; 2],
}

/// The geometry: two axles at the distance L, and f. The reference point is the middle of the rear axle, which moves along θ + f(φ).
///
/// φ is the steering angle of the front axle, rad, positive to the left, and taken to be within ±[`STEEPEST`]; a NaN counts as 0. Wheels that are not
/// finite numbers count as no motion.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Geometry {
    wheel_base: f32,
    rear: Axle,
    front: Axle,
    rear_steering: RearSteering,
}

/// Sines and cosines of φ_f and φ_r.
#[derive(Clone, Copy)]
struct Steering {
    front: (f32, f32),
    rear: (f32, f32),
    /// f'(φ).
    slope: f32,
}

impl Steering {
    /// ΔS of the rear axle for one of the front axle: both have the same part along the car, v_r cos φ_r = v_f cos φ_f.
    fn transport(self) -> f32 {
        self.front.1 / self.rear.1
    }

    /// Its derivative by φ.
    fn transport_slope(self) -> f32 {
        let ((sin, cos), (rear_sin, rear_cos)) = (self.front, self.rear);
        (self.slope * cos * rear_sin / rear_cos - sin) / rear_cos
    }
}

impl Geometry {
    /// A geometry of the wheel base L and the tracks of the rear and of the front axle (m), all above 0.
    #[must_use]
    pub fn new(
        wheel_base: f32,
        [rear, front]: [f32; 2],
        rear_steering: RearSteering,
        relation: Relation,
    ) -> Self {
        Self {
            wheel_base,
            rear: Axle::new(rear, relation),
            front: Axle::new(front, relation),
            rear_steering,
        }
    }

    /// L, m.
    #[must_use]
    pub fn wheel_base(&self) -> f32 {
        self.wheel_base
    }

    /// The rear axle, which is steered by [`Self::direction`].
    #[must_use]
    pub fn rear_axle(&self) -> &Axle {
        &self.rear
    }

    /// The front axle, which is steered by φ.
    #[must_use]
    pub fn front_axle(&self) -> &Axle {
        &self.front
    }

    /// α = f(φ): where the reference point goes, against θ.
    #[must_use]
    pub fn direction(&self, steering: f32) -> f32 {
        self.rear_steering.angle(limit(steering, STEEPEST))
    }

    fn steering(&self, angle: f32) -> Steering {
        let angle = limit(angle, STEEPEST);
        Steering {
            front: sin_cos(angle),
            rear: sin_cos(self.rear_steering.angle(angle)),
            slope: self.rear_steering.slope(),
        }
    }

    /// Δθ/ΔS of the rear axle's centre, 1/m: sin(φ_f − φ_r)/(L cos φ_f) (theory section 5).
    #[must_use]
    pub fn curvature(&self, steering: f32) -> f32 {
        let Steering {
            front: (sin, cos),
            rear: (rear_sin, rear_cos),
            ..
        } = self.steering(steering);
        (sin * rear_cos - cos * rear_sin) / (cos * self.wheel_base)
    }

    /// φ for a wanted speed of the rear axle's centre and a yaw rate: the inverse of [`Self::curvature`].
    ///
    /// ```text
    ///     f = 0: tan φ = κL          f = −φ: sin φ = κL/2          κ = v_α/v_s
    /// ```
    ///
    /// The same in reverse. Curves that are too tight for any angle, and turns without translation, are answered by ±90°: a car's own limit is for the
    /// caller. None if neither is wanted (then any angle will do: leave it as it is), or what is wanted is not finite.
    #[must_use]
    pub fn steering_for(&self, wanted: Twist) -> Option<f32> {
        let aside = sign(wanted.translation) * wanted.rotation * self.wheel_base;
        let ahead = wanted.translation.abs();
        if !(aside.is_finite() && ahead.is_finite()) || (aside == 0.0 && ahead == 0.0) {
            return None;
        }
        Some(match self.rear_steering {
            RearSteering::Fixed => libm::atan2f(aside, ahead),
            RearSteering::Opposite => {
                let (opposite, hypotenuse) = (0.5 * aside, ahead);
                if opposite.abs() < hypotenuse {
                    let sine = opposite / hypotenuse;
                    libm::atan2f(sine, sqrt((1.0 - sine) * (1.0 + sine)))
                } else {
                    sign(aside) * FRAC_PI_2
                }
            }
        })
    }

    /// How far ahead of the rear axle the vehicle's reference point lies, m: where the car's axis moves along θ. That is on the perpendicular from the common
    /// centre: the middle of a fixed rear axle, the middle of a car whose axles are steered alike.
    #[must_use]
    pub fn reference(&self) -> f32 {
        match self.rear_steering {
            RearSteering::Fixed => 0.0,
            RearSteering::Opposite => 0.5 * self.wheel_base,
        }
    }

    /// ΔS and Δα of the reference point, from the rear axle's: all points of the car's axis go the same way along it, ΔS = ΔS_r cos φ_r.
    #[must_use]
    pub fn at_reference(&self, rear: Twist, steering: f32) -> Twist {
        let (_, cos) = sin_cos(self.direction(steering));
        Twist {
            translation: rear.translation * cos,
            ..rear
        }
    }

    /// The inverse of [`Self::at_reference`].
    #[must_use]
    pub fn at_rear(&self, twist: Twist, steering: f32) -> Twist {
        let (_, cos) = sin_cos(self.direction(steering));
        Twist {
            translation: twist.translation / cos,
            ..twist
        }
    }

    /// Δα/ΔS of the reference point, 1/m: tan φ/L, or 2 tan φ/L if the rear axle is steered, too.
    #[must_use]
    pub fn path_curvature(&self, steering: f32) -> f32 {
        let (sin, cos) = sin_cos(limit(steering, STEEPEST));
        sin / (cos * (self.wheel_base - self.reference()))
    }

    /// φ for a wanted twist of the reference point: the inverse of [`Self::path_curvature`], the same in reverse, and ±90° for a turn without translation. None
    /// if neither is wanted, or what is wanted is not finite.
    #[must_use]
    pub fn steering_towards(&self, wanted: Twist) -> Option<f32> {
        let aside =
            sign(wanted.translation) * wanted.rotation * (self.wheel_base - self.reference());
        let ahead = wanted.translation.abs();
        let is_known = aside.is_finite() && ahead.is_finite() && (aside != 0.0 || ahead != 0.0);
        is_known.then(|| libm::atan2f(aside, ahead))
    }

    /// Speeds of the wheels for a speed of the rear axle's centre (m/s) while the car is steered by φ.
    #[must_use]
    pub fn wheel_speeds(&self, speed: f32, steering: f32) -> Wheels {
        let rear = Twist {
            translation: speed,
            rotation: speed * self.curvature(steering),
        };
        let front = Twist {
            translation: speed / self.steering(steering).transport(),
            ..rear
        };
        Wheels {
            rear: self.rear.wheels(rear, self.direction(steering)),
            front: self.front.wheels(front, steering),
        }
    }

    /// ΔS and Δα of the rear axle's centre, from the front axle's.
    #[must_use]
    pub fn from_front(&self, front: Twist, steering: f32) -> Twist {
        Twist {
            translation: front.translation * self.steering(steering).transport(),
            ..front
        }
    }

    /// The best of what the two axles say of the rear axle's centre. Were they told by wheels that are equally good, ΔS of the rear axle has the variance
    /// σ²/2 and of the front axle (σ cos φ_f/cos φ_r)²/2; Δα has 2σ²/(B cos α)². Each counts by its reciprocal.
    #[must_use]
    pub fn fused(&self, rear: Twist, from_front: Twist, steering: f32) -> Twist {
        let [translation, rotation] = self.weights(self.steering(steering));
        Twist {
            translation: rear.translation
                + translation * (from_front.translation - rear.translation),
            rotation: rear.rotation + rotation * (from_front.rotation - rear.rotation),
        }
        .or_none()
    }

    /// How the displacements of the rear wheels are to be scaled while the car is steered by φ: see [`Axle::scaling`].
    #[must_use]
    pub fn rear_scaling(&self, steering: f32) -> Scaling {
        let curve = Twist {
            translation: 1.0,
            rotation: self.curvature(steering),
        };
        self.rear.scaling(curve, self.direction(steering))
    }

    /// How those of the front wheels are.
    #[must_use]
    pub fn front_scaling(&self, steering: f32) -> Scaling {
        let curve = Twist {
            translation: 1.0 / self.steering(steering).transport(),
            rotation: self.curvature(steering),
        };
        self.front.scaling(curve, limit(steering, STEEPEST))
    }

    /// What gains do to the reference point's motions while the car is steered by φ, as the wheels of one axle tell them.
    ///
    /// With a the axle's angle, a' = da/dφ, and S', A' what [`Axle::sensitivity`] says of ΔS and Δα of its centre, by φ and by B:
    ///
    /// ```text
    ///     ∂ΔS/∂k_r = (ΔS/2 + Δα B cos a/4)/k_r     ∂Δα/∂k_r = (ΔS/(B cos a) + Δα/2)/k_r      k_l with −B
    ///     ∂ΔS/∂k_b = S'_B ΔS/k_b     ∂Δα/∂k_b = (A'_B − 1) Δα/k_b     ∂ΔS/∂φ₀ = (S'_φ − a' tan a) ΔS     ∂Δα/∂φ₀ = A'_φ Δα
    /// ```
    fn influence_of(&self, axle: &Axle, phi: f32, slope: f32) -> Influence {
        let angle = slope * phi;
        let (sin, cos) = sin_cos(angle);
        // κ of the reference point, and of the axle's centre, which goes farther.
        let (phi_sin, phi_cos) = sin_cos(phi);
        let tangent = phi_sin / phi_cos;
        let length = self.wheel_base - self.reference();
        let half = 0.5 * axle.track();
        let x = half * cos * tangent / length;
        let dx = half * (cos * (1.0 + tangent * tangent) - slope * sin * tangent) / length;
        let by_angle = axle.sensitivity(angle, [x, dx], slope);
        let by_track = axle.sensitivity(angle, [x, x], 0.0);
        let wheel = |half: f32| [0.5, 0.5 * half * cos, 0.5 / (half * cos), 0.5];
        Influence {
            by_gain: [
                wheel(half),
                wheel(-half),
                [by_track.translation, 0.0, 0.0, by_track.rotation - 1.0],
                [
                    by_angle.translation - slope * sin / cos,
                    0.0,
                    0.0,
                    by_angle.rotation,
                ],
            ],
        }
    }

    /// What gains of 1 would change in the reference point's motions while the car is steered by φ, as the rear axle's wheels tell them: right wheels, left
    /// wheels, tracks, φ₀.
    #[must_use]
    pub fn rear_influence(&self, steering: f32) -> Influence {
        let phi = limit(steering, STEEPEST);
        self.influence_of(&self.rear, phi, self.rear_steering.slope())
    }

    /// The same, as the front axle's wheels tell them.
    #[must_use]
    pub fn front_influence(&self, steering: f32) -> Influence {
        self.influence_of(&self.front, limit(steering, STEEPEST), 1.0)
    }

    /// How much the front axle counts for ΔS and for Δα, 0 to 1.
    fn weights(&self, steering: Steering) -> [f32; 2] {
        let transport = steering.transport();
        let rear = self.rear.track() * steering.rear.1;
        let front = self.front.track() * steering.front.1;
        [
            1.0 / (1.0 + transport * transport),
            front * front / (rear * rear + front * front),
        ]
    }

    /// ΔS and Δα by the wheels of the rear axle.
    #[must_use]
    pub fn rear(&self, wheels: [f32; 2], steering: f32) -> Twist {
        self.rear.twist(wheels, self.direction(steering))
    }

    /// ΔS and Δα by the wheels of the front axle.
    #[must_use]
    pub fn front(&self, wheels: [f32; 2], steering: f32) -> Twist {
        self.from_front(self.front.twist(wheels, steering), steering)
    }

    /// ΔS and Δα by all four wheels.
    #[must_use]
    pub fn four(&self, wheels: &Wheels, steering: f32) -> Twist {
        let rear = self.rear(wheels.rear, steering);
        self.fused(rear, self.front(wheels.front, steering), steering)
    }

    /// Derivatives of [`Self::rear`].
    #[must_use]
    pub fn rear_jacobian(&self, wheels: [f32; 2], steering: f32) -> Jacobian<2> {
        let axle = self.rear.jacobian(wheels, self.direction(steering));
        let slope = self.rear_steering.slope();
        Jacobian {
            by_steering: Twist {
                translation: slope * axle.by_steering.translation,
                rotation: slope * axle.by_steering.rotation,
            },
            ..axle
        }
    }

    /// Derivatives of [`Self::front`].
    #[must_use]
    pub fn front_jacobian(&self, wheels: [f32; 2], steering: f32) -> Jacobian<2> {
        let axle = self.front.jacobian(wheels, steering);
        let moved = self.front.twist(wheels, steering).translation;
        let steering = self.steering(steering);
        let transported = |twist: Twist| Twist {
            translation: steering.transport() * twist.translation,
            ..twist
        };
        let mut by_steering = transported(axle.by_steering);
        by_steering.translation += steering.transport_slope() * moved;
        Jacobian {
            by_wheel: axle.by_wheel.map(transported),
            by_steering,
        }
    }

    /// Derivatives of [`Self::four`]: rear left, rear right, front left, front right. The weights are taken as constant: what a change of theirs would do is
    /// proportional to the axles' disagreement, which is noise itself.
    #[must_use]
    pub fn four_jacobian(&self, wheels: &Wheels, steering: f32) -> Jacobian<4> {
        let rear = self.rear_jacobian(wheels.rear, steering);
        let front = self.front_jacobian(wheels.front, steering);
        let by_rear = |twist| self.fused(twist, Twist::ZERO, steering);
        let by_front = |twist| self.fused(Twist::ZERO, twist, steering);
        let [rear_left, rear_right] = rear.by_wheel.map(by_rear);
        let [front_left, front_right] = front.by_wheel.map(by_front);
        Jacobian {
            by_wheel: [rear_left, rear_right, front_left, front_right],
            by_steering: self.fused(rear.by_steering, front.by_steering, steering),
        }
    }
}
