// Made by scripts/tables from the descriptions of results in grapnel/: change those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// which bodies there are, how they hang together and what they look like.
export interface Scene {
  /** the format of this file */
  schema: SceneFormat;
  /** of Grapnel */
  version: string;
  /** what was simulated */
  scenario: SceneScenario;
  /** true if nothing ever moves but along the plane z = 0: all joints turn about z or slide along the plane; it holds the centre of mass of every body (with what is fixed to it) and is a principal plane of it; end-effectors and grasp points lie in it; initial velocities, momentum, gravity, orbit and loads keep to it (all to 1e-9) */
  planar: boolean;
  /** base first, then links (parents before children), then targets */
  bodies: SceneBody[];
  /** of the robot */
  end_effectors: SceneEndEffector[];
  /** of all targets */
  grasp_points: SceneGraspPoint[];
  /** of the scenario */
  grasps: SceneGrasp[];
  /** that shapes refer to */
  meshes: SceneMesh[];
  /** results of earlier versions lack it */
  limits: SceneLimits;
}
export const kScene: FieldNote[] = [
  ["schema","","the format of this file"],
  ["version","","of Grapnel"],
  ["scenario","","what was simulated"],
  ["planar","","true if nothing ever moves but along the plane z = 0: all joints turn about z or slide along the plane; it holds the centre of mass of every body (with what is fixed to it) and is a principal plane of it; end-effectors and grasp points lie in it; initial velocities, momentum, gravity, orbit and loads keep to it (all to 1e-9)"],
  ["bodies","","base first, then links (parents before children), then targets"],
  ["end_effectors","","of the robot"],
  ["grasp_points","","of all targets"],
  ["grasps","","of the scenario"],
  ["meshes","","that shapes refer to"],
  ["limits","","results of earlier versions lack it"],
];

export type SceneFormat = "grapnel-scene/2";

// what was simulated.
export interface SceneScenario {
  /** the scenario's name */
  name: string;
  /** as in summary.json */
  sha256: string;
}
export const kSceneScenario: FieldNote[] = [
  ["name","","the scenario's name"],
  ["sha256","","as in summary.json"],
];

// a rigid body.
export interface SceneBody {
  /** unique among base and links, and among targets; a target may be called like a link */
  name: string;
  /** `base`, `link`, `target`, `part` (of a target: a panel, or a piece of one) */
  kind: string;
  /** of links: base or an earlier link; of parts: their target; else null */
  parent: string | null;
  /** of links; else null */
  joint: SceneJoint | null;
  /** its motion in the time series: SERIES/position and SERIES/quaternion_wxyz are the pose of its frame in W. `base`, `links/NAME` (of parts too), `targets/NAME` */
  series: string;
  /** of the body [kg] */
  mass: number;
  /** centre of mass in its frame [m] */
  com: [number, number, number];
  /** xx, yy, zz, xy, xz, yz about the centre of mass, its axes [kg m^2] */
  inertia: [number, number, number, number, number, number];
  /** its shapes */
  geometry: SceneShape[];
}
export const kSceneBody: FieldNote[] = [
  ["name","","unique among base and links, and among targets; a target may be called like a link"],
  ["kind","","`base`, `link`, `target`, `part` (of a target: a panel, or a piece of one)"],
  ["parent","","of links: base or an earlier link; of parts: their target; else null"],
  ["joint","","of links; else null"],
  ["series","","its motion in the time series: SERIES/position and SERIES/quaternion_wxyz are the pose of its frame in W. `base`, `links/NAME` (of parts too), `targets/NAME`"],
  ["mass","kg","of the body"],
  ["com","m","centre of mass in its frame"],
  ["inertia","kg m^2","xx, yy, zz, xy, xz, yz about the centre of mass, its axes"],
  ["geometry","","its shapes"],
];

// how a link hangs on its parent.
export interface SceneJoint {
  /** of the joint */
  name: string;
  /** `revolute`, `continuous`, `prismatic`, `fixed` */
  type: string;
  /** unit, in the joint's frame [1] */
  axis: [number, number, number];
  /** of the joint's frame in the parent's at joint value 0 [m] */
  position: [number, number, number];
  /** likewise [1] */
  quaternion_wxyz: [number, number, number, number];
}
export const kSceneJoint: FieldNote[] = [
  ["name","","of the joint"],
  ["type","","`revolute`, `continuous`, `prismatic`, `fixed`"],
  ["axis","1","unit, in the joint's frame"],
  ["position","m","of the joint's frame in the parent's at joint value 0"],
  ["quaternion_wxyz","1","likewise"],
];

