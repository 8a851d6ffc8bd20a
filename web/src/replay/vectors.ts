// Vectors of a run as arrows: impulses near the impacts, contact forces during compliant impacts, linear momentum.
import { Group, Quaternion, Vector3 } from "three";
import { number } from "../format";
import type { Instant, Run, Series } from "../run";
import { Arrow } from "./arrows";
import type { BodyView } from "./bodies";
import type { Impact, ImpactGrasp } from "./impacts";
import type { Label, Labels } from "./labels";
import { contactPoint } from "./markers";
import type { Paints } from "./palette";
import { poseAt, type PoseTrack, poseTrack, vectorAt } from "./poses";

const kAfter = 1.5; // an impulse is displayed from its impact until this long after its end [s of simulation]
const kRounding = 1e-12; // impulses below this share of the momentum are rounding errors

interface ImpulseArrow {
  arrow: Arrow;
  label: Label;
  impact: Impact;
  grasp: ImpactGrasp;
  track: PoseTrack | undefined;
  localPoint: Vector3; // the contact point in the end-effector's frame
  marker: Group;
  holds: Series | undefined;
}

// Impulses act on the robot at the contact point; arrow and point move with the end-effector.
export class Impulses {
  readonly arrows = new Group();
  readonly points = new Group();
  private readonly made: ImpulseArrow[] = [];
  private readonly largest: number;

  constructor(
    private readonly run: Run,
    impacts: Impact[],
    paints: Paints,
    labels: Labels,
    private readonly span: number,
    role: string,
    prefix: string,
  ) {
    const largest = Math.max(0, ...impacts.flatMap((i) => i.grasps.map((g) => Math.hypot(...g.impulse))));
    const momentum = Number(run.summary?.ledger?.scale?.linear_momentum) || 0;
    this.largest = largest > kRounding * momentum ? largest : 0; // grasps without an impulse have no arrows
    for (const impact of impacts) {
      for (const grasp of impact.grasps) {
        const arrow = new Arrow(paints, role, 0.0065 * span);
        const marker = contactPoint(0.014 * span, paints);
        const track = poseTrack(run, `end_effectors/${grasp.endEffector}`);
        const label = labels.add(role, `${prefix}${number(Math.hypot(...grasp.impulse))} N s`);
        this.arrows.add(arrow.object);
        this.points.add(marker);
        const holds = run.series(`grasps/${grasp.endEffector}/holds`);
        this.made.push({ arrow, label, impact, grasp, track, localPoint: inFrame(track, impact.time, grasp.point), marker, holds });
      }
    }
  }

  // End points of the arrows at their impacts.
  tips(): Vector3[] {
    return this.made.map(({ grasp }) => new Vector3(...grasp.point).addScaledVector(new Vector3(...grasp.impulse), this.scale));
  }
  private get scale(): number {
    return this.largest > 0 ? (0.34 * this.span) / this.largest : 0; // [m per N s]
  }

  // `back`: as in Clock.back; states of the impact's time before the last are before the impact.
  update(time: number, instant: Instant, back: number, shown: { impulses: boolean; points: boolean }): void {
    for (const one of this.made) {
      const occurred = hasOccurred(this.run, one.impact.time, time, instant, back);
      const near = occurred && time <= one.impact.time + one.impact.duration + kAfter;
      const held = occurred && one.holds !== undefined && this.run.at(one.holds, { ...instant, fraction: 0 })[0] > 0.5;
      const point = time > one.impact.time ? inWorld(one.track, instant, one.localPoint, one.grasp.point) : new Vector3(...one.grasp.point);
      one.marker.visible = shown.points && (near || held);
      one.marker.position.copy(point);
      if (near && shown.impulses && this.largest > 0) {
        const impulse = new Vector3(...one.grasp.impulse);
        one.arrow.set(point, impulse, this.scale * impulse.length());
        one.label.anchor.copy(one.arrow.tip);
      } else one.arrow.hide();
      one.label.visible = one.arrow.object.visible;
    }
  }
}

// Whether the displayed state is after the impact: of several states of its time all but the first.
export function hasOccurred(run: Run, impact: number, time: number, instant: Instant, back: number): boolean {
  return time > impact || (time === impact && (back === 0 || run.ranks[instant.index] > 0));
}

function inFrame(track: PoseTrack | undefined, time: number, point: [number, number, number]): Vector3 {
  if (!track) return new Vector3();
  const position = new Vector3();
  const turn = new Quaternion();
  poseAt(track, track.run.locate(time), position, turn);
  return new Vector3(...point).sub(position).applyQuaternion(turn.invert());
}

function inWorld(track: PoseTrack | undefined, instant: Instant, localPoint: Vector3, still: [number, number, number]): Vector3 {
  if (!track) return new Vector3(...still);
  const position = new Vector3();
  const turn = new Quaternion();
  poseAt(track, instant, position, turn);
  return localPoint.clone().applyQuaternion(turn).add(position);
}

// One arrow per vector series, with a common scale: the largest over the run has a given length.
class SeriesArrows {
  readonly object = new Group();
  private readonly made: { series: Series; arrow: Arrow; label: Label; name: string; origin: (instant: Instant) => Vector3; marker?: Group }[] = [];
  private largest = 0;

  constructor(
    private readonly run: Run,
    private readonly length: number,
    private readonly unit: string,
  ) {}

