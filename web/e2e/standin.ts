/**
 * A stand-in for `navigator.serial`: one port, whose far end is a pseudo-terminal of the simulator. The page knows no difference: it has the streams, events and
 * errors of the Web Serial specification. What the test does to the cable it does through `window.cable`.
 */
import { closeSync, constants, openSync } from "node:fs";
import { ReadStream, WriteStream } from "node:tty";
import type { Page } from "playwright-core";

export interface Cable {
  unplug(): Promise<void>;
  /** `other`: as another device that looks alike. */
  plug(other?: boolean): Promise<void>;
  /** What the page has written, all of it. */
  readonly written: string;
  end(): void;
}

/** Bytes to the page go in packets, as USB's do. */
const PACKET_MS = 5;

export async function standIn(page: Page, terminal: string): Promise<Cable> {
  const descriptor = openSync(terminal, constants.O_RDWR | constants.O_NOCTTY);
  const reading = new ReadStream(descriptor);
  const writing = new WriteStream(descriptor);
  let written = "";
  let pending: Buffer[] = [];
  await page.exposeBinding("serialWrite", (_, text: string) => {
    written += text;
    writing.write(Buffer.from(text, "latin1"));
  });
  // The loader of this file wraps named functions in a helper, which the page does not have.
  await page.addInitScript({ content: `(() => { const __name = (named) => named; (${inPage})(); })();` });
  reading.on("data", (data: Buffer) => pending.push(data));
  let flushing = false;
  const flush = setInterval(() => {
    if (flushing || pending.length === 0) return;
    const text = Buffer.concat(pending).toString("latin1");
    pending = [];
    flushing = true;
    page
      .evaluate((bytes) => window.cable?.hear(bytes), text)
      // The page is being loaded, or has been closed: what nobody hears is lost, as on a wire.
      .catch(() => {})
      .finally(() => {
        flushing = false;
      });
  }, PACKET_MS);
  return {
    unplug: () => page.evaluate(() => window.cable?.plug(false, false)),
    plug: (other = false) => page.evaluate((as) => window.cable?.plug(true, as), other),
    get written() {
      return written;
    },
    end: () => {
      clearInterval(flush);
      reading.destroy();
      writing.destroy();
      try {
        closeSync(descriptor);
      } catch {
        // One of the streams has closed it.
      }
    },
  };
}

interface FarEnd {
  hear(bytes: string): void;
  /** `other`: the browser takes what is plugged in for another device that looks alike, as after a real one's new start. */
  plug(on: boolean, other: boolean): void;
}

declare global {
  interface Window {
    cable?: FarEnd;
    serialWrite(text: string): Promise<void>;
  }
}

/** Runs in the page, before anything of the page does. */
function inPage(): void {
  let plugged = true;
  let controller: ReadableStreamDefaultController<Uint8Array> | undefined;

  class Port extends EventTarget {
    readable: ReadableStream<Uint8Array> | null = null;
    writable: WritableStream<Uint8Array> | null = null;

    getInfo() {
      return { usbVendorId: 0x0483, usbProductId: 0x374b };
    }

    async open(options: SerialOptions) {
      if (options.baudRate !== 115_200) throw new TypeError("the base talks at 115 200 baud");
      if (this.readable) throw new DOMException("The port is already open.", "InvalidStateError");
      if (!plugged) throw new DOMException("Failed to open serial port.", "NetworkError");
      this.readable = new ReadableStream({
        start: (own) => {
          controller = own;
        },
      });
      this.writable = new WritableStream({
        write: (bytes) => {
          if (!plugged) throw new DOMException("The device has been lost.", "NetworkError");
          return window.serialWrite(String.fromCharCode(...bytes));
        },
      });
    }

    async close() {
      if (this.readable?.locked || this.writable?.locked) throw new TypeError("Cannot close a locked stream.");
      controller = undefined;
      this.readable = null;
      this.writable = null;
    }
  }

  let port = new Port();
  const serial = Object.assign(new EventTarget(), {
    requestPort: async () => port,
    getPorts: async () => [port],
  });
  Object.defineProperty(navigator, "serial", { value: serial });
  window.cable = {
    hear: (bytes) => {
      if (plugged) controller?.enqueue(Uint8Array.from(bytes, (byte) => byte.charCodeAt(0)));
    },
    plug: (on, other) => {
      plugged = on;
      if (other) port = new Port();
      if (!on) {
        controller?.error(new DOMException("The device has been lost.", "NetworkError"));
        controller = undefined;
        port.readable = null;
      }
      // The browser tells it at the port, and it bubbles to `navigator.serial`.
      const event = new Event(on ? "connect" : "disconnect");
      Object.defineProperty(event, "target", { value: port });
      serial.dispatchEvent(event);
    },
  };
}
