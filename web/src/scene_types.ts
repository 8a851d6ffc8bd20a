// Made by scripts/tables from the descriptions of results in grapnel/; edit those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// bodies of the scenario, their tree, and their shapes.
export interface Scene {
  /** format of this file */
  schema: SceneFormat;
  /** version of Grapnel */
  version: string;
  /** the simulated scenario */
  scenario: SceneScenario;
  /** true if all motion stays in the plane z = 0: all joints turn about z or slide in the plane; the plane contains the centre of mass of every body (with what is fixed to it) and is a principal plane of that body; end-effectors and grasp points lie in it; initial velocities, momentum, gravity, orbit and loads lie in it (all to 1e-9) */
  planar: boolean;
  /** base first, then links (parents before children), then targets */
  bodies: SceneBody[];
  /** end-effectors of the robot */
  end_effectors: SceneEndEffector[];
  /** grasp points of all targets */
  grasp_points: SceneGraspPoint[];
  /** grasps of the scenario */
  grasps: SceneGrasp[];
  /** meshes that shapes refer to */
  meshes: SceneMesh[];
  /** absent in results of earlier versions */
  limits: SceneLimits;
  /** bodies fixed in W; absent in results of earlier versions */
  obstacles: SceneObstacle[];
  /** wheels, gyros and thrusters; absent in results of earlier versions */
  actuators: SceneActuator[];
  /** whose orbit W follows; null: no orbit. Absent in results of earlier versions */
  central_body: SceneCentralBody | null;
}
export const kScene: FieldNote[] = [
  ["schema","","format of this file"],
  ["version","","version of Grapnel"],
  ["scenario","","the simulated scenario"],
  ["planar","","true if all motion stays in the plane z = 0: all joints turn about z or slide in the plane; the plane contains the centre of mass of every body (with what is fixed to it) and is a principal plane of that body; end-effectors and grasp points lie in it; initial velocities, momentum, gravity, orbit and loads lie in it (all to 1e-9)"],
  ["bodies","","base first, then links (parents before children), then targets"],
  ["end_effectors","","end-effectors of the robot"],
  ["grasp_points","","grasp points of all targets"],
  ["grasps","","grasps of the scenario"],
  ["meshes","","meshes that shapes refer to"],
  ["limits","","absent in results of earlier versions"],
  ["obstacles","","bodies fixed in W; absent in results of earlier versions"],
  ["actuators","","wheels, gyros and thrusters; absent in results of earlier versions"],
  ["central_body","","whose orbit W follows; null: no orbit. Absent in results of earlier versions"],
];

export type SceneFormat = "grapnel-scene/2";

// the simulated scenario.
export interface SceneScenario {
  /** name of the scenario */
  name: string;
  /** as in summary.json */
  sha256: string;
}
export const kSceneScenario: FieldNote[] = [
  ["name","","name of the scenario"],
  ["sha256","","as in summary.json"],
];

// a rigid body.
export interface SceneBody {
  /** name, unique among base and links, and among targets; a target may have the name of a link */
  name: string;
  /** `base`, `link`, `target`, `part` (of a target: a panel, or a segment of one) */
  kind: string;
  /** for links: base or an earlier link; for parts: their target; else null */
  parent: string | null;
  /** joint of a link; else null */
  joint: SceneJoint | null;
  /** name of its motion in the time series: SERIES/position and SERIES/quaternion_wxyz are the pose of its frame in W. `base`, `links/NAME` (for parts too), `targets/NAME` */
  series: string;
  /** mass of the body [kg] */
  mass: number;
  /** centre of mass in the body's frame [m] */
  com: [number, number, number];
  /** xx, yy, zz, xy, xz, yz about the centre of mass, its axes [kg m^2] */
  inertia: [number, number, number, number, number, number];
  /** shapes of the body */
  geometry: SceneShape[];
}
export const kSceneBody: FieldNote[] = [
  ["name","","name, unique among base and links, and among targets; a target may have the name of a link"],
  ["kind","","`base`, `link`, `target`, `part` (of a target: a panel, or a segment of one)"],
  ["parent","","for links: base or an earlier link; for parts: their target; else null"],
  ["joint","","joint of a link; else null"],
  ["series","","name of its motion in the time series: SERIES/position and SERIES/quaternion_wxyz are the pose of its frame in W. `base`, `links/NAME` (for parts too), `targets/NAME`"],
  ["mass","kg","mass of the body"],
  ["com","m","centre of mass in the body's frame"],
  ["inertia","kg m^2","xx, yy, zz, xy, xz, yz about the centre of mass, its axes"],
  ["geometry","","shapes of the body"],
];

