/** A network that fails: connections to the simulator that can fall silent, or be cut, while both ends believe in them. */
import { type AddressInfo, connect, createServer, type Socket } from "node:net";

export interface Between {
  /** The page's address through it. */
  readonly url: string;
  /** Passes nothing on any more, either way, and ends nothing. */
  mute(on: boolean): void;
  /** Cuts what there is. */
  cut(): void;
  end(): Promise<void>;
}

export async function proxy(target: string): Promise<Between> {
  const { port, host } = new URL(target);
  const sockets = new Set<Socket>();
  let muted = false;
  const server = createServer((near) => {
    const far = connect(Number(port), "127.0.0.1");
    let begun = false;
    for (const [from, to] of [
      [near, far],
      [far, near],
    ] as const) {
      sockets.add(from);
      from.on("error", () => to.destroy());
      from.on("close", () => {
        sockets.delete(from);
        to.destroy();
      });
    }
    near.on("data", (data) => {
      if (muted) return;
      // The server answers to its own name only: it shall not know that there is something between.
      far.write(begun ? data : Buffer.from(data.toString("latin1").replaceAll(own, host), "latin1"));
      begun = true;
    });
    far.on("data", (data) => {
      if (!muted) near.write(data);
    });
  });
  await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
  const own = `127.0.0.1:${(server.address() as AddressInfo).port}`;
  const cut = () => {
    for (const socket of sockets) socket.destroy();
  };
  return {
    url: `http://${own}/`,
    mute: (on) => {
      muted = on;
    },
    cut,
    end: () => {
      cut();
      return new Promise((resolve) => server.close(() => resolve()));
    },
  };
}
