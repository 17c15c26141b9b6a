//! The paths that a base was asked for in a run, by what was sent to it and what it told.

use crate::script::{Action, Script};
use crate::trace::Row;

/// A posture of a path: x and y, m, and its heading, rad, if it has one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// m.
    pub at: [f64; 2],
    /// rad.
    pub heading: Option<f64>,
}

/// A path, or the target of a chase.
#[derive(Clone, Debug, PartialEq)]
pub struct AskedPath {
    /// Where the base believed to be when it set out, m. None for a chase.
    pub start: Option<[f64; 2]>,
    /// Where it was to go.
    pub places: Vec<Place>,
}

/// What the base is about.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Errand {
    #[default]
    None,
    Path,
    Chase,
}

/// The queue of postures as the base has it.
#[derive(Debug, Default)]
struct Queue {
    places: Vec<Place>,
    errand: Errand,
    paths: Vec<AskedPath>,
}

/// The paths of a run, from its script, the lines that the base sent (seconds, a tab and the line) and its trace. What it refused is taken for accepted.
#[must_use]
pub fn asked_paths(script: &Script, said: &str, rows: &[Row]) -> Vec<AskedPath> {
    let sent = script.steps.iter().filter_map(|step| match &step.action {
        Action::Send(line) => Some((step.time, line.as_str())),
        _ => None,
    });
    let told = said.lines().filter_map(|line| {
        let (time, line) = line.split_once('\t')?;
        Some((time.parse().ok()?, line))
    });
    let mut lines: Vec<(f64, &str)> = sent.chain(told).collect();
    // Stable: what was sent at an instant comes before what was told at it.
    lines.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut queue = Queue::default();
    for (time, line) in lines {
        queue.take(line, || {
            let next = rows.partition_point(|row| row.t < time);
            rows.get(next)
                .or(rows.last())
                .map(|row| [row.est_x, row.est_y])
        });
    }
    queue.paths
}

impl Queue {
    fn take(&mut self, line: &str, pose: impl Fn() -> Option<[f64; 2]>) {
        // Without its tag and its check.
        let line = line.split('*').next().unwrap_or_default();
        let words: Vec<String> = line
            .split([' ', '\t', ','])
            .filter(|word| !word.is_empty() && !word.starts_with('@'))
            .map(str::to_ascii_lowercase)
            .collect();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        match words[..] {
            ["follow", "start"] if self.errand != Errand::Path => self.set_out(pose()),
            ["follow", "clear"] | ["!", "path", "done"] => {
                self.places.clear();
                self.errand = Errand::None;
            }
            ["follow", ref posture @ ..] => {
                let Some(place) = place(posture) else { return };
                self.places.push(place);
                if self.errand == Errand::Path
                    && let Some(path) = self.paths.last_mut()
                {
                    path.places.push(place);
                }
            }
            ["goto", ref posture @ ..] => {
                let Some(place) = place(posture) else { return };
                self.places = vec![place];
                self.set_out(pose());
            }
            ["chase", ref target @ ..] => {
                let Some(place) = place(target) else { return };
                if self.errand != Errand::Chase {
                    self.errand = Errand::Chase;
                    self.paths.push(AskedPath {
                        start: None,
                        places: Vec::new(),
                    });
                }
                self.paths
                    .last_mut()
                    .expect("one was begun")
                    .places
                    .push(place);
            }
            ["!", "posture", _] if !self.places.is_empty() => drop(self.places.remove(0)),
            // It has begun what replaces it.
            ["!", "path" | "chase", "end", "replaced"] => {}
            ["!", "path" | "chase", "end", _] => self.errand = Errand::None,
            _ => {}
        }
    }

    fn set_out(&mut self, start: Option<[f64; 2]>) {
        self.errand = Errand::Path;
        self.paths.push(AskedPath {
            start,
            places: self.places.clone(),
        });
    }
}