// the joint between a link and its parent.
export interface SceneJoint {
  /** name of the joint */
  name: string;
  /** `revolute`, `continuous`, `prismatic`, `fixed` */
  type: string;
  /** unit axis in the joint's frame [1] */
  axis: [number, number, number];
  /** of the joint's frame in the parent's at joint value 0 [m] */
  position: [number, number, number];
  /** likewise [1] */
  quaternion_wxyz: [number, number, number, number];
}
export const kSceneJoint: FieldNote[] = [
  ["name","","name of the joint"],
  ["type","","`revolute`, `continuous`, `prismatic`, `fixed`"],
  ["axis","1","unit axis in the joint's frame"],
  ["position","m","of the joint's frame in the parent's at joint value 0"],
  ["quaternion_wxyz","1","likewise"],
];

// a shape on a body.
export interface SceneShape {
  /** `box`, `cylinder`, `capsule`, `sphere`, `mesh` */
  shape: string;
  /** dimensions by shape, see below; for a mesh the scale factors of its vertices [m] */
  size: [number, number, number];
  /** origin of the shape's frame in the body's frame [m] */
  position: [number, number, number];
  /** orientation of the shape's frame in the body's frame [1] */
  quaternion_wxyz: [number, number, number, number];
  /** index into `meshes`, for shape `mesh` [1] */
  mesh?: number;
}
export const kSceneShape: FieldNote[] = [
  ["shape","","`box`, `cylinder`, `capsule`, `sphere`, `mesh`"],
  ["size","m","dimensions by shape, see below; for a mesh the scale factors of its vertices"],
  ["position","m","origin of the shape's frame in the body's frame"],
  ["quaternion_wxyz","1","orientation of the shape's frame in the body's frame"],
  ["mesh","1","index into `meshes`, for shape `mesh`"],
];

// an end-effector on a body of the robot.
export interface SceneEndEffector {
  /** name of the end-effector */
  name: string;
  /** body of the robot */
  body: string;
  /** position in that body's frame [m] */
  position: [number, number, number];
  /** orientation in that body's frame [1] */
  quaternion_wxyz: [number, number, number, number];
}
export const kSceneEndEffector: FieldNote[] = [
  ["name","","name of the end-effector"],
  ["body","","body of the robot"],
  ["position","m","position in that body's frame"],
  ["quaternion_wxyz","1","orientation in that body's frame"],
];

// a grasp point of a target.
export interface SceneGraspPoint {
  /** target of the grasp point */
  target: string;
  /** name of the grasp point */
  name: string;
  /** position in the target's frame [m] */
  position: [number, number, number];
  /** unit vector in the target's frame; null: not given [1] */
  approach_direction: [number, number, number] | null;
}
export const kSceneGraspPoint: FieldNote[] = [
  ["target","","target of the grasp point"],
  ["name","","name of the grasp point"],
  ["position","m","position in the target's frame"],
  ["approach_direction","1","unit vector in the target's frame; null: not given"],
];

// a grasp or contact of the scenario.
export interface SceneGrasp {
  /** end-effector of the grasp */
  end_effector: string;
  /** target of the grasp */
  target: string;
  /** grasp point on the target */
  grasp_point: string;
  /** `rigid`, `hinge`, `point`, or `contact` for a contact without a grasp */
  model: string;
}
export const kSceneGrasp: FieldNote[] = [
  ["end_effector","","end-effector of the grasp"],
  ["target","","target of the grasp"],
  ["grasp_point","","grasp point on the target"],
  ["model","","`rigid`, `hinge`, `point`, or `contact` for a contact without a grasp"],
];

// a triangle mesh in its own frame.
export interface SceneMesh {
  /** name of the mesh file */
  name: string;
  /** x, y, z of each vertex, in the file's unit; the size of a shape converts to metres [1] */
  vertices: number[];
  /** three vertex indices per triangle, from 0 [1] */
  triangles: number[];
}
export const kSceneMesh: FieldNote[] = [
  ["name","","name of the mesh file"],
  ["vertices","1","x, y, z of each vertex, in the file's unit; the size of a shape converts to metres"],
  ["triangles","1","three vertex indices per triangle, from 0"],
];

