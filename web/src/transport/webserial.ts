/**
 * The way to a real base: a serial port by Web Serial, 115 200 baud. A port that is unplugged is opened again when it is back; errors of the line (a wrong stop
 * bit, an overrun) cost the bytes that they hit and no more.
 */
import { type Clock, clock as pageClock } from "./clock.ts";
import { LineSplitter, notALine } from "./lines.ts";
import { Backoff, type Listener, SILENCE_MS, type Traffic, type Transport } from "./transport.ts";

const OPTIONS: SerialOptions = { baudRate: 115_200, dataBits: 8, stopBits: 1, parity: "none", flowControl: "none", bufferSize: 16_384 };
/** After these the port goes on with a new reader, as the Web Serial specification has it. */
const SURVIVED: ReadonlySet<string> = new Set(["BufferOverrunError", "BreakError", "FramingError", "ParityError"]);
/** As many errors within a second are no line any more. */
const MAX_ERRORS = 50;
/** A write that takes longer does not come to an end. */
const WRITE_MS = 1000;
/** Closing a port that is gone may never end. */
const CLOSE_MS = 1000;
const LOOK_MS = 250;

/** What a port says of itself: nothing, if it is not on USB. */
function idOf(port: SerialPort): string {
  const { usbVendorId, usbProductId } = port.getInfo();
  return usbVendorId === undefined ? "" : `${hex(usbVendorId)}:${hex(usbProductId ?? 0)}`;
}

function hex(value: number): string {
  return value.toString(16).padStart(4, "0");
}

/** One opening of the port, until it is lost: what comes late of it is nobody's. */
interface Session {
  readonly port: SerialPort;
  readonly splitter: LineSplitter;
  reader: ReadableStreamDefaultReader<Uint8Array> | undefined;
  writer: WritableStreamDefaultWriter<Uint8Array> | undefined;
  lost: boolean;
}

export class WebSerialTransport implements Transport {
  readonly to: string;
  readonly traffic: Traffic = { heardBytes: 0, sentBytes: 0, damaged: 0 };
  readonly #serial: Serial;
  readonly #clock: Clock;
  readonly #backoff = new Backoff();
  #port: SerialPort;
  #listener: Listener | undefined;
  #session: Session | undefined;
  #wanted = false;
  #plugged = true;
  #another = false;
  #attempts = 0;
  #retry = () => {};
  #look = () => {};
  #heardAt = 0;
  #expects = false;
  /** The port was opened before anybody has it: see `request`. */
  #ready: boolean;
  #closing: Promise<unknown> = Promise.resolve();

  constructor(serial: Serial, port: SerialPort, clock: Clock = pageClock, ready = false) {
    this.#serial = serial;
    this.#port = port;
    this.#clock = clock;
    this.#ready = ready;
    this.to = `USB ${idOf(port)}`.trim().replace(/^USB$/, "serial port");
  }

  /** Asks the user for a port and opens it: whoever calls has a port that works before he gives up another one. */
  static async request(serial: Serial, clock: Clock = pageClock): Promise<WebSerialTransport> {
    const port = await serial.requestPort();
    if (port.readable) throw new Error("this page has that port open already");
    await port.open(OPTIONS);
    return new WebSerialTransport(serial, port, clock, true);
  }

  attach(listener: Listener): void {
    this.#listener = listener;
  }

