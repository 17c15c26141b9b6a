//! Corrections from outside: the Kalman command, and observations that arrive late [C §3], theory sections 4 and 6.
//!
//! Everything here runs outside the control interrupt, against a snapshot. Differences of nearly equal covariances are formed: interpolated or rounded,
//! they may be slightly indefinite, and their positive part is what counts.
//!
//! An observation is taken number by number, after its covariance has been made diagonal: each is a division, none a matrix to invert. With C the pose's own
//! covariance, Γ the leverage of the gains and P their covariance ([`super::belief`]), a number with row h, variance r and innovation ν is worth
//!
//! ```text
//!     s_e = r + hᵀ C h     γ = Γᵀ h     s = s_e + γᵀ P γ     d² = ν²/s
//!     learned:      k_g = P γ/s    δg = k_g ν    P := P − s k_g k_gᵀ    k = C h/s_e
//!     considered:   δg = 0                                               k = (C + Γ P Γᵀ) h/s
//!     P̂ := P̂ + Γ δg + k (ν − γ·δg)     C := (I − k hᵀ) C (I − k hᵀ)ᵀ + r k kᵀ     Γ := Γ − k γᵀ
//! ```
//!
//! which is the Kalman filter of pose and gains together (B. Friedland 1969), and where the gains are only considered, that of S. F. Schmidt (1966).
//!
//! An older observation after a newer one is taken as if the newer had not told of the older's instant: what the two share is counted as the theory's
//! section 4 does, which may be off by a tenth of the covariance. Keeping the cross-covariances would cost 4 KiB. Where the gains are only considered, the
//! order matters anyhow: that filter, exact in every way, is a fiftieth of the innovation apart.

use super::belief::{Belief, Leverage};
use super::estimator::{Pose, transport};
use crate::math::{
    NotPositive, add_outer, along, applied, inner, is_finite, nearest_positive, positive_part,
    product, product_transposed, scaled, sum, symmetric, symmetric_part, transported, wrap,
    written_covariance,
};
use crate::vehicle::gains::{GainMatrix, GainVector};
use crate::vehicle::{GAINS, Spread};
use nalgebra::{Matrix3, Vector3};

/// Why a correction was refused. Nothing has changed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CorrectionError {
    /// A covariance, a gain, or their result is not symmetric or not positive semi-definite.
    NotPositive,
    /// The observation lies beyond the gate; the squared Mahalanobis distance of its innovation.
    Gate(f32),
    /// A result is not a finite number.
    NotFinite,
    /// A gain would be beyond reason: see [`Calibration::is_plausible`](crate::vehicle::Calibration::is_plausible).
    Gains,
}

impl core::fmt::Display for CorrectionError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotPositive => "the covariance would not be symmetric positive semi-definite",
            Self::Gate(_) => "the observation is beyond the gate",
            Self::NotFinite => "the result would not be finite",
            Self::Gains => "a gain would be beyond reason",
        })
    }
}
impl core::error::Error for CorrectionError {}

impl From<NotPositive> for CorrectionError {
    fn from(_: NotPositive) -> Self {
        Self::NotPositive
    }
}

/// A change of what is known at one instant, in a form that can be carried to any other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Update {
    /// The pose that was corrected …
    pose: Pose,
    /// … and its own covariance before …
    before: Matrix3<f64>,
    /// … and after.
    after: Matrix3<f64>,
    /// Γ before.
    leverage: Leverage,
    /// What of the correction of the pose does not come through the gains (m, m, rad).
    shift: Vector3<f64>,
    /// What it has taken from the leverage.
    absorbed: Leverage,
    /// The correction of the gains, and how well they are known after it.
    gains: GainVector,
    spread: GainMatrix,
    /// Gains that are only considered correct no pose: then what has come through them is in the shift.
    learned: bool,
    /// Γ P Γᵀ before, where that is so; otherwise 0.
    shared: Matrix3<f64>,
    /// By how much the covariance has changed: the pose's own, and what was shared.
    change: Matrix3<f64>,
}

