// Bending drawn larger than it is. Links that bend are recorded as straight pieces NAME, NAME:1, NAME:2 and so on, each hinged on the one before
// and parallel to it where nothing bends: what each is turned against the one before is multiplied, and whatever hangs on them goes along.
import { Quaternion, Vector3 } from "three";
import type { Run } from "../run";
import type { BodyView } from "./bodies";

interface Step {
  view: BodyView;
  on: BodyView; // what carries it
  bends: boolean;
  position: Vector3; // in the frame of what carries it
  turn: Quaternion;
}

export class Bending {
  private readonly steps: Step[] = [];

  constructor(run: Run, views: BodyView[]) {
    const pieces = piecesThatBend(run);
    const known = new Map<string, BodyView>();
    const moved = new Set<BodyView>();
    for (const view of views) {
      const bends = pieces.has(view.body.name);
      const on = view.track && known.get((bends ? pieceBefore(view.body.name) : view.body.parent) ?? "");
      known.set(view.body.name, view);
      if (!on) continue;
      if (!bends && !moved.has(on)) continue; // true: nothing on its way to the base bends
      this.steps.push({ view, on, bends, position: new Vector3(), turn: new Quaternion() });
      moved.add(view);
    }
  }

  get isThere(): boolean {
    return this.steps.length > 0;
  }

  // Moves bodies that stand where they are.
  apply(factor: number): void {
    if (factor === 1) return;
    for (const { view, on, position, turn } of this.steps) {
      const back = on.object.quaternion.clone().invert();
      position.copy(view.object.position).sub(on.object.position).applyQuaternion(back);
      turn.copy(back.multiply(view.object.quaternion));
    }
    for (const { view, on, bends, position, turn } of this.steps) {
      view.object.position.copy(position).applyQuaternion(on.object.quaternion).add(on.object.position);
      view.object.quaternion.copy(on.object.quaternion).multiply(bends ? times(turn, factor) : turn);
    }
  }
}

// The bodies that are hinged by bending or twisting on the piece before them, as the run's deflections name them: "arm:2z", or
// "target:satellite/panel:1y" of a target. A link that is merely called so has no deflection.
export function piecesThatBend(run: Run): Set<string> {
  const names = (run.series("elastic/deflection")?.components ?? []).flatMap((hinge) => /^(?:target:)?(.*:\d+)[xyz]$/.exec(hinge)?.[1] ?? []);
  return new Set(names);
}

// Of "arm:3" it is "arm:2", of "arm:1" it is "arm".
function pieceBefore(name: string): string {
  const colon = name.lastIndexOf(":");
  const number = Number(name.slice(colon + 1));
  return number > 1 ? `${name.slice(0, colon)}:${number - 1}` : name.slice(0, colon);
}

// The turn about the same axis by a multiple of its angle, at most half a turn.
function times(turn: Quaternion, factor: number): Quaternion {
  const sign = turn.w < 0 ? -1 : 1;
  const axis = new Vector3(turn.x, turn.y, turn.z).multiplyScalar(sign);
  const sine = axis.length();
  if (sine === 0) return turn;
  const angle = 2 * Math.atan2(sine, sign * turn.w);
  return new Quaternion().setFromAxisAngle(axis.divideScalar(sine), Math.min(Math.PI, factor * angle));
}
