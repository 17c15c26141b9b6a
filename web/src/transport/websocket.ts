/**
 * The way to a simulated base: one WebSocket, text messages being the serial line and binary ones the simulated world. See docs/page.md.
 *
 * A lost connection is made again as what it was. Whoever drove comes back to a seat that is still his own for a while: the server has not noticed the loss yet.
 * He watches then, and takes the seat when it comes free shortly after; later than that it is for the user to say.
 */
import { type Clock, clock as pageClock } from "./clock.ts";
import { notALine } from "./lines.ts";
import { Backoff, type Listener, type Role, SILENCE_MS, type Traffic, type Transport } from "./transport.ts";

/** What is used of a WebSocket. */
export type Socket = Pick<WebSocket, "send" | "close" | "bufferedAmount" | "binaryType" | "onopen" | "onmessage" | "onclose" | "onerror">;

/** The server's word for a seat that is taken. */
const SEAT_TAKEN = 4409;
/** What the server says of the seat, in its greeting or when that changes. */
const SEAT_FREE = /^\{"(hello|seat)".*"free"/;
/** Unsent bytes beyond this mean that nobody takes them. */
const MAX_UNSENT = 16 * 1024;
/** The server says hello at once. */
const GREETING_MS = 5000;
const LOOK_MS = 250;
/** The server notices a lost driver within 5 s of a ping that comes every 2 s. */
const RECLAIM_MS = 12_000;

export interface WebSocketOptions {
  readonly role?: Role;
  readonly clock?: Clock;
  readonly make?: (url: string, role: Role) => Socket;
}

export class WebSocketTransport implements Transport {
  readonly to: string;
  readonly traffic: Traffic = { heardBytes: 0, sentBytes: 0, damaged: 0 };
  readonly #url: string;
  readonly #clock: Clock;
  readonly #make: (url: string, role: Role) => Socket;
  readonly #backoff = new Backoff();
  #listener: Listener | undefined;
  #role: Role;
  #socket: Socket | undefined;
  /** Hello has come: it is open in this role. */
  #open: Role | undefined;
  #retry = () => {};
  #look = () => {};
  #heardAt = 0;
  #expects = false;
  /** Until when a seat that comes free is ours again. */
  #reclaimUntil = 0;

  constructor(url: string, options: WebSocketOptions = {}) {
    this.#url = url;
    this.to = new URL(url).host;
    this.#role = options.role ?? "drive";
    this.#clock = options.clock ?? pageClock;
    this.#make = options.make ?? ((at, role) => new WebSocket(at, role));
  }

  attach(listener: Listener): void {
    this.#listener = listener;
  }

  open(): void {
    this.#abandon();
    this.#retry();
    this.#listener?.connecting();
    const socket = this.#make(this.#url, this.#role);
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    this.#heardAt = this.#clock.elapsed();
    socket.onmessage = (event) => this.#message(event.data);
    socket.onclose = (event) => this.#closed(event.code, event.reason);
    this.#watch(socket);
  }

  close(): void {
    this.#retry();
    this.#abandon();
  }

  send(line: string): void {
    const why = notALine(line);
    if (why !== undefined) throw new Error(`not sent: ${why}`);
    this.#write(line, line.length + 1);
  }

  sendWorld(message: string): void {
    this.#write(new TextEncoder().encode(message), 0);
  }

  expectTraffic(on: boolean): void {
    this.#expects = on;
    this.#heardAt = this.#clock.elapsed();
  }

  takeSeat(): void {
    this.#role = "drive";
    this.open();
  }

  #write(message: string | Uint8Array<ArrayBuffer>, bytes: number): void {
    const socket = this.#socket;
    if (!socket || this.#open === undefined) throw new Error("not sent: there is no connection to the base");
    if (this.#open === "watch") throw new Error("not sent: this page only watches");
    if (socket.bufferedAmount > MAX_UNSENT) {
      this.#lose("the server takes nothing any more");
      throw new Error("not sent: the connection to the base is lost");
    }
    socket.send(message);
    this.traffic.sentBytes += bytes;
  }

  #message(data: unknown): void {
    this.#heardAt = this.#clock.elapsed();
    if (typeof data === "string") {
      this.#greeted(this.#role);
      this.traffic.heardBytes += data.length + 2;
      if (notALine(data) === undefined) this.#listener?.line(data);
      else this.traffic.damaged += 1;
    } else if (data instanceof ArrayBuffer) {
      const text = new TextDecoder().decode(data);
      if (text.startsWith('{"hello"')) this.#greeted(this.#role);
      if (SEAT_FREE.test(text) && this.#role === "watch" && this.#clock.elapsed() < this.#reclaimUntil) this.takeSeat();
      else this.#listener?.world(text);
    }
  }

  #greeted(role: Role): void {
    if (this.#open !== undefined) return;
    this.#open = role;
    this.#backoff.reset();
    if (role === "drive") this.#reclaimUntil = 0;
    this.#listener?.opened({ role, another: false });
  }

  #closed(code: number, reason: string): void {
    if (code === SEAT_TAKEN && this.#role === "drive") {
      this.#role = "watch";
      this.open();
      return;
    }
    const open = this.#open !== undefined;
    this.#lose(reason || (open ? "the server has closed it" : "nobody answers there"));
  }

  #lose(why: string): void {
    if (this.#open === "drive") this.#reclaimUntil = this.#clock.elapsed() + RECLAIM_MS;
    // Within that time it goes for the seat again, whatever it could be in between.
    if (this.#clock.elapsed() < this.#reclaimUntil) this.#role = "drive";
    this.#abandon();
    const wait = this.#backoff.next();
    this.#retry();
    this.#retry = this.#clock.after(wait, () => this.open());
    this.#listener?.lost(why, this.#clock.now() + wait);
  }

  /** Looks whether anything still comes, and goes. */
  #watch(socket: Socket): void {
    this.#look = this.#clock.after(LOOK_MS, () => {
      const silence = this.#clock.elapsed() - this.#heardAt;
      if (socket.bufferedAmount > MAX_UNSENT) this.#lose("the server takes nothing any more");
      else if (this.#open === undefined && silence > GREETING_MS) this.#lose("nobody answers there");
      else if (this.#open !== undefined && this.#expects && silence > SILENCE_MS) this.#lose("nothing has been heard for 3 s");
      else this.#watch(socket);
    });
  }

  /** Lets go of the socket: whatever still comes of it is nobody's. */
  #abandon(): void {
    this.#look();
    this.#open = undefined;
    this.#expects = false;
    const socket = this.#socket;
    this.#socket = undefined;
    if (!socket) return;
    socket.onmessage = null;
    socket.onclose = null;
    socket.close();
  }
}