impl Update {
    /// None at all, of this state.
    #[must_use]
    pub fn none(belief: &Belief, spread: &Spread) -> Self {
        Self {
            pose: belief.pose,
            before: belief.own,
            after: belief.own,
            leverage: belief.leverage,
            shift: Vector3::zeros(),
            absorbed: Leverage::zeros(),
            gains: GainVector::zeros(),
            spread: spread.covariance(),
            learned: false,
            shared: Matrix3::zeros(),
            change: Matrix3::zeros(),
        }
    }

    /// P := P + K ΔP, C := C − K C (CorrectPos), with C the whole covariance. The gains are considered. `shift` is ΔP in m, m, rad; `gain` is K.
    ///
    /// # Errors
    /// [`CorrectionError::NotPositive`] if the result is not symmetric (1e-3) or not positive semi-definite (−1e-5), both in correlation scale.
    #[inline(never)]
    pub fn by_gain(
        &mut self,
        shift: &Vector3<f64>,
        gain: &Matrix3<f64>,
    ) -> Result<(), CorrectionError> {
        let c = sum(&self.before, 1.0, &self.through(&self.leverage));
        let after = symmetric(&sum(&c, -1.0, &product(gain, &c)), &c)
            .map_err(|_| CorrectionError::NotPositive)?;
        let after = nearest_positive(&after, &c)?;
        self.absorbed = product(gain, &self.leverage);
        let left = self.through(&self.leverage_after());
        self.after = positive_part(&sum(&after, -1.0, &left));
        self.shift = applied(gain, shift);
        self.note_change();
        self.check()
    }

    /// What every past state will need of it.
    #[inline(never)]
    fn note_change(&mut self) {
        self.change = sum(&self.after, -1.0, &self.before);
        if !self.learned {
            self.shared = self.through(&self.leverage);
            let shared_after = self.through(&self.leverage_after());
            self.change = sum(&self.change, 1.0, &shared_after);
            self.change = sum(&self.change, -1.0, &self.shared);
        }
    }

    fn leverage_after(&self) -> Leverage {
        sum(&self.leverage, -1.0, &self.absorbed)
    }

    /// Γ P Γᵀ.
    fn through(&self, leverage: &Leverage) -> Matrix3<f64> {
        self.between(leverage, leverage)
    }

    /// Γ₁ P Γ₂ᵀ: what two poses have in common through the gains.
    #[inline(never)]
    fn between(&self, one: &Leverage, other: &Leverage) -> Matrix3<f64> {
        product_transposed(&product(one, &self.spread), other)
    }

    /// An observation of the whole pose with innovation ν and covariance R; gives d².
    ///
    /// # Errors
    /// [`CorrectionError::NotPositive`] if R is not symmetric positive semi-definite, or the innovation's covariance is singular;
    /// [`CorrectionError::Gate`] if d² exceeds the gate.
    #[inline(never)]
    pub fn by_pose(
        &mut self,
        innovation: &Vector3<f64>,
        r: &Matrix3<f64>,
        terms: Terms,
    ) -> Result<f32, CorrectionError> {
        let r = written_covariance(r)?;
        let scale = self.before.diagonal() + self.through(&self.leverage).diagonal() + r.diagonal();
        // R = L D Lᵀ: L⁻¹ z has the covariance D.
        let (l, d) = ldl(&r);
        let (mut rows, mut z) = (Matrix3::<f64>::identity(), *innovation);
        for i in 1..3 {
            for j in 0..i {
                for column in 0..3 {
                    rows[(i, column)] -= l[(i, j)] * rows[(j, column)];
                }
                z[i] -= l[(i, j)] * z[j];
            }
        }
        let mut filter = Filter::new(self, terms.learns);
        for i in 0..3 {
            let h = rows.row(i).transpose();
            filter.take(&h, d[i], z[i], scale[i])?;
        }
        filter.finish(terms.gate)
    }

