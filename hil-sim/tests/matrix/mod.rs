//! The fault matrix: each encoder fault at each wheel in each phase of a motion, both ways; what comes of it, and what may.
#![allow(dead_code, reason = "each test uses a part of it")]

pub mod report;

use hil_sim::base::Base;
use hil_sim::faults::{EncoderFault, Fault, Side};
use hil_sim::rig::Rig;
use hil_sim::robot::Robot;
use std::collections::HashMap;
use vehicle_controller::params::Id;

/// The seed of every run.
pub const SEED: u64 = 1;
/// What is commanded, m/s and m/s²; and °/s and °/s² when turning.
const MOVE: &str = "0.5 1";
const TURN: &str = "150 300";
/// N.
const PUSH: f64 = 5.0;
/// A wheel that should turn at this part of its free speed must be seen not to.
const PART_OF_FREE_SPEED: f64 = 0.3;
/// Within this of that moment, ms.
const MAX_DETECTION_MS: f64 = 150.0;
/// The body may travel so far after the fault, m.
const MAX_TRAVEL: f64 = 0.2;
/// And so far in the wrong direction, m.
const MAX_WRONG_WAY: f64 = 0.05;
/// It is over before that when a fault has been latched, and no motor driven, for so long, ms: nothing moves by itself then.
const REST_MS: u64 = 1000;
/// A run goes on for so long after the fault, or after the command that follows it, ms.
const AFTERMATH_MS: u64 = 2500;

/// The faults.
pub const FAULTS: [EncoderFault; 7] = [
    EncoderFault::Stuck,
    EncoderFault::OpenA,
    EncoderFault::OpenB,
    EncoderFault::Swapped,
    EncoderFault::Scale(2.0),
    EncoderFault::Drop(0.5),
    EncoderFault::Jump(500),
];
/// The same for people.
const MEANINGS: [&str; 7] = [
    "unplugged",
    "channel A lost",
    "channel B lost",
    "A and B exchanged",
    "counts double",
    "loses half",
    "500 counts at once",
];
const SIDES: [Side; 3] = [Side::Left, Side::Right, Side::Both];

/// When the fault comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Phase {
    /// 0.3 s before a move, at rest with the motors off.
    Standstill,
    /// While a move accelerates.
    Accel,
    /// While it goes on.
    Move,
    /// While it decelerates to its end.
    Deccel,
    /// While the base turns.
    Turn,
    /// While it holds against a push, 0.5 s before a move.
    Hold,
}

impl Phase {
    pub const ALL: [Self; 6] = [
        Self::Standstill,
        Self::Accel,
        Self::Move,
        Self::Deccel,
        Self::Turn,
        Self::Hold,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Standstill => "standstill",
            Self::Accel => "ACCEL",
            Self::Move => "MOVE",
            Self::Deccel => "DECCEL",
            Self::Turn => "turning",
            Self::Hold => "HOLD, pushed",
        }
    }
}

/// A case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    pub fault: EncoderFault,
    pub side: Side,
    pub phase: Phase,
    pub forward: bool,
}

/// What is done to the base, in ms since power-on.
struct Plan {
    lines: Vec<(u64, String)>,
    /// When, and N.
    push: Option<(u64, f64)>,
    fault: u64,
    /// The motion that the fault meets: its command.
    motion: u64,
    end: u64,
}

/// The base after a millisecond.
#[derive(Clone, Debug)]
struct Sample {
    pose: [f64; 3],
    rim: [f64; 2],
    driven: bool,
    /// What is latched.
    latched: Option<String>,
}

/// What came of a case.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// From the moment at which the wheel should turn, or from the fault if that is later, to the latched fault, ms. Negative: it was latched before.
    pub detection: Option<f64>,
    /// What was latched first.
    pub name: Option<String>,
    /// From that moment until the motors were off for good, ms.
    pub off: f64,
    /// Of the axle's middle, from the later of fault and command, m.
    pub travel: f64,
    /// Furthest back from the furthest point: of the axle's middle, or when turning of a rim, m. While it is pushed: beyond what the push alone does.
    pub wrong_way: f64,
    /// Furthest from the heading at the fault, °; when turning, how far it turned.
    pub turned: f64,
}

