// The impacts of a run, from its summary: what is marked on the track and drawn as arrows.
import type { Run } from "../run";

export interface ImpactGrasp {
  endEffector: string;
  target: string;
  point: [number, number, number]; // in W [m]
  impulse: [number, number, number]; // on the robot, in W [N s]
}

export interface Impact {
  time: number; // [s]
  duration: number; // during which it is resolved in time; 0: it takes none
  grasps: ImpactGrasp[];
}

export function impactsOf(run: Run): Impact[] {
  const summary = run.summary ?? {};
  const all = [summary.impact, ...(Array.isArray(summary.later_impacts) ? summary.later_impacts : [])];
  return all
    .filter((one) => one && Number.isFinite(one.time))
    .map((one) => ({
      time: one.time,
      duration: one.law === "compliant" && Number.isFinite(one.duration) ? one.duration : 0,
      grasps: (Array.isArray(one.grasps) ? one.grasps : [])
        .filter((g: any) => isVector(g?.contact_point) && isVector(g?.impulse))
        .map((g: any) => ({
          endEffector: String(g.end_effector),
          target: String(g.target),
          point: g.contact_point,
          impulse: g.impulse,
        })),
    }));
}

function isVector(value: unknown): boolean {
  return Array.isArray(value) && value.length === 3 && value.every((x) => Number.isFinite(x));
}
