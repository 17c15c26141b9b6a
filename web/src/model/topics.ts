/** Who wants to know what is new. */
import { type Clock, clock as pageClock } from "../transport/clock.ts";
import type { Topic } from "./model.ts";

/** Frames do not come to a page that nobody sees; it still has to raise an alarm. */
const WITHOUT_FRAMES_MS = 200;

/** Calls back before the next frame. */
export type NextFrame = (run: () => void) => void;

/** The next frame, or soon if there are none. */
export function nextFrame(clock: Clock = pageClock): NextFrame {
  return (run) => {
    let done = false;
    const once = () => {
      if (done) return;
      done = true;
      cancel();
      run();
    };
    const cancel = clock.after(WITHOUT_FRAMES_MS, once);
    if (typeof requestAnimationFrame === "function") requestAnimationFrame(once);
  };
}

interface Subscription {
  readonly topics: readonly Topic[];
  readonly listener: () => void;
}

/** Collects what is new and tells it, to each listener at most once a frame. */
export class Topics {
  readonly #frame: NextFrame;
  #subscriptions = new Set<Subscription>();
  #fresh = new Set<Topic>();
  #asked = false;

  constructor(frame: NextFrame) {
    this.#frame = frame;
  }

  subscribe(topics: readonly Topic[], listener: () => void): () => void {
    const subscription = { topics, listener };
    this.#subscriptions.add(subscription);
    return () => this.#subscriptions.delete(subscription);
  }

  publish(...topics: readonly Topic[]): void {
    for (const topic of topics) this.#fresh.add(topic);
    if (this.#asked) return;
    this.#asked = true;
    this.#frame(() => this.#tell());
  }

  #tell(): void {
    this.#asked = false;
    const fresh = this.#fresh;
    this.#fresh = new Set();
    for (const subscription of [...this.#subscriptions]) {
      if (!this.#subscriptions.has(subscription) || !subscription.topics.some((topic) => fresh.has(topic))) continue;
      try {
        subscription.listener();
      } catch (error) {
        // One view that fails must not keep the others from what is new; a Stop's alarm least of all.
        reportLater(error);
      }
    }
  }
}

function reportLater(error: unknown): void {
  setTimeout(() => {
    throw error;
  });
}