/// Of `x y [θ [v]]`, θ in degrees.
fn place(words: &[&str]) -> Option<Place> {
    let number = |word: &&str| word.parse::<f64>().ok().filter(|x| x.is_finite());
    Some(Place {
        at: [number(words.first()?)?, number(words.get(1)?)?],
        heading: words.get(2).and_then(number).map(f64::to_radians),
    })
}

/// Where the references of both axes are: the estimate, and what the base has yet to go and to turn to them (theory sections 2 and 7). Between two corrections this
/// is the pose that they integrate to; a correction moves it as it moves the estimate.
#[must_use]
pub(super) fn reference(row: &Row) -> [f64; 3] {
    let (ahead, turn) = (row.s_ref - row.s, row.alpha_ref - row.alpha);
    let middle = row.est_theta + 0.5 * turn;
    [
        row.est_x + ahead * middle.cos(),
        row.est_y + ahead * middle.sin(),
        row.est_theta + turn,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(script: &str, said: &str) -> Vec<AskedPath> {
        let script = Script::parse(script, "a.script").unwrap();
        let row = |k: u32| Row {
            t: f64::from(k),
            est_x: 0.1 * f64::from(k),
            ..Row::default()
        };
        let rows: Vec<Row> = (0..10).map(row).collect();
        asked_paths(&script, said, &rows)
    }

    fn places(path: &AskedPath) -> Vec<[f64; 2]> {
        path.places.iter().map(|place| place.at).collect()
    }

    #[test]
    fn a_path_is_what_was_in_the_queue_and_what_was_added() {
        let script =
            "0 Follow 1 0\n0 @7 follow, 1,2, 90 0.2*1234\n1 FOLLOW START\n2 Follow 3 3 -\n9 !end\n";
        let [path] = &paths(script, "0.001\tOK\n")[..] else {
            panic!("one path")
        };
        assert_eq!(path.start, Some([0.1, 0.0]));
        assert_eq!(places(path), [[1.0, 0.0], [1.0, 2.0], [3.0, 3.0]]);
        let headings: Vec<_> = path.places.iter().map(|place| place.heading).collect();
        assert_eq!(headings, [None, Some(std::f64::consts::FRAC_PI_2), None]);
    }

    #[test]
    fn what_was_passed_before_a_stop_is_not_asked_for_again() {
        let script = "0 Follow 1 0\n0 Follow 2 0\n0 Follow start\n3 Stop\n4 Follow start\n";
        let said = "2.5\t! posture 1\n3.002\t! path end stop\n5\t! path done\n";
        let paths = paths(script, said);
        assert_eq!(places(&paths[0]), [[1.0, 0.0], [2.0, 0.0]]);
        assert_eq!(places(&paths[1]), [[2.0, 0.0]]);
        assert_eq!(paths[1].start, Some([0.4, 0.0]));
    }

    #[test]
    fn errands_follow_one_another() {
        let script = "0 GoTo 1 0\n1 Chase 2 2\n2 Chase 3 2\n4 GoTo 0 0\n5 Follow start\n";
        let said = "1.002\t! path end replaced\n3.9\t! chase end timeout\n";
        let paths = paths(script, said);
        assert_eq!(paths.len(), 3, "{paths:?}");
        assert_eq!(places(&paths[1]), [[2.0, 2.0], [3.0, 2.0]]);
        assert_eq!(paths[1].start, None);
        assert_eq!(places(&paths[2]), [[0.0, 0.0]]);
    }

    #[test]
    fn the_reference_is_ahead_of_the_estimate_by_what_is_left_to_follow() {
        let row = Row {
            est_x: 1.0,
            est_theta: std::f64::consts::FRAC_PI_2,
            s: 4.0,
            s_ref: 4.5,
            ..Row::default()
        };
        let [x, y, theta] = reference(&row);
        assert!((x - 1.0).abs() < 1e-12 && (y - 0.5).abs() < 1e-12);
        assert_eq!(theta, row.est_theta);
    }
}
