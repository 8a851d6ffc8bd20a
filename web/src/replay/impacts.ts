// The impacts of a run, from its summary: marked on the track and drawn as arrows.
import type { Vec3 } from "../data";
import type { Run } from "../run";

export interface ImpactGrasp {
  endEffector: string;
  target: string;
  point: [number, number, number]; // in W [m]
  impulse: [number, number, number]; // on the robot, in W [N s]
}

export interface Impact {
  time: number; // [s]
  duration: number; // of a compliant impact; 0: instantaneous
  grasps: ImpactGrasp[];
}

export function impactsOf(run: Run): Impact[] {
  const summary = run.summary ?? {};
  const all = [summary.impact, ...(Array.isArray(summary.later_impacts) ? summary.later_impacts : [])];
  return all.flatMap((one) => {
    const time = one?.time;
    if (!one || !isNumber(time)) return [];
    return {
      time,
      duration: one.law === "compliant" && isNumber(one.duration) ? one.duration : 0,
      grasps: (Array.isArray(one.grasps) ? one.grasps : []).flatMap((g) =>
        isVector(g?.contact_point) && isVector(g.impulse)
          ? { endEffector: String(g.end_effector), target: String(g.target), point: g.contact_point, impulse: g.impulse }
          : [],
      ),
    };
  });
}

function isNumber(value: unknown): value is number {
  return Number.isFinite(value);
}
function isVector(value: unknown): value is Vec3 {
  return Array.isArray(value) && value.length === 3 && value.every((x) => Number.isFinite(x));
}
