/** How sure the base is of where it is: the ellipse, and what bends it into a banana. */
import type { Covariance, Pose } from "../../model/model.ts";
import { DEGREE, type Point } from "./geometry.ts";

/** The 95 % quantile of χ² with two degrees of freedom: −2 ln 0.05. */
export const CHI2_95 = 5.991;
/** The 97.5 % quantile of the normal distribution: 95 % lie within ± so many deviations. */
export const NORMAL_95 = 1.96;

/** Beyond, a heading within the 95 % region may be any: there is no banana, it has closed to a ring. */
const MOST_TURNED = Math.PI;

/** The same covariance in m², m·rad and rad². */
function inRadians([cxx, cxy, cxt, cyy, cyt, ctt]: Covariance): Covariance {
  return [cxx, cxy, cxt * DEGREE, cyy, cyt * DEGREE, ctt * DEGREE * DEGREE];
}

function inDegrees([cxx, cxy, cxt, cyy, cyt, ctt]: Covariance): Covariance {
  return [cxx, cxy, cxt / DEGREE, cyy, cyt / DEGREE, ctt / (DEGREE * DEGREE)];
}

export interface Ellipse {
  /** Half the axes, m; the first is the longer one. */
  readonly a: number;
  readonly b: number;
  /** Direction of the longer one, rad. */
  readonly angle: number;
}

/** The 95 % ellipse of the position: its axes are √(χ² λ) along the eigenvectors of the upper left 2 × 2. */
export function ellipse([cxx, cxy, , cyy]: Covariance): Ellipse {
  const middle = (cxx + cyy) / 2;
  const off = Math.hypot((cxx - cyy) / 2, cxy);
  const axis = (eigenvalue: number) => Math.sqrt(CHI2_95 * Math.max(0, eigenvalue));
  return { a: axis(middle + off), b: axis(middle - off), angle: Math.atan2(2 * cxy, cxx - cyy) / 2 };
}

/** The standard deviations: along the longer axis of the position, m, and of the heading, degrees. */
export function deviations(covariance: Covariance): { position: number; heading: number } {
  return { position: ellipse(covariance).a / Math.sqrt(CHI2_95), heading: Math.sqrt(Math.max(0, covariance[5])) };
}

/**
 * What is known of a pose, carried to where the base has driven since: C := F C Fᵀ with F = [1 0 −Δy; 0 1 Δx; 0 0 1]. What the way itself adds is left
 * out: the base tells its covariance five times a second, so that is little, and it is not for the page to know.
 */
export function carry(covariance: Covariance, from: Pose, to: Pose): Covariance {
  const [cxx, cxy, cxt, cyy, cyt, ctt] = inRadians(covariance);
  const [dx, dy] = [to.x - from.x, to.y - from.y];
  return inDegrees([
    cxx - 2 * dy * cxt + dy * dy * ctt,
    cxy + dx * cxt - dy * cyt - dx * dy * ctt,
    cxt - dy * ctt,
    cyy + 2 * dx * cyt + dx * dx * ctt,
    cyt + dx * ctt,
    ctt,
  ]);
}

type Triple = readonly [number, number, number];

/**
 * The outline of the banana: where the base is with 95 %, if its pose is normally distributed in exponential coordinates. For small headings that is the
 * ellipse.
 *
 * After a long way with an unsure heading, the true position lies on an arc about where the way began, not on the straight line that an ellipse in x and y
 * makes of it. In exponential coordinates the error ξ = (u, v, θ) = log(P̂⁻¹ P) is a constant twist, and the distribution stays close to a normal one (Long,
 * Wolfe, Mashner and Chirikjian, *The Banana Distribution is Gaussian*, RSS 2012). Its covariance is that of x, y and θ seen from the base:
 * B = Mᵀ C M, M = diag(R(θ̂), 1). The position that belongs to ξ is
 *
 *     p = V(θ) (u, v),   V(θ) = [s −c; c s],   s = sin θ/θ,   c = (1 − cos θ)/θ.
 *
 * The region is the shadow on the plane of the ellipsoid ξᵀ B⁻¹ ξ ≤ χ²₂ = 5.991. Where V is the identity, the shadow is exactly the 95 % ellipse of the
 * position, whose χ² has two degrees of freedom.
 *
 * Its outline is the image of the points at which p folds the surface: with ξ = √χ² L ω, B = L Lᵀ, |ω| = 1 and G = ∂p/∂ω (2 × 3), those where the direction
 * k = g₁ × g₂ that p does not see is tangent to the sphere, k(ω) · ω = 0. For V = 1 that is the great circle ω ⟂ k₀. In general it is looked for on each
 * meridian through ± k₀, ω = e(φ) cos λ + k̂₀ sin λ. At ± k₀ itself u = v = 0, and k · ω = ± |k₀| det V there: so there is a root between.
 */
