/** No base: what a page shows before it is connected to one. */
import { Ring } from "./history.ts";
import type { Cursor, Model } from "./model.ts";
import { geometryOf } from "./shape.ts";
import { nextFrame, Topics } from "./topics.ts";

export function noBase(): Model {
  const topics = new Topics(nextFrame());
  let cursor: Cursor = { t: undefined };
  return {
    kind: "live",
    connection: { state: "none" },
    version: undefined,
    history: new Ring(1),
    estimates: [],
    status: undefined,
    parameters: new Map(),
    unsaved: false,
    path: { mode: "idle", postures: [] },
    map: undefined,
    gains: [],
    geometry: geometryOf(new Map()),
    world: undefined,
    spoken: [],
    statistics: { heardBytesPerSecond: 0, sentBytesPerSecond: 0, damagedLines: 0, unanswered: 0 },
    alarm: undefined,
    streaming: true,
    pose: undefined,
    heardAt: { telemetry: undefined, pose: undefined, states: undefined, motors: undefined },
    unresponsive: false,
    get cursor() {
      return cursor;
    },
    commands: undefined,
    mayDrive: false,
    setCursor(t) {
      cursor = { t };
      topics.publish("cursor");
    },
    subscribe: (of, listener) => topics.subscribe(of, listener),
  };
}
