// Exaggerated bending. Flexible links are recorded as straight segments NAME, NAME:1, NAME:2 etc., each hinged on the
// previous one and parallel to it without deflection. The rotation of each relative to the previous one is multiplied;
// attached bodies move along.
import { Quaternion, Vector3 } from "three";
import type { Run } from "../run";
import type { BodyView } from "./bodies";

interface Step {
  view: BodyView;
  on: BodyView; // parent body
  isFlexible: boolean;
  position: Vector3; // in the parent's frame
  turn: Quaternion;
}

export class Bending {
  private readonly steps: Step[] = [];

  constructor(run: Run, views: BodyView[]) {
    const segments = flexibleSegments(run);
    const known = new Map<string, BodyView>();
    const moved = new Set<BodyView>();
    for (const view of views) {
      const isFlexible = segments.has(view.body.name);
      const on = view.track && known.get((isFlexible ? segmentBefore(view.body.name) : view.body.parent) ?? "");
      known.set(view.body.name, view);
      if (!on) continue;
      if (!isFlexible && !moved.has(on)) continue; // rigid up to the base
      this.steps.push({ view, on, isFlexible, position: new Vector3(), turn: new Quaternion() });
      moved.add(view);
    }
  }

  get isThere(): boolean {
    return this.steps.length > 0;
  }

  // Moves bodies that have their recorded poses.
  apply(factor: number): void {
    if (factor === 1) return;
    for (const { view, on, position, turn } of this.steps) {
      const back = on.object.quaternion.clone().invert();
      position.copy(view.object.position).sub(on.object.position).applyQuaternion(back);
      turn.copy(back.multiply(view.object.quaternion));
    }
    for (const { view, on, isFlexible, position, turn } of this.steps) {
      view.object.position.copy(position).applyQuaternion(on.object.quaternion).add(on.object.position);
      view.object.quaternion.copy(on.object.quaternion).multiply(isFlexible ? times(turn, factor) : turn);
    }
  }
}

// Bodies with a bending or twisting hinge on the previous segment, as named by the run's deflections: "arm:2z", or
// "target:satellite/panel:1y" for a target. Other links with such names have no deflection.
export function flexibleSegments(run: Run): Set<string> {
  const names = (run.series("elastic/deflection")?.components ?? []).flatMap((hinge) => /^(?:target:)?(.*:\d+)[xyz]$/.exec(hinge)?.[1] ?? []);
  return new Set(names);
}

// "arm:2" for "arm:3", "arm" for "arm:1".
function segmentBefore(name: string): string {
  const colon = name.lastIndexOf(":");
  const number = Number(name.slice(colon + 1));
  return number > 1 ? `${name.slice(0, colon)}:${number - 1}` : name.slice(0, colon);
}

// The rotation about the same axis by a multiple of its angle, at most 180 deg.
function times(turn: Quaternion, factor: number): Quaternion {
  const sign = turn.w < 0 ? -1 : 1;
  const axis = new Vector3(turn.x, turn.y, turn.z).multiplyScalar(sign);
  const sine = axis.length();
  if (sine === 0) return turn;
  const angle = 2 * Math.atan2(sine, sign * turn.w);
  return new Quaternion().setFromAxisAngle(axis.divideScalar(sine), Math.min(Math.PI, factor * angle));
}
