//! The two wheels of a steered axle [H §II.C], as theory section 5 corrects it.

use super::{Jacobian, Twist};
use crate::math::{larger, limit, sign, sin_cos, sqrt};

/// Steering angles are taken to be within ± this, rad: 80°. At 90° both wheels roll alike whatever the yaw rate is.
pub const STEEPEST: f32 = 1.4;
/// Bounds the derivatives where a wheel's S* passes through 0: there the path turns about a point within the track, which is no car's.
const STEEPEST_RATIO: f32 = 10.0;

/// How the displacements of the wheels make up the motion of the axle's centre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Relation {
    /// Wheels on circles about the common centre (theory section 5):
    ///
    /// ```text
    ///     q = (S_r² − S_l²)(1/cos α − 1)/2
    ///     S_r* = sign(S_r) √(S_r² + q)     S_l* = sign(S_l) √(S_l² − q)
    ///     ΔS = (S_r* + S_l*)/2             Δθ = (S_r* − S_l*)/B
    /// ```
    #[default]
    Exact,
    /// \[H eq. 2\], the first order in B/ρ of it, for comparison:
    ///
    /// ```text
    ///     ΔS = (S_r + S_l)/2               Δθ = (S_r − S_l)/(B cos α)
    /// ```
    Printed,
}

/// An axle of two wheels at the distance B, each of which stands at right angles to its way to the common centre. The axle's centre moves along θ + α.
///
/// Wheels come left first. Displacements, or speeds: the relation is homogeneous. A wheel's displacement has the sign of its S*.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Axle {
    relation: Relation,
    track: f32,
    half_track: f32,
    /// 1/B.
    curvature: f32,
}

/// A steering angle as the relation needs it.
#[derive(Clone, Copy)]
struct Steering {
    sin: f32,
    cos: f32,
}

impl Steering {
    /// Within ±[`STEEPEST`]; a NaN is 0.
    fn new(angle: f32) -> Self {
        let (sin, cos) = sin_cos(limit(angle, STEEPEST));
        Self { sin, cos }
    }

    /// 1 − cos α, without its cancellation.
    fn versine(self) -> f32 {
        self.sin * self.sin / (1.0 + self.cos)
    }

    /// 1/cos α − 1.
    fn excess(self) -> f32 {
        self.versine() / self.cos
    }
}

impl Axle {
    /// An axle of the track B (distance of the wheels' contacts, m), above 0.
    #[must_use]
    pub fn new(track: f32, relation: Relation) -> Self {
        Self {
            relation,
            track,
            half_track: 0.5 * track,
            curvature: 1.0 / track,
        }
    }

    /// B, m.
    #[must_use]
    pub fn track(&self) -> f32 {
        self.track
    }

    /// ΔS and Δθ of the axle's centre from its wheels, steered by α (rad).
    ///
    /// Not for one cycle's counts: the relation is not linear, and on numbers as small as a count or none it is wrong by per cents. Counts take
    /// [`Self::scaling`]. Displacements that no motion of the axle has (a radicand below 0) count as S* = 0; what is not finite, as no motion.
    #[must_use]
    pub fn twist(&self, [left, right]: [f32; 2], steering: f32) -> Twist {
        let steering = Steering::new(steering);
        let (sum, difference) = (right + left, right - left);
        let twist = match self.relation {
            Relation::Printed => Twist {
                translation: 0.5 * sum,
                rotation: difference * (self.curvature / steering.cos),
            },
            // As the differential drive has it, to the bit.
            Relation::Exact if steering.sin == 0.0 => Twist {
                translation: 0.5 * sum,
                rotation: difference * self.curvature,
            },
            Relation::Exact => {
                // The changes S* − S, not S* itself: straight ahead they are small, and the difference of the wheels keeps all of its digits.
                let q = 0.5 * difference * sum * steering.excess();
                let (of_left, of_right) = (change(left, -q), change(right, q));
                Twist {
                    translation: 0.5 * (sum + (of_right + of_left)),
                    rotation: (difference + (of_right - of_left)) * self.curvature,
                }
            }
        };
        twist.or_none()
    }