// a shape on a body.
export interface SceneShape {
  /** `box`, `cylinder`, `capsule`, `sphere`, `mesh` */
  shape: string;
  /** by shape, see below; of a mesh what vertices are multiplied with [m] */
  size: [number, number, number];
  /** of the shape's frame in the body's [m] */
  position: [number, number, number];
  /** of the shape's frame in the body's [1] */
  quaternion_wxyz: [number, number, number, number];
  /** of shape `mesh`: index into `meshes` [1] */
  mesh?: number;
}
export const kSceneShape: FieldNote[] = [
  ["shape","","`box`, `cylinder`, `capsule`, `sphere`, `mesh`"],
  ["size","m","by shape, see below; of a mesh what vertices are multiplied with"],
  ["position","m","of the shape's frame in the body's"],
  ["quaternion_wxyz","1","of the shape's frame in the body's"],
  ["mesh","1","of shape `mesh`: index into `meshes`"],
];

// an end-effector on a body of the robot.
export interface SceneEndEffector {
  /** of the end-effector */
  name: string;
  /** of the robot */
  body: string;
  /** in that body's frame [m] */
  position: [number, number, number];
  /** in that body's frame [1] */
  quaternion_wxyz: [number, number, number, number];
}
export const kSceneEndEffector: FieldNote[] = [
  ["name","","of the end-effector"],
  ["body","","of the robot"],
  ["position","m","in that body's frame"],
  ["quaternion_wxyz","1","in that body's frame"],
];

// where a target may be grasped.
export interface SceneGraspPoint {
  /** that it is on */
  target: string;
  /** of the grasp point */
  name: string;
  /** in the target's frame [m] */
  position: [number, number, number];
  /** unit, in the target's frame; null: none is given [1] */
  approach_direction: [number, number, number] | null;
}
export const kSceneGraspPoint: FieldNote[] = [
  ["target","","that it is on"],
  ["name","","of the grasp point"],
  ["position","m","in the target's frame"],
  ["approach_direction","1","unit, in the target's frame; null: none is given"],
];

// what is to meet.
export interface SceneGrasp {
  /** that grasps */
  end_effector: string;
  /** that is grasped */
  target: string;
  /** of the target */
  grasp_point: string;
  /** `rigid`, `hinge`, `point`, or `contact` for what is only touched */
  model: string;
}
export const kSceneGrasp: FieldNote[] = [
  ["end_effector","","that grasps"],
  ["target","","that is grasped"],
  ["grasp_point","","of the target"],
  ["model","","`rigid`, `hinge`, `point`, or `contact` for what is only touched"],
];

// a triangle mesh in its own frame.
export interface SceneMesh {
  /** of the file */
  name: string;
  /** x, y, z in turn, in the file's unit: the size of a shape makes them metres [1] */
  vertices: number[];
  /** three vertex numbers in turn, from 0 [1] */
  triangles: number[];
}
export const kSceneMesh: FieldNote[] = [
  ["name","","of the file"],
  ["vertices","1","x, y, z in turn, in the file's unit: the size of a shape makes them metres"],
  ["triangles","1","three vertex numbers in turn, from 0"],
];

// lines in plots.
export interface SceneLimits {
  /** of end-effectors with an envelope */
  grasps: SceneGraspLimits[];
  /** the distance that bodies are to keep; null: it is not watched [m] */
  clearance: number | null;
}
export const kSceneLimits: FieldNote[] = [
  ["grasps","","of end-effectors with an envelope"],
  ["clearance","m","the distance that bodies are to keep; null: it is not watched"],
];

// what a grasp can close on.
export interface SceneGraspLimits {
  /** that has an envelope */
  end_effector: string;
  /** largest distance from the grasp point; null: any [m] */
  position: number | null;
  /** largest relative speed; null: any [m/s] */
  velocity: number | null;
}
export const kSceneGraspLimits: FieldNote[] = [
  ["end_effector","","that has an envelope"],
  ["position","m","largest distance from the grasp point; null: any"],
  ["velocity","m/s","largest relative speed; null: any"],
];
