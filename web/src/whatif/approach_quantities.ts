// Quantities of the approach: time to capture, and speed and direction at which end-effectors arrive. No DOM.
import type { Run } from "../run";
import type { SceneGrasp } from "../scene_types";
import { decade, direct, type Group, type Quantity } from "./groups";
import { isNumber, isVector, type Settings, type Vec3 } from "./settings";
import { dot, length, rotated, shortUnit, times, turned, unit } from "./vectors";

const kDegree = Math.PI / 180;

export function approachGroups(settings: Settings, base: Run): Group[] {
  if (settings.value("approach") === undefined) return [];
  const duration = settings.value("approach.duration");
  const time = isNumber(duration) && duration > 0 ? [direct("Approach", "Time to capture", "s", "approach.duration", duration, { ...decade(duration), low: duration / 4, high: duration * 4 })] : [];
  return [...time, ...straightIn(settings), ...arrivals(settings, base), ...directions(settings, base)];
}

function straightIn(settings: Settings): Group[] {
  if (settings.value("approach.straight_in") === undefined) return [];
  const speed = settings.value("approach.straight_in.final_speed") ?? 0;
  if (!isNumber(speed)) return [];
  return [direct("Approach", "Speed at contact", "m/s", "approach.straight_in.final_speed", speed, { low: 0, high: Math.max(0.05, 5 * speed) })];
}

// ---- Relative velocity at arrival: its size, and its direction by an angle ----

// Whether the final rates follow from the motion of the grasp points, to which the relative velocity is added.
function ratesFollow(settings: Settings): boolean {
  const has = (key: string): boolean => settings.value(`approach.${key}`) !== undefined;
  if (has("straight_in") || has("trajectory") || has("pieces")) return false;
  return settings.value("approach.final_rates.match") !== undefined || (has("plan") && !has("final_rates"));
}

function arrivals(settings: Settings, base: Run): Group[] {
  if (!ratesFollow(settings)) return [];
  return graspsOf(base).flatMap((grasp) => {
    const path = `grasps.${grasp.end_effector}.relative_velocity`;
    const given = settings.value(path) ?? [0, 0, 0];
    const closesAlone = ["closes_at", "closes_on_arrival", "closes_when_settled"].some((key) => settings.value(`grasps.${grasp.end_effector}.${key}`) !== undefined);
    const direction = isVector(given) ? (unit(given) ?? inwardNormal(base, grasp)) : null;
    return direction && isVector(given) && !closesAlone ? [arrival(grasp.end_effector, path, given, direction, targetAxis(base, grasp))] : [];
  });
}

function arrival(name: string, path: string, given: Vec3, direction: Vec3, axis: Vec3): Group {
  const speed = length(given);
  const keys = { speed: `speed ${path}`, angle: `angle ${path}` };
  const into = unit(given) ? "along the present direction" : "along the inward normal";
  const quantities: Quantity[] = [
    { key: keys.speed, name: `Speed at contact, ${name}`, unit: "m/s", base: speed, low: 0, high: Math.max(0.2, 4 * speed), log: false, note: `relative to the grasp point, ${into}` },
    { key: keys.angle, name: `Direction of the velocity, ${name}`, unit: "deg", base: 0, low: -90, high: 90, log: false, note: "rotation about the target's z axis" },
  ];
  return {
    title: "Approach",
    quantities,
    paths: [path],
    overrides: (values) => {
      const angle = ((values.get(keys.angle) as number | undefined) ?? 0) * kDegree;
      const size = (values.get(keys.speed) as number | undefined) ?? speed;
      return [{ path, value: times(angle === 0 ? direction : rotated(direction, axis, angle), size) }];
    },
    read: (value) => {
      if (!isVector(value)) return null;
      const along = dot(value, direction);
      return Math.abs(along - length(value)) <= 1e-12 * length(value) ? [[keys.speed, along]] : null;
    },
  };
}

// ---- Direction of the end-effector at the grasp ----

// Rotates the grasp point's approach direction. Points without one get it from the inward normal.
function directions(settings: Settings, base: Run): Group[] {
  if (settings.value("approach.plan") === undefined) return [];
  return graspsOf(base).flatMap((grasp) => {
    const point = base.scene!.grasp_points.find((one) => one.target === grasp.target && one.name === grasp.grasp_point);
    const shared = graspsOf(base).some((other) => other !== grasp && other.target === grasp.target && other.grasp_point === grasp.grasp_point);
    const given = point?.approach_direction ?? null;
    if (!point || shared || grasp.model === "contact") return [];
    const oriented = settings.value(`grasps.${grasp.end_effector}.orientation`) ?? (given ? "axis" : "free");
    const hasAxis = settings.value(`robot.end_effectors.${grasp.end_effector}.approach_axis`) !== undefined;
    const direction = given ? unit(given) : hasAxis ? localNormal(base, grasp) : null;
    if (!direction || (given ? oriented !== "axis" : oriented === "pose")) return [];
    return [approachAngle(grasp, direction, given !== null)];
  });
}

function approachAngle(grasp: SceneGrasp, direction: Vec3, given: boolean): Group {
  const path = `targets.${grasp.target}.grasp_points.${grasp.grasp_point}.approach_direction`;
  const orientation = `grasps.${grasp.end_effector}.orientation`;
  const axis: Vec3 = Math.abs(direction[2]) > 0.99 ? [0, 1, 0] : [0, 0, 1];
  const key = `angle ${path}`;
  const about = `about the target's ${axis[2] === 1 ? "z" : "y"} axis`;
  return {
    title: "Approach",
    quantities: [{ key, name: `Angle of approach, ${grasp.end_effector}`, unit: "deg", base: 0, low: -60, high: 60, log: false, note: given ? about : `${about}, from the inward normal; free in the base case` }],
    paths: given ? [path] : [path, orientation],
    overrides: (values) => [
      { path, value: rotated(direction, axis, ((values.get(key) as number | undefined) ?? 0) * kDegree) },
      ...(given ? [] : [{ path: orientation, value: "axis" }]),
    ],
  };
}

// ---- Geometry of the base case ----

function graspsOf(base: Run): SceneGrasp[] {
  return Array.isArray(base.scene?.grasps) ? base.scene.grasps : [];
}

// In the target's frame: from the grasp point to the centre of mass.
function localNormal(base: Run, grasp: SceneGrasp): Vec3 | null {
  const point = base.scene?.grasp_points.find((one) => one.target === grasp.target && one.name === grasp.grasp_point);
  if (!point) return null;
  if (point.approach_direction) return point.approach_direction;
  const body = base.scene!.bodies.find((one) => one.kind === "target" && one.name === grasp.target);
  return body ? unit(body.com.map((c, k) => c - point.position[k])) : null;
}

function inwardNormal(base: Run, grasp: SceneGrasp): Vec3 | null {
  const local = localNormal(base, grasp);
  const attitude = attitudeAtCapture(base, grasp.target);
  return local && attitude ? shortUnit(turned(local, attitude)) : null;
}

function targetAxis(base: Run, grasp: SceneGrasp): Vec3 {
  const attitude = attitudeAtCapture(base, grasp.target);
  return (attitude && shortUnit(turned([0, 0, 1], attitude))) ?? [0, 0, 1];
}

function attitudeAtCapture(base: Run, target: string): number[] | null {
  const body = base.scene?.bodies.find((one) => one.kind === "target" && one.name === target);
  const series = body && base.series(`${body.series}/quaternion_wxyz`);
  const time = base.summary.impact?.time ?? base.summary.approach?.end?.time;
  return series && typeof time === "number" ? base.at(series, base.locate(time)) : null;
}