    /// The wheels from ΔS and Δθ of the axle's centre: the inverse of [`Self::twist`].
    ///
    /// ```text
    ///     S_r = sign(ΔS + Δθ B/2) √(ΔS² + ΔS Δθ B cos α + Δθ² B²/4)     S_l with −Δθ
    /// ```
    #[must_use]
    pub fn wheels(&self, twist: Twist, steering: f32) -> [f32; 2] {
        let steering = Steering::new(steering);
        let twist = twist.or_none();
        let wheels = match self.relation {
            Relation::Printed => {
                let sideways = twist.rotation * self.half_track * steering.cos;
                [twist.translation - sideways, twist.translation + sideways]
            }
            Relation::Exact if steering.sin == 0.0 => self.starred(twist),
            Relation::Exact => {
                let starred = self.starred(twist);
                let [left, right] = self.changes(twist, steering);
                [starred[0] + left, starred[1] + right]
            }
        };
        if wheels.into_iter().all(f32::is_finite) {
            wheels
        } else {
            [0.0; 2]
        }
    }

    /// S* of the wheels: of a differential drive with the same ΔS and Δθ.
    fn starred(&self, twist: Twist) -> [f32; 2] {
        let sideways = twist.rotation * self.half_track;
        [twist.translation - sideways, twist.translation + sideways]
    }

    /// S − S* of the wheels.
    fn changes(&self, twist: Twist, steering: Steering) -> [f32; 2] {
        let [left, right] = self.starred(twist);
        // S_r² = S_r*² − ΔS Δθ B (1 − cos α)
        let q = twist.translation * twist.rotation * self.track * steering.versine();
        [change(left, q), change(right, -q)]
    }

    /// What one cycle's displacements are to be scaled by on the curve that the axle's centre describes. Only the proportion Δθ : ΔS of `curve` counts.
    ///
    /// The curve is [`Self::twist`] of the observers' speeds, or what the steering angle prescribes
    /// ([`bisteerable::Geometry::curvature`](super::bisteerable::Geometry::curvature)); an error of it enters Δθ by 1 − cos α only. It must not follow single
    /// counts, as a count and its wheel's speed then rise in the same cycle: at 0.1 m/s and 0.3 mm a count, observers of 125 rad/s leave 0.2 % of Δθ, those of
    /// 10 rad/s 0.001 %. At rest the observers tell no curve, which counts as straight.
    #[must_use]
    pub fn scaling(&self, curve: Twist, steering: f32) -> Scaling {
        let steering = Steering::new(steering);
        match self.relation {
            Relation::Printed => Scaling {
                wheels: [1.0; 2],
                curvature: self.curvature / steering.cos,
            },
            Relation::Exact => {
                // Of about one, so that no square runs out of exponents.
                let size = larger(
                    curve.translation.abs(),
                    curve.rotation.abs() * self.half_track,
                );
                let curve = Twist {
                    translation: curve.translation / size,
                    rotation: curve.rotation / size,
                }
                .or_none();
                let starred = self.starred(curve);
                let changes = self.changes(curve, steering);
                let ratio = |wheel: usize| {
                    let is = starred[wheel] + changes[wheel];
                    // At rest, or in the one wheel that an unsteered axle turns about.
                    if is == 0.0 { 1.0 } else { starred[wheel] / is }
                };
                Scaling {
                    wheels: [ratio(0), ratio(1)],
                    curvature: self.curvature,
                }
            }
        }
    }

    /// What a change of the curve and of α changes in ΔS and Δθ by [`Self::scaling`], relative to themselves. With x = κB/2 of the curve, x' and α' their
    /// derivatives by whatever changes:
    ///
    /// ```text
    ///     v = 1 − cos α      D± = 1 ± 2x cos α + x²
    ///     P = x' v (1 − x) + α' x (1 + x) sin α      Q = x' v (1 + x) + α' x (1 − x) sin α
    ///     ∂ΔS/ΔS = (P/D₊ − Q/D₋)/2      ∂Δθ/Δθ = (P/D₊ + Q/D₋)/(2x)
    /// ```
    ///
    /// As printed: ∂Δθ/Δθ = α' tan α.
    #[must_use]
    pub fn sensitivity(&self, steering: f32, [x, dx]: [f32; 2], slope: f32) -> Twist {
        let steering = Steering::new(steering);
        let twist = match self.relation {
            Relation::Printed => Twist {
                translation: 0.0,
                rotation: slope * steering.sin / steering.cos,
            },
            Relation::Exact => {
                // 1 ± 2x cos α + x² = (1 ± x)² ∓ 2xv
                let versine = steering.versine();
                let part = |x: f32, dx: f32| {
                    let both = dx * versine * (1.0 - x) + slope * x * (1.0 + x) * steering.sin;
                    both / ((1.0 + x) * (1.0 + x) - 2.0 * x * versine)
                };
                let (right, left) = (part(x, dx), part(-x, -dx));
                Twist {
                    translation: 0.5 * (right + left),
                    // Straight ahead nothing changes.
                    rotation: if x == 0.0 {
                        0.0
                    } else {
                        0.5 * (right - left) / x
                    },
                }
            }
        };
        twist.or_none()
    }

