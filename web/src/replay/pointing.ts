// The pointer on the picture: a hovered body's name, mass and speed; a double click shows a body from near.
import { type Object3D, Quaternion, Raycaster, Vector2, Vector3 } from "three";
import { element } from "../dom";
import { withUnit } from "../format";
import type { Instant, Run } from "../run";
import type { BodyView } from "./bodies";
import { poseAt, type PoseTrack } from "./poses";
import type { RunView } from "./run_view";
import type { Viewport } from "./viewport";

const kHoverPause = 60; // between two searches for the body below the pointer [ms]

// Speed of a body's centre of mass [m/s]: exact where its velocity is recorded, else from its adjacent samples.
export function speedOf(run: Run, view: { body: BodyView["body"]; track: PoseTrack | undefined }, instant: Instant): number {
  const [velocity, rate] = ["velocity", "angular_velocity"].map((name) => run.series(`${view.body.series}/${name}`));
  if (!view.track) return NaN;
  const com = new Vector3(...view.body.com);
  if (velocity && rate) {
    const turn = new Quaternion();
    poseAt(view.track, instant, new Vector3(), turn);
    const arm = com.applyQuaternion(turn);
    return new Vector3().fromArray(run.at(rate, instant)).cross(arm).add(new Vector3().fromArray(run.at(velocity, instant))).length();
  }
  const { index } = instant;
  const next = run.time[index + 1] > run.time[index] ? index + 1 : index;
  const last = next > index ? index : run.time[index - 1] < run.time[index] ? index - 1 : index;
  const step = run.time[next] - run.time[last];
  return step > 0 ? centreAt(view.track, com, next).distanceTo(centreAt(view.track, com, last)) / step : NaN;
}

function centreAt(track: PoseTrack, com: Vector3, index: number): Vector3 {
  const [position, turn] = [new Vector3(), new Quaternion()];
  poseAt(track, { index, fraction: 0 }, position, turn);
  return com.clone().applyQuaternion(turn).add(position);
}

// Returns the function that removes the listeners.
export function listenPointer(viewport: Viewport, canvas: HTMLCanvasElement, instant: () => Instant): () => void {
  const tip = element("div", { class: "replay-tip", "aria-hidden": "true" });
  tip.hidden = true;
  viewport.host.append(tip);
  let last = 0;
  const moved = (event: PointerEvent): void => {
    if (event.pointerType !== "mouse" || event.timeStamp - last < kHoverPause) return;
    last = event.timeStamp;
    const found = event.buttons === 0 ? bodyBelow(viewport, canvas, event) : undefined;
    tip.hidden = !found;
    if (!found) return;
    const { body } = found.view;
    const speed = speedOf(viewport.views[0].run, found.view, instant());
    tip.textContent = [body.name, withUnit(body.mass, "kg"), Number.isFinite(speed) ? withUnit(speed, "m/s", 3) : ""].filter(Boolean).join(" · ");
    tip.style.transform = `translate(${event.offsetX + 14}px, ${event.offsetY + 12}px)`;
  };
  const left = (): void => void (tip.hidden = true);
  const focused = (event: MouseEvent): void => {
    const found = bodyBelow(viewport, canvas, event);
    if (found) viewport.focusOn(found.view, found.point);
  };
  canvas.addEventListener("pointermove", moved);
  canvas.addEventListener("pointerleave", left);
  canvas.addEventListener("dblclick", focused);
  return () => {
    canvas.removeEventListener("pointermove", moved);
    canvas.removeEventListener("pointerleave", left);
    canvas.removeEventListener("dblclick", focused);
    tip.remove();
  };
}

// The first body of the first run below the pointer, and the point on it.
function bodyBelow(viewport: Viewport, canvas: HTMLCanvasElement, event: MouseEvent): { view: BodyView; point: Vector3 } | undefined {
  const { left, top, width, height } = canvas.getBoundingClientRect();
  const ray = new Raycaster();
  ray.params.Line.threshold = 0; // edges lie on faces
  ray.setFromCamera(new Vector2((2 * (event.clientX - left)) / width - 1, 1 - (2 * (event.clientY - top)) / height), viewport.rig.camera);
  const first: RunView = viewport.views[0];
  const drawn = first.bodies.filter((view) => view.object.visible);
  const [hit] = ray.intersectObjects(drawn.map((view) => view.object), true);
  const view = hit && drawn.find((one) => within(one.object, hit.object));
  return view && { view, point: hit.point.clone() };
}

function within(root: Object3D, part: Object3D | null): boolean {
  for (let at = part; at; at = at.parent) if (at === root) return true;
  return false;
}
