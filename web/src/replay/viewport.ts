// The picture: runs drawn on a stage, viewed by a camera, with labels.
import { Quaternion, Vector3 } from "three";
import type { Clock } from "../clock";
import type { Quat, SceneBody, Vec3 } from "../data";
import { element } from "../dom";
import { number } from "../format";
import { kVariant } from "../page/names";
import type { Run } from "../run";
import { type BodyView } from "./bodies";
import { type Ball, CameraRig, type ViewSpec } from "./cameras";
import { Labels } from "./labels";
import { Compass } from "./compass";
import { type Ground, makeGround } from "./ground";
import { buildObstacles } from "./obstacles";
import { goodDirection } from "./outlook";
import { currentTheme, listenTheme, Paints, roleColor, type Theme } from "./palette";
import { outwardOf, RunView, type Shown } from "./run_view";
import { listenPointer } from "./pointing";
import { centralBodyOf, Sky } from "./sky";
import { Stage } from "./stage";
import { Legend, type LegendRow } from "./toolbar";

export interface Pose {
  position: Vec3;
  quaternion_wxyz: Quat;
}

const kNearEnd = 0.16; // radius about an end-effector that its cameras show, of the scene's span
const kSamples = 80; // instants at which the extent of the motion is evaluated

export class Viewport {
  readonly views: RunView[];
  readonly rig: CameraRig;
  readonly stage: Stage;
  readonly shown: Shown;
  bent = 1; // factor by which bending is exaggerated
  private readonly paints = new Paints();
  private readonly labels = new Labels();
  private readonly ownLabels: number; // without those of a variant
  private readonly legend = new Legend();
  private readonly ends: (() => void)[] = [];
  private readonly compass = new Compass();
  private readonly ground: Ground;
  private readonly direction: Vector3; // initial view direction
  private filmed: (() => void) | null = null;
  private readonly planar: boolean;
  private readonly extents = new Map<BodyView | null, Ball[]>();
  private width = 0;
  private height = 0;

  constructor(
    readonly host: HTMLElement,
    canvas: HTMLCanvasElement,
    context: WebGL2RenderingContext,
    runs: Run[],
    private readonly clock: Clock,
  ) {
    this.stage = new Stage(canvas, context);
    this.paints.theme = currentTheme();
    this.views = runs.map((run, i) => new RunView(run, run.scene!, this.paints, this.labels, i > 0));
    this.ownLabels = this.labels.count;
    for (const view of this.views) this.stage.world.add(view.object);
    const first = this.views[0];
    this.planar = first.scene.planar;
    this.shown = defaultShown(first);
    this.direction = this.viewDirection(first);
    this.rig = this.makeRig(canvas, first);
    this.ground = this.makeGround();
    const all = this.extent(null);
    const obstacles = buildObstacles(first.scene, middleOf(all), radiusOf(all), this.paints);
    this.stage.world.add(this.ground.object, obstacles);
    host.append(this.labels.host, this.compass.host);
    this.stage.onDraw(() => this.draw());
    this.ends.push(listenTheme(() => this.retheme()));
    this.watchSize();
    this.watchWheel(canvas);
    this.ends.push(listenPointer(this, canvas, () => first.run.locate(clock.time, clock.back)));
    canvas.addEventListener("webglcontextrestored", this.stage.invalidate);
    this.retheme();
  }

