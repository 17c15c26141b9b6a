/** The simulated world as the page knows it, and what is asked of it. */
import type { Clock } from "../transport/clock.ts";
import { BaseClock } from "./baseclock.ts";
import type { Pose, World, WorldRequest } from "./model.ts";
import type { Hello, Moment } from "./worldline.ts";

/** A true pose that is older is no fix: the base refuses 1.5 s. */
const MAX_AGE_S = 1;
/** The server answers at once. */
const ANSWER_MS = 3000;

interface Pending {
  readonly done: () => void;
  readonly refused: (why: string) => void;
}

export class Simulated {
  readonly #clock: Clock;
  readonly #baseClock = new BaseClock();
  #hello: Hello | undefined;
  #pending = new Map<number, Pending>();
  #id = 0;
  world: World | undefined;

  constructor(clock: Clock) {
    this.#clock = clock;
  }

  get vehicle(): string | undefined {
    return this.#hello?.vehicle;
  }

  hello(hello: Hello): void {
    this.#hello = hello;
  }

  moment(moment: Moment): void {
    const { t, x, y, theta, ...rest } = moment;
    this.#baseClock.heard(t, this.#clock.elapsed() / 1000);
    this.world = {
      ...rest,
      pose: { t, x, y, theta },
      robot: this.#hello?.robot ?? "",
      speed: this.#hello?.speed,
      faults: this.#hello?.faults ?? [],
      truth: this.#hello?.truth,
      heardAt: this.#clock.elapsed(),
    };
  }

  /** Seconds that have passed for the base since the pose was the true one; undefined if none is known. */
  get age(): number | undefined {
    if (!this.world) return undefined;
    const now = this.#baseClock.now(this.#clock.elapsed() / 1000, this.world.speed ?? 1);
    return now === undefined ? undefined : Math.max(0, now - this.world.pose.t);
  }

  /** The true pose with its age, while telemetry is alive; undefined if there is none, or it is too old for a fix. `heardAt`: of telemetry, by the clock that never leaps. */
  truth(heardAt: number | undefined): (Pose & { readonly age: number }) | undefined {
    const { world, age } = this;
    if (!world || heardAt === undefined || age === undefined || age > MAX_AGE_S) return undefined;
    if (this.#clock.elapsed() - heardAt > 1000 * MAX_AGE_S) return undefined;
    return { ...world.pose, age };
  }

  /** Another base, which may have no simulated world. */
  forget(): void {
    this.#hello = undefined;
    this.world = undefined;
    this.#baseClock.forget();
  }

  ask(request: WorldRequest, send: (message: string) => void): Promise<void> {
    this.#id += 1;
    const id = this.#id;
    return new Promise((resolve, reject) => {
      const end = (settle: () => void) => () => {
        cancel();
        this.#pending.delete(id);
        settle();
      };
      const refused = (why: string) => end(() => reject(new Error(why)))();
      const cancel = this.#clock.after(ANSWER_MS, () => refused("the simulator has not answered"));
      this.#pending.set(id, { done: end(resolve), refused });
      try {
        send(JSON.stringify({ id, ...request }));
      } catch (error) {
        refused(error instanceof Error ? error.message : String(error));
      }
    });
  }

  done(id: number): void {
    this.#pending.get(id)?.done();
  }

  refused(id: number, why: string): void {
    this.#pending.get(id)?.refused(why);
  }

  lost(): void {
    for (const pending of [...this.#pending.values()]) pending.refused("the connection was lost");
  }
}