impl Case {
    /// All of them, in the order of the table.
    pub fn all() -> Vec<Self> {
        let mut cases = Vec::new();
        for fault in FAULTS {
            for phase in Phase::ALL {
                for side in SIDES {
                    for forward in [true, false] {
                        cases.push(Self {
                            fault,
                            side,
                            phase,
                            forward,
                        });
                    }
                }
            }
        }
        cases
    }

    pub fn name(&self) -> String {
        let way = if self.forward { "forward" } else { "backward" };
        format!("{} {} {way} {}", self.side, self.fault, self.phase.name())
    }

    fn sign(&self) -> f64 {
        if self.forward { 1.0 } else { -1.0 }
    }

    fn plan(&self) -> Plan {
        let minus = if self.forward { "" } else { "-" };
        let on = format!("m {minus}inf {MOVE}");
        let plan = |mut lines: Vec<(u64, String)>, fault: u64| {
            // Nobody says anything after the command: that is another fault.
            lines.insert(0, (100, "SetParam deadman 0".to_owned()));
            let motion = lines.last().map_or(0, |(at, _)| *at);
            Plan {
                lines,
                push: None,
                fault,
                motion,
                end: fault.max(motion) + AFTERMATH_MS,
            }
        };
        // A move gets to 0.5 m/s in 0.5 s; one of 1 m decelerates from 2 s to 2.5 s after its command. A turn gets to 150 °/s in 0.5 s.
        match self.phase {
            Phase::Standstill => plan(vec![(600, on)], 300),
            Phase::Accel => plan(vec![(300, on)], 550),
            Phase::Move => plan(vec![(300, on)], 1300),
            Phase::Deccel => plan(vec![(300, format!("m {minus}1 {MOVE}"))], 2400),
            Phase::Turn => plan(vec![(300, format!("t {minus}inf {TURN}"))], 1300),
            // The motors hold once they have moved.
            Phase::Hold => Plan {
                push: Some((1500, PUSH * self.sign())),
                ..plan(vec![(300, format!("m {minus}0.05")), (2300, on)], 1800)
            },
        }
    }

    /// The case as a script for `hil-sim run`.
    pub fn script(&self) -> String {
        let plan = self.plan();
        let mut steps: Vec<(u64, String)> = plan.lines;
        let fault = Fault::Encoder(self.side, self.fault);
        steps.push((plan.fault, format!("!fault {fault}")));
        if let Some((at, force)) = plan.push {
            let seconds = (plan.motion - at) as f64 / 1e3;
            steps.push((at, format!("!push {force} 0 {seconds}")));
        }
        steps.push((plan.end, "!end".into()));
        steps.sort_by_key(|(at, _)| *at);
        let line = |(at, text): &(u64, String)| format!("{:<6} {text}\n", *at as f64 / 1e3);
        steps.iter().map(line).collect()
    }
}

/// Runs cases on one kind of base, and keeps the sound runs that they are compared with.
pub struct Matrix<F> {
    power_up: F,
    twins: HashMap<(Phase, bool), Vec<Sample>>,
    /// m/s.
    threshold: f64,
    half_base: f64,
}

impl<F: FnMut(&Robot) -> Box<dyn Base>> Matrix<F> {
    pub fn new(power_up: F) -> Self {
        let params = robot().params;
        let get = |id| f64::from(params.get(id));
        // v = (U·d_max − U_friction)/k
        let free_speed =
            (get(Id::Supply) * get(Id::MaxDuty) - get(Id::MotorFriction)) / get(Id::MotorSpeedGain);
        Self {
            power_up,
            twins: HashMap::new(),
            threshold: PART_OF_FREE_SPEED * free_speed,
            half_base: 0.5 * get(Id::WheelBase),
        }
    }