  // ---- Interface ----
  // Below the picture, so that it covers nothing.
  get legendHost(): HTMLElement {
    return this.legend.host;
  }
  // Draws a variant of the first run as the second run, translucent; null: none.
  compare(variant: Run | null): void {
    for (const view of this.views.splice(1)) view.dispose();
    this.labels.truncate(this.ownLabels);
    if (variant?.scene && variant.samples > 0) {
      const view = new RunView(variant, variant.scene, this.paints, this.labels, true);
      this.views.push(view);
      this.stage.world.add(view.object);
    }
    this.refresh();
  }
  invalidate(): void {
    this.stage.invalidate();
  }
  setCamera(index: number): void {
    this.rig.select(index);
    this.refreshLegend();
    this.invalidate();
  }
  // `point`: on the body, in the stage's frame.
  focusOn(view: BodyView, point: Vector3): void {
    this.rig.focus(point, Math.min(view.radius, 0.6 * this.views[0].span));
  }
  bodyPose(name: string, run = 0): Pose | null {
    const view = this.views[run]?.bodies.find((b) => b.body.name === name);
    if (!view?.track) return null;
    this.pose(this.clock.time, this.clock.back);
    this.stage.world.updateMatrixWorld(true);
    const matrix = this.stage.world.matrixWorld.clone().invert().multiply(view.object.matrixWorld);
    const [position, turn, scale] = [new Vector3(), new Quaternion(), new Vector3()];
    matrix.decompose(position, turn, scale);
    return { position: [position.x, position.y, position.z], quaternion_wxyz: [turn.w, turn.x, turn.y, turn.z] };
  }
  // Draws an instant in light colours onto a canvas, for print.
  still(time: number, target: HTMLCanvasElement): void {
    const [width, height] = [1400, 760];
    target.width = width;
    target.height = height;
    const context = target.getContext("2d");
    if (!context || this.width === 0) return;
    this.paints.apply("light");
    this.pose(time);
    this.stage.resize(width, height, 1);
    this.paints.resize(width, height, 1.4);
    this.rig.as(width, height, () => {
      this.render();
      context.fillStyle = "#ffffff";
      context.fillRect(0, 0, width, height);
      context.drawImage(this.stage.canvas, 0, 0);
      context.scale(1.6, 1.6);
      const color = (role: string) => roleColor(role, "light");
      this.labels.draw(context, this.stage.world, this.rig.camera, width / 1.6, height / 1.6, color);
      this.legend.draw(context, height / 1.6, color);
    });
    this.paints.apply(currentTheme());
    this.resize(this.width, this.height);
    this.draw();
  }
  // For a video: the picture with its labels, legend and time, at the size of the canvas.
  onPicture(listener: (() => void) | null): void {
    this.filmed = listener;
  }
  paint(context: CanvasRenderingContext2D): void {
    const { width, height } = context.canvas;
    const color = (role: string) => roleColor(role, this.shownTheme);
    const dark = this.shownTheme === "dark";
    context.fillStyle = dark ? "#10161d" : "#eef2f6";
    context.fillRect(0, 0, width, height);
    this.render(); // WebGL's picture exists until the end of the frame
    context.drawImage(this.stage.canvas, 0, 0, width, height);
    context.save();
    context.scale(width / this.width, height / this.height);
    this.labels.draw(context, this.stage.world, this.rig.camera, this.width, this.height, color, dark ? "#10161d" : "#fff");
    this.legend.draw(context, this.height, color, dark ? "#e6ebf0" : "#333");
    context.font = "600 15px system-ui, sans-serif";
    context.fillStyle = dark ? "#e6ebf0" : "#17202a";
    context.fillText(`t = ${this.clock.time.toFixed(2)} s`, 12, 24);
    context.restore();
  }
  // Even numbers of pixels, as encoders require.
  size(): { width: number; height: number } {
    const canvas = this.stage.canvas;
    return { width: 2 * Math.max(8, canvas.width >> 1), height: 2 * Math.max(8, canvas.height >> 1) };
  }
  dispose(): void {
    for (const end of this.ends) end();
    this.rig.dispose();
    this.paints.dispose();
    this.stage.dispose();
  }

  // ---- Drawing ----
  private draw(): void {
    if (this.width === 0) return;
    this.pose(this.clock.time, this.clock.back);
    this.render();
    const color = (role: string) => roleColor(role, this.shownTheme);
    this.labels.layout(this.stage.world, this.rig.camera, this.width, this.height, color);
    this.compass.update(this.rig.camera, this.stage.world, this.rig.unitsPerPixel(this.rig.target), color);
    this.filmed?.();
  }
  // The sky requires dark colours.
  private get shownTheme(): Theme {
    return this.shown.sky ? "dark" : this.paints.theme;
  }
  private pose(time: number, back = 0): void {
    for (const view of this.views) view.update(time, back, this.shown, this.bent);
    this.stage.sky?.pose(this.views[0].run.locate(time, back));
    this.rig.frame(this.stage.world);
  }
  private render(): void {
    this.ground.object.visible = this.shown.ground;
    this.stage.world.updateMatrixWorld(true);
    this.rig.camera.updateMatrixWorld();
    for (const { mass } of this.views) {
      const size = 22 * this.rig.unitsPerPixel(mass.position.clone().applyMatrix4(this.stage.world.matrixWorld));
      mass.scale.set(size, size, 1);
    }
    this.light();
    this.stage.render(this.rig.camera);
  }
  // Shadows are sharp near the view target, and cover the extent of the bodies.
  private light(): void {
    const view = this.views[0];
    const body = this.rig.active.follow ?? view.bodies.find((one) => one.body.kind === "base") ?? null;
    const all = this.extent(null);
    const whole = radiusOf(all);
    const near = 3.2 * view.span;
    if (!body || whole <= near) this.stage.lightUp(middleOf(all), 1.15 * whole);
    else this.stage.lightUp(body.object.position, near);
  }

