/** Stand-ins for `navigator.serial` and a port, whose far end is the test. */

export class FakePort extends EventTarget {
  onconnect = null;
  ondisconnect = null;
  connected = true;
  readable: ReadableStream<Uint8Array> | null = null;
  writable: WritableStream<Uint8Array> | null = null;
  written = "";
  opened = 0;
  options: SerialOptions | undefined;
  refuses: string | undefined;
  stalls = false;
  readonly #id: SerialPortInfo;
  #controller: ReadableStreamDefaultController<Uint8Array> | undefined;

  constructor(usbVendorId?: number, usbProductId?: number) {
    super();
    this.#id = usbVendorId === undefined ? {} : { usbVendorId, usbProductId: usbProductId ?? 0 };
  }

  getInfo(): SerialPortInfo {
    return this.#id;
  }

  async open(options: SerialOptions): Promise<void> {
    if (this.refuses) throw new DOMException(this.refuses, "NetworkError");
    if (this.readable) throw new DOMException("open already", "InvalidStateError");
    this.options = options;
    this.opened += 1;
    this.#newReadable();
    this.writable = new WritableStream({
      write: (chunk) => {
        this.written += new TextDecoder().decode(chunk);
        return this.stalls ? new Promise(() => {}) : undefined;
      },
    });
  }

  async close(): Promise<void> {
    if (this.readable?.locked || this.writable?.locked) throw new TypeError("locked");
    this.readable = null;
    this.writable = null;
  }

  async forget(): Promise<void> {}
  async setSignals(): Promise<void> {}
  async getSignals(): Promise<SerialInputSignals> {
    return { clearToSend: true, dataCarrierDetect: true, dataSetReady: true, ringIndicator: false };
  }

  hear(bytes: string | Uint8Array): void {
    this.#controller?.enqueue(typeof bytes === "string" ? new TextEncoder().encode(bytes) : bytes);
  }

  /** An error that the specification survives: the stream errors, and there is a new one. */
  fails(name: string): void {
    if (!this.readable) return;
    const controller = this.#controller;
    this.#newReadable();
    controller?.error(new DOMException(name, name));
  }

  /** The device is gone. */
  dies(): void {
    const controller = this.#controller;
    this.readable = null;
    controller?.error(new DOMException("The device has been lost.", "NetworkError"));
  }

  #newReadable(): void {
    this.readable = new ReadableStream({
      start: (controller) => {
        this.#controller = controller;
      },
    });
  }
}

export class FakeSerial extends EventTarget {
  onconnect = null;
  ondisconnect = null;
  chosen: FakePort | undefined;

  async requestPort(): Promise<SerialPort> {
    if (!this.chosen) throw new DOMException("No port selected by the user.", "NotFoundError");
    return this.chosen as unknown as SerialPort;
  }

  async getPorts(): Promise<SerialPort[]> {
    return [];
  }

  tell(type: "connect" | "disconnect", port: FakePort): void {
    const event = new Event(type);
    Object.defineProperty(event, "target", { value: port });
    // The dispatch sets the target anew: the listeners are called with one that stays.
    for (const listener of this.#listeners.get(type) ?? []) listener(event);
  }

  #listeners = new Map<string, Set<(event: Event) => void>>();

  override addEventListener(type: string, listener: EventListenerOrEventListenerObject | null): void {
    if (typeof listener !== "function") return;
    this.#listeners.set(type, (this.#listeners.get(type) ?? new Set()).add(listener));
  }

  override removeEventListener(type: string, listener: EventListenerOrEventListenerObject | null): void {
    if (typeof listener === "function") this.#listeners.get(type)?.delete(listener);
  }
}