  add(series: Series | undefined, name: string, arrow: Arrow, label: Label, origin: (instant: Instant) => Vector3, marker?: Group): void {
    if (!series || series.width !== 3) return;
    for (let i = 0; i < this.run.samples; ++i) {
      const size = Math.hypot(series.data[3 * i], series.data[3 * i + 1], series.data[3 * i + 2]);
      if (size > this.largest) this.largest = size;
    }
    this.object.add(arrow.object);
    if (marker) this.object.add(marker);
    this.made.push({ series, arrow, label, name, origin, marker });
  }

  get empty(): boolean {
    return this.made.length === 0 || this.largest === 0;
  }

  update(instant: Instant, shown: boolean): void {
    for (const one of this.made) {
      one.arrow.hide();
      if (shown && this.largest > 0) {
        const value = vectorAt(this.run, one.series, instant);
        one.arrow.set(one.origin(instant), value, (this.length * value.length()) / this.largest);
        one.label.anchor.copy(one.arrow.tip);
        one.label.text = this.unit === "" ? one.name : `${one.name} ${number(value.length(), 3)} ${this.unit}`;
      }
      one.label.visible = one.arrow.object.visible;
      if (!one.marker) continue;
      one.marker.visible = one.arrow.object.visible;
      if (one.marker.visible) one.marker.position.copy(one.origin(instant));
    }
  }
}

export function momentumArrows(run: Run, bodies: BodyView[], paints: Paints, labels: Labels, span: number, roles: Map<string, string>): SeriesArrows {
  const made = new SeriesArrows(run, 0.55 * span, "N s");
  const arrow = (role: string) => new Arrow(paints, role, 0.0055 * span);
  const base = bodies.find((b) => b.body.kind === "base");
  for (const view of bodies) {
    if (view.body.kind !== "target") continue;
    const role = roles.get(view.body.name) ?? "robot";
    const series = run.series(`${view.body.series}/linear_momentum`);
    made.add(series, view.body.name, arrow(role), labels.add("system"), () => centreOf(view));
  }
  if (base) made.add(run.series("robot/linear_momentum"), "robot", arrow("robot"), labels.add("robot"), () => centreOf(base));
  const centre = run.series("system/center_of_mass");
  if (centre) made.add(run.series("system/linear_momentum"), "total", arrow("system"), labels.add("system"), (at) => vectorAt(run, centre, at));
  return made;
}

// The total angular momentum about the system's centre of mass, and its parts.
export function angularArrows(run: Run, paints: Paints, labels: Labels, span: number): SeriesArrows {
  const made = new SeriesArrows(run, 0.7 * span, "N m s");
  const centre = run.series("system/center_of_mass");
  if (!centre) return made;
  const at = (instant: Instant) => vectorAt(run, centre, instant);
  made.add(run.series("system/angular_momentum"), "total", new Arrow(paints, "angular", 0.007 * span), labels.add("angular"), at);
  made.add(run.series("robot/angular_momentum"), "robot", new Arrow(paints, "robot", 0.0045 * span), labels.add("robot"), at);
  return made;
}

// From the base: to the central body's centre, and along the orbit.
export function orbitArrows(run: Run, bodies: BodyView[], paints: Paints, labels: Labels, span: number): SeriesArrows {
  const made = new SeriesArrows(run, 0.8 * span, "");
  const base = bodies.find((view) => view.body.kind === "base");
  if (!base) return made;
  const at = () => centreOf(base);
  made.add(negated(run.series("orbit/radial")), "nadir", new Arrow(paints, "mass", 0.005 * span), labels.add("mass"), at);
  made.add(run.series("orbit/along_track"), "along track", new Arrow(paints, "axis y", 0.005 * span), labels.add("axis y"), at);
  return made;
}

function negated(series: Series | undefined): Series | undefined {
  return series && { ...series, data: series.data.map((value) => -value) };
}

// During a compliant impact the grasp forces are displayed; later ones, and those of contacts between shapes, have the
// same scale.
export function forceArrows(run: Run, names: string[], paints: Paints, labels: Labels, span: number): SeriesArrows {
  const made = new SeriesArrows(run, 0.34 * span, "N");
  for (const name of names) {
    const track = poseTrack(run, `end_effectors/${name}`);
    if (!track) continue;
    const origin = (instant: Instant) => inWorld(track, instant, new Vector3(), [0, 0, 0]);
    made.add(run.series(`grasps/${name}/force`), "", new Arrow(paints, "force", 0.0055 * span), labels.add("force"), origin);
  }
  for (const { force, point } of contactForces(run)) {
    made.add(force, "", new Arrow(paints, "force", 0.0055 * span), labels.add("force"), (at) => new Vector3(...knownPoint(run, point, at)), contactPoint(0.012 * span, paints, "force"));
  }
  return made;
}

// Of the pairs of bodies that touch at any sample.
export function contactForces(run: Run): { force: Series; point: Series }[] {
  return run.all().flatMap((point) => {
    const force = /^contacts\/.+\/point$/.test(point.path) ? run.series(point.path.replace(/point$/, "force")) : undefined;
    return force && point.width === 3 && force.data.some((value) => value !== 0) ? [{ force, point }] : [];
  });
}

// Bodies that are apart have no point: beside such a sample that of the other sample.
export function knownPoint(run: Run, point: Series, instant: Instant): number[] {
  const samples = [run.at(point, instant), ...[0, 1].map((step) => run.at(point, { index: Math.min(instant.index + step, run.samples - 1), fraction: 0 }))];
  return samples.find((one) => one.every(Number.isFinite)) ?? [0, 0, 0];
}

// Centre of mass of a body as drawn.
export function centreOf(view: BodyView): Vector3 {
  return new Vector3(...view.body.com).applyQuaternion(view.object.quaternion).add(view.object.position);
}
export type { SeriesArrows };
