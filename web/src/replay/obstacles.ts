// Obstacles of a scene: bodies fixed in W. A half-space is drawn as a square grid of its surface.
import { BufferGeometry, DoubleSide, Float32BufferAttribute, Group, LineSegments, Mesh, PlaneGeometry, Quaternion, Vector3 } from "three";
import type { Scene, SceneObstacle, Vec3 } from "../data";
import { niceLength } from "./ground";
import type { Paints } from "./palette";
import { type Appearance, geometrySolid, quaternion } from "./shapes";

const kAppearance: Appearance = { role: "obstacle", jointRole: "obstacle", edgeRole: "edge", opacity: 1 };
const kCells = 20; // along each edge of a square, about

// `centre`, `radius`: of a ball that contains the motion of all bodies, for the size of half-spaces.
export function buildObstacles(scene: Scene, centre: Vector3, radius: number, paints: Paints): Group {
  const group = new Group();
  for (const obstacle of scene.obstacles ?? []) {
    const made = obstacle.half_space ? halfSpace(surfaceSquare(obstacle, centre.toArray(), radius), paints) : shapes(obstacle, scene, paints);
    made.name = obstacle.name;
    made.position.set(...obstacle.position);
    made.quaternion.copy(quaternion(obstacle.quaternion_wxyz));
    group.add(made);
  }
  return group;
}

function shapes(obstacle: SceneObstacle, scene: Scene, paints: Paints): Group {
  const group = new Group();
  for (const shape of obstacle.geometry) {
    const made = geometrySolid(shape, scene, kAppearance, paints);
    if (made) group.add(made);
  }
  return group;
}

export interface SurfaceSquare {
  x: number; // of its centre in the obstacle's frame, a multiple of the step [m]
  y: number;
  step: number; // between lines [m]
  cells: number; // from the centre to an edge
}

// The square of a half-space's surface about the point nearest to `centre`, with edges of at least four radii.
export function surfaceSquare(obstacle: Pick<SceneObstacle, "position" | "quaternion_wxyz">, centre: Vec3, radius: number): SurfaceSquare {
  const [w, x, y, z] = obstacle.quaternion_wxyz;
  const local = new Vector3(...centre).sub(new Vector3(...obstacle.position)).applyQuaternion(new Quaternion(x, y, z, w).normalize().invert());
  const step = niceLength((4 * radius) / kCells);
  return { x: Math.round(local.x / step) * step, y: Math.round(local.y / step) * step, step, cells: Math.ceil((2 * radius) / step) };
}

function halfSpace(square: SurfaceSquare, paints: Paints): Group {
  const { x, y, step, cells } = square;
  const half = cells * step;
  const points: number[] = [];
  for (let k = -cells; k <= cells; ++k) {
    points.push(x + k * step, y - half, 0, x + k * step, y + half, 0);
    points.push(x - half, y + k * step, 0, x + half, y + k * step, 0);
  }
  const lines = new BufferGeometry();
  lines.setAttribute("position", new Float32BufferAttribute(points, 3));
  const plane = new Mesh(new PlaneGeometry(2 * half, 2 * half), paints.surface("obstacle", kPlaneOpacity));
  plane.material.side = DoubleSide;
  plane.position.set(x, y, 0);
  const group = new Group();
  group.add(plane, new LineSegments(lines, paints.line("obstacle", 0.6)));
  return group;
}

const kPlaneOpacity = 0.22;
