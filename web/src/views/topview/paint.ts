/** One frame of the top view: what is drawn, and over what. */
import type { Model } from "../../model/model.ts";
import { STALE } from "../freshness.ts";
import { inkOn } from "../theme.ts";
import { drawBase, drawDoubt, drawGoal, drawPlan, drawRulers, drawScaleBar, drawSign, type Scene } from "./draw.ts";
import { drawTail, SOLID, TRUE_DASH } from "./drawtrail.ts";
import type { Point } from "./geometry.ts";
import type { Dragged } from "./goal.ts";
import type { Ground } from "./ground.ts";
import { silhouette } from "./silhouette.ts";
import type { Snapshot } from "./snapshot.ts";
import type { Trail } from "./trail.ts";

export interface Ways {
  readonly estimated: Trail;
  readonly truly: Trail;
}

export interface Giving {
  readonly dragged: Dragged;
  readonly words: string;
}

export function paint(
  scene: Scene,
  ground: Ground,
  model: Model,
  shown: Snapshot,
  { estimated, truly }: Ways,
  goal: Giving | undefined,
): void {
  const { view, palette } = scene;
  const { history } = model;
  const until = history.pushed - history.length + shown.index;
  const stale = shown.age > STALE;
  const trueStale = shown.truthAge > STALE;
  const { pose, truth } = shown;
  const ways = [
    { trail: truly, style: { colour: palette.true, width: 2, dash: TRUE_DASH }, at: truth },
    { trail: estimated, style: { colour: palette.est, width: 2, dash: SOLID }, at: pose },
  ];
  for (const { trail } of ways) trail.update(history, view.scale);
  // Of the map and of the path only the present state is known: in the past the one is pale, the other not there.
  ground.draw(scene, model.map, !shown.past || model.kind === "log", ways, until);
  for (const { trail, style, at } of ways) drawTail(scene, trail, until, end(at), style);
  if (!shown.past) drawPlan(scene, model.path, pose);

  const shape = silhouette(model.geometry, shown.motion, (model.parameters.get("rear_steered")?.value ?? 0) !== 0);
  const estimate = stale ? palette.muted : palette.est;
  if (pose)
    drawBase(scene, pose, shape, { colour: estimate, fill: palette.paper, wheels: stale ? palette.muted : palette.ink, ghost: stale });
  if (truth) {
    const colour = trueStale ? palette.muted : palette.true;
    drawBase(scene, truth, shape, { colour, fill: colour, wheels: colour, ghost: true });
  }
  // Over the base: a large one would hide how well it knows where it is.
  if (shown.doubt) drawDoubt(scene, shown.doubt, estimate, Math.max(44, shape.radius * view.scale * 1.9));
  if (goal) drawGoal(scene, goal.dragged, goal.words);
  drawRulers(scene);
  drawScaleBar(scene);
  signs(scene, model, shown);
}

function end(pose: { readonly x: number; readonly y: number } | undefined): Point | undefined {
  return pose && [pose.x, pose.y];
}

function signs(scene: Scene, model: Model, shown: Snapshot): void {
  const { palette } = scene;
  let line = 0;
  const sign = (text: string, colour: string) => {
    drawSign(scene, text, colour, inkOn(colour), line);
    line += 1;
  };
  const old = (age: number) => (age < 100 ? `${age.toFixed(1)} s old` : "long ago");
  if (shown.past) sign(`PAST: as of ${(shown.t ?? 0).toFixed(2)} s${model.kind === "live" ? ". The base goes on" : ""}`, palette.deccel);
  if (shown.pose && shown.age > STALE) sign(`STALE: the estimate is ${old(shown.age)}`, palette.fault);
  if (shown.truth && shown.truthAge > STALE) sign(`The true pose is ${old(shown.truthAge)}`, palette.muted);
  const assumed = model.map?.assumed;
  if (assumed !== undefined) sign(`Where ${assumed} was marked is not known here: the map may lie elsewhere`, palette.muted);
}
