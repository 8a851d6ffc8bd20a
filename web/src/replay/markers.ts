// Small markers: attitude axes, grasp points, contact points, the centre of mass.
import { CanvasTexture, CylinderGeometry, Group, Mesh, OctahedronGeometry, SphereGeometry, Sprite, SpriteMaterial, Vector3 } from "three";
import type { Scene, SceneBody, SceneShape } from "../data";
import type { Paints } from "./palette";
import { along, quaternion } from "./shapes";

// x red, y green, z blue.
export function attitudeAxes(length: number, paints: Paints): Group {
  const group = new Group();
  const geometry = new CylinderGeometry(0.014 * length, 0.014 * length, length, 10).translate(0, length / 2, 0);
  const axes: [string, Vector3][] = [
    ["axis x", new Vector3(1, 0, 0)],
    ["axis y", new Vector3(0, 1, 0)],
    ["axis z", new Vector3(0, 0, 1)],
  ];
  for (const [role, axis] of axes) {
    const part = new Group();
    const shone = new Mesh(geometry, paints.flat(role, 0.3, true));
    shone.renderOrder = 20;
    part.add(new Mesh(geometry, paints.flat(role)), shone);
    group.add(along(part, axis));
  }
  return group;
}

// A grasp point in its target's frame: a diamond, a handle if the point is off the surface of a box, and the approach
// direction.
export function graspPoint(point: Scene["grasp_points"][number], target: SceneBody, size: number, role: string, paints: Paints): Group {
  const group = new Group();
  const at = new Vector3(...point.position);
  const diamond = new Mesh(new OctahedronGeometry(size), paints.flat("joint"));
  diamond.position.copy(at);
  group.add(diamond);
  const foot = nearestOfBoxes(at, target);
  if (foot && foot.distanceTo(at) > 1e-3) group.add(bar(foot, at, 0.32 * size, paints, role));
  if (point.approach_direction) {
    const direction = new Vector3(...point.approach_direction).normalize();
    group.add(bar(at.clone().addScaledVector(direction, -5 * size), at, 0.1 * size, paints, "joint"));
  }
  return group;
}

export function contactPoint(size: number, paints: Paints, role = "impulse"): Group {
  const group = new Group();
  const sphere = new SphereGeometry(size, 20, 14);
  const shone = new Mesh(sphere, paints.flat(role, 0.35, true));
  shone.renderOrder = 20;
  group.add(new Mesh(sphere, paints.flat(role)), shone);
  group.visible = false;
  return group;
}

// The engineering symbol of a centre of mass; its size in pixels is set in every frame.
export function massCentre(): Sprite {
  const side = 64;
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = side;
  const context = canvas.getContext("2d");
  if (context) {
    const c = side / 2;
    const r = 0.4 * side;
    for (let k = 0; k < 4; ++k) {
      context.beginPath();
      context.moveTo(c, c);
      context.arc(c, c, r, (k * Math.PI) / 2, ((k + 1) * Math.PI) / 2);
      context.fillStyle = k % 2 ? "#10161d" : "#ffffff";
      context.fill();
    }
    context.beginPath();
    context.arc(c, c, r, 0, 2 * Math.PI);
    context.lineWidth = 5;
    context.strokeStyle = "#10161d";
    context.stroke();
  }
  const texture = new CanvasTexture(canvas);
  const sprite = new Sprite(new SpriteMaterial({ map: texture, depthTest: false, depthWrite: false, transparent: true }));
  sprite.renderOrder = 30;
  return sprite;
}

function bar(from: Vector3, to: Vector3, radius: number, paints: Paints, role: string): Group {
  const span = to.clone().sub(from);
  const part = new Group();
  part.add(new Mesh(new CylinderGeometry(radius, radius, span.length(), 10), paints.surface(role)));
  const made = along(part, span);
  made.position.copy(from).addScaledVector(span, 0.5);
  return made;
}

// In the body's frame; undefined: it has shapes other than boxes, which may be closer.
function nearestOfBoxes(point: Vector3, body: SceneBody): Vector3 | undefined {
  if (body.geometry.some((g) => g.shape !== "box")) return undefined;
  const feet = body.geometry.map((g) => nearestOfBox(point, g));
  return feet.sort((a, b) => a.distanceTo(point) - b.distanceTo(point))[0];
}

function nearestOfBox(point: Vector3, g: SceneShape): Vector3 {
  const turn = quaternion(g.quaternion_wxyz);
  const centre = new Vector3(...g.position);
  const half = new Vector3(...g.size).multiplyScalar(0.5);
  const inside = point
    .clone()
    .sub(centre)
    .applyQuaternion(turn.clone().invert())
    .clamp(half.clone().negate(), half);
  return inside.applyQuaternion(turn).add(centre);
}
