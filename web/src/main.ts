/** Which base: the simulator that served this page, or a serial port that the user chooses. */
import { type App, app } from "./app.ts";
import { LiveModel } from "./model/live.ts";
import type { Model } from "./model/model.ts";
import { noBase } from "./model/none.ts";
import { csv } from "./record/csv.ts";
import { readLog } from "./record/read.ts";
import type { Transport } from "./transport/transport.ts";
import { WebSerialTransport } from "./transport/webserial.ts";
import { WebSocketTransport } from "./transport/websocket.ts";

declare global {
  interface Window {
    /** What is shown: to look at, in tests and in the browser's tools. */
    page: App;
  }
}

/** The base that is connected; it is left when another one is. */
let connected: LiveModel | undefined;

function leave(): void {
  connected?.close();
  connected = undefined;
}

function enter(transport: Transport): LiveModel {
  leave();
  connected = new LiveModel(transport);
  connected.open();
  return connected;
}

const served = document.querySelector<HTMLMetaElement>('meta[name="base"]')?.content === "served";
const simulator = () => new WebSocketTransport(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/base`);

window.page = app(window, {
  served,
  serial: "serial" in navigator,
  live: served ? enter(simulator()) : noBase(),
  // The new port is open before the old base is left.
  connect: async (): Promise<Model> => enter(await WebSerialTransport.request(navigator.serial)),
  disconnect: async () => {
    leave();
    return noBase();
  },
  readLog,
  csv,
});
