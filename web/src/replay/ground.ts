// The plane below the scene: a grid fixed in W that fades outwards, with the shadows of the bodies. It makes slow drift
// visible.
import { BufferGeometry, Float32BufferAttribute, Group, LineSegments, Mesh, PlaneGeometry, ShadowMaterial, Vector3 } from "three";
import type { Paints } from "./palette";

export interface Ground {
  object: Group;
  step: number; // of the grid [m]
}

// The smallest 1, 2 or 5 times a power of ten that is at least `wish`.
export function niceLength(wish: number): number {
  const power = 10 ** Math.floor(Math.log10(wish));
  return ([1, 2, 5, 10].find((k) => k * power >= wish * 0.999) ?? 10) * power;
}

// In the plane z = `height` about a centre, for a scene of that radius [m].
export function makeGround(centre: Vector3, radius: number, height: number, paints: Paints): Ground {
  const step = niceLength(radius / 5);
  const object = new Group();
  object.add(gridLines(centre, radius, step, height, paints), shadows(centre, radius, height));
  return { object, step };
}

// Segments of one step each, so that each fades by its position.
function gridLines(centre: Vector3, radius: number, step: number, height: number, paints: Paints): LineSegments {
  const half = Math.ceil((3.2 * radius) / step);
  const [cx, cy] = [Math.round(centre.x / step), Math.round(centre.y / step)];
  const points: number[] = [];
  const colors: number[] = [];
  const add = (i: number, k: number): void => {
    points.push((cx + i) * step, (cy + k) * step, height);
    const far = Math.hypot(i, k) / half;
    colors.push(1, 1, 1, Math.max(0, 1 - far) ** 1.3);
  };
  for (let i = -half; i <= half; ++i) {
    for (let k = -half; k < half; ++k) {
      if (Math.hypot(i, k) > half) continue;
      add(i, k);
      add(i, k + 1);
      add(k, i);
      add(k + 1, i);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(points, 3));
  geometry.setAttribute("color", new Float32BufferAttribute(colors, 4));
  const object = new LineSegments(geometry, paints.fading("grid", 0.45));
  object.renderOrder = -1;
  return object;
}

function shadows(centre: Vector3, radius: number, height: number): Mesh {
  const plane = new Mesh(new PlaneGeometry(6 * radius, 6 * radius), new ShadowMaterial({ opacity: 0.26, depthWrite: false }));
  plane.position.set(centre.x, centre.y, height);
  plane.receiveShadow = true;
  plane.renderOrder = -2;
  return plane;
}
