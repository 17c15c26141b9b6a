//! What a correction does to the past, against the Kalman filter of both instants and the gains together.

use super::*;
use nalgebra::SMatrix;

/// Uniform in ±1, the same each time (Knuth's MMIX generator).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / f64::powi(2.0, 52) - 1.0
    }

    fn matrix<const C: usize>(&mut self, scale: [f64; 3]) -> SMatrix<f64, 3, C> {
        SMatrix::from_fn(|row, _| self.next() * scale[row])
    }

    fn positive(&mut self, scale: [f64; 3]) -> Matrix3<f64> {
        let root: Matrix3<f64> = self.matrix(scale);
        root * root.transpose()
    }

    fn spread(&mut self) -> Spread {
        let root = GainMatrix::from_fn(|_, _| 0.01 * self.next());
        Spread::of(&(root * root.transpose()))
    }
}

fn relative<const N: usize>(
    is: &SMatrix<f64, N, N>,
    wanted: &SMatrix<f64, N, N>,
    scale: &SMatrix<f64, N, N>,
) -> f64 {
    let d = scale.diagonal().map(|v| 1.0 / libm::sqrt(v));
    (is - wanted)
        .component_mul(&(d * d.transpose()))
        .abs()
        .max()
}

fn the_past_follows(learns: bool) {
    let mut random = Random(7);
    for n in 0..1000 {
        // A tenth of them knew the heading only, as after a turn on the spot that began with a pose known exactly.
        let past = if n % 10 == 0 {
            Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 2e-6))
        } else {
            random.positive([0.01, 0.01, 0.02])
        };
        let past_leverage: Leverage = random.matrix([0.02, 0.02, 0.08]);
        let (dx, dy) = (0.1 * random.next(), 0.1 * random.next());
        let phi = transport(dx, dy);
        let own = phi * past * phi.transpose() + random.positive([1e-3, 1e-3, 1e-3]);
        let leverage = phi * past_leverage + random.matrix::<GAINS>([0.1, 0.1, 0.5]);
        let spread = random.spread();
        let p = spread.covariance();

        let at = |x: f64, y: f64, own, leverage| Belief {
            pose: Pose { x, y, theta: 0.3 },
            own,
            leverage,
        };
        let now = at(2.0, -1.0, own, leverage);
        let mut then = at(2.0 - dx, -1.0 - dy, past, past_leverage);
        let (h, r, nu) = (Vector3::new(0.3, -1.0, 0.2), 1e-4, 0.02);
        let mut update = Update::none(&now, &spread);
        let terms = Terms { gate: 0.0, learns };
        update.by_number(nu, r, &h, terms).unwrap();
        let before = then.pose;
        update.carry_to_earlier(&mut then);

        // Both poses' errors, and what they have in common.
        let whole = past + past_leverage * p * past_leverage.transpose();
        let common = past * phi.transpose() + past_leverage * p * leverage.transpose();
        let s = r + h.dot(&((own + leverage * p * leverage.transpose()) * h));
        let k = common * h / s;
        let moved = Vector3::new(
            then.pose.x - before.x,
            then.pose.y - before.y,
            then.pose.theta - before.theta,
        );
        let sigma = whole.diagonal().map(libm::sqrt);
        let off = (moved - k * nu).component_div(&sigma).abs().max();
        // Of a standard deviation; the smoother's inverse costs some digits.
        assert!(off < 1e-5, "{n}: {moved} {}", k * nu);

        let p_after = if learns { update.gains().1 } else { spread };
        let is = then.own + then.shared(&p_after);
        let wanted = whole - k * s * k.transpose();
        let off = relative(&is, &wanted, &whole);
        assert!(off < 1e-5, "{n}: {off:.1e} {is} {wanted}");
        if !learns {
            // The gains stay as they are: of the past's error just so much is theirs.
            let gamma = leverage.transpose() * h;
            let wanted = past_leverage - k * gamma.transpose();
            let off = (then.leverage - wanted).abs().max();
            assert!(off < 1e-5, "{n}: {off:.1e}");
        }
    }
}

