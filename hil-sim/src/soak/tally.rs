//! What came of a soak.

use std::collections::BTreeMap;
use std::fmt;

/// Something to look at: what, when, and what went before.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The shard.
    pub shard: u64,
    /// The robot.
    pub robot: &'static str,
    /// Simulated time since the shard's power-on, s.
    pub seconds: f64,
    /// What it is.
    pub what: String,
    /// The last lines of the conversation, and the last ticks.
    pub trace: String,
}

/// What is counted.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Simulated ticks of healthy driving and of driving with faults.
    pub ticks: [u64; 2],
    /// Lines that were sent, and of them motions that were accepted.
    pub lines: u64,
    /// Motions that were accepted.
    pub motions: u64,
    /// Pushes.
    pub pushes: u64,
    /// Faults that were put in, by kind.
    pub injected: BTreeMap<&'static str, u64>,
    /// Faults that were latched, by name; those that were asked for (`estop`) among them.
    pub latched: BTreeMap<&'static str, u64>,
    /// Faults that were latched with nothing wrong, and not asked for.
    pub false_trips: u64,
    /// Things that must not be.
    pub violations: u64,
    /// The longest from a latched fault to the motors off, ms: for faults that switch off, and for those that stop.
    pub worst: [u64; 2],
    /// The first of them.
    pub findings: Vec<Finding>,
}

/// So many findings are kept.
const KEPT: usize = 20;

impl Tally {
    /// Adds what came of another shard.
    pub fn add(&mut self, other: Self) {
        for (sum, more) in self.ticks.iter_mut().zip(other.ticks) {
            *sum += more;
        }
        self.lines += other.lines;
        self.motions += other.motions;
        self.pushes += other.pushes;
        for (kind, count) in other.injected {
            *self.injected.entry(kind).or_default() += count;
        }
        for (name, count) in other.latched {
            *self.latched.entry(name).or_default() += count;
        }
        self.false_trips += other.false_trips;
        self.violations += other.violations;
        for (worst, other) in self.worst.iter_mut().zip(other.worst) {
            *worst = (*worst).max(other);
        }
        let room = KEPT.saturating_sub(self.findings.len());
        self.findings.extend(other.findings.into_iter().take(room));
    }

    /// Nothing was found that must not be.
    pub fn is_good(&self) -> bool {
        self.false_trips == 0 && self.violations == 0
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for finding in &self.findings {
            writeln!(
                f,
                "== shard {}, {}, {:.3} s: {}\n{}",
                finding.shard, finding.robot, finding.seconds, finding.what, finding.trace
            )?;
        }
        let hours = self.ticks.map(|ticks| ticks as f64 / 3.6e6);
        let sum = |counts: &BTreeMap<&str, u64>| counts.values().sum::<u64>();
        writeln!(f, "simulated hours, healthy        {:>10.3}", hours[0])?;
        writeln!(f, "simulated hours, with faults    {:>10.3}", hours[1])?;
        writeln!(f, "lines sent                      {:>10}", self.lines)?;
        writeln!(f, "motions accepted                {:>10}", self.motions)?;
        writeln!(f, "pushes                          {:>10}", self.pushes)?;
        writeln!(
            f,
            "faults injected                 {:>10}",
            sum(&self.injected)
        )?;
        for (kind, count) in &self.injected {
            writeln!(f, "  {kind:<30}{count:>10}")?;
        }
        writeln!(
            f,
            "faults latched                  {:>10}",
            sum(&self.latched)
        )?;
        for (name, count) in &self.latched {
            writeln!(f, "  {name:<30}{count:>10}")?;
        }
        let [off, stop] = self.worst;
        writeln!(
            f,
            "from fault to motors off, worst {off:>10} ms (reaction off)"
        )?;
        writeln!(
            f,
            "                                {stop:>10} ms (reaction stop)"
        )?;
        writeln!(
            f,
            "false trips                     {:>10}",
            self.false_trips
        )?;
        writeln!(f, "invariants violated             {:>10}", self.violations)
    }
}
