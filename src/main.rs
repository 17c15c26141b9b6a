//! The firmware: the library's three layers on a board, at three priorities. Nothing waits for anybody.
//!
//! ```text
//!     control   TIM5, 1 kHz, highest   the tick: sensors in, motors out
//!        ▲ requests   │ events, snapshots          (mailboxes and single-producer, single-consumer queues)
//!     idle                             the interpreter, parameters, LEDs, log
//!        ▲ bytes                                   (another one)
//!     receive   USART3                 one byte
//! ```
//!
//! No critical section is entered after the start, so nothing ever delays the tick. No path from idle or an interrupt leads to a panic
//! (`cargo xtask panics` proves it on the linked image).

#![no_std]
#![no_main]

mod board;
mod inbox;
mod mailbox;

#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use crate::board::ResetCause;
    use crate::board::nucleo_f429zi::{self as board, Board, Config};
    use crate::inbox::Inbox;
    use crate::mailbox::{self, Mailbox};
    use core::mem::MaybeUninit;
    use core::sync::atomic::{AtomicU32, Ordering};
    use heapless::spsc::{Consumer, Producer, Queue};
    use vehicle_controller::controller::{Controller, Event, Interface, Request, Snapshot};
    use vehicle_controller::interpreter::{self, Identity, Interpreter};
    use vehicle_controller::map::Atlas;
    use vehicle_controller::params::Params;
    use vehicle_controller::params::store::Store;
    use vehicle_controller::supervisor::{Fault, Heartbeat, Place};
    use vehicle_controller::time::{Duration, Instant};

    /// The period of the control loop.
    const PERIOD: Duration = Duration::millis(1);
    /// Idle may be busy with one thing for so many ticks; then it is taken for dead, and the watchdog is left to starve.
    const IDLE_DEADLINE: u32 = 10;
    /// The watchdog's time-out, nominally. Its oscillator is 17 to 47 kHz for a nominal 32: this is 8 to 23 ms.
    const WATCHDOG: Duration = Duration::millis(12);

    type Desk = interpreter::Desk<Config>;

    #[shared]
    struct Shared {
        /// 0 when idle has come around since the last tick; else what the tick's timer showed when the last tick was done. (Should that have been 0, a tick takes
        /// idle for alive once more.)
        tick_end: AtomicU32,
    }

    #[local]
    struct Local {
        // The tick's.
        controller: &'static mut Controller<board::Vehicle>,
        sensors: board::Sensors,
        timer: board::Ticker,
        clock: board::Clock,
        watchdog: board::Watchdog,
        heartbeat: Heartbeat,
        requests: mailbox::Receiver<'static, Option<Request<Config>>>,
        events: Producer<'static, Event>,
        snapshots: mailbox::Sender<'static, Snapshot>,
        // The receiver's.
        receiver: board::Receiver,
        inbox: Inbox,
        // Idle's.
        desk: &'static mut Desk,
        interpreter: &'static mut Interpreter,
        store: Store<board::ParamFlash>,
        transmitter: board::Transmitter,
        leds: board::Leds,
        logged: Logged,
        to_controller: mailbox::Sender<'static, Option<Request<Config>>>,
        from_controller: Consumer<'static, Event>,
        known: mailbox::Receiver<'static, Snapshot>,
        bytes: Consumer<'static, u8>,
    }

    /// What the log has told already.
    pub struct Logged {
        params: Params,
    }

    // What is large is made in its place: the stack has no room for it.
    #[init(local = [
        controller_place: MaybeUninit<Controller<board::Vehicle>> = MaybeUninit::uninit(),
        desk_place: MaybeUninit<Desk> = MaybeUninit::uninit(),
        interpreter_place: MaybeUninit<Interpreter> = MaybeUninit::uninit(),
        request_mailbox: Mailbox<Option<Request<Config>>> = Mailbox::new(),
        event_queue: Queue<Event, 16> = Queue::new(),
        snapshot_mailbox: Mailbox<Snapshot> = Mailbox::new(),
        byte_queue: Queue<u8, 512> = Queue::new(),
    ])]
    fn init(ctx: init::Context) -> (Shared, Local) {
        let defaults = Params::of(board::KIND);
        let mut board = match Board::start(ctx.core, ctx.device, WATCHDOG) {
            Ok(board) => board,
            Err(message) => fail(message),
        };
        let mut store = Store::open(board.flash);
        let found = store.load_or_defaults(&defaults);
        let config = found.params.build(PERIOD);
        // To read what was stored may have taken some milliseconds.
        board.watchdog.feed();
        if let Err(message) = board.timer.start() {
            fail(message);
        }
        let reset_cause = board.reset_cause.name();
        defmt::info!(
            "vehicle-controller {=str}, {=str}",
            env!("CARGO_PKG_VERSION"),
            reset_cause
        );
        let fault = if board.reset_cause == ResetCause::Watchdog {
            Some(Fault::Watchdog)
        } else {
            found.lost.then_some(Fault::Storage)
        };
        let vehicle = match board.parts.assemble(&config.vehicle) {
            Ok(vehicle) => vehicle,
            Err(message) => fail(message),
        };
        let controller = place(ctx.local.controller_place, || {
            Controller::new(vehicle, config, fault)
        });
        let identity = Identity {
            target: board::TARGET,
            reset_cause,
            period: PERIOD,
        };
        let (to_controller, requests) = ctx.local.request_mailbox.split(None);
        let (events, from_controller) = ctx.local.event_queue.split();
        let snapshot = controller.snapshot();
        let (snapshots, known) = ctx.local.snapshot_mailbox.split(snapshot);
        let (received, bytes) = ctx.local.byte_queue.split();
        let shared = Shared {
            tick_end: AtomicU32::new(0),
        };
        let interpreter = place(ctx.local.interpreter_place, || {
            Interpreter::with_storage(identity, &defaults, &found)
        });
        if let Some(fault) = fault {
            interpreter.notify(Event::Fault(fault, Place::Base));
        }
        let local = Local {
            desk: ctx
                .local
                .desk_place
                .write(Interface::new(snapshot, found.params.limits())),
            controller,
            sensors: board.sensors,
            timer: board.timer,
            clock: board.clock,
            watchdog: board.watchdog,
            heartbeat: Heartbeat::new(IDLE_DEADLINE),
            requests,
            events,
            snapshots,
            receiver: board.receiver,
            inbox: Inbox::new(received),
            interpreter,
            store,
            transmitter: board.transmitter,
            leds: board.leds,
            logged: Logged { params: defaults },
            to_controller,
            from_controller,
            known,
            bytes,
        };
        (shared, local)
    }

    /// The tick.
    #[task(binds = TIM5, priority = 3, shared = [&tick_end],
        local = [controller, sensors, timer, clock, watchdog, heartbeat, requests, events, snapshots])]
    fn control(ctx: control::Context) {
        let now: Instant = ctx.local.clock.now();
        ctx.local.timer.acknowledge();
        let inputs = ctx.local.sensors.read();
        let controller = &mut **ctx.local.controller;
        ctx.local.requests.take_with(|request| {
            if let Some(request) = request {
                // There is room: each tick takes one and carries it out.
                let _ = controller.request(*request);
            }
        });
        for event in controller.tick(now, &inputs) {
            // Idle has had no time for 16 events: then there are no lines to tell them in either.
            let _ = ctx.local.events.enqueue(*event);
        }
        // SAFETY: idle, the receiver, cannot interrupt this.
        unsafe {
            ctx.local
                .snapshots
                .replace_with(|snapshot| controller.update_snapshot(snapshot));
        }
        let elapsed = board::steps_since_due();
        let idle_alive = ctx.shared.tick_end.swap(elapsed, Ordering::Relaxed) == 0;
        if ctx.local.heartbeat.beat(idle_alive) {
            ctx.local.watchdog.feed();
        }
    }

    /// A byte has come.
    #[task(binds = USART3, priority = 2, local = [receiver, inbox])]
    fn receive(ctx: receive::Context) {
        let (byte, lost) = ctx.local.receiver.read();
        ctx.local.inbox.put(byte, lost);
    }

    #[idle(shared = [&tick_end],
        local = [atlas: Atlas = Atlas::new(), desk, interpreter, store, transmitter, leds, logged, to_controller, from_controller, known, bytes])]
    #[inline(never)]
    fn idle(ctx: idle::Context) -> ! {
        let idle::LocalResources {
            atlas,
            desk,
            interpreter,
            store,
            transmitter,
            leds,
            logged,
            to_controller,
            from_controller,
            known,
            bytes,
            ..
        } = ctx.local;
        loop {
            let elapsed = ctx.shared.tick_end.swap(0, Ordering::Relaxed);
            if elapsed != 0 {
                interpreter.note_tick_load(board::share_of_period(elapsed));
            }
            // First, so that the events that led to it are all there: they are told before a reply shows what they did.
            let snapshot = known.take();
            while let Some(event) = from_controller.dequeue() {
                if let Event::Fault(fault, _) = event {
                    defmt::error!("fault {=str}", fault.name());
                }
                interpreter.notify(event);
            }
            if let Some(snapshot) = snapshot {
                leds.show(&snapshot);
                desk.update(snapshot);
            }
            // Whether it can still be answered or not: it may be what stops the base.
            while let Some(byte) = bytes.dequeue() {
                interpreter.receive(byte);
            }
            desk.work();
            interpreter.poll(desk, atlas);
            interpreter.attend(store, desk);
            to_controller.send_with(|request| {
                *request = desk.take_request();
                request.is_some()
            });
            interpreter.transmit_to(transmitter);
            logged.tell_changes(interpreter.params());
        }
    }

    /// Makes a large thing where it stays. Apart, so that what it takes of the stack is given back.
    #[inline(never)]
    fn place<T>(place: &mut MaybeUninit<T>, make: impl FnOnce() -> T) -> &mut T {
        place.write(make())
    }

    /// Nothing can be started: with the motors off until the watchdog tries again.
    fn fail(message: &str) -> ! {
        defmt::error!("{=str}", message);
        board::halt()
    }

    impl Logged {
        fn tell_changes(&mut self, params: &Params) {
            for id in params.ids() {
                if params.get(id) != self.params.get(id) {
                    defmt::info!("parameter {=str} = {=f32}", id.spec().name, params.get(id));
                }
            }
            self.params = *params;
        }
    }
}