    /// Tries cases, shows their table, and fails if one of them breaks a requirement.
    pub fn try_all(&mut self, cases: impl IntoIterator<Item = Case>) -> Vec<(Case, Verdict)> {
        let try_case = |case: Case| (case, self.try_case(&case, false));
        let results: Vec<_> = cases.into_iter().map(try_case).collect();
        println!("{}", report::table(&results));
        let complaints = report::complaints(&results);
        assert!(
            complaints.is_empty(),
            "{} of {} cases:\n{}",
            complaints.len(),
            results.len(),
            complaints.join("\n")
        );
        results
    }

    /// Plays a case's plan, with its fault or without. The sound twin is always on this computer: on the board it is the same within a tick.
    fn play(&mut self, case: &Case, faulty: bool, verbose: bool) -> Vec<Sample> {
        let plan = case.plan();
        let mut base: Box<dyn Base> = if faulty {
            (self.power_up)(&robot())
        } else {
            Box::new(Rig::new(&robot(), SEED).unwrap())
        };
        let mut samples = Vec::new();
        let mut said = Vec::new();
        let mut driven = 0;
        for ms in 0..plan.end {
            for (_, line) in plan.lines.iter().filter(|(at, _)| *at == ms) {
                base.send(format!("{line}\n").as_bytes()).unwrap();
            }
            if let Some((_, force)) = plan.push.filter(|(at, _)| *at == ms) {
                base.push(force, 0.0, (plan.motion - ms) as f64 / 1e3);
            }
            if faulty && ms == plan.fault {
                base.inject(Fault::Encoder(case.side, case.fault)).unwrap();
            }
            base.tick().unwrap();
            said.extend(base.receive());
            let row = base.row().unwrap();
            if verbose {
                while let Some(end) = said.iter().position(|byte| *byte == b'\n') {
                    let line: Vec<u8> = said.drain(..=end).collect();
                    println!("{ms:5}  {}", String::from_utf8_lossy(&line).trim());
                }
                if ms + 20 >= plan.fault.min(plan.motion) && ms % 10 == 0 {
                    report::trace(ms, &row, base.plant());
                }
            }
            let sample = Sample {
                pose: base.plant().pose(),
                rim: base.plant().wheel_speed(),
                driven: row.left_duty != 0.0 || row.right_duty != 0.0,
                latched: Some(row.fault).filter(|name| name != "none"),
            };
            if sample.driven || sample.latched.is_none() {
                driven = ms;
            }
            samples.push(sample);
            if ms > driven.max(plan.motion) + REST_MS {
                break;
            }
        }
        samples
    }

    /// What comes of a case.
    pub fn try_case(&mut self, case: &Case, verbose: bool) -> Verdict {
        let key = (case.phase, case.forward);
        let twin = match self.twins.get(&key) {
            Some(twin) => twin.clone(),
            None => self.play(case, false, false),
        };
        let run = self.play(case, true, verbose);
        let verdict = self.judge(case, &twin, &run);
        self.twins.insert(key, twin);
        verdict
    }

    /// What the checker says of a base on which nothing is wrong, with the moment at which its wheel turns, ms after the later of fault and command.
    pub fn try_sound(&mut self, case: &Case) -> (Verdict, f64) {
        let twin = self.play(case, false, false);
        let verdict = self.judge(case, &twin, &twin);
        let plan = case.plan();
        let driven = twin.iter().rposition(|sample| sample.driven);
        let end = driven.map_or(0, |ms| ms + 1) as f64;
        let moment = end - verdict.off;
        (verdict, moment - plan.fault.max(plan.motion) as f64)
    }