export function banana(pose: Pose, covariance: Covariance, points = 120): Point[] | undefined {
  const root = rootOf(bodyCovariance(pose, covariance));
  const radius = Math.sqrt(CHI2_95);
  if (root === undefined || radius * root.l00 >= MOST_TURNED) return undefined;
  const shadow = new Shadow(root, radius);
  const pole = unit(shadow.unseen([0, 0, 0]));
  if (pole === undefined) return undefined;
  const [e1, e2] = across(pole);
  const [sin, cos] = [Math.sin(pose.theta * DEGREE), Math.cos(pose.theta * DEGREE)];
  const outline: Point[] = [];
  for (let index = 0; index < points; index += 1) {
    const phi = (2 * Math.PI * index) / points;
    const [a, b] = [Math.cos(phi), Math.sin(phi)];
    const equator: Triple = [a * e1[0] + b * e2[0], a * e1[1] + b * e2[1], a * e1[2] + b * e2[2]];
    const on = (latitude: number): Triple => {
      const [c, s] = [Math.cos(latitude), Math.sin(latitude)];
      return [c * equator[0] + s * pole[0], c * equator[1] + s * pole[1], c * equator[2] + s * pole[2]];
    };
    const [x, y] = shadow.place(on(rootNearZero((latitude) => dot(shadow.unseen(on(latitude)), on(latitude)))));
    outline.push([pose.x + cos * x - sin * y, pose.y + sin * x + cos * y]);
  }
  return outline;
}

/** B = Mᵀ C M: the error as seen from the base, in radians. */
function bodyCovariance(pose: Pose, covariance: Covariance): Covariance {
  const [cxx, cxy, cxt, cyy, cyt, ctt] = inRadians(covariance);
  const [s, c] = [Math.sin(pose.theta * DEGREE), Math.cos(pose.theta * DEGREE)];
  return [
    c * c * cxx + 2 * s * c * cxy + s * s * cyy,
    s * c * (cyy - cxx) + (c * c - s * s) * cxy,
    c * cxt + s * cyt,
    s * s * cxx - 2 * s * c * cxy + c * c * cyy,
    c * cyt - s * cxt,
    ctt,
  ];
}

/** The lower triangular root in the order θ, u, v. */
interface Root {
  readonly l00: number;
  readonly l10: number;
  readonly l11: number;
  readonly l20: number;
  readonly l21: number;
  readonly l22: number;
}

function rootOf([buu, buv, but, bvv, bvt, btt]: Covariance): Root | undefined {
  // A covariance may be singular, and is after ResetPos: then a nanoradian and a micrometre, which nobody sees, keep directions defined.
  const l00 = Math.sqrt(Math.max(btt, 1e-18));
  const [l10, l20] = [but / l00, bvt / l00];
  const l11 = Math.sqrt(Math.max(buu - l10 * l10, 1e-12));
  const l21 = (buv - l20 * l10) / l11;
  const l22 = Math.sqrt(Math.max(bvv - l20 * l20 - l21 * l21, 1e-12));
  const root = { l00, l10, l11, l20, l21, l22 };
  return Object.values(root).every(Number.isFinite) ? root : undefined;
}

