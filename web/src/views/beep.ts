/** The alarm's sound. A browser lets a page make one only after the user has touched it: the first touch or key arms it. */

const PERIOD_MS = 800;
const SECONDS = 0.25;
const PITCH_HZ = 880;

export interface Beeper {
  sound(on: boolean): void;
  destroy(): void;
}

export function beeper(target: Window): Beeper {
  let context: AudioContext | undefined;
  let timer: ReturnType<typeof setInterval> | undefined;

  const arm = () => {
    try {
      context ??= new AudioContext();
      void context.resume().catch(() => {});
    } catch {
      // No sound on this machine; the red banner remains.
    }
  };
  const gestures = ["pointerdown", "keydown"] as const;
  for (const kind of gestures) target.addEventListener(kind, arm, { capture: true, once: true });

  const beep = () => {
    if (context?.state !== "running") return;
    const start = context.currentTime;
    const volume = context.createGain();
    // Without ramps the ends click.
    volume.gain.setValueAtTime(0, start);
    volume.gain.linearRampToValueAtTime(0.3, start + 0.02);
    volume.gain.setValueAtTime(0.3, start + SECONDS - 0.02);
    volume.gain.linearRampToValueAtTime(0, start + SECONDS);
    volume.connect(context.destination);
    const tone = context.createOscillator();
    tone.type = "square";
    tone.frequency.value = PITCH_HZ;
    tone.connect(volume);
    tone.start(start);
    tone.stop(start + SECONDS);
    tone.onended = () => volume.disconnect();
  };

  const sound = (on: boolean) => {
    if (on === (timer !== undefined)) return;
    clearInterval(timer);
    timer = undefined;
    if (!on) return;
    beep();
    timer = setInterval(beep, PERIOD_MS);
  };
  return {
    sound,
    destroy: () => {
      sound(false);
      for (const kind of gestures) target.removeEventListener(kind, arm, { capture: true });
      void context?.close();
    },
  };
}
