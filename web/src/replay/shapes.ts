// Solids for bodies: their own geometry, or default shapes. Everything is in the body's frame.
import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CapsuleGeometry,
  CylinderGeometry,
  EdgesGeometry,
  Group,
  LineSegments,
  Mesh,
  Quaternion,
  SphereGeometry,
  Vector3,
} from "three";
import type { Quat, Scene, SceneShape } from "../data";
import type { Paints } from "./palette";
import { cellLines, connectedParts, type Plate, plateOf, plateOfBox } from "./panels";

// Materials of a body's solids.
export interface Appearance {
  role: string;
  jointRole: string;
  edgeRole: string;
  opacity: number;
}

const kY = new Vector3(0, 1, 0);
const kMaxForEdges = 120000; // vertices: finding the edges of larger meshes takes seconds
const kZ = new Vector3(0, 0, 1);

export function quaternion(q: Quat): Quaternion {
  return new Quaternion(q[1], q[2], q[3], q[0]).normalize();
}

// Outline of a solid: its edges, a rim if it has none, or both (cylinders).
type Outline = "edges" | "rim" | "both";

export function solid(geometry: BufferGeometry, appearance: Appearance, paints: Paints, outline: Outline, role = appearance.role): Group {
  const group = new Group();
  const mesh = new Mesh(geometry, paints.surface(role, appearance.opacity));
  mesh.castShadow = mesh.receiveShadow = appearance.opacity === 1;
  group.add(mesh);
  const lineOpacity = appearance.opacity < 1 ? 0.55 * appearance.opacity + 0.1 : 0.55;
  if (outline !== "rim" && geometry.getAttribute("position").count <= kMaxForEdges) {
    const edges = new EdgesGeometry(geometry, 32);
    if (edges.getAttribute("position").count > 0) group.add(new LineSegments(edges, paints.line(appearance.edgeRole, lineOpacity)));
  }
  if (outline !== "edges" && appearance.opacity === 1) group.add(new Mesh(geometry, paints.rim(appearance.edgeRole)));
  return group;
}

// Cylinders and capsules of scene.json are along z, those of three.js along y.
export function geometrySolid(geometry: SceneShape, scene: Scene, appearance: Appearance, paints: Paints): Group | undefined {
  const [a, b, c] = geometry.size;
  const group = new Group();
  let made: Group | undefined;
  if (geometry.shape === "box" && a > 0 && b > 0 && c > 0) made = box([a, b, c], appearance, paints);
  if (geometry.shape === "sphere" && a > 0) made = sphere(a, appearance, paints);
  if (geometry.shape === "cylinder" && a > 0 && b > 0) made = along(solid(new CylinderGeometry(a, a, b, 40), appearance, paints, "both"), kZ);
  if (geometry.shape === "capsule" && a > 0) made = along(solid(new CapsuleGeometry(a, Math.max(b, 0), 8, 28), appearance, paints, "rim"), kZ);
  if (geometry.shape === "mesh") {
    made = meshSolid(scene, geometry.mesh ?? -1, appearance, paints);
    made?.scale.set(a || 1, b || 1, c || 1);
  }
  if (!made) return undefined;
  group.add(made);
  group.position.set(...geometry.position);
  group.quaternion.copy(quaternion(geometry.quaternion_wxyz));
  return group;
}

// Two great circles make the rotation of a sphere visible.
function sphere(radius: number, appearance: Appearance, paints: Paints): Group {
  const group = solid(new SphereGeometry(radius, 48, 32), appearance, paints, "rim");
  const points: Vector3[] = [];
  const circle = (at: (angle: number) => Vector3) => {
    for (let i = 0; i < 96; ++i) for (const k of [i, i + 1]) points.push(at((k / 96) * 2 * Math.PI).multiplyScalar(1.002 * radius));
  };
  circle((t) => new Vector3(Math.cos(t), Math.sin(t), 0));
  circle((t) => new Vector3(Math.cos(t), 0, Math.sin(t)));
  circle((t) => new Vector3(0, Math.cos(t), Math.sin(t)));
  group.add(new LineSegments(new BufferGeometry().setFromPoints(points), paints.line(appearance.edgeRole, 0.28 * appearance.opacity)));
  return group;
}

// A thin box is a panel.
function box(size: [number, number, number], appearance: Appearance, paints: Paints): Group {
  const plate = appearance.opacity === 1 ? plateOfBox(size) : undefined;
  const group = solid(new BoxGeometry(...size), appearance, paints, "edges", plate ? "panel" : appearance.role);
  if (plate) group.add(cells(plate, paints));
  return group;
}