/** The map from the unit sphere of ω = (ω_θ, ω_u, ω_v) to the position, and the direction that it does not see. */
class Shadow {
  private readonly l: Root;
  private readonly radius: number;

  constructor(root: Root, radius: number) {
    this.l = root;
    this.radius = radius;
  }

  private twist([w0, w1, w2]: Triple): Triple {
    const { l00, l10, l11, l20, l21, l22 } = this.l;
    const r = this.radius;
    return [r * (l10 * w0 + l11 * w1), r * (l20 * w0 + l21 * w1 + l22 * w2), r * l00 * w0];
  }

  place(omega: Triple): Point {
    const [u, v, theta] = this.twist(omega);
    const [s, c] = arc(theta);
    return [s * u - c * v, c * u + s * v];
  }

  unseen(omega: Triple): Triple {
    const { l00, l10, l11, l20, l21, l22 } = this.l;
    const [u, v, theta] = this.twist(omega);
    const [s, c] = arc(theta);
    const [ds, dc] = arcSlope(theta);
    const [bentX, bentY] = [(ds * u - dc * v) * l00, (dc * u + ds * v) * l00];
    const gx: Triple = [s * l10 - c * l20 + bentX, s * l11 - c * l21, -c * l22];
    const gy: Triple = [c * l10 + s * l20 + bentY, c * l11 + s * l21, s * l22];
    return [gx[1] * gy[2] - gx[2] * gy[1], gx[2] * gy[0] - gx[0] * gy[2], gx[0] * gy[1] - gx[1] * gy[0]];
  }
}

/** sin θ/θ and (1 − cos θ)/θ. */
function arc(theta: number): Point {
  if (Math.abs(theta) < 1e-4) return [1 - (theta * theta) / 6, theta / 2];
  return [Math.sin(theta) / theta, (1 - Math.cos(theta)) / theta];
}

/** Their derivatives. */
function arcSlope(theta: number): Point {
  if (Math.abs(theta) < 1e-4) return [-theta / 3, 1 / 2 - (theta * theta) / 8];
  const [s, c] = arc(theta);
  return [(Math.cos(theta) - s) / theta, s - c / theta];
}

/** The root of a function on (−π/2, π/2) that is negative at the lower end and positive at the upper one: the nearest to 0 on its side. */
function rootNearZero(f: (latitude: number) => number): number {
  const STEPS = 24;
  const atZero = f(0);
  if (atZero === 0) return 0;
  const side = atZero > 0 ? -1 : 1;
  let [near, far] = [0, side * (Math.PI / 2)];
  for (let step = 1; step < STEPS; step += 1) {
    const latitude = (side * step * Math.PI) / (2 * STEPS);
    if (f(latitude) > 0 !== atZero > 0) {
      far = latitude;
      break;
    }
    near = latitude;
  }
  // 2⁻²⁰ of a step: below a thousandth of a pixel for any banana that fits a screen.
  for (let halving = 0; halving < 20; halving += 1) {
    const middle = (near + far) / 2;
    if (f(middle) > 0 === atZero > 0) near = middle;
    else far = middle;
  }
  return (near + far) / 2;
}

function dot(a: Triple, b: Triple): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

function unit(a: Triple): Triple | undefined {
  const length = Math.sqrt(dot(a, a));
  return length > 0 && Number.isFinite(length) ? [a[0] / length, a[1] / length, a[2] / length] : undefined;
}

/** Two directions that are at right angles to one, and to each other. */
function across(a: Triple): readonly [Triple, Triple] {
  const aside: Triple = Math.abs(a[0]) < 0.6 ? [1, 0, 0] : [0, 1, 0];
  const along = dot(aside, a);
  const first = unit([aside[0] - along * a[0], aside[1] - along * a[1], aside[2] - along * a[2]]) ?? aside;
  const second: Triple = [a[1] * first[2] - a[2] * first[1], a[2] * first[0] - a[0] * first[2], a[0] * first[1] - a[1] * first[0]];
  return [first, second];
}