  private retheme(): void {
    const theme: Theme = currentTheme();
    this.paints.apply(theme);
    this.host.dataset.theme = this.shownTheme;
    this.refreshLegend();
    this.invalidate();
  }
  private refreshLegend(): void {
    const { scene, roles, run } = this.views[0];
    const rows: LegendRow[] = [];
    const arms = new Set<string>();
    for (const end of scene.end_effectors) {
      const role = roles.get(end.body) ?? "base";
      if (!arms.has(role)) rows.push({ role, text: end.name });
      arms.add(role);
    }
    for (const body of scene.bodies) if (body.kind === "target") rows.push({ role: roles.get(body.name)!, text: body.name });
    if (scene.obstacles?.length) rows.push({ role: "obstacle", text: scene.obstacles.map((one) => one.name).join(", ") });
    const other = this.views[1];
    if (other) {
      rows.unshift({ role: "base", text: `${run.data.label || kVariant[0]}: solid` });
      rows.push({ role: "second", text: `${other.run.data.label || kVariant[1]}: translucent`, faint: true });
    }
    if (this.bent > 1) rows.push({ role: "base", text: `bending drawn ${number(this.bent)} times`, faint: true });
    if (this.shown.initial) rows.push({ role: "ghost", text: "initial pose", faint: true });
    if (this.shown.ground) rows.push({ role: "grid", text: `grid ${number(this.ground.step)} m`, faint: true });
    this.legend.show(rows, (role) => roleColor(role, this.shownTheme));
  }
  refresh(): void {
    if (this.shown.sky && !this.stage.sky) this.stage.sky = new Sky(centralBodyOf(this.views[0].run, this.views[0].scene));
    else if (!this.shown.sky && this.stage.sky) {
      this.stage.sky.dispose();
      this.stage.sky = null;
    }
    this.host.dataset.theme = this.shownTheme;
    this.refreshLegend();
    this.invalidate();
  }

  // ---- Construction ----
  private makeRig(canvas: HTMLElement, first: RunView): CameraRig {
    const follow = (kind: string) => first.bodies.filter((b) => b.body.kind === kind && b.track);
    const specs: ViewSpec[] = [
      { id: "inertial", label: "Inertial", follow: null, top: false },
      ...follow("base").map((b) => ({ id: "follow base", label: "Follow base", follow: b, top: false })),
      ...follow("target").map((b) => ({ id: `follow ${b.body.name}`, label: `Follow ${b.body.name}`, follow: b, top: false })),
      { id: "top", label: "From above, orthographic", follow: null, top: true },
      ...first.ends.map((end) => ({ id: `contact ${end.body.name}`, label: `Contact of ${end.body.name}`, follow: end, top: false })),
      ...first.ends.map((end) => endCamera(first, end)),
    ];
    const extent = (body: BodyView | null) => this.extent(body);
    let start = this.planar ? specs.findIndex((spec) => spec.top) : 0;
    const base = specs[1]?.follow;
    if (base && radiusOf(extent(null)) > 2.5 * radiusOf(extent(base))) start = 1; // large common drift
    return new CameraRig(specs, start, canvas, extent, this.direction, () => this.invalidate());
  }

  private viewDirection(first: RunView): Vector3 {
    const impact = first.impacts[0];
    first.pose(impact?.time ?? 0.5 * (first.run.begin + first.run.end));
    this.stage.world.updateMatrixWorld(true);
    const ends = first.endPoints();
    const bodies = first.bodies.filter((b) => b.track);
    const seen = impact && impact.grasps.length > 0 ? impact.grasps.map((g) => new Vector3(...g.point)) : ends;
    const apart = [...ends, ...bodies.filter((b) => b.body.kind !== "link" && b.body.kind !== "part").map((b) => b.object.position.clone())];
    return goodDirection({ apart, seen, bodies: bodies.map((b) => b.object), span: first.span }, this.planar);
  }