function cells(plate: Plate, paints: Paints): LineSegments {
  return new LineSegments(cellLines(plate), paints.line("cell", 0.6));
}

const kMaxForPanels = 60000; // triangles: the search for parts of larger meshes is slow

// Parts that are thin rectangles are panels; the rest has the body's colour.
function meshSolid(scene: Scene, index: number, appearance: Appearance, paints: Paints): Group | undefined {
  const mesh = scene.meshes[index];
  if (!mesh || mesh.triangles.length === 0) return undefined;
  const { vertices, triangles } = mesh;
  const wanted = appearance.opacity === 1 && triangles.length <= 3 * kMaxForPanels;
  const parts = wanted ? connectedParts(vertices, triangles) : [];
  const plates = parts.map((part) => plateOf(vertices, triangles, part));
  if (!plates.some(Boolean)) return solid(meshGeometry(vertices, triangles), appearance, paints, "edges");
  const group = new Group();
  const of = (panel: boolean): number[] =>
    parts.filter((_, k) => Boolean(plates[k]) === panel).flatMap((part) => part.flatMap((t) => [triangles[3 * t], triangles[3 * t + 1], triangles[3 * t + 2]]));
  const rest = of(false);
  if (rest.length > 0) group.add(solid(meshGeometry(vertices, rest), appearance, paints, "edges"));
  group.add(solid(meshGeometry(vertices, of(true)), appearance, paints, "edges", "panel"));
  for (const plate of plates) if (plate) group.add(cells(plate, paints));
  return group;
}

function meshGeometry(vertices: number[], triangles: number[]): BufferGeometry {
  const indexed = new BufferGeometry();
  indexed.setAttribute("position", new BufferAttribute(new Float32Array(vertices), 3));
  indexed.setIndex(triangles.slice());
  const flat = indexed.toNonIndexed(); // flat shading, as in CAD models
  flat.computeVertexNormals();
  return flat;
}

// Rotates a solid along y of three.js to lie along `axis`.
export function along(group: Group, axis: Vector3): Group {
  const outer = new Group();
  group.quaternion.setFromUnitVectors(kY, axis.clone().normalize());
  outer.add(group);
  return outer;
}

// A rod from one point to another, thinner at its end.
export function rod(from: Vector3, to: Vector3, radius: number, taper: number, appearance: Appearance, paints: Paints): Group | undefined {
  const span = to.clone().sub(from);
  const length = span.length();
  if (length < 1e-9) return undefined;
  const made = along(solid(new CylinderGeometry(radius * taper, radius, length, 24), appearance, paints, "both"), span);
  made.position.copy(from).addScaledVector(span, 0.5);
  return made;
}

// A joint in its body's frame: a short cylinder along the axis of rotation, a bar along the axis of translation.
export function jointSolid(type: string, axis: Vector3, radius: number, appearance: Appearance, paints: Paints): Group | undefined {
  if (type === "fixed" || axis.length() < 1e-9) return undefined;
  const geometry =
    type === "prismatic" ? new BoxGeometry(1.6 * radius, 5 * radius, 1.6 * radius) : new CylinderGeometry(radius, radius, 2.3 * radius, 32);
  return along(solid(geometry, appearance, paints, type === "prismatic" ? "edges" : "both", appearance.jointRole), axis);
}

// A gripper that extends from behind the end-effector's point up to it: a palm and three fingers.
export function gripperSolid(direction: Vector3, size: number, appearance: Appearance, paints: Paints): Group {
  const gripper = new Group();
  const palm = solid(new CylinderGeometry(0.95 * size, 0.7 * size, 0.7 * size, 28), appearance, paints, "both", appearance.jointRole);
  palm.position.y = -1.35 * size;
  gripper.add(palm);
  for (let k = 0; k < 3; ++k) {
    const angle = (k * 2 * Math.PI) / 3;
    const finger = solid(new BoxGeometry(0.3 * size, 1.2 * size, 0.3 * size), appearance, paints, "edges", appearance.jointRole);
    finger.position.set(0.72 * size * Math.cos(angle), -0.45 * size, 0.72 * size * Math.sin(angle));
    finger.rotation.y = -angle;
    gripper.add(finger);
  }
  return along(gripper, direction);
}
