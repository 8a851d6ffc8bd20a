// All drawn objects of one run.
import { Group, Quaternion, type Sprite, Vector3 } from "three";
import type { Scene } from "../data";
import type { Instant, Run } from "../run";
import { rolesOf } from "../roles";
import { Actuators } from "./actuators";
import { Bending } from "./bending";
import { buildBodies, type BodyView, poseBodies, typicalLink } from "./bodies";
import { type Impact, impactsOf } from "./impacts";
import type { Label, Labels } from "./labels";
import { attitudeAxes, graspPoint, massCentre } from "./markers";
import type { Paints } from "./palette";
import { poseAt, poseTrack, vectorAt } from "./poses";
import { Trail } from "./trails";
import { TorqueTint } from "./torques";
import { angularArrows, contactForces, forceArrows, Impulses, momentumArrows, centreOf, orbitArrows, type SeriesArrows } from "./vectors";

// Display options.
export interface Shown {
  axes: boolean;
  trails: boolean;
  points: boolean;
  impulses: boolean;
  forces: boolean;
  momentum: boolean;
  angular: boolean;
  actuators: boolean;
  torques: boolean;
  orbit: boolean;
  initial: boolean;
  mass: boolean;
  names: boolean;
  ground: boolean;
  sky: boolean;
}
export const kMaxBending = 100; // maximum factor of exaggeration

export class RunView {
  readonly object = new Group();
  readonly bodies: BodyView[];
  readonly ends: BodyView[]; // frames of the end-effectors, for cameras; not drawn
  readonly bending: Bending;
  readonly roles: Map<string, string>;
  readonly impacts: Impact[];
  readonly span: number; // radius of the robot and targets at the beginning: reference for the sizes of arrows [m]
  readonly mass: Sprite = massCentre();
  private readonly initial = new Group();
  private readonly axes: Group[] = [];
  private readonly trails: Trail[] = [];
  private readonly points: Group[] = [];
  private readonly names: { label: Label; at: () => Vector3 }[] = [];
  readonly impulses: Impulses;
  private readonly momentum: SeriesArrows | undefined;
  private readonly angular: SeriesArrows | undefined;
  private readonly orbit: SeriesArrows | undefined;
  private readonly actuators: Actuators | undefined;
  private readonly torques: TorqueTint | undefined;
  private readonly forces: SeriesArrows | undefined;

  constructor(
    readonly run: Run,
    readonly scene: Scene,
    private readonly paints: Paints,
    private readonly labels: Labels,
    readonly second: boolean,
  ) {
    this.roles = rolesOf(scene);
    this.impacts = impactsOf(run);
    this.bodies = buildBodies(run, scene, paints, second ? "second" : "solid");
    this.ends = endFrames(run, scene);
    this.bending = new Bending(run, this.bodies);
    for (const view of this.bodies) this.object.add(view.object);
    poseBodies(this.bodies, { index: 0, fraction: 0 });
    this.span = spanOf(this.bodies);
    this.impulses = new Impulses(run, this.impacts, paints, labels, this.span, second ? "second" : "impulse", run.data.label ? `${run.data.label} ` : "");
    this.object.add(this.impulses.arrows, this.impulses.points);
    this.addTrails();
    if (!second) {
      this.addMarkers();
      this.addNames();
      this.momentum = momentumArrows(run, this.bodies, paints, labels, this.span, this.roles);
      this.forces = forceArrows(run, scene.end_effectors.map((e) => e.name), paints, labels, this.span);
      this.angular = angularArrows(run, paints, labels, this.span);
      this.orbit = orbitArrows(run, this.bodies, paints, labels, this.span);
      this.actuators = new Actuators(run, scene, this.base);
      this.torques = new TorqueTint(run, scene, this.bodies);
      this.object.add(this.momentum.object, this.angular.object, this.orbit.object, this.forces.object, this.actuators.object);
    }
    this.object.add(this.mass, this.initial);
  }