  // The region that a view must contain, relative to the followed body: for a target its surroundings, else all bodies
  // at all times.
  private extent(follow: BodyView | null): Ball[] {
    const known = this.extents.get(follow);
    if (known) return known;
    const near = follow?.body.kind === "target" ? 2.1 * follow.radius : follow?.body.kind === "end_effector" ? kNearEnd * this.views[0].span : 0;
    const balls = near > 0 ? [{ centre: new Vector3(), radius: near }] : this.sweep(follow);
    const sound = balls.filter((ball) => Number.isFinite(ball.centre.lengthSq() + ball.radius)); // a failed run may end in NaN
    this.extents.set(follow, sound);
    return sound;
  }
  private sweep(follow: BodyView | null): Ball[] {
    const balls: Ball[] = [];
    for (const view of this.views) {
      const { begin, end } = view.run;
      for (let k = 0; k <= kSamples; ++k) {
        for (const each of this.views) each.pose(begin + ((end - begin) * k) / kSamples);
        const origin = follow?.object.position ?? new Vector3();
        for (const { body, object, track, radius } of view.bodies) {
          if (!track) continue;
          balls.push({ centre: object.position.clone().sub(origin), radius: shownPart(body) * radius });
        }
        for (const point of view.endPoints()) balls.push({ centre: point.sub(origin), radius: 0.02 * view.span });
      }
      if (!follow) for (const tip of view.impulses.tips()) balls.push({ centre: tip, radius: 0.03 * view.span });
    }
    return balls;
  }

  private makeGround(): Ground {
    const balls = this.extent(null);
    const radius = radiusOf(balls);
    const lowest = Math.min(...balls.map((b) => b.centre.z - b.radius));
    return makeGround(middleOf(balls), radius, (Number.isFinite(lowest) ? lowest : 0) - 0.04 * radius, this.paints);
  }

  private watchSize(): void {
    const observer = new ResizeObserver(() => {
      const { width, height } = this.host.getBoundingClientRect();
      if (width > 0 && height > 0) this.resize(width, height);
    });
    observer.observe(this.host);
    this.ends.push(() => observer.disconnect());
  }
  private resize(width: number, height: number): void {
    const ratio = Math.min(2, devicePixelRatio || 1);
    this.width = width;
    this.height = height;
    this.stage.resize(width, height, ratio);
    this.paints.resize(width * ratio, height * ratio, ratio);
    this.rig.resize(width, height);
    this.invalidate();
  }

  // The wheel scrolls the page until the replay has been clicked; with Ctrl it always zooms.
  private watchWheel(canvas: HTMLCanvasElement): void {
    const hold = (event: WheelEvent): void => {
      if (!event.ctrlKey && document.activeElement !== canvas) event.stopImmediatePropagation();
    };
    this.host.addEventListener("wheel", hold, { capture: true, passive: true });
    canvas.addEventListener("pointerdown", () => canvas.focus({ preventScroll: true }));
    this.ends.push(() => this.host.removeEventListener("wheel", hold, { capture: true }));
  }
}

// Behind the end-effector and above it, looking outward; turns with it.
function endCamera(view: RunView, end: BodyView): ViewSpec {
  const outward = outwardOf(view.scene, end.body.name);
  const side = Math.abs(outward.z) < 0.9 ? new Vector3(0, 0, 1) : new Vector3(1, 0, 0);
  const towards = outward.clone().negate().addScaledVector(side, 0.45).normalize();
  return { id: `from ${end.body.name}`, label: `From ${end.body.name}`, follow: end, top: false, turn: true, towards };
}

// The share of a body's radius that a view must contain: links are represented by their ends, balls by their radius.
function shownPart(body: SceneBody): number {
  if (body.kind === "link") return 0.06;
  return body.geometry.length === 1 && body.geometry[0].shape === "sphere" ? 1 : 0.85;
}

function middleOf(balls: Ball[]): Vector3 {
  return balls.reduce((sum, b) => sum.add(b.centre), new Vector3()).divideScalar(Math.max(1, balls.length));
}
function radiusOf(balls: Ball[]): number {
  const centre = middleOf(balls);
  return Math.max(0.1, ...balls.map((b) => b.centre.distanceTo(centre) + b.radius));
}

function defaultShown(view: RunView): Shown {
  return {
    axes: false,
    trails: true,
    points: true,
    impulses: true,
    forces: view.impacts.some((i) => i.duration > 0) || view.touches,
    momentum: false,
    angular: false,
    actuators: true,
    torques: true,
    orbit: false,
    initial: false,
    mass: true,
    names: false,
    ground: true,
    sky: false,
  };
}

export function messageInstead(host: HTMLElement, title: string, text: string): void {
  host.append(element("div", { class: "replay-message", role: "status" }, element("strong", {}, title), element("p", {}, text)));
}
