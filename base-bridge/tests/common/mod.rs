//! A simulated base in real time, a cable that can be pulled, and a bridge at its other end, watched.
#![allow(dead_code, reason = "each test uses what it needs")]

pub mod cable;

use base_bridge::app::{App, Quit};
use base_bridge::line::Door;
use base_bridge::network::{FramedPose, Inbox, Network, Request};
use base_bridge::params::Params;
use hil_sim::rig::{PERIOD, Rig};
use hil_sim::robot::Robot;
use ros_messages::base::{Level, Motion, Report, Status};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use vehicle_controller::params::Id;

/// What is true at a tick.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// Simulated time, s.
    pub t: f64,
    /// When the host was there.
    pub at: Instant,
    /// The true pose: m, m, rad.
    pub pose: [f64; 3],
    /// The base's estimate: m, m, rad.
    pub estimate: [f64; 3],
    /// The translation's reference, m/s.
    pub reference: f64,
    /// The rotation's, rad/s.
    pub turn_reference: f64,
}

type Task = Box<dyn FnOnce(&mut Rig) + Send>;

/// A simulated base.
#[derive(Clone)]
pub struct Base {
    pub input: Sender<Vec<u8>>,
    tasks: Sender<Task>,
    /// Where its bytes go; nowhere while the cable is pulled.
    pub listener: Arc<Mutex<Option<Sender<Vec<u8>>>>>,
    truth: Arc<Mutex<Vec<Truth>>>,
}

impl Base {
    /// Switches a robot on, with these parameters changed.
    pub fn start(name: &str, seed: u64, changes: &[(Id, f32)]) -> Self {
        let mut robot = Robot::load(name).unwrap();
        robot.params.set_all(changes).unwrap();
        let (to_base, from_host) = channel::<Vec<u8>>();
        let (tasks, todo) = channel::<Task>();
        let base = Self {
            input: to_base,
            tasks,
            listener: Arc::default(),
            truth: Arc::default(),
        };
        let (listener, truth) = (Arc::clone(&base.listener), Arc::clone(&base.truth));
        std::thread::spawn(move || {
            let mut rig = Rig::new(&robot, seed).unwrap();
            let begin = Instant::now();
            for tick in 1.. {
                for bytes in from_host.try_iter() {
                    rig.send(&bytes);
                }
                for task in todo.try_iter() {
                    task(&mut rig);
                }
                rig.tick();
                let bytes = rig.receive();
                if !bytes.is_empty()
                    && let Some(listener) = &*listener.lock().unwrap()
                {
                    let _ = listener.send(bytes);
                }
                let row = rig.row();
                truth.lock().unwrap().push(Truth {
                    t: row.t,
                    at: Instant::now(),
                    pose: [row.true_x, row.true_y, row.true_theta],
                    estimate: [row.est_x, row.est_y, row.est_theta],
                    reference: row.v_s_ref,
                    turn_reference: row.v_alpha_ref,
                });
                // Nobody is there any more but this thread.
                if Arc::strong_count(&truth) == 1 {
                    return;
                }
                let due = begin + tick * Duration::from_micros(PERIOD.ticks());
                std::thread::sleep(due.saturating_duration_since(Instant::now()));
            }
        });
        base
    }

    /// Lets something happen to it.
    pub fn task(&self, task: impl FnOnce(&mut Rig) + Send + 'static) {
        self.tasks.send(Box::new(task)).unwrap();
    }

    /// The covariance of its estimate, by x, y and heading: m, rad.
    pub fn covariance(&self) -> [[f64; 3]; 3] {
        let (sender, receiver) = channel();
        self.task(move |rig| {
            let row = rig.row();
            let [x, y, heading] = [
                [row.cxx, row.cxy, row.cxt],
                [row.cxy, row.cyy, row.cyt],
                [row.cxt, row.cyt, row.ctt],
            ];
            sender.send([x, y, heading]).unwrap();
        });
        receiver.recv().unwrap()
    }

    /// What is true now.
    pub fn now(&self) -> Truth {
        loop {
            if let Some(truth) = self.truth.lock().unwrap().last() {
                return *truth;
            }
            sleep(0.001);
        }
    }

    /// What the translation is to be now, m/s.
    pub fn reference(&self) -> f64 {
        self.now().reference
    }

    /// Everything since a simulated time.
    pub fn since(&self, t: f64) -> Vec<Truth> {
        let truth = self.truth.lock().unwrap();
        let begin = truth.partition_point(|truth| truth.t < t);
        truth[begin..].to_vec()
    }