    /// An observation of one number with innovation ν, variance r and row h; gives d².
    ///
    /// # Errors
    /// As for [`by_pose`](Self::by_pose).
    #[inline(never)]
    pub fn by_number(
        &mut self,
        innovation: f64,
        variance: f64,
        row: &Vector3<f64>,
        terms: Terms,
    ) -> Result<f32, CorrectionError> {
        if variance.is_nan() || variance < 0.0 {
            return Err(CorrectionError::NotPositive);
        }
        let mut filter = Filter::new(self, terms.learns);
        filter.take(row, variance, innovation, 0.0)?;
        filter.finish(terms.gate)
    }

    /// A straight run that was `longer` (m) than odometry says; gives d². `run` is by how much each gain makes it longer, and its random variance (m²).
    ///
    /// # Errors
    /// [`CorrectionError::Gate`] if d² exceeds the gate; [`CorrectionError::NotFinite`].
    #[inline(never)]
    pub fn by_run(
        &mut self,
        (effects, variance): ([f32; GAINS], f32),
        longer: f64,
        gate: f64,
    ) -> Result<f32, CorrectionError> {
        let h = GainVector::from(effects.map(f64::from));
        // Both wheels alike: what k_scale = 0 says is known, and is measured all the same.
        let common = h.map(|e| if e > 0.0 { 1.0 } else { 0.0 });
        if inner(&common, &applied(&self.spread, &common)) <= NOTHING {
            add_outer(&mut self.spread, UNKNOWN * UNKNOWN, &common, &common);
        }
        let ph = applied(&self.spread, &h);
        let s = TAPE * TAPE + f64::from(variance) + inner(&h, &ph);
        let distance = longer * longer / s;
        if gate > 0.0 && distance > gate {
            return Err(CorrectionError::Gate(distance as f32));
        }
        add_outer(&mut self.spread, -1.0 / s, &ph, &ph);
        self.gains = ph * (longer / s);
        self.learned = true;
        self.check()?;
        Ok(distance as f32)
    }

    fn check(&self) -> Result<(), CorrectionError> {
        if is_finite(&self.shift)
            && is_finite(&self.gains)
            && is_finite(&self.after)
            && is_finite(&self.absorbed)
            && is_finite(&self.spread)
        {
            Ok(())
        } else {
            Err(CorrectionError::NotFinite)
        }
    }
}

/// What is observed, and how it is taken.
#[derive(Clone, Copy, Debug)]
pub struct Terms {
    /// The largest squared Mahalanobis distance that is taken; 0: any.
    pub gate: f64,
    /// The gains are learned, not only considered.
    pub learns: bool,
}

/// How well a tape measures, m.
const TAPE: f64 = 5e-3;
/// Gains that are said to be known, and are measured all the same, may be off by so much.
const UNKNOWN: f64 = 0.02;

/// An update while an observation is taken, number by number.
struct Filter<'a> {
    update: &'a mut Update,
    leverage: Leverage,
    distance: f64,
}

/// Of an innovation's variance, so much may be rounding.
const NOTHING: f64 = 1e-10;

impl<'a> Filter<'a> {
    fn new(update: &'a mut Update, learns: bool) -> Self {
        update.learned = learns;
        Self {
            leverage: update.leverage,
            update,
            distance: 0.0,
        }
    }

