//! The base's estimate.

use ros_messages::base::frames::Pose;

/// What `GetEstPos` answers, in SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Where it is.
    pub pose: Pose,
    /// Covariance of x, y and θ: m², m·rad, rad².
    pub covariance: [[f64; 3]; 3],
}

impl Estimate {
    /// Reads `EstPos x y θ Cxx Cxy Cxθ Cyy Cyθ Cθθ`.
    pub fn parse(reply: &str) -> Option<Self> {
        let numbers = reply.strip_prefix("EstPos ")?;
        let numbers: Result<Vec<f64>, _> = numbers
            .split_ascii_whitespace()
            .map(str::parse::<f64>)
            .collect();
        let [x, y, theta, xx, xy, xt, yy, yt, tt] = numbers.ok()?[..] else {
            return None;
        };
        let [xt, yt] = [xt, yt].map(f64::to_radians);
        let tt = tt.to_radians().to_radians();
        Some(Self {
            pose: Pose::new(x, y, theta.to_radians()),
            covariance: [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_become_radians_in_each_place() {
        let text = "EstPos 1 -2 90 1.0e-4 2.0e-5 3.0e-3 4.0e-4 5.0e-3 6.0e-1";
        let estimate = Estimate::parse(text).unwrap();
        let d = std::f64::consts::PI / 180.0;
        assert!((estimate.pose.theta - 90.0 * d).abs() < 1e-15);
        let expected = [
            [1e-4, 2e-5, 3e-3 * d],
            [2e-5, 4e-4, 5e-3 * d],
            [3e-3 * d, 5e-3 * d, 0.6 * d * d],
        ];
        for (row, expected) in estimate.covariance.iter().zip(expected) {
            for (value, expected) in row.iter().zip(expected) {
                assert!((value - expected).abs() <= expected * 1e-14);
            }
        }
        assert_eq!(Estimate::parse("EstPos 1 2 3"), None);
    }
}
