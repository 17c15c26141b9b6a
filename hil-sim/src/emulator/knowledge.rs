//! What the controller in the image knows: the snapshot that its desk keeps, found and read by the image's own debug information.

use super::debug_info::DebugInfo;
use super::live_watch::{self, Found, View};
use crate::trace::Row;
use anyhow::{Context, Result, bail};
use vehicle_controller::controller::estimator::{Compound, Estimate, Estimator, Noise, Pose};
use vehicle_controller::controller::{Belief, State};
use vehicle_controller::supervisor::Fault;
use vehicle_controller::vehicle::gains::OFFSET;
use vehicle_controller::vehicle::{Calibration, Influence, Twist};

/// The type of the static in which idle keeps its copy of the controller's snapshot; others are on their way through a queue or a mailbox.
const DESK: &str = "vehicle_controller::controller::interface::Interface";

/// The order in which a covariance is kept.
const UPPER_TRIANGLE: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Where an image keeps what its controller knows.
#[derive(Debug)]
pub(super) struct Knowledge {
    info: DebugInfo,
    found: Found,
}

impl Knowledge {
    /// Finds the snapshot in an image.
    pub(super) fn find(elf: &[u8]) -> Result<Self> {
        let info = DebugInfo::load(elf)?;
        let desks = live_watch::find(&info, DESK)?;
        let [desk] = desks.as_slice() else {
            let paths: Vec<_> = desks.iter().map(|found| found.path.as_str()).collect();
            bail!(
                "one static of the image should hold a {DESK}, and {} do ({}): an image needs its debug information",
                paths.len(),
                paths.join(", ")
            );
        };
        let found = desk.member(&info, "snapshot")?;
        Ok(Self { info, found })
    }

    /// Where it is, and how long.
    pub(super) fn place(&self) -> (u64, u64) {
        (self.found.address, self.found.size)
    }

    /// Both axes are in the state Hold, by the bytes of the snapshot.
    pub(super) fn holds(&self, bytes: &[u8]) -> Result<bool> {
        let snapshot = self.view(bytes);
        let state = |axis: &str| state(&snapshot.member(axis)?);
        Ok(state("translation.state")? == State::Hold && state("rotation.state")? == State::Hold)
    }

    fn view<'a>(&'a self, bytes: &'a [u8]) -> View<'a> {
        View::new(&self.info, self.found.id, bytes)
    }

    /// Fills in what a controller knows, by the bytes of its snapshot.
    pub(super) fn tell(&self, bytes: &[u8], row: &mut Row) -> Result<()> {
        let snapshot = self.view(bytes);
        fill(&snapshot, row).with_context(|| format!("the image's {}", self.found.path))
    }
}

fn fill(snapshot: &View<'_>, row: &mut Row) -> Result<()> {
    row.t = snapshot.member("time.ticks")?.number()? * 1e-6;
    let estimate = estimator(&snapshot.member("estimator")?)?.present();
    let c = &estimate.covariance;
    (row.est_x, row.est_y, row.est_theta) = (estimate.pose.x, estimate.pose.y, estimate.pose.theta);
    (row.cxx, row.cxy, row.cxt) = (c.m11, c.m12, c.m13);
    (row.cyy, row.cyt, row.ctt) = (c.m22, c.m23, c.m33);
    let axis = |name: &str| -> Result<[f64; 4]> {
        let axis = snapshot.member(name)?;
        let displacement = axis.member("displacement")?.real()?;
        Ok([
            displacement,
            displacement + axis.member("error")?.number()?,
            axis.member("speed")?.number()?,
            axis.member("reference_speed")?.number()?,
        ])
    };
    [row.s, row.s_ref, row.v_s, row.v_s_ref] = axis("translation")?;
    [row.alpha, row.alpha_ref, row.v_alpha, row.v_alpha_ref] = axis("rotation")?;
    let named = |name: &str| Ok::<_, anyhow::Error>(state(&snapshot.member(name)?)?.name());
    named("translation.state")?.clone_into(&mut row.move_state);
    named("rotation.state")?.clone_into(&mut row.turn_state);
    let wheels = snapshot.member("wheels")?;
    let [left, right] = [wheels.element(0)?, wheels.element(1)?];
    row.left_count = left.member("count")?.integer()?;
    row.right_count = right.member("count")?.integer()?;
    row.left_speed = left.member("speed")?.number()?;
    row.right_speed = right.member("speed")?.number()?;
    row.left_duty = left.member("duty")?.number()?;
    row.right_duty = right.member("duty")?.number()?;
    row.battery = snapshot.member("supply")?.number()?;
    if let Some(steer) = &mut row.steer {
        let calibration = snapshot.member("estimator.calibration.gains")?;
        *steer = snapshot.member("steering")?.element(0)?.number()?
            - calibration.element(OFFSET as u64)?.number()?;
    }
    fault(&snapshot.member("fault")?)?.clone_into(&mut row.fault);
    Ok(())
}