    /// `scale` is the variance that the innovation would have had in the beginning.
    #[inline(never)]
    fn take(
        &mut self,
        h: &Vector3<f64>,
        variance: f64,
        innovation: f64,
        scale: f64,
    ) -> Result<(), CorrectionError> {
        let update = &mut *self.update;
        let ch = applied(&update.after, h);
        let lever = applied(&self.leverage.transpose(), h);
        let pl = applied(&update.spread, &lever);
        let own = variance + inner(h, &ch);
        let s = own + inner(&lever, &pl);
        // A variance of nothing means that both the estimate and the observation claim to be exact.
        if s.is_nan() || s <= NOTHING * scale {
            return Err(CorrectionError::NotPositive);
        }
        let left = innovation - inner(h, &update.shift);
        self.distance += left * left / s;
        let (k, left) = if update.learned {
            let change = pl * (left / s);
            add_outer(&mut update.spread, -1.0 / s, &pl, &pl);
            update.gains = along(&update.gains, 1.0, &change);
            update.shift = along(&update.shift, 1.0, &applied(&self.leverage, &change));
            // What is known exactly is not corrected.
            let inverse = if own > NOTHING * scale {
                1.0 / own
            } else {
                0.0
            };
            (ch * inverse, left - inner(&lever, &change))
        } else {
            let both = along(&ch, 1.0, &applied(&self.leverage, &pl));
            (both * (1.0 / s), left)
        };
        update.shift = along(&update.shift, left, &k);
        add_outer(&mut self.leverage, -1.0, &k, &lever);
        // (I − k hᵀ) C (I − k hᵀ)ᵀ + r k kᵀ
        add_outer(&mut update.after, -1.0, &k, &ch);
        add_outer(&mut update.after, -1.0, &ch, &k);
        add_outer(&mut update.after, own, &k, &k);
        Ok(())
    }

    #[inline(never)]
    fn finish(self, gate: f64) -> Result<f32, CorrectionError> {
        let distance = self.distance as f32;
        if !self.distance.is_finite() {
            return Err(CorrectionError::NotFinite);
        }
        if gate > 0.0 && self.distance > gate {
            return Err(CorrectionError::Gate(distance));
        }
        let update = self.update;
        update.after = positive_part(&update.after);
        let through_gains = applied(&update.leverage, &update.gains);
        update.shift = along(&update.shift, -1.0, &through_gains);
        update.absorbed = sum(&update.leverage, -1.0, &self.leverage);
        update.note_change();
        update.check()?;
        Ok(distance)
    }
}

/// L and the diagonal of D of a positive semi-definite matrix L D Lᵀ, L lower triangular with a diagonal of ones.
fn ldl(m: &Matrix3<f64>) -> (Matrix3<f64>, Vector3<f64>) {
    let over = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
    let positive = |a: f64| if a > 0.0 { a } else { 0.0 };
    let d1 = positive(m.m11);
    let (l21, l31) = (over(m.m21, d1), over(m.m31, d1));
    let d2 = positive(m.m22 - l21 * l21 * d1);
    let l32 = over(m.m32 - l31 * l21 * d1, d2);
    let d3 = positive(m.m33 - l31 * l31 * d1 - l32 * l32 * d2);
    let l = Matrix3::new(1.0, 0.0, 0.0, l21, 1.0, 0.0, l31, l32, 1.0);
    (l, Vector3::new(d1, d2, d3))
}

/// Inverse of a covariance, if it is regular in correlation scale.
#[inline(never)]
fn invert(m: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let d = m
        .diagonal()
        .map(|v| if v > 0.0 { 1.0 / libm::sqrt(v) } else { 0.0 });
    let scale = Matrix3::from_diagonal(&d);
    let scaled_by = |m: &Matrix3<f64>| product(&product(&scale, m), &scale);
    let a = scaled_by(m);
    // By cofactors: of numbers of the size of 1.
    let (x, y, z) = (
        a.m22 * a.m33 - a.m23 * a.m23,
        a.m13 * a.m23 - a.m12 * a.m33,
        a.m12 * a.m23 - a.m13 * a.m22,
    );
    let determinant = a.m11 * x + a.m12 * y + a.m13 * z;
    if determinant.is_nan() || determinant < NOTHING {
        return None;
    }
    let w = a.m12 * a.m13 - a.m11 * a.m23;
    let inverse = Matrix3::new(
        x,
        y,
        z,
        y,
        a.m11 * a.m33 - a.m13 * a.m13,
        w,
        z,
        w,
        a.m11 * a.m22 - a.m12 * a.m12,
    );
    Some(scaled(1.0 / determinant, &scaled_by(&inverse)))
}

impl Update {
    /// The correction of the gains, and how well they are known after it.
    #[must_use]
    pub fn gains(&self) -> (GainVector, Spread) {
        (self.gains, Spread::of(&self.spread))
    }

