// The bodies of one run as a tree of solids, posed at an instant.
import { BoxGeometry, Group, Vector3 } from "three";
import type { Scene, SceneBody, SceneShape } from "../data";
import { rolesOf } from "../roles";
import type { Instant, Run } from "../run";
import { flexibleSegments } from "./bending";
import { inertiaBox } from "./inertia";
import type { Paints } from "./palette";
import { poseAt, type PoseTrack, poseTrack } from "./poses";
import { geometrySolid, gripperSolid, jointSolid, type Appearance, rod, solid } from "./shapes";

export type Style = "solid" | "ghost" | "second";

export interface BodyView {
  body: SceneBody;
  object: Group;
  track: PoseTrack | undefined;
  radius: number; // of the drawn shapes, about the frame's origin [m]
  joint?: Group; // its drawn joint
}

export function buildBodies(run: Run, scene: Scene, paints: Paints, style: Style): BodyView[] {
  const roles = rolesOf(scene);
  const rodRadius = rodRadiusOf(scene);
  const segments = flexibleSegments(run);
  return scene.bodies.map((body) => {
    const appearance = appearanceOf(roles.get(body.name) ?? "base", style);
    const object = new Group();
    object.name = body.name;
    const own = body.geometry.map((shape) => geometrySolid(shape, scene, appearance, paints)).filter((made) => made !== undefined);
    for (const part of own.length > 0 ? own : defaultSolids(body, scene, rodRadius, appearance, paints)) object.add(part);
    const joint = body.kind !== "link" ? undefined : addJointAndGrippers(object, body, scene, !segments.has(body.name), rodRadius, appearance, paints);
    const track = poseTrack(run, body.series);
    object.visible = track !== undefined; // bodies without known motion are not displayed
    return { body, object, track, radius: reach(body, scene), joint };
  });
}

export function poseBodies(views: BodyView[], instant: Instant): void {
  for (const view of views) if (view.track) poseAt(view.track, instant, view.object.position, view.object.quaternion);
}

function appearanceOf(role: string, style: Style): Appearance {
  if (style === "ghost") return { role: "ghost", jointRole: "ghost", edgeRole: "ghost", opacity: 0.16 };
  if (style === "second") return { role: "second", jointRole: "second", edgeRole: "second", opacity: 0.3 };
  return { role, jointRole: "joint", edgeRole: "edge", opacity: 1 };
}

// Links: rods from joint to joint or end-effector. Others: the box of the same inertia.
function defaultSolids(body: SceneBody, scene: Scene, radius: number, appearance: Appearance, paints: Paints): Group[] {
  if (body.kind === "link") {
    const origin = new Vector3();
    return linkEnds(body, scene)
      .map((end) => rod(origin, end, radius, 0.72, appearance, paints))
      .filter((made) => made !== undefined);
  }
  const box = inertiaBox(body.mass, body.inertia);
  const size = box?.size ?? new Vector3(1, 1, 1).multiplyScalar(0.4 * typicalLink(scene));
  const made = solid(new BoxGeometry(size.x, size.y, size.z), appearance, paints, "edges");
  made.position.set(...body.com);
  if (box) made.quaternion.copy(box.quaternion);
  return [made];
}

// End points of a link, in its frame: its children's joints, else its end-effectors, else twice the position of its
// centre of mass.
function linkEnds(body: SceneBody, scene: Scene): Vector3[] {
  const ends = scene.bodies.filter((b) => b.parent === body.name && b.joint).map((b) => new Vector3(...b.joint!.position));
  for (const e of scene.end_effectors) if (e.body === body.name) ends.push(new Vector3(...e.position));
  if (ends.length === 0) ends.push(new Vector3(...body.com).multiplyScalar(2));
  return ends;
}

// The drawn joint.
function addJointAndGrippers(object: Group, body: SceneBody, scene: Scene, showsJoint: boolean, rodRadius: number, appearance: Appearance, paints: Paints): Group | undefined {
  let joint: Group | undefined;
  const tube = body.geometry.find((g) => (g.shape === "cylinder" || g.shape === "capsule") && g.size[0] > 0);
  const girth = tube ? tube.size[0] : rodRadius;
  if (body.joint && showsJoint && !body.geometry.some((g) => g.shape === "mesh")) {
    // The joint axis has the same components in both frames of the joint, since rotation about it does not change it.
    joint = jointSolid(body.joint.type, new Vector3(...body.joint.axis), 1.3 * girth, appearance, paints);
    if (joint) object.add(joint);
  }
  for (const e of scene.end_effectors) {
    if (e.body !== body.name) continue;
    const point = new Vector3(...e.position);
    const outwards = point.lengthSq() > 1e-12 ? point : new Vector3(0, 0, 1);
    const gripper = gripperSolid(outwards, 1.8 * girth, appearance, paints);
    gripper.position.copy(point);
    object.add(gripper);
  }
  return joint;
}

// Distances between joints of chains, sorted.
function linkLengths(scene: Scene): number[] {
  const links = scene.bodies.filter((body) => body.kind === "link");
  const lengths = links.flatMap((body) => linkEnds(body, scene).map((end) => end.length()));
  return lengths.filter((length) => length > 1e-6).sort((a, b) => a - b);
}

function rodRadiusOf(scene: Scene): number {
  return 0.02 * (typicalLink(scene) + (linkLengths(scene).at(-1) ?? 0));
}

// Reference for sizes: the median distance between joints of a chain, or the base's size.
export function typicalLink(scene: Scene): number {
  const lengths = linkLengths(scene);
  const median = lengths[lengths.length >> 1];
  if (median > 0) return median;
  return Math.max(...scene.bodies.map((b) => inertiaBox(b.mass, b.inertia)?.size.length() ?? 0), 0.1);
}

// Radius about the frame's origin of all drawn shapes of a body.
function reach(body: SceneBody, scene: Scene): number {
  let radius = Math.max(0, ...body.geometry.map((shape) => shapeReach(shape, scene)));
  if (body.geometry.length === 0 && body.kind !== "link") {
    radius = Math.hypot(...body.com) + 0.5 * (inertiaBox(body.mass, body.inertia)?.size.length() ?? 0.4);
  }
  if (body.kind === "link") for (const end of linkEnds(body, scene)) radius = Math.max(radius, end.length());
  return radius;
}

function shapeReach(g: SceneShape, scene: Scene): number {
  const offset = Math.hypot(...g.position);
  const [a, b, c] = g.size;
  if (g.shape === "box") return offset + 0.5 * Math.hypot(a, b, c);
  if (g.shape === "cylinder") return offset + Math.hypot(a, b / 2);
  if (g.shape === "capsule") return offset + a + b / 2;
  if (g.shape === "sphere") return offset + a;
  return offset + meshReach(scene, g.mesh ?? -1, g.size);
}

function meshReach(scene: Scene, index: number, scale: readonly number[]): number {
  const vertices = scene.meshes[index]?.vertices ?? [];
  let most = 0;
  for (let i = 0; i + 2 < vertices.length; i += 3)
    most = Math.max(most, Math.hypot(vertices[i] * (scale[0] || 1), vertices[i + 1] * (scale[1] || 1), vertices[i + 2] * (scale[2] || 1)));
  return most;
}