  open(): void {
    if (this.#wanted) return;
    this.#wanted = true;
    this.#serial.addEventListener("connect", this.#onConnect);
    this.#serial.addEventListener("disconnect", this.#onDisconnect);
    void this.#begin();
  }

  close(): void {
    this.#wanted = false;
    this.#serial.removeEventListener("connect", this.#onConnect);
    this.#serial.removeEventListener("disconnect", this.#onDisconnect);
    this.#retry();
    this.#end();
  }

  /** Settles when the port is closed: it can be opened by somebody else then. */
  get closed(): Promise<unknown> {
    return this.#closing;
  }

  send(line: string): void {
    const why = notALine(line);
    if (why !== undefined) throw new Error(`not sent: ${why}`);
    const session = this.#session;
    if (!session) throw new Error("not sent: there is no connection to the base");
    this.#write(session, `${line}\n`);
  }

  expectTraffic(on: boolean): void {
    this.#expects = on;
    this.#heardAt = this.#clock.elapsed();
  }

  async #begin(): Promise<void> {
    this.#retry();
    if (this.#session) return;
    // Cables flap: an attempt that a later one has overtaken has nothing to say any more.
    this.#attempts += 1;
    const attempt = this.#attempts;
    this.#listener?.connecting();
    await this.#closing;
    if (!this.#wanted || this.#session || attempt !== this.#attempts) return;
    const port = this.#port;
    try {
      if (!this.#ready) await port.open(OPTIONS);
    } catch (error) {
      if (this.#wanted && attempt === this.#attempts && !this.#session) this.#lose(`the port does not open: ${message(error)}`);
      return;
    } finally {
      this.#ready = false;
    }
    const { writable, readable } = port;
    if (this.#wanted && attempt === this.#attempts && (writable?.locked || readable?.locked)) {
      this.#lose("something else on this page uses the port");
      return;
    }
    if (!this.#wanted || attempt !== this.#attempts || !writable) {
      void within(CLOSE_MS, this.#clock, port.close());
      return;
    }
    const session: Session = { port, splitter: new LineSplitter(), reader: undefined, writer: writable.getWriter(), lost: false };
    this.#session = session;
    this.#retry();
    this.#heardAt = this.#clock.elapsed();
    // What was left of a line before must not join the next one.
    this.#write(session, "\n");
    const another = this.#another;
    this.#another = false;
    this.#watch(session);
    void this.#read(session);
    this.#listener?.opened({ role: "drive", another });
  }

  async #read(session: Session): Promise<void> {
    let errors: { at: number; name: string }[] = [];
    while (!session.lost && session.port.readable) {
      let reader: Session["reader"];
      try {
        reader = session.port.readable.getReader();
        session.reader = reader;
        for (;;) {
          const { value, done } = await reader.read();
          if (done || session.lost) break;
          this.#heard(session, value);
        }
        if (!session.lost) return this.#lost(session, "the port was closed");
      } catch (error) {
        const name = error instanceof Error || error instanceof DOMException ? error.name : "";
        if (!SURVIVED.has(name)) return this.#lost(session, `the port was lost: ${message(error)}`);
        session.splitter.lost();
        const at = this.#clock.elapsed();
        errors = [...errors.filter((each) => at - each.at < 1000), { at, name }];
        if (errors.filter((each) => each.name === name).length >= MAX_ERRORS)
          return this.#lost(session, `${MAX_ERRORS} errors within a second: ${name}`);
      } finally {
        reader?.releaseLock();
        session.reader = undefined;
      }
    }
    this.#lost(session, "the port is gone");
  }

  #heard(session: Session, bytes: Uint8Array): void {
    this.#heardAt = this.#clock.elapsed();
    this.traffic.heardBytes += bytes.length;
    this.#backoff.reset();
    const before = session.splitter.dropped;
    session.splitter.push(bytes, (text) => {
      if (!session.lost) this.#listener?.line(text);
    });
    this.traffic.damaged += session.splitter.dropped - before;
  }

  #write(session: Session, text: string): void {
    const bytes = new TextEncoder().encode(text);
    const cancel = this.#clock.after(WRITE_MS, () => this.#lost(session, "the port takes nothing any more"));
    session.writer?.write(bytes).then(
      () => {
        cancel();
        this.traffic.sentBytes += bytes.length;
      },
      (error) => {
        cancel();
        this.#lost(session, `the port was lost: ${message(error)}`);
      },
    );
  }

  #watch(session: Session): void {
    this.#look();
    this.#look = this.#clock.after(LOOK_MS, () => {
      if (session.lost) return;
      if (this.#expects && this.#clock.elapsed() - this.#heardAt > SILENCE_MS) this.#lost(session, "nothing has been heard for 3 s");
      else this.#watch(session);
    });
  }

  #lost(session: Session, why: string): void {
    if (session.lost || session !== this.#session) return;
    this.#lose(why);
  }

  #lose(why: string): void {
    this.#end();
    if (!this.#wanted) return;
    if (!this.#plugged) {
      this.#listener?.lost(why, undefined);
      return;
    }
    const wait = this.#backoff.next();
    this.#retry();
    this.#retry = this.#clock.after(wait, () => void this.#begin());
    this.#listener?.lost(why, this.#clock.now() + wait);
  }

  /** Gives the port up; nothing that waits to be sent outlives that. */
  #end(): void {
    this.#look();
    this.#expects = false;
    const session = this.#session;
    this.#session = undefined;
    if (!session) return;
    session.lost = true;
    this.#closing = release(session, this.#clock);
  }

  #onDisconnect = (event: Event): void => {
    if (event.target !== this.#port) return;
    this.#plugged = false;
    // An attempt that is under way has overtaken itself: it would take a dead port for a session, and not hear of the live one.
    this.#attempts += 1;
    this.#retry();
    this.#lose("it was unplugged");
  };

  /** The port is back: as the same object, or as another one that looks alike and may belong to another board. */
  #onConnect = (event: Event): void => {
    const port = event.target as SerialPort;
    const id = idOf(this.#port);
    const alike = port !== this.#port && id !== "" && idOf(port) === id;
    if (this.#session || (port !== this.#port && !alike)) return;
    if (alike) {
      this.#port = port;
      this.#another = true;
    }
    this.#plugged = true;
    this.#backoff.reset();
    void this.#begin();
  };
}

/** Lets go of the port, whatever of it still answers: what hangs is left hanging, and the port is closed all the same. */
async function release({ reader, writer, port }: Session, clock: Clock): Promise<void> {
  await within(CLOSE_MS, clock, Promise.allSettled([reader?.cancel(), writer?.abort()]));
  writer?.releaseLock();
  await within(CLOSE_MS, clock, port.close());
}

/** Settles with what is waited for, or after a time without it. */
function within(ms: number, clock: Clock, what: Promise<unknown>): Promise<void> {
  return new Promise((resolve) => {
    const cancel = clock.after(ms, resolve);
    const done = () => {
      cancel();
      resolve();
    };
    what.then(done, done);
  });
}

function message(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
