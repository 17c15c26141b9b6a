/** The top view in words: for who does not see it, and for who wants the figures. */
import type { Model } from "../../model/model.ts";
import { STALE } from "../freshness.ts";
import { lengthWords, wrapDegrees } from "./geometry.ts";
import { type Snapshot, truePose } from "./snapshot.ts";
import { deviations } from "./uncertainty.ts";

const fixed = (value: number, digits: number) => {
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−");
};

export function statusWords(model: Model, shown: Snapshot): string {
  const { pose, doubt, truth } = shown;
  if (!pose) return model.kind === "log" ? "This log tells no pose." : "No pose was heard yet.";
  const words = [`x ${fixed(pose.x, 3)} m · y ${fixed(pose.y, 3)} m · heading ${fixed(wrapDegrees(pose.theta), 1)}°`];
  if (doubt) {
    const { position, heading } = deviations(doubt.covariance);
    words.push(`σ ${lengthWords(position)}, ${fixed(heading, 2)}°`);
  }
  // Of the same instant as the estimate, where that is known: at 0.5 m/s 20 ms are a centimetre.
  const then = shown.sampled ? (truePose(model.history, shown.index) ?? truth) : undefined;
  if (then && shown.truthAge <= STALE) {
    const off = Math.hypot(then.x - pose.x, then.y - pose.y);
    words.push(`truly ${lengthWords(off)}, ${fixed(Math.abs(wrapDegrees(then.theta - pose.theta)), 2)}° off`);
  }
  if (shown.past) words.push(`as of ${fixed(shown.t ?? 0, 2)} s`);
  else if (model.path.mode === "path") words.push(`${model.path.postures.length} postures left`);
  else if (model.path.mode === "chase") words.push("chasing");
  if (shown.age > STALE) words.unshift("STALE");
  return words.join(" · ");
}

/** Why a click gives no order; undefined: it does. */
export function whyNoGoal(model: Model): string | undefined {
  if (model.kind === "log") return "This is a log: it takes no goals.";
  if (model.connection.state !== "open") return "No base is connected, so there is none to send anywhere.";
  if (!model.mayDrive || !model.commands) return "Another page drives this base; this one only watches.";
  if (model.cursor.t !== undefined) return "The view is paused in the past. Press Live, then set a goal.";
  return undefined;
}