    /// Carries the update to a later state of the same journey (or to the same one).
    ///
    /// With Φ the product of F since: P̂ := P̂ + Φ K ν + Γ δg, C := Φ C⁺ Φᵀ + Q, where Q = C − Φ C⁻ Φᵀ is the noise since, Γ := Γ − Φ K H Γ⁻.
    pub fn carry_to_later(&self, belief: &mut Belief) {
        let dx = belief.pose.x - self.pose.x;
        let dy = belief.pose.y - self.pose.y;
        let gain = transport(dx, dy);
        self.move_along(belief, &gain);
        let noise = positive_part(&along_with(&belief.own, -1.0, &gain, &self.before));
        belief.own = along_with(&noise, 1.0, &gain, &self.after);
    }

    /// Carries the update to an earlier state: the smoother's gain is X (Φ C_τ Φᵀ + Q)⁻¹ with X = C_τ Φᵀ; where gains are only considered, Γ_τ P Γᵀ and
    /// Γ P Γᵀ go with the two. Where that is singular, what the past knows of its own is left as it was. (The last factor should be C⁻¹; but what the ring
    /// knows of its past is not quite what it would be had it known all in time, and a C smaller than what C_τ has become of would make the gain a multiple
    /// of what it can be.)
    pub fn carry_to_earlier(&self, belief: &mut Belief) {
        // Φ from there to here is the inverse of Φ from here to there.
        let dx = self.pose.x - belief.pose.x;
        let dy = self.pose.y - belief.pose.y;
        let gain = self.smoother(belief, dx, dy);
        let leverage = belief.leverage;
        self.move_along(belief, &gain);
        self.spread_earlier(belief, &leverage, &gain);
    }

    #[inline(never)]
    fn smoother(&self, past: &Belief, dx: f64, dy: f64) -> Matrix3<f64> {
        let arrived = transported(&past.own, dx, dy);
        let noise = positive_part(&sum(&self.before, -1.0, &arrived));
        let c = sum(&sum(&arrived, 1.0, &noise), 1.0, &self.shared);
        let mut x = product_transposed(&past.own, &transport(dx, dy));
        if !self.learned {
            x = sum(&x, 1.0, &self.between(&past.leverage, &self.leverage));
        }
        match invert(&c) {
            Some(inverse) => product(&x, &inverse),
            None => Matrix3::zeros(),
        }
    }

    /// `leverage` is what the past had.
    #[inline(never)]
    fn spread_earlier(&self, past: &mut Belief, leverage: &Leverage, gain: &Matrix3<f64>) {
        let mut own = past.own;
        if !self.learned {
            own = sum(&own, 1.0, &self.through(leverage));
            own = sum(&own, -1.0, &self.through(&past.leverage));
        }
        past.own = positive_part(&along_with(&own, 1.0, gain, &self.change));
    }

    /// `gain` is by how much another pose goes along with the one that was corrected.
    #[inline(never)]
    fn move_along(&self, belief: &mut Belief, gain: &Matrix3<f64>) {
        let through_gains = applied(&belief.leverage, &self.gains);
        let shift = along(&applied(gain, &self.shift), 1.0, &through_gains);
        belief.pose.x += shift.x;
        belief.pose.y += shift.y;
        belief.pose.theta += shift.z;
        belief.leverage = sum(&belief.leverage, -1.0, &product(gain, &self.absorbed));
    }
}

/// C + s G M Gᵀ.
#[inline(never)]
fn along_with(c: &Matrix3<f64>, s: f64, gain: &Matrix3<f64>, m: &Matrix3<f64>) -> Matrix3<f64> {
    let m = product_transposed(&product(gain, m), gain);
    symmetric_part(&sum(c, s, &m))
}

/// z − P̂ for a full observation, the angle wrapped to the nearer side.
#[must_use]
pub fn pose_innovation(observed: &Pose, estimate: &Pose) -> Vector3<f64> {
    Vector3::new(
        observed.x - estimate.x,
        observed.y - estimate.y,
        wrap(observed.theta - estimate.theta),
    )
}

#[cfg(test)]
mod tests;
