//! What the square path experiment says in closed form.

/// Something of each direction: clockwise, and counter-clockwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Directions<T> {
    /// Turns to the right.
    pub clockwise: T,
    /// Turns to the left.
    pub counter_clockwise: T,
}

/// What Borenstein and Feng make of the return errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosedForm {
    /// By how much every quarter turn falls short, rad: the wheel base is wider than thought.
    pub alpha: f64,
    /// By how much every side bends to the left, rad: the right wheel is larger than the left one.
    pub beta: f64,
    /// E_d: the right wheel's diameter over the left one's.
    pub unequal_diameters: f64,
    /// E_b: the true wheel base over the one that was thought, if the mean of the diameters is right.
    pub wheel_base: f64,
}

impl ClosedForm {
    /// Of the mean return errors, true minus calculated position in the frame of the start, m, after squares with sides of `side` m; `base` is what was
    /// thought to be the wheel base, m.
    ///
    /// With turns that fall short by α a square to the left ends at (−2Lα, 2Lα), one to the right at its mirror image; with sides that bend to the left by β
    /// they end at (2Lβ, −2Lβ) and (−2Lβ, −2Lβ). So
    ///
    /// ```text
    ///     −4Lα = x_cw + x_ccw = y_cw − y_ccw       −4Lβ = x_cw − x_ccw = y_cw + y_ccw
    ///     E_b = 90°/(90° − α)     R = (L/2)/sin(β/2)     E_d = D_R/D_L = (R + b/2)/(R − b/2)
    /// ```
    ///
    /// of which the means over x and y are taken.
    #[must_use]
    pub fn of(errors: &Directions<[f64; 2]>, side: f64, base: f64) -> Self {
        let ([x_cw, y_cw], [x_ccw, y_ccw]) = (errors.clockwise, errors.counter_clockwise);
        let mean = |a: f64, b: f64| f64::midpoint(a, b) / (-4.0 * side);
        let alpha = mean(x_cw + x_ccw, y_cw - y_ccw);
        let beta = mean(x_cw - x_ccw, y_cw + y_ccw);
        let quarter = std::f64::consts::FRAC_PI_2;
        let wheel_base = quarter / (quarter - alpha);
        // Both radii over R, which is infinite for β = 0.
        let half_base = 0.5 * base * wheel_base * (0.5 * beta).sin() / (0.5 * side);
        Self {
            alpha,
            beta,
            unequal_diameters: (1.0 + half_base) / (1.0 - half_base),
            wheel_base,
        }
    }

    /// The gains k_r, k_l, k_b: c_r = 2/(1/E_d + 1), c_l = 2/(E_d + 1) keep the mean diameter.
    #[must_use]
    pub fn gains(&self) -> [f64; 3] {
        let ratio = self.unequal_diameters;
        [
            2.0 / (1.0 / ratio + 1.0),
            2.0 / (ratio + 1.0),
            self.wheel_base,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a base ends that thinks it drives a square: it turns by a quarter less α, and its sides are arcs that bend to the left by β.
    fn end(side: f64, turn: f64, alpha: f64, beta: f64) -> [f64; 2] {
        let (mut x, mut y, mut heading) = (0.0, 0.0, 0.0_f64);
        let chord = side * (0.5 * beta).sin() / (0.5 * beta);
        for _ in 0..4 {
            x += chord * (heading + 0.5 * beta).cos();
            y += chord * (heading + 0.5 * beta).sin();
            heading += beta + turn * (std::f64::consts::FRAC_PI_2 - alpha);
        }
        [x, y]
    }

    #[test]
    fn it_finds_the_angles_that_made_the_errors() {
        for (alpha, beta) in [(0.01, 0.004), (-0.02, 0.003), (0.005, -0.01)] {
            let errors = Directions {
                clockwise: end(4.0, -1.0, alpha, beta),
                counter_clockwise: end(4.0, 1.0, alpha, beta),
            };
            let found = ClosedForm::of(&errors, 4.0, 0.2);
            // The equations are of first order: what is left out is of the angles' squares.
            let left_out = 4.0 * (alpha * alpha + beta * beta);
            assert!((found.alpha - alpha).abs() < left_out, "{found:?}");
            assert!((found.beta - beta).abs() < left_out, "{found:?}");
        }
    }

    #[test]
    fn the_gains_are_those_of_the_paper_s_equations() {
        let errors = Directions {
            clockwise: [-0.2, 0.04],
            counter_clockwise: [0.1, 0.09],
        };
        // −0.1/−8 and −0.05/−8; −0.3/−8 and 0.13/−8, each pair halved.
        let found = ClosedForm::of(&errors, 2.0, 0.4);
        assert!((found.alpha - 0.009_375).abs() < 1e-12, "{found:?}");
        assert!((found.beta - 0.010_625).abs() < 1e-12, "{found:?}");
        let [right, left, base] = found.gains();
        assert!((base - 90.0 / (90.0 - 0.009_375_f64.to_degrees())).abs() < 1e-12);
        let radius = 1.0 / (0.5 * 0.010_625_f64).sin();
        let ratio = (radius + 0.2 * base) / (radius - 0.2 * base);
        assert!((right / left - ratio).abs() < 1e-12 && (right + left - 2.0).abs() < 1e-12);
    }
}