    /// Waits until this simulated time.
    pub fn wait_until(&self, t: f64) {
        while self.now().t < t {
            sleep(0.002);
        }
    }

    /// Its speed over the last 20 ms: m/s along its way, rad/s.
    pub fn speed(&self) -> (f64, f64) {
        let now = self.now();
        let then = self.since(now.t - 0.020)[0];
        let dt = (now.t - then.t).max(1e-3);
        let way = (now.pose[0] - then.pose[0]).hypot(now.pose[1] - then.pose[1]);
        (way / dt, (now.pose[2] - then.pose[2]) / dt)
    }
}

/// A network that remembers.
#[derive(Clone, Default)]
pub struct Seen {
    reports: Arc<(Mutex<Vec<Report>>, Condvar)>,
    closed: Arc<Mutex<bool>>,
}

impl Network for Seen {
    fn publish(&mut self, report: &Report) {
        self.reports.0.lock().unwrap().push(report.clone());
        self.reports.1.notify_all();
    }

    fn close(&mut self) {
        *self.closed.lock().unwrap() = true;
    }
}

/// A bridge in this process.
pub struct Bridge {
    pub inbox: Inbox,
    seen: Seen,
    said: Arc<Mutex<Vec<String>>>,
    quit: Quit,
    thread: Option<JoinHandle<()>>,
}

impl Bridge {
    /// Starts one at this line.
    pub fn start(door: impl Door + 'static, params: Params) -> Self {
        let app = App::new(params);
        let (inbox, quit, seen) = (app.inbox(), app.quit(), Seen::default());
        let network = seen.clone();
        let said = Arc::default();
        let writing: Arc<Mutex<Vec<String>>> = Arc::clone(&said);
        let thread = std::thread::spawn(move || {
            let begin = Instant::now();
            let ended = app.run(Box::new(door), network, |words| {
                eprintln!("{:8.3} {words}", begin.elapsed().as_secs_f64());
                writing.lock().unwrap().push(words.to_owned());
            });
            ended.unwrap();
        });
        Self {
            inbox,
            seen,
            said,
            quit,
            thread: Some(thread),
        }
    }

    /// What it has published so far.
    pub fn reports(&self) -> Vec<Report> {
        self.seen.reports.0.lock().unwrap().clone()
    }

    /// What it has told a person so far.
    pub fn said(&self) -> Vec<String> {
        self.said.lock().unwrap().clone()
    }

    /// How much.
    pub fn mark(&self) -> usize {
        self.seen.reports.0.lock().unwrap().len()
    }

    /// Where the base was, since then.
    pub fn motions(&self, since: usize) -> Vec<Motion> {
        let reports = self.seen.reports.0.lock().unwrap();
        let motion = |report: &Report| match report {
            Report::Motion(motion) => Some(motion.clone()),
            _ => None,
        };
        reports[since..].iter().filter_map(motion).collect()
    }

    /// Waits for a report that pleases, behind the first `since`.
    pub fn wait_for<T>(
        &self,
        since: usize,
        seconds: f64,
        mut pick: impl FnMut(&Report) -> Option<T>,
    ) -> Option<T> {
        let until = Instant::now() + Duration::from_secs_f64(seconds);
        let (reports, news) = &*self.seen.reports;
        let mut reports = reports.lock().unwrap();
        let mut at = since;
        loop {
            while let Some(report) = reports.get(at) {
                if let Some(found) = pick(report) {
                    return Some(found);
                }
                at += 1;
            }
            let wait = until.checked_duration_since(Instant::now())?;
            reports = news.wait_timeout(reports, wait).unwrap().0;
        }
    }

    /// Waits until the base is known, and told of.
    pub fn wait_until_up(&self, since: usize) {
        let up = self.wait_for(since, 10.0, |report| {
            let link = status(report, "link")?;
            (link.message == "connected").then_some(())
        });
        assert!(up.is_some(), "no base");
    }

    /// Waits until the base is heard of again.
    pub fn wait_for_motion(&self, since: usize) {
        let heard = self.wait_for(since, 10.0, |report| {
            matches!(report, Report::Motion(_)).then_some(())
        });
        assert!(heard.is_some(), "no telemetry");
    }