  get base(): BodyView | undefined {
    return this.bodies.find((view) => view.body.kind === "base");
  }

  // Frees the memory of its shapes. Materials are shared.
  dispose(): void {
    this.object.removeFromParent();
    this.object.traverse((one) => (one as { geometry?: { dispose(): void } }).geometry?.dispose());
  }

  // Whether shapes of bodies touch at any sample.
  get touches(): boolean {
    return contactForces(this.run).length > 0;
  }

  // The options of Shown that apply to this run.
  offers(what: keyof Shown): boolean {
    if (what === "impulses") return this.impacts.some((i) => i.grasps.length > 0);
    if (what === "forces") return this.forces !== undefined && !this.forces.empty;
    if (what === "momentum") return this.momentum !== undefined && !this.momentum.empty;
    if (what === "angular") return this.angular !== undefined && !this.angular.empty;
    if (what === "orbit") return this.orbit !== undefined && !this.orbit.empty;
    if (what === "actuators") return this.actuators !== undefined && !this.actuators.empty;
    if (what === "torques") return this.torques !== undefined && !this.torques.empty;
    if (what === "mass") return this.run.series("system/center_of_mass") !== undefined;
    return true;
  }

  // `bent`: factor by which bending is exaggerated.
  update(time: number, back: number, shown: Shown, bent: number): void {
    const instant = this.run.locate(time, back);
    poseBodies(this.bodies, instant);
    poseBodies(this.ends, instant);
    this.bending.apply(bent);
    for (const trail of this.trails) {
      trail.object.visible = shown.trails;
      if (shown.trails) trail.update(instant);
    }
    for (const group of this.axes) group.visible = shown.axes;
    for (const group of this.points) group.visible = shown.points;
    this.initial.visible = shown.initial && !this.second;
    if (this.initial.visible && this.initial.children.length === 0) this.addGhost();
    this.impulses.update(time, instant, back, shown);
    this.momentum?.update(instant, shown.momentum);
    this.angular?.update(instant, shown.angular);
    this.orbit?.update(instant, shown.orbit);
    this.actuators?.update(instant, this.base, shown.actuators, this.paints.theme);
    this.torques?.update(instant, shown.torques, this.paints.theme);
    this.forces?.update(instant, shown.forces);
    this.placeMass(instant, shown);
    for (const { label, at } of this.names) {
      label.visible = shown.names;
      if (shown.names) label.anchor.copy(at());
    }
  }

  // Only the bodies: faster if nothing is drawn.
  pose(time: number): void {
    poseBodies(this.bodies, this.run.locate(time));
  }

  // Positions of the end-effectors, as last posed.
  endPoints(): Vector3[] {
    const points: Vector3[] = [];
    for (const end of this.scene.end_effectors) {
      const view = this.bodies.find((b) => b.body.name === end.body && b.track);
      if (view) points.push(new Vector3(...end.position).applyQuaternion(view.object.quaternion).add(view.object.position));
    }
    return points;
  }

  private placeMass(instant: Instant, shown: Shown): void {
    const series = this.run.series("system/center_of_mass");
    this.mass.visible = shown.mass && series !== undefined && !this.second;
    if (series && this.mass.visible) this.mass.position.copy(vectorAt(this.run, series, instant));
  }

  // Created on first use: meshes may be large.
  private addGhost(): void {
    const views = buildBodies(this.run, this.scene, this.paints, "ghost");
    poseBodies(views, { index: 0, fraction: 0 });
    for (const view of views) this.initial.add(view.object);
  }

  private addTrails(): void {
    for (const end of this.scene.end_effectors) {
      const series = this.run.series(`end_effectors/${end.name}/position`);
      if (series) this.addTrail(series.data, this.roles.get(end.body) ?? "base");
    }
    for (const view of this.bodies) {
      if (view.body.kind !== "target" || !view.track) continue;
      this.addTrail(centrePath(view, this.run), this.roles.get(view.body.name) ?? "base");
    }
  }
  private addTrail(points: Float32Array, role: string): void {
    if (points.length < 6) return;
    const painted = this.second ? "second" : role;
    const trail = new Trail(points, this.paints.wideLine(painted, 2, this.second ? 0.6 : 0.95), this.paints.line(painted, 0.32));
    this.trails.push(trail);
    this.object.add(trail.object);
  }

