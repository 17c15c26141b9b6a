/**
 * Lays the base's map out. An arc says where a place's frame lies as seen from another's: where it likely is, and a disc and a range of headings that it certainly does
 * not leave (docs/map.md). From one place on, the others follow by whichever way leaves them the smallest circle.
 */
import type { ArcRow, LandmarkRow, MapRow, PlaceRow } from "../protocol/replies.ts";
import type { MapPlace, MapSketch, Pose } from "./model.ts";

/** Where a place lies, and how far off that may be. */
interface Known {
  readonly pose: Pose;
  /** Metres around the pose. */
  readonly radius: number;
  /** Degrees to either side of the heading. */
  readonly half: number;
}

const RADIANS = Math.PI / 180;

/** The pose that `step` leads to, as seen from `from`. */
export function compose(from: Pose, step: Pose): Pose {
  const [sine, cosine] = [Math.sin(from.theta * RADIANS), Math.cos(from.theta * RADIANS)];
  return { x: from.x + cosine * step.x - sine * step.y, y: from.y + sine * step.x + cosine * step.y, theta: wrap(from.theta + step.theta) };
}

/** The way back. */
export function invert(step: Pose): Pose {
  const [sine, cosine] = [Math.sin(step.theta * RADIANS), Math.cos(step.theta * RADIANS)];
  return { x: -cosine * step.x - sine * step.y, y: sine * step.x - cosine * step.y, theta: wrap(-step.theta) };
}

/** Degrees in (−180, 180]. */
export function wrap(degrees: number): number {
  const rest = degrees % 360;
  return rest > 180 ? rest - 360 : rest <= -180 ? rest + 360 : rest;
}

/** How far a point at that distance can be off when the direction is off by so many degrees: the chord. */
function sway(distance: number, degrees: number): number {
  return 2 * distance * Math.sin((Math.min(degrees, 180) / 2) * RADIANS);
}

/** What an arc says of its end, from what is known of its beginning; or of its beginning, if taken `back`. */
function along(from: Known, arc: ArcRow, back: boolean): Known {
  const { bound, likely } = arc;
  const centre = { x: bound.distance * Math.cos(bound.bearing * RADIANS), y: bound.distance * Math.sin(bound.bearing * RADIANS) };
  // The circles are drawn about the likely poses, which are not the middles of the bounds.
  const radius = bound.radius + Math.hypot(centre.x - likely.x, centre.y - likely.y);
  const half = bound.half + Math.abs(wrap(bound.heading - likely.theta));
  const distance = Math.hypot(likely.x, likely.y);
  const turned = back ? sway(distance, half) : 0;
  return {
    pose: compose(from.pose, back ? invert(likely) : likely),
    radius: from.radius + radius + sway(distance, from.half) + turned,
    half: from.half + half,
  };
}

/** Where the places lie, seen from one of them whose pose is known. */
function spread(root: string, pose: Pose, places: ReadonlySet<string>, arcs: readonly ArcRow[]): Map<string, Known> {
  const done = new Map<string, Known>();
  const reached = new Map<string, Known>([[root, { pose, radius: 0, half: 0 }]]);
  const reach = (name: string, known: Known) => {
    const other = reached.get(name);
    if (places.has(name) && !done.has(name) && (!other || known.radius < other.radius)) reached.set(name, known);
  };
  while (reached.size > 0) {
    const [name, known] = [...reached].reduce((best, next) => (next[1].radius < best[1].radius ? next : best));
    reached.delete(name);
    done.set(name, known);
    for (const arc of arcs) {
      if (arc.from === name) reach(arc.to, along(known, arc, false));
      if (arc.to === name) reach(arc.from, along(known, arc, true));
    }
  }
  return done;
}

/** The map as it is drawn. `marks`: poses at which places were marked, in the frame of the estimate, as far as somebody here has heard it. */
export function layout(rows: readonly MapRow[], anchor: string | undefined, marks: ReadonlyMap<string, Pose>): MapSketch {
  const places = rows.filter((row): row is PlaceRow => row.kind === "place");
  const landmarks = rows.filter((row): row is LandmarkRow => row.kind === "landmark");
  const arcs = rows.filter((row): row is ArcRow => row.kind === "arc");
  const names = new Set(places.map((place) => place.name));
  const marked = [...(anchor === undefined ? [] : [anchor]), ...[...marks.keys()].reverse()].find(
    (name) => names.has(name) && marks.has(name),
  );
  const root = marked ?? (anchor !== undefined && names.has(anchor) ? anchor : places[0]?.name);
  const at = (marked !== undefined && marks.get(marked)) || { x: 0, y: 0, theta: 0 };
  const known = root === undefined ? new Map<string, Known>() : spread(root, at, names, arcs);
  const sketch = {
    places: places.map((place) => sketchPlace(place, known.get(place.name), landmarks)),
    arcs: arcs.map(({ from, to, freeway }) => ({ from, to, freeway })),
    anchor,
  };
  return marked === undefined && root !== undefined ? { ...sketch, assumed: root } : sketch;
}

function sketchPlace(place: PlaceRow, known: Known | undefined, landmarks: readonly LandmarkRow[]): MapPlace {
  const own = landmarks.filter((landmark) => landmark.place === place.name);
  return {
    name: place.name,
    radius: place.radius,
    pose: known?.pose,
    bound: known?.radius ?? 0,
    landmarks: own.map(({ name, spot }) => {
      if (!spot || !known) return { name, x: undefined, y: undefined };
      const angle = spot.bearing * RADIANS;
      const { x, y } = compose(known.pose, { x: spot.distance * Math.cos(angle), y: spot.distance * Math.sin(angle), theta: 0 });
      return { name, x, y };
    }),
  };
}
