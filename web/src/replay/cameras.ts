// Camera views: inertial, following base or a target, orthographic from above. Following moves the world, not the
// camera, so that every view retains its own orbit.
import { Box3, type Group, Matrix4, MOUSE, OrthographicCamera, PerspectiveCamera, Quaternion, TOUCH, Vector3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { BodyView } from "./bodies";

export interface Ball {
  centre: Vector3;
  radius: number;
}

export interface ViewSpec {
  id: string; // "inertial", "follow base", "follow target-1", "top"
  label: string;
  follow: BodyView | null;
  top: boolean;
  turn?: boolean; // always turns with the followed body
  towards?: Vector3; // from the view target to the camera at first, in the followed body's frame; absent: the rig's
}

interface View extends ViewSpec {
  camera: PerspectiveCamera | OrthographicCamera;
  controls: OrbitControls;
  touched: boolean; // the user has rotated it: resizing the window does not reset it
  fitted: boolean;
}

// The direction from the view target to the camera, rotated about z and limited before z.
export function turned(offset: Vector3, right: number, up: number): Vector3 {
  const size = offset.length();
  const azimuth = Math.atan2(offset.y, offset.x) + right;
  const height = Math.min(1.5, Math.max(-1.5, Math.asin(offset.z / size) + up));
  return new Vector3(Math.cos(azimuth) * Math.cos(height), Math.sin(azimuth) * Math.cos(height), Math.sin(height)).multiplyScalar(size);
}

const kFieldOfView = 27; // [deg], vertical: small perspective distortion
const kMargin = 1.06;

export class CameraRig {
  turnWithBody = false;
  private readonly views: View[];
  private current: View;
  private width = 16;
  private height = 9;

  // `extent`: the region that a view must contain, relative to the body it follows.
  constructor(
    specs: ViewSpec[],
    first: number,
    private readonly canvas: HTMLElement,
    private readonly extent: (follow: BodyView | null) => Ball[],
    private readonly direction: Vector3, // from the scene to the camera, for perspective views
    private readonly changed: () => void,
  ) {
    this.views = specs.map((spec) => this.make(spec));
    this.current = this.views[first];
    this.current.controls.connect(this.canvas);
    this.canvas.style.touchAction = "pan-y"; // vertical swipes scroll the page
  }

  get list(): readonly ViewSpec[] {
    return this.views;
  }
  get active(): ViewSpec {
    return this.current;
  }
  // The view target.
  get target(): Vector3 {
    return this.current.controls.target;
  }
  sight(): [number, number, number] {
    return this.camera.position.clone().sub(this.target).normalize().toArray();
  }
  get camera(): PerspectiveCamera | OrthographicCamera {
    return this.current.camera;
  }

  select(index: number): void {
    const view = this.views[index];
    if (!view || view === this.current) return;
    this.current.controls.disconnect();
    this.current = view;
    view.controls.connect(this.canvas);
    this.canvas.style.touchAction = "pan-y";
    if (!view.touched || !view.fitted) this.fit(view);
    else this.shape(view);
    this.changed();
  }

  reset(): void {
    this.current.touched = false;
    this.fit(this.current);
    this.changed();
  }

  zoom(factor: number): void {
    const view = this.current;
    view.touched = true;
    if (view.camera instanceof OrthographicCamera) view.camera.zoom *= factor;
    else view.camera.position.sub(view.controls.target).divideScalar(factor).add(view.controls.target);
    view.camera.updateProjectionMatrix();
    view.controls.update();
    this.changed();
  }

  // Directs the view to a point of the view's frame, with a ball of that radius about it filling half the picture.
  focus(point: Vector3, radius: number): void {
    const view = this.current;
    view.touched = true;
    const towards = view.camera.position.clone().sub(view.controls.target).normalize();
    view.controls.target.copy(point);
    if (view.camera instanceof OrthographicCamera) {
      view.camera.position.copy(point).addScaledVector(towards, 20 * radius);
      view.camera.zoom = (view.camera.userData.half ?? 1) / (2 * radius);
    } else {
      view.camera.position.copy(point).addScaledVector(towards, (2 * radius) / Math.tan((kFieldOfView * Math.PI) / 360));
    }
    this.shape(view);
    view.controls.update();
    this.changed();
  }

  // Rotates about the view target; the orthographic view pans instead.
  orbit(right: number, up: number): void {
    const view = this.current;
    view.touched = true;
    const { camera, controls } = view;
    const offset = camera.position.clone().sub(controls.target);
    if (camera instanceof OrthographicCamera) {
      const step = (camera.top - camera.bottom) / camera.zoom;
      const shift = new Vector3(right * step, up * step, 0);
      controls.target.add(shift);
      camera.position.add(shift);
    } else {
      camera.position.copy(controls.target).add(turned(offset, right, up));
    }
    controls.update();
    this.changed();
  }

  resize(width: number, height: number): void {
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
    if (this.current.touched) this.shape(this.current);
    else this.fit(this.current);
    for (const view of this.views) if (view !== this.current) view.fitted = view.touched;
  }

  // Draws with another aspect ratio, for a printed picture.
  as(width: number, height: number, draw: () => void): void {
    const before: [number, number] = [this.width, this.height];
    this.resize(width, height);
    draw();
    this.resize(...before);
  }

  // Places the world for the view: the followed body at the origin.
  frame(world: Group): void {
    const body = this.current.follow?.object;
    world.position.set(0, 0, 0);
    world.quaternion.identity();
    if (!body) return;
    if (this.turnWithBody || this.current.turn) world.quaternion.copy(body.quaternion).invert();
    world.position.copy(body.position).negate().applyQuaternion(world.quaternion);
  }

  unitsPerPixel(point: Vector3): number {
    const camera = this.current.camera;
    if (camera instanceof OrthographicCamera) return (camera.top - camera.bottom) / camera.zoom / this.height;
    const depth = point.clone().applyMatrix4(camera.matrixWorldInverse).z;
    return (2 * Math.tan((kFieldOfView * Math.PI) / 360) * Math.abs(depth)) / this.height;
  }

  dispose(): void {
    this.current.controls.disconnect(); // the others are never connected
  }

  private make(spec: ViewSpec): View {
    const camera = spec.top ? new OrthographicCamera() : new PerspectiveCamera(kFieldOfView, 16 / 9);
    const upright = !spec.top && Math.abs(spec.towards?.z ?? 0) < 0.9; // z cannot be up if the camera looks along it
    camera.up.set(0, upright ? 0 : 1, upright ? 1 : 0);
    const controls = new OrbitControls(camera, null);
    controls.zoomSpeed = 0.9;
    if (spec.top) {
      controls.enableRotate = false;
      controls.mouseButtons = { LEFT: MOUSE.PAN, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN };
      controls.touches = { ONE: TOUCH.PAN, TWO: TOUCH.DOLLY_PAN };
    }
    const view: View = { ...spec, camera, controls, touched: false, fitted: false };
    controls.addEventListener("start", () => (view.touched = true));
    controls.addEventListener("change", this.changed);
    return view;
  }

  // The camera position at which all balls are as large as possible.
  private fit(view: View): void {
    const balls = this.extent(view.follow);
    const towards = view.top ? new Vector3(0, 0, 1) : (view.towards ?? this.direction);
    const turn = new Quaternion().setFromRotationMatrix(new Matrix4().lookAt(towards, new Vector3(), view.camera.up));
    const into = turn.clone().invert();
    const seen = balls.map((ball) => ({ centre: ball.centre.clone().applyQuaternion(into), radius: ball.radius }));
    const box = new Box3();
    for (const { centre, radius } of seen) {
      box.expandByPoint(centre.clone().addScalar(radius)).expandByPoint(centre.clone().addScalar(-radius));
    }
    const middle = box.isEmpty() ? new Vector3() : box.getCenter(new Vector3());
    const size = box.isEmpty() ? new Vector3(1, 1, 1) : box.getSize(new Vector3());
    view.controls.target.copy(middle).applyQuaternion(turn);
    view.camera.position.copy(view.controls.target).addScaledVector(towards, this.distance(view, seen, middle, size));
    view.fitted = true;
    this.shape(view);
    view.controls.update();
  }

  private distance(view: View, seen: Ball[], middle: Vector3, size: Vector3): number {
    const aspect = this.width / this.height;
    if (view.camera instanceof OrthographicCamera) {
      const half = 0.5 * kMargin * Math.max(size.y, size.x / aspect, 1e-3);
      view.camera.userData.half = half;
      view.camera.zoom = 1;
      return size.z + 2 * half;
    }
    const up = Math.tan((kFieldOfView * Math.PI) / 360);
    let distance = 1e-3;
    for (const { centre, radius } of seen) {
      const p = centre.clone().sub(middle);
      for (const [offset, slope] of [
        [Math.abs(p.x), up * aspect],
        [Math.abs(p.y), up],
      ])
        distance = Math.max(distance, p.z + (offset + radius * Math.hypot(1, slope)) / slope);
    }
    return kMargin * distance;
  }

  // Sets the aspect ratio and the range of depths.
  private shape(view: View): void {
    const camera = view.camera;
    const far = camera.position.distanceTo(view.controls.target);
    if (camera instanceof OrthographicCamera) {
      const half = camera.userData.half ?? 1;
      const aspect = this.width / this.height;
      Object.assign(camera, { left: -half * aspect, right: half * aspect, top: half, bottom: -half, near: 0.01 * far, far: 20 * far });
    } else {
      camera.aspect = this.width / this.height;
      camera.near = 0.01 * far;
      camera.far = 30 * far;
    }
    camera.updateProjectionMatrix();
  }
}
