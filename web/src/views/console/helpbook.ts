/** What the base says of its commands, asked when somebody begins to type, and once: nothing of it is known beforehand. */

type Ask = (line: string) => Promise<string>;

export class HelpBook {
  #ask: Ask | undefined;
  #changed: () => void;
  #asked = false;
  #generation = 0;
  #topics: string[] = [];
  #commands: string[] = [];
  #help = new Map<string, string | undefined>();

  constructor(changed: () => void) {
    this.#changed = changed;
  }

  get topics(): readonly string[] {
    return this.#topics;
  }

  get commands(): readonly string[] {
    return this.#commands;
  }

  /** Another base, or none: what was known is of the one before. */
  reset(ask: Ask | undefined): void {
    this.#ask = ask;
    this.#asked = false;
    this.#generation += 1;
    this.#topics = [];
    this.#commands = [];
    this.#help.clear();
  }

  /** Somebody types: asks what commands there are, unless that is known. */
  async open(): Promise<void> {
    if (this.#asked || !this.#ask) return;
    this.#asked = true;
    const generation = this.#generation;
    try {
      const topics = topicsOf(await this.#question("Help"));
      for (const topic of topics) {
        const commands = wordsOf(await this.#question(`Help ${topic}`));
        if (generation !== this.#generation) return;
        this.#topics.push(topic);
        this.#commands.push(...commands);
      }
      this.#changed();
    } catch {
      // Not answered: asked again when somebody types again.
      if (generation === this.#generation) this.reset(this.#ask);
    }
  }

  /** What a command takes and does, as the base says it; asked if it is not known yet. */
  of(command: string): string | undefined {
    const key = command.toLowerCase();
    const known = this.#commands.some((each) => each.toLowerCase() === key) || SHORT.has(key);
    if (known && !this.#help.has(key)) {
      this.#help.set(key, undefined);
      void this.#learn(command, key);
    }
    return this.#help.get(key);
  }

  async #learn(command: string, key: string): Promise<void> {
    const generation = this.#generation;
    try {
      const reply = await this.#question(`Help ${command}`);
      if (generation !== this.#generation) return;
      this.#help.set(key, reply.replace(/^Help /, ""));
      this.#changed();
    } catch {
      if (generation === this.#generation) this.#help.delete(key);
    }
  }

  async #question(line: string): Promise<string> {
    if (!this.#ask) throw new Error("no base to ask");
    const reply = await this.#ask(line);
    if (!reply.startsWith("Help ")) throw new Error(reply);
    return reply;
  }
}

/** Short names do not stand in the lists. */
const SHORT = new Set(["m", "t"]);

/** `Help motion path …; try Help motion`. */
function topicsOf(reply: string): string[] {
  return wordsOf(reply.split(";", 1)[0] ?? "");
}

/** `Help move turn Stop`. */
function wordsOf(reply: string): string[] {
  return reply.split(" ").slice(1);
}