fn state(view: &View<'_>) -> Result<State> {
    Ok(match view.name()? {
        "Hold" => State::Hold,
        "Accel" => State::Accel,
        "Move" => State::Move,
        "Deccel" => State::Deccel,
        other => bail!("an axis is in a state `{other}` that this simulator does not know"),
    })
}

/// The protocol's name of the fault.
fn fault(view: &View<'_>) -> Result<&'static str> {
    let Some(fault) = view.option()? else {
        return Ok("none");
    };
    let name = fault.name()?;
    let same = Fault::ALL.iter().find(|known| format!("{known:?}") == name);
    match same {
        Some(fault) => Ok(fault.name()),
        None => bail!("a fault `{name}` that this simulator does not know"),
    }
}

/// The estimator, put together again so that the library's own propagation gives the present estimate.
fn estimator(view: &View<'_>) -> Result<Estimator> {
    let number = |path: &str| view.member(path)?.real();
    let float = |path: &str| view.member(path)?.float();
    let twist = |path: &str| {
        Ok::<_, anyhow::Error>(Twist {
            translation: float(&format!("{path}.translation"))?,
            rotation: float(&format!("{path}.rotation"))?,
        })
    };
    let mut estimate = Estimate::certain(Pose {
        x: number("reckoning.pose.x")?,
        y: number("reckoning.pose.y")?,
        theta: number("reckoning.pose.theta")?,
    });
    let triangle = view.member("reckoning.covariance")?;
    for (index, (row, column)) in UPPER_TRIANGLE.into_iter().enumerate() {
        let element = triangle.element(index as u64)?.real()?;
        estimate.covariance[(row, column)] = element;
        estimate.covariance[(column, row)] = element;
    }
    let since = Compound::of(
        [
            number("since.ahead")?,
            number("since.aside")?,
            number("since.turned")?,
        ],
        float("since.travelled")?,
        twist("since.variation")?,
    );
    let mut belief = Belief::from(estimate);
    // An image of the differential drive alone has fewer gains than this simulator knows: the first of them.
    let columns = view.member("reckoning.leverage.__0")?;
    for (gain, mut column) in (0..columns.length()?).zip(belief.leverage.column_iter_mut()) {
        let elements = columns.element(gain)?;
        for (index, element) in (0..).zip(column.iter_mut()) {
            *element = elements.element(index)?.real()?;
        }
    }
    let fill = |floats: &mut [f32], path: &str| -> Result<()> {
        let array = view.member(path)?;
        for (index, float) in (0..array.length()?).zip(floats) {
            *float = array.element(index)?.float()?;
        }
        Ok(())
    };
    let mut calibration = Calibration::default();
    fill(&mut calibration.gains, "calibration.gains")?;
    fill(&mut calibration.spread.root, "calibration.spread.root")?;
    let mut influence = Influence::default();
    let by_gain = view.member("influence.by_gain")?;
    for (gain, row) in (0..by_gain.length()?).zip(&mut influence.by_gain) {
        let elements = by_gain.element(gain)?;
        for (index, element) in (0..).zip(row) {
            *element = elements.element(index)?.float()?;
        }
    }
    let mut noise = Noise {
        translation: float("noise.translation")?,
        drift: float("noise.drift")?,
        rotation: float("noise.rotation")?,
        ..Noise::default()
    };
    fill(&mut noise.steering, "noise.steering")?;
    Ok(Estimator::resume(
        &belief,
        since,
        noise,
        calibration,
        influence,
    ))
}