    fn judge(&self, case: &Case, twin: &[Sample], run: &[Sample]) -> Verdict {
        let plan = case.plan();
        let name = case.name();
        assert!(
            twin.iter().all(|sample| sample.latched.is_none()),
            "{name}: the sound twin latches a fault: {:?}",
            twin.iter().find_map(|sample| sample.latched.as_deref())
        );
        let (fault, motion) = (plan.fault as usize, plan.motion as usize);
        let should_turn = |sample: &Sample| {
            let mut wheels = case.side.wheels();
            wheels.any(|wheel| sample.rim[wheel].abs() >= self.threshold)
        };
        let turns = twin[fault..].iter().position(should_turn);
        let turns = turns.unwrap_or_else(|| panic!("{name}: the twin's wheel never turns"));
        let moment = fault + turns;
        let since = |ms: usize| ms as f64 - moment as f64;
        let latched = run.iter().position(|sample| sample.latched.is_some());
        let last_driven = run.iter().rposition(|sample| sample.driven);
        let begin = fault.max(motion);
        let steps = |from: usize| run[from..].windows(2);
        let travel = steps(begin).map(|pair| distance(&pair[0], &pair[1])).sum();
        let turned = run[begin..].iter().map(|s| s.pose[2] - run[begin].pose[2]);
        let turned = turned.fold(0.0, |most: f64, angle| most.max(angle.abs()));

        // Along the commanded direction.
        let progress: Vec<f64> = if case.phase == Phase::Turn {
            let angles = run[begin..].iter().map(|sample| sample.pose[2]);
            angles.map(|a| case.sign() * a * self.half_base).collect()
        } else {
            advance(&run[begin..])
                .into_iter()
                .map(|s| case.sign() * s)
                .collect()
        };
        let mut furthest = f64::NEG_INFINITY;
        let mut wrong_way = 0.0_f64;
        for place in progress {
            furthest = furthest.max(place);
            wrong_way = wrong_way.max(furthest - place);
        }
        if fault < motion {
            let reach = |samples: &[Sample]| {
                let places = advance(&samples[fault..motion]);
                places.into_iter().fold(0.0, |far: f64, s| far.max(s.abs()))
            };
            wrong_way = wrong_way.max(reach(run) - reach(twin));
        }
        Verdict {
            detection: latched.map(since),
            name: latched.and_then(|ms| run[ms].latched.clone()),
            off: last_driven.map_or(0.0, |ms| since(ms + 1)),
            travel,
            wrong_way,
            turned: turned.to_degrees(),
        }
    }
}

impl Verdict {
    /// What it breaks of what is required.
    pub fn complaints(&self) -> Vec<String> {
        let mut complaints = Vec::new();
        match self.detection {
            None => complaints.push("not detected".into()),
            Some(ms) if ms > MAX_DETECTION_MS => {
                complaints.push(format!("detected after {ms} ms"));
            }
            Some(_) => {}
        }
        if self.travel > MAX_TRAVEL {
            complaints.push(format!("travels {:.3} m", self.travel));
        }
        if self.wrong_way > MAX_WRONG_WAY {
            complaints.push(format!("goes {:.3} m the wrong way", self.wrong_way));
        }
        complaints
    }
}

/// The robot of the matrix.
fn robot() -> Robot {
    Robot::load("default").unwrap()
}

fn distance(from: &Sample, to: &Sample) -> f64 {
    (to.pose[0] - from.pose[0]).hypot(to.pose[1] - from.pose[1])
}

/// How far the axle's middle has come along the body's own direction, m: a place for each sample.
fn advance(samples: &[Sample]) -> Vec<f64> {
    let mut places = vec![0.0];
    let mut place = 0.0;
    for pair in samples.windows(2) {
        let (sin, cos) = (0.5 * (pair[0].pose[2] + pair[1].pose[2])).sin_cos();
        let dx = pair[1].pose[0] - pair[0].pose[0];
        let dy = pair[1].pose[1] - pair[0].pose[1];
        place += dx * cos + dy * sin;
        places.push(place);
    }
    places
}