    /// Says speeds once.
    pub fn speeds(&self, v: f64, omega: f64) {
        assert!(self.inbox.put(Request::Speeds {
            linear: [v, 0.0, 0.0],
            angular: [0.0, 0.0, omega],
            stamp: None,
        }));
    }

    /// Says speeds at 20 Hz, for so long.
    pub fn drive(&self, v: f64, omega: f64, seconds: f64) {
        for _ in 0..(seconds * 20.0).ceil() as u32 {
            self.speeds(v, omega);
            sleep(0.05);
        }
    }

    /// Says speeds at 20 Hz, until something is so. On a machine with much else to do a deadman may come first.
    pub fn drive_until(&self, v: f64, omega: f64, is: impl Fn() -> bool) {
        let begin = Instant::now();
        while !is() {
            let patient = begin.elapsed() < Duration::from_secs(10);
            assert!(patient, "{v} {omega}: {:?}", self.diagnostics());
            for tenth in 0..10 {
                self.speeds(v, omega);
                sleep(0.05);
                if tenth == 9 && !is() {
                    // Nothing to clear is no fault of the base.
                    let _ = self.call(Request::ClearFault);
                }
                if is() {
                    return;
                }
            }
        }
    }

    /// The last of them.
    pub fn diagnostics(&self) -> Option<Report> {
        let is = |report: &Report| matches!(report, Report::Diagnostics { .. });
        self.reports().into_iter().rfind(is)
    }

    /// Asks for a service, and waits for its answer.
    pub fn call(
        &self,
        request: impl FnOnce(base_bridge::network::Reply) -> Request,
    ) -> Result<String, String> {
        let (answer, answered): (_, Receiver<Result<String, String>>) = channel();
        let reply = Box::new(move |result| answer.send(result).unwrap());
        assert!(self.inbox.put(request(reply)));
        answered
            .recv_timeout(Duration::from_secs(5))
            .expect("a service is always answered")
    }

    /// Ends it.
    pub fn end(mut self) {
        self.finish();
        assert!(*self.seen.closed.lock().unwrap());
    }

    fn finish(&mut self) {
        self.quit.quit();
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking());
        }
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        self.finish();
    }
}

/// A part of the diagnostics.
pub fn status<'a>(report: &'a Report, name: &str) -> Option<&'a Status> {
    let Report::Diagnostics { statuses, .. } = report else {
        return None;
    };
    statuses.iter().find(|status| status.name == name)
}

/// How often the bridge has refused something, or made it smaller.
pub fn count(report: &Report, name: &str) -> Option<u64> {
    let values = &status(report, "commands")?.values;
    let value = values.iter().find(|(key, _)| key == name);
    Some(value.map_or(0, |(_, count)| count.parse().unwrap()))
}

/// Waits until the base's part says this.
pub fn wait_for_base(bridge: &Bridge, since: usize, message: &str) {
    let found = bridge.wait_for(since, 5.0, |report| {
        let base = status(report, "controller")?;
        let level = base.level != Level::Ok;
        assert_eq!(level, base.message != "no fault");
        (base.message == message).then_some(())
    });
    assert!(found.is_some(), "{message}");
}

/// A pose of a frame.
pub fn pose(frame: &str, x: f64, y: f64, heading: f64) -> FramedPose {
    FramedPose {
        stamp: None,
        frame: frame.to_owned(),
        position: [x, y, 0.0],
        orientation: base_bridge::commands::posture::quaternion(heading),
    }
}

/// A diagonal covariance: m, rad.
pub fn diagonal(position: f64, heading: f64) -> [f64; 36] {
    let mut all = [0.0; 36];
    (all[0], all[7], all[35]) = (position * position, position * position, heading * heading);
    all
}

/// ns since 1970.
pub fn wall() -> i64 {
    let now = std::time::SystemTime::now();
    now.duration_since(std::time::UNIX_EPOCH)
        .unwrap()
        .as_nanos() as i64
}

pub fn sleep(seconds: f64) {
    std::thread::sleep(Duration::from_secs_f64(seconds));
}

/// How long speeds may take to the wheels' reference: half of them 3 ms, all but one of a hundred 15 ms.
pub fn assert_prompt(mut times: Vec<f64>) {
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[(share * (times.len() - 1) as f64) as usize];
    let [median, p90, p99, most] = [0.5, 0.9, 0.99, 1.0].map(at);
    println!("ms: median {median:.2}, p90 {p90:.2}, p99 {p99:.2}, most {most:.2}");
    assert!(median <= 3.0 && p99 <= 15.0);
}