  private addMarkers(): void {
    for (const view of this.bodies) {
      if (view.body.kind === "link" || view.body.kind === "part") continue;
      const axes = attitudeAxes(0.9 * view.radius, this.paints);
      this.axes.push(axes);
      view.object.add(axes);
    }
    for (const end of this.scene.end_effectors) {
      const view = this.bodies.find((b) => b.body.name === end.body);
      if (!view) continue;
      const axes = attitudeAxes(0.45 * typicalLink(this.scene), this.paints);
      axes.position.set(...end.position);
      axes.quaternion.set(end.quaternion_wxyz[1], end.quaternion_wxyz[2], end.quaternion_wxyz[3], end.quaternion_wxyz[0]);
      this.axes.push(axes);
      view.object.add(axes);
    }
    for (const point of this.scene.grasp_points) {
      const view = this.bodies.find((b) => b.body.name === point.target);
      if (!view) continue;
      const made = graspPoint(point, view.body, 0.016 * this.span, this.roles.get(point.target) ?? "base", this.paints);
      this.points.push(made);
      view.object.add(made);
    }
  }

  private addNames(): void {
    for (const view of this.bodies) {
      if (view.body.kind === "link" || view.body.kind === "part") continue;
      this.names.push({ label: this.labels.add("system", view.body.name), at: () => centreOf(view) });
    }
    for (const end of this.scene.end_effectors) {
      const view = this.bodies.find((b) => b.body.name === end.body);
      if (!view) continue;
      const at = () => new Vector3(...end.position).applyQuaternion(view.object.quaternion).add(view.object.position);
      this.names.push({ label: this.labels.add(this.roles.get(end.body) ?? "system", end.name), at });
    }
  }
}

// The end-effectors' frames as bodies without shapes.
function endFrames(run: Run, scene: Scene): BodyView[] {
  return scene.end_effectors.flatMap((end) => {
    const carrier = scene.bodies.find((body) => body.name === end.body);
    const series = `end_effectors/${end.name}`;
    const track = poseTrack(run, series);
    if (!carrier || !track) return [];
    const body = { ...carrier, name: end.name, kind: "end_effector", series, geometry: [] };
    return [{ body, object: new Group(), track, radius: 0.1 * typicalLink(scene) }];
  });
}

// From a link's origin to its end-effector, in the end-effector's frame: outward.
export function outwardOf(scene: Scene, name: string): Vector3 {
  const end = scene.end_effectors.find((one) => one.name === name);
  const position = new Vector3(...(end?.position ?? [0, 0, 1]));
  if (!end || position.lengthSq() < 1e-12) return new Vector3(0, 0, 1);
  const [w, x, y, z] = end.quaternion_wxyz;
  return position.normalize().applyQuaternion(new Quaternion(x, y, z, w).invert());
}

// Half of the largest distance from the base, with a minimum.
function spanOf(bodies: BodyView[]): number {
  const base = bodies.find((b) => b.body.kind === "base")?.object.position ?? new Vector3();
  const far = bodies.filter((b) => b.track).map((b) => b.object.position.distanceTo(base) + b.radius);
  return Math.max(0.1, ...far);
}

function centrePath(view: BodyView, run: Run): Float32Array {
  const track = poseTrack(run, view.body.series);
  const points = new Float32Array(3 * run.samples);
  if (!track) return points;
  const position = new Vector3();
  const turn = new Quaternion();
  const com = new Vector3(...view.body.com);
  for (let i = 0; i < run.samples; ++i) {
    poseAt(track, { index: i, fraction: 0 }, position, turn);
    com.clone().applyQuaternion(turn).add(position).toArray(points, 3 * i);
  }
  return points;
}