    /// Derivatives of [`Self::twist`]. Those by the wheels depend on the proportion of the displacements only, so the observers' speeds serve as well.
    ///
    /// With c = 1/cos α − 1:
    ///
    /// ```text
    ///     ∂S_r*/∂S_r = (1 + c/2) S_r/S_r*    ∂S_r*/∂S_l = −(c/2) S_l/S_r*    ∂S_r*/∂α = (S_r² − S_l²) sin α/(4 cos²α S_r*)
    /// ```
    ///
    /// and the same of S_l* with l and r exchanged. At rest they are those of a straight path.
    #[must_use]
    pub fn jacobian(&self, [left, right]: [f32; 2], steering: f32) -> Jacobian<2> {
        let steering = Steering::new(steering);
        match self.relation {
            Relation::Printed => {
                let per_metre = self.curvature / steering.cos;
                let wheel = |rotation| Twist {
                    translation: 0.5,
                    rotation,
                };
                Jacobian {
                    by_wheel: [wheel(-per_metre), wheel(per_metre)],
                    by_steering: Twist {
                        translation: 0.0,
                        rotation: (right - left) * per_metre * steering.sin / steering.cos,
                    }
                    .or_none(),
                }
            }
            Relation::Exact => {
                let c = steering.excess();
                let slope = steering.sin / (steering.cos * steering.cos);
                let q = 0.5 * (right - left) * (right + left) * c;
                // S*, with its derivatives by the wheel itself, the other one, and α.
                let wheel = |own: f32, other: f32, q: f32| {
                    let starred = own + change(own, q);
                    let (by_own, by_other) = (ratio(own, starred), ratio(other, starred));
                    [
                        (1.0 + 0.5 * c) * by_own,
                        -0.5 * c * by_other,
                        0.25 * slope * (own - other) * (by_own + by_other),
                    ]
                };
                let [ll, lr, la] = wheel(left, right, -q);
                let [rr, rl, ra] = wheel(right, left, q);
                let twist = |left: f32, right: f32| Twist {
                    translation: 0.5 * (right + left),
                    rotation: (right - left) * self.curvature,
                };
                Jacobian {
                    by_wheel: [twist(ll, rl), twist(lr, rr)],
                    by_steering: twist(la, ra).or_none(),
                }
            }
        }
    }
}

/// A linear map of a cycle's wheel displacements to the motion of the axle's centre: however the counts fall into cycles, nothing of them is lost.
///
/// ```text
///     S_r* = S_r |1 + κB/2| / √(1 + κB cos α + κ²B²/4)     S_l* with −κ     κ = Δθ/ΔS
/// ```
///
/// (theory section 5, with the magnitude of the numerator: beyond |κ| = 2/B the inner wheel rolls back, and S has the sign of S* as in the relation itself).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scaling {
    /// S*/S, left first: between 0 and 1.31.
    pub wheels: [f32; 2],
    /// Δθ for each metre of S_r* − S_l*, 1/m.
    pub curvature: f32,
}

impl Scaling {
    /// ΔS and Δθ of the axle's centre.
    #[must_use]
    pub fn twist(&self, [left, right]: [f32; 2]) -> Twist {
        let [of_left, of_right] = self.wheels;
        let (left, right) = (left * of_left, right * of_right);
        Twist {
            translation: 0.5 * (right + left),
            rotation: (right - left) * self.curvature,
        }
        .or_none()
    }
}

/// sign(x) √(x² + q) − x: by what a wheel's displacement changes. −x where the radicand is below 0.
fn change(x: f32, q: f32) -> f32 {
    let square = x * x + q;
    if q == 0.0 {
        0.0
    } else if square > 0.0 {
        // The third binomial formula: the sum of two numbers of one sign cannot cancel.
        q / (x + sign(x) * sqrt(square))
    } else {
        -x
    }
}

/// x/y within ±[`STEEPEST_RATIO`]; 1 for 0/0, as on a straight path, and for what is no number.
fn ratio(x: f32, y: f32) -> f32 {
    let ratio = x / y;
    if ratio.is_nan() {
        1.0
    } else {
        limit(ratio, STEEPEST_RATIO)
    }
}