#[test]
fn the_past_follows_a_correction_that_learns_the_gains() {
    the_past_follows(true);
}

#[test]
fn the_past_follows_a_correction_that_considers_the_gains() {
    the_past_follows(false);
}

/// Pose and gains.
const STATE: usize = 3 + GAINS;

/// Pose and gains in one filter, in Joseph's form, with nothing left out: the gains' gain left out where they are only considered.
fn joint(
    own: &Matrix3<f64>,
    leverage: &Leverage,
    p: &GainMatrix,
    r: &Matrix3<f64>,
    learns: bool,
) -> (SMatrix<f64, STATE, STATE>, SMatrix<f64, STATE, 3>) {
    let mut c = SMatrix::<f64, STATE, STATE>::zeros();
    c.fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&(own + leverage * p * leverage.transpose()));
    c.fixed_view_mut::<3, GAINS>(0, 3)
        .copy_from(&(leverage * p));
    c.fixed_view_mut::<GAINS, 3>(3, 0)
        .copy_from(&(p * leverage.transpose()));
    c.fixed_view_mut::<GAINS, GAINS>(3, 3).copy_from(p);
    let h = SMatrix::<f64, 3, STATE>::identity();
    let s = h * c * h.transpose() + r;
    let mut k = c * h.transpose() * s.try_inverse().unwrap();
    if !learns {
        k.fixed_view_mut::<GAINS, 3>(3, 0).fill(0.0);
    }
    let left = SMatrix::<f64, STATE, STATE>::identity() - k * h;
    (left * c * left.transpose() + k * r * k.transpose(), k)
}

#[test]
fn a_fix_is_the_kalman_filter_of_pose_and_gains() {
    let mut random = Random(11);
    for n in 0..1000 {
        let learns = n % 2 == 0;
        let own = random.positive([0.02, 0.02, 0.05]);
        let leverage: Leverage = random.matrix([0.5, 0.5, 2.0]);
        let spread = random.spread();
        let p = spread.covariance();
        let r = random.positive([0.01, 0.01, 0.02]) + Matrix3::from_diagonal_element(1e-6);
        let nu = Vector3::new(0.02, -0.01, 0.03);
        let mut belief = Belief {
            pose: Pose::default(),
            own,
            leverage,
        };
        let mut update = Update::none(&belief, &spread);
        let terms = Terms { gate: 0.0, learns };
        let distance = update.by_pose(&nu, &r, terms).unwrap();
        update.carry_to_later(&mut belief);
        let (change, known) = update.gains();

        let (c, k) = joint(&own, &leverage, &p, &r, learns);
        let whole = own + leverage * p * leverage.transpose();
        let s = whole + r;
        let wanted = nu.dot(&(s.try_inverse().unwrap() * nu));
        assert!((f64::from(distance) / wanted - 1.0).abs() < 1e-5, "{n}");
        let moved = k * nu;
        let pose = Vector3::new(belief.pose.x, belief.pose.y, belief.pose.theta);
        assert!((pose - moved.fixed_rows::<3>(0)).abs().max() < 1e-9, "{n}");
        // What is told of the gains has the digits of an f32.
        let p_after = if learns { known } else { spread };
        if learns {
            assert!(
                (change - moved.fixed_rows::<GAINS>(3)).abs().max() < 1e-9,
                "{n}"
            );
            let wanted = c.fixed_view::<GAINS, GAINS>(3, 3).into();
            let off = relative(&p_after.covariance(), &wanted, &p);
            assert!(off < 1e-6, "{n}: {off:.1e}");
        } else {
            assert_eq!(change, GainVector::zeros());
        }
        let off = relative(
            &(belief.own + belief.shared(&p_after)),
            &c.fixed_view::<3, 3>(0, 0).into(),
            &whole,
        );
        assert!(off < 1e-6, "{n}: {off:.1e}");
        let common = belief.leverage * p_after.covariance();
        let off = (common - c.fixed_view::<3, GAINS>(0, 3)).abs().max();
        assert!(off < 1e-8, "{n}: {off:.1e}");
    }
}