// limits shown in plots.
export interface SceneLimits {
  /** limits of end-effectors with an envelope */
  grasps: SceneGraspLimits[];
  /** required clearance between bodies; null: not monitored [m] */
  clearance: number | null;
  /** limits of the joints that have any; absent in results of earlier versions */
  joints: SceneJointLimits[];
}
export const kSceneLimits: FieldNote[] = [
  ["grasps","","limits of end-effectors with an envelope"],
  ["clearance","m","required clearance between bodies; null: not monitored"],
  ["joints","","limits of the joints that have any; absent in results of earlier versions"],
];

// envelope of a grasp.
export interface SceneGraspLimits {
  /** end-effector with the envelope */
  end_effector: string;
  /** largest distance from the grasp point; null: no limit [m] */
  position: number | null;
  /** largest relative speed; null: no limit [m/s] */
  velocity: number | null;
}
export const kSceneGraspLimits: FieldNote[] = [
  ["end_effector","","end-effector with the envelope"],
  ["position","m","largest distance from the grasp point; null: no limit"],
  ["velocity","m/s","largest relative speed; null: no limit"],
];

// limits of a joint.
export interface SceneJointLimits {
  /** name of the joint */
  joint: string;
  /** smallest position; null: no limit [rad or m] */
  lower: number | null;
  /** largest position; null: no limit [rad or m] */
  upper: number | null;
  /** largest rate in both directions; null: no limit [rad/s or m/s] */
  rate: number | null;
  /** largest effort in both directions; null: no limit [N m or N] */
  effort: number | null;
}
export const kSceneJointLimits: FieldNote[] = [
  ["joint","","name of the joint"],
  ["lower","rad or m","smallest position; null: no limit"],
  ["upper","rad or m","largest position; null: no limit"],
  ["rate","rad/s or m/s","largest rate in both directions; null: no limit"],
  ["effort","N m or N","largest effort in both directions; null: no limit"],
];

// a body fixed in W that others may touch.
export interface SceneObstacle {
  /** name of the obstacle */
  name: string;
  /** origin of its frame in W [m] */
  position: [number, number, number];
  /** orientation of its frame in W [1] */
  quaternion_wxyz: [number, number, number, number];
  /** true: all points with z <= 0 in its frame */
  half_space: boolean;
  /** its shapes, in its frame; empty for a half-space */
  geometry: SceneShape[];
}
export const kSceneObstacle: FieldNote[] = [
  ["name","","name of the obstacle"],
  ["position","m","origin of its frame in W"],
  ["quaternion_wxyz","1","orientation of its frame in W"],
  ["half_space","","true: all points with z <= 0 in its frame"],
  ["geometry","","its shapes, in its frame; empty for a half-space"],
];

// a wheel, gyro or thruster of the base.
export interface SceneActuator {
  /** name of the actuator */
  name: string;
  /** `wheel`, `gyro`, `thruster` */
  kind: string;
  /** of a thruster, in the base's frame; null: a wheel or gyro [m] */
  position: [number, number, number] | null;
  /** unit axis of a wheel, of a gimbal, or of a thruster's force, in the base's frame [1] */
  axis: [number, number, number];
  /** of a gyro: unit axis of the rotor with the gimbal at zero; else null [1] */
  spin_axis: [number, number, number] | null;
  /** largest rate of a wheel or gimbal, force of a thruster; null: no limit [rad/s or N] */
  limit: number | null;
}
export const kSceneActuator: FieldNote[] = [
  ["name","","name of the actuator"],
  ["kind","","`wheel`, `gyro`, `thruster`"],
  ["position","m","of a thruster, in the base's frame; null: a wheel or gyro"],
  ["axis","1","unit axis of a wheel, of a gimbal, or of a thruster's force, in the base's frame"],
  ["spin_axis","1","of a gyro: unit axis of the rotor with the gimbal at zero; else null"],
  ["limit","rad/s or N","largest rate of a wheel or gimbal, force of a thruster; null: no limit"],
];

// the body whose orbit the frame W follows.
export interface SceneCentralBody {
  /** `earth`, `moon`, `mars` */
  name: string;
  /** equatorial radius; null: the scenario states a gravitational parameter [m] */
  radius: number | null;
}
export const kSceneCentralBody: FieldNote[] = [
  ["name","","`earth`, `moon`, `mars`"],
  ["radius","m","equatorial radius; null: the scenario states a gravitational parameter"],
];
