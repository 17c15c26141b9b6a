/** What a user may see of a connection that comes and goes. */

import type { Role, Transport } from "../transport/transport.ts";
import type { Connection } from "./model.ts";

/** The state of a line, as a view has it. */
export class Seat {
  connection: Connection;
  #to: string;
  #free = false;
  #role: Role | undefined;
  #another = false;

  constructor(transport: Transport) {
    this.#to = transport.to;
    this.connection = { state: "none" };
  }

  /** The role in which the line is open, if it is. */
  get role(): Role | undefined {
    return this.connection.state === "open" ? this.#role : undefined;
  }

  connecting(): void {
    this.connection = { state: "connecting", to: this.#to };
  }

  /** `another`: it may be another base than the one that was lost. */
  opened(role: Role, another: boolean): void {
    this.#role = role;
    this.#another ||= another;
    this.#free = false;
    this.#show();
  }

  free(free: boolean): void {
    this.#free = free;
    if (this.connection.state === "open") this.#show();
  }

  /** The user knows which base this is. */
  confirmed(): void {
    this.#another = false;
    if (this.connection.state === "open") this.#show();
  }

  lost(why: string, retryAt: number | undefined): void {
    this.connection = { state: "lost", to: this.#to, why, retryAt };
  }

  closed(): void {
    this.connection = { state: "none" };
  }

  #show(): void {
    const role = this.#role ?? "watch";
    this.connection = { state: "open", to: this.#to, role, seatFree: this.#free && role === "watch", another: this.#another };
  }
}
