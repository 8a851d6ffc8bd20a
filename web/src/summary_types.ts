// Made by scripts/tables from the descriptions of results in grapnel/: change those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// what happened in one capture, in SI units and radians.
export interface Summary {
  /** the format of this file */
  schema: SummaryFormat;
  /** of Grapnel */
  version: string;
  /** what was simulated */
  scenario: ScenarioNamed;
  /** how the run ended */
  status: CaptureStatus;
  /** body, time and condition, if it failed; else empty */
  failure: string;
  /** for who reads the result */
  warnings: string[];
  /** absent without one */
  orbit?: OrbitReport;
  /** frequencies; absent where nothing bends */
  elastic?: Elastic[];
  /** absent where control is continuous */
  control?: ControlReport;
  /** readings against the truth; absent without sensors */
  sensors?: SensorReport[];
  /** absent without an approach */
  approach?: Approach;
  /** whether the grasps closed; absent without grasps */
  capture?: Capture;
  /** the first; absent without an impact */
  impact?: ImpactReport;
  /** of grasps that closed later, in the order of time; absent if there are none */
  later_impacts?: ImpactReport[];
  /** grasps that are released, in the order of time; absent if there are none */
  releases?: ReleaseReport[];
  /** absent without such motion */
  post_impact?: PostImpact;
  /** of a scenario in which nothing is captured; else absent */
  motion?: PostImpact;
  /** the largest loads of every phase; absent if nothing was loaded */
  loads?: PeakLoad[];
  /** reaction wheels; absent if there are none */
  wheels?: WheelReport[];
  /** control moment gyros; absent if there are none */
  gyros?: GyrosReport;
  /** per phase, of joints with sticking friction, stops or known motors; absent if there are none */
  joints?: JointReport[];
  /** joints that met their stops, the first hundred; absent if none did */
  stop_impacts?: StopImpact[];
  /** all of them [1] */
  stop_impact_count?: number;
  /** absent if there are none */
  thrusters?: ThrustersReport;
  /** actuators that were at their limits, the longest first; absent if none was */
  saturation?: SaturationReport[];
  /** of control loops, per phase of motion; absent where it was not observed */
  stability?: StabilityReport[];
  /** the one of `loads` with the least margin over all phases; absent where nothing is rated */
  worst_margin?: PeakLoad;
  /** absent where no two bodies have shapes */
  clearance?: Clearances;
  /** of joints and drives */
  limits: Limits;
  /** whether a robot could do this */
  feasibility: Feasibility;
  /** whether physics was kept */
  ledger: Ledger;
  /** per phase */
  cost: PhaseCost[];
}
export const kSummary: FieldNote[] = [
  ["schema","","the format of this file"],
  ["version","","of Grapnel"],
  ["scenario","","what was simulated"],
  ["status","","how the run ended"],
  ["failure","","body, time and condition, if it failed; else empty"],
  ["warnings","","for who reads the result"],
  ["orbit","","absent without one"],
  ["elastic","","frequencies; absent where nothing bends"],
  ["control","","absent where control is continuous"],
  ["sensors","","readings against the truth; absent without sensors"],
  ["approach","","absent without an approach"],
  ["capture","","whether the grasps closed; absent without grasps"],
  ["impact","","the first; absent without an impact"],
  ["later_impacts","","of grasps that closed later, in the order of time; absent if there are none"],
  ["releases","","grasps that are released, in the order of time; absent if there are none"],
  ["post_impact","","absent without such motion"],
  ["motion","","of a scenario in which nothing is captured; else absent"],
  ["loads","","the largest loads of every phase; absent if nothing was loaded"],
  ["wheels","","reaction wheels; absent if there are none"],
  ["gyros","","control moment gyros; absent if there are none"],
  ["joints","","per phase, of joints with sticking friction, stops or known motors; absent if there are none"],
  ["stop_impacts","","joints that met their stops, the first hundred; absent if none did"],
  ["stop_impact_count","1","all of them"],
  ["thrusters","","absent if there are none"],
  ["saturation","","actuators that were at their limits, the longest first; absent if none was"],
  ["stability","","of control loops, per phase of motion; absent where it was not observed"],
  ["worst_margin","","the one of `loads` with the least margin over all phases; absent where nothing is rated"],
  ["clearance","","absent where no two bodies have shapes"],
  ["limits","","of joints and drives"],
  ["feasibility","","whether a robot could do this"],
  ["ledger","","whether physics was kept"],
  ["cost","","per phase"],
];

export type SummaryFormat = "grapnel-summary/2";

// what was simulated.
export interface ScenarioNamed {
  /** the scenario's name */
  name: string;
  /** of the bytes of the scenario, all files it includes, and overrides */
  sha256: string;
}
export const kScenarioNamed: FieldNote[] = [
  ["name","","the scenario's name"],
  ["sha256","","of the bytes of the scenario, all files it includes, and overrides"],
];

export type CaptureStatus = "not_run" | "completed" | "failed";

// the orbit with which W falls.
export interface OrbitReport {
  /** the central one; `own` with a gravitational parameter of the scenario's */
  body: string;
  /** from its centre to the reference point, W's origin, at t = 0 [m] */
  radius: number;
  /** at which radial and along-track turn in W, at t = 0 [rad/s] */
  rate: number;
  /** of the orbit [s] */
  period: number;
}
export const kOrbitReport: FieldNote[] = [
  ["body","","the central one; `own` with a gravitational parameter of the scenario's"],
  ["radius","m","from its centre to the reference point, W's origin, at t = 0"],
  ["rate","rad/s","at which radial and along-track turn in W, at t = 0"],
  ["period","s","of the orbit"],
];

// small vibrations about the posture at an instant; loops count nothing.
export interface Elastic {
  /** `start`, or `captured`: with the targets that grasps hold */
  at: string;
  /** when the posture was this [s] */
  time: number;
  /** that stand for what bends [1] */
  springs: number;
  /** frequency of the fastest mode, base and joints free: it limits the steps [Hz] */
  fastest: number;
  /** the slowest, up to 20 */
  modes: ElasticMode[];
}
export const kElastic: FieldNote[] = [
  ["at","","`start`, or `captured`: with the targets that grasps hold"],
  ["time","s","when the posture was this"],
  ["springs","1","that stand for what bends"],
  ["fastest","Hz","frequency of the fastest mode, base and joints free: it limits the steps"],
  ["modes","","the slowest, up to 20"],
];

// a mode of vibration, by its place from the slowest on.
export interface ElasticMode {
  /** frequency with the base held and the joints braked; null: there are no more modes [Hz] */
  held: number | null;
  /** with the base free and the joints braked [Hz] */
  braked: number | null;
  /** with base and joints free [Hz] */
  free: number | null;
  /** of `held` [1] */
  damping_ratio: number;
  /** of `held`, in the directions of the base's axes; zero for a base that is fixed [kg] */
  effective_mass: [number, number, number];
  /** of `held`, about the base's axes; likewise [kg m^2] */
  effective_inertia: [number, number, number];
}
export const kElasticMode: FieldNote[] = [
  ["held","Hz","frequency with the base held and the joints braked; null: there are no more modes"],
  ["braked","Hz","with the base free and the joints braked"],
  ["free","Hz","with base and joints free"],
  ["damping_ratio","1","of `held`"],
  ["effective_mass","kg","of `held`, in the directions of the base's axes; zero for a base that is fixed"],
  ["effective_inertia","kg m^2","of `held`, about the base's axes; likewise"],
];

// the on-board computer that samples the control.
export interface ControlReport {
  /** between samples [s] */
  period: number;
  /** from a sample to the command that follows from it [s] */
  delay: number;
  /** the controller: a library or an FMU as the scenario names it, or the name of a class in Python; empty without one */
  plugin: string;
  /** of its bytes, of a class in Python of its source; empty without one */
  plugin_sha256: string;
}
export const kControlReport: FieldNote[] = [
  ["period","s","between samples"],
  ["delay","s","from a sample to the command that follows from it"],
  ["plugin","","the controller: a library or an FMU as the scenario names it, or the name of a class in Python; empty without one"],
  ["plugin_sha256","","of its bytes, of a class in Python of its source; empty without one"],
];

// readings of one sensor against the truth, at the instants of reading.
export interface SensorReport {
  /** as `joint position`, `gyro` or `force left` */
  sensor: string;
  /** of the errors; rad stands for m where a joint is prismatic */
  unit: string;
  /** between readings [s] */
  sample_time: number;
  /** numbers read: instants times channels times components [1] */
  readings: number;
  /** mean of reading less truth [`unit`] */
  mean_error: number;
  /** root of its mean square [`unit`] */
  rms_error: number;
  /** largest of either sign [`unit`] */
  largest_error: number;
}
export const kSensorReport: FieldNote[] = [
  ["sensor","","as `joint position`, `gyro` or `force left`"],
  ["unit","","of the errors; rad stands for m where a joint is prismatic"],
  ["sample_time","s","between readings"],
  ["readings","1","numbers read: instants times channels times components"],
  ["mean_error","`unit`","mean of reading less truth"],
  ["rms_error","`unit`","root of its mean square"],
  ["largest_error","`unit`","largest of either sign"],
];

// the motion up to the capture.
export interface Approach {
  /** at the phase's first instant */
  start?: PhaseEnd;
  /** at its last instant */
  end?: PhaseEnd;
  /** joint rates the approach aimed at, in the order of `joints.names`; absent without a plan [rad/s or m/s] */
  planned_final_rates?: number[];
  /** of the joints' motion */
  plan?: PlanReport;
  /** plans and the estimates they rest on; absent where targets are known and planned for once */
  navigation?: NavigationReport[];
  /** absent without it */
  impedance?: ImpedanceReport;
}
export const kApproach: FieldNote[] = [
  ["start","","at the phase's first instant"],
  ["end","","at its last instant"],
  ["planned_final_rates","rad/s or m/s","joint rates the approach aimed at, in the order of `joints.names`; absent without a plan"],
  ["plan","","of the joints' motion"],
  ["navigation","","plans and the estimates they rest on; absent where targets are known and planned for once"],
  ["impedance","","absent without it"],
];

// the system's state where a phase begins or ends.
export interface PhaseEnd {
  /** of this state [s] */
  time: number;
  /** of the robot */
  base: BodyMotion;
  /** of the robot */
  joints: JointMotion;
  /** of the robot */
  end_effectors: EndEffectorMotion[];
  /** the free bodies that may be grasped */
  targets: BodyMotion[];
}
export const kPhaseEnd: FieldNote[] = [
  ["time","s","of this state"],
  ["base","","of the robot"],
  ["joints","","of the robot"],
  ["end_effectors","","of the robot"],
  ["targets","","the free bodies that may be grasped"],
];

// motion of a free body's frame at one instant.
export interface BodyMotion {
  /** of the body */
  name: string;
  /** of the origin of the body's frame, in W [m] */
  position: [number, number, number];
  /** turns the body's axes into W's [1] */
  quaternion_wxyz: [number, number, number, number];
  /** in W [rad/s] */
  angular_velocity: [number, number, number];
  /** of the origin of the body's frame, in W [m/s] */
  velocity: [number, number, number];
}
export const kBodyMotion: FieldNote[] = [
  ["name","","of the body"],
  ["position","m","of the origin of the body's frame, in W"],
  ["quaternion_wxyz","1","turns the body's axes into W's"],
  ["angular_velocity","rad/s","in W"],
  ["velocity","m/s","of the origin of the body's frame, in W"],
];

// the robot's joints at one instant.
export interface JointMotion {
  /** of the joints */
  names: string[];
  /** in the order of `names`; m of prismatic joints [rad or m] */
  position: number[];
  /** likewise [rad/s or m/s] */
  velocity: number[];
}
export const kJointMotion: FieldNote[] = [
  ["names","","of the joints"],
  ["position","rad or m","in the order of `names`; m of prismatic joints"],
  ["velocity","rad/s or m/s","likewise"],
];

// an end-effector, and how it stands to the grasp point it is to meet.
export interface EndEffectorMotion {
  /** of the end-effector */
  name: string;
  /** of the origin of the end-effector's frame, in W [m] */
  position: [number, number, number];
  /** of that origin, in W [m/s] */
  velocity: [number, number, number];
  /** in W [rad/s] */
  angular_velocity: [number, number, number];
  /** what it is to grasp; this and what follows are absent if it grasps nothing */
  target?: string;
  /** on the target */
  grasp_point?: string;
  /** from the end-effector's origin to the grasp point [m] */
  miss_distance?: number;
  /** end-effector minus grasp point, in W [m/s] */
  relative_velocity?: [number, number, number];
  /** end-effector minus target, in W [rad/s] */
  relative_angular_velocity?: [number, number, number];
}
export const kEndEffectorMotion: FieldNote[] = [
  ["name","","of the end-effector"],
  ["position","m","of the origin of the end-effector's frame, in W"],
  ["velocity","m/s","of that origin, in W"],
  ["angular_velocity","rad/s","in W"],
  ["target","","what it is to grasp; this and what follows are absent if it grasps nothing"],
  ["grasp_point","","on the target"],
  ["miss_distance","m","from the end-effector's origin to the grasp point"],
  ["relative_velocity","m/s","end-effector minus grasp point, in W"],
  ["relative_angular_velocity","rad/s","end-effector minus target, in W"],
];

// where the joints were to go, and how that was found.
export interface PlanReport {
  /** names */
  joints: string[];
  /** the reference at the capture; of the closest attempt if planning failed [rad or m] */
  final_position: number[];
  /** likewise [rad/s or m/s] */
  final_rates: number[];
  /** largest component of the demanded final motion that no joint rates give [m/s or rad/s] */
  unmet_rate: number;
  /** of the base's motion, while planning [1] */
  rhs_evaluations: number;
  /** whether there is a solution; this and what follows down to `smallest_singular_value` only where final values were looked for */
  found?: boolean;
  /** what was made least */
  objective?: string;
  /** how small that became [1] */
  objective_value?: number | null;
  /** of which it is the weighted sum */
  terms?: PlanTerm[];
  /** per end-effector */
  miss?: PlannedMiss[];
  /** initial guesses tried [1] */
  starts?: number;
  /** how many of them led to a solution [1] */
  solutions?: number;
  /** how many of these differ by more than 1e-3 rad or m [1] */
  distinct_solutions?: number;
  /** Newton steps over all of them [1] */
  iterations?: number;
  /** of the goals' error against final joint values; small: near a singularity [m/rad] */
  smallest_singular_value?: number | null;
  /** the last piece, where the scenario asks for one */
  straight_in?: StraightInReport;
  /** of the last segment that was planned, where its way is looked at */
  way?: PlannedPath;
  /** times of capture, where the scenario has one looked for */
  window?: WindowReport;
}
export const kPlanReport: FieldNote[] = [
  ["joints","","names"],
  ["final_position","rad or m","the reference at the capture; of the closest attempt if planning failed"],
  ["final_rates","rad/s or m/s","likewise"],
  ["unmet_rate","m/s or rad/s","largest component of the demanded final motion that no joint rates give"],
  ["rhs_evaluations","1","of the base's motion, while planning"],
  ["found","","whether there is a solution; this and what follows down to `smallest_singular_value` only where final values were looked for"],
  ["objective","","what was made least"],
  ["objective_value","1","how small that became"],
  ["terms","","of which it is the weighted sum"],
  ["miss","","per end-effector"],
  ["starts","1","initial guesses tried"],
  ["solutions","1","how many of them led to a solution"],
  ["distinct_solutions","1","how many of these differ by more than 1e-3 rad or m"],
  ["iterations","1","Newton steps over all of them"],
  ["smallest_singular_value","m/rad","of the goals' error against final joint values; small: near a singularity"],
  ["straight_in","","the last piece, where the scenario asks for one"],
  ["way","","of the last segment that was planned, where its way is looked at"],
  ["window","","times of capture, where the scenario has one looked for"],
];

// one of the terms that a plan's objective is the sum of.
export interface PlanTerm {
  /** as in approach.plan.weights */
  name: string;
  /** in the reciprocal of the value's unit [1] */
  weight: number;
  /** [rad^2; effort: (N m)^2; impulse: J; clearance: m; limits, manipulability, impulse_index, wheel_momentum: 1] [1] */
  value: number | null;
}
export const kPlanTerm: FieldNote[] = [
  ["name","","as in approach.plan.weights"],
  ["weight","1","in the reciprocal of the value's unit"],
  ["value","1","[rad^2; effort: (N m)^2; impulse: J; clearance: m; limits, manipulability, impulse_index, wheel_momentum: 1]"],
];

// how far an end-effector stays from its goal when the plan is followed exactly, in flight with everything that acts where planning corrects by flights; where nothing was found, in the closest attempt.
export interface PlannedMiss {
  /** whose miss it is */
  end_effector: string;
  /** from its goal; null: unknown [m] */
  distance: number | null;
  /** from what the grasp's orientation asks for; null: unknown [rad] */
  angle: number | null;
  /** of a piece straight in: how far the relative velocity in the end is from final_speed along the approach direction [m/s] */
  velocity?: number;
  /** likewise the relative angular velocity from zero, of what the grasp's orientation and `roll` ask for [rad/s] */
  angular_velocity?: number;
}
export const kPlannedMiss: FieldNote[] = [
  ["end_effector","","whose miss it is"],
  ["distance","m","from its goal; null: unknown"],
  ["angle","rad","from what the grasp's orientation asks for; null: unknown"],
  ["velocity","m/s","of a piece straight in: how far the relative velocity in the end is from final_speed along the approach direction"],
  ["angular_velocity","rad/s","likewise the relative angular velocity from zero, of what the grasp's orientation and `roll` ask for"],
];

// the last piece of an approach, on a straight line to the grasp point.
export interface StraightInReport {
  /** of the piece straight in [s] */
  begin: number;
  /** distance from the grasp point at which it begins [m] */
  stand_off: number;
  /** at which it meets the grasp point [m/s] */
  final_speed: number;
  /** of the generalized Jacobian's rows in use, over the piece [m/rad] */
  smallest_singular_value: number | null;
  /** whether it came so near a singularity that rates were damped */
  damped: boolean;
  /** when rates were damped [s] */
  damped_interval: [number, number];
  /** largest component of the demanded motion that was missed, where it was damped or impossible [m/s or rad/s] */
  unmet: number;
  /** when that was [s] */
  unmet_time: number;
  /** of the series that keep the joint motion [rad or m] */
  fit_error: number;
  /** added to the rates of least norm to keep limits on the way, moving no end-effector: root mean square over the piece of the joints' rates together [rad/s or m/s] */
  self_motion: number;
}
export const kStraightInReport: FieldNote[] = [
  ["begin","s","of the piece straight in"],
  ["stand_off","m","distance from the grasp point at which it begins"],
  ["final_speed","m/s","at which it meets the grasp point"],
  ["smallest_singular_value","m/rad","of the generalized Jacobian's rows in use, over the piece"],
  ["damped","","whether it came so near a singularity that rates were damped"],
  ["damped_interval","s","when rates were damped"],
  ["unmet","m/s or rad/s","largest component of the demanded motion that was missed, where it was damped or impossible"],
  ["unmet_time","s","when that was"],
  ["fit_error","rad or m","of the series that keep the joint motion"],
  ["self_motion","rad/s or m/s","added to the rates of least norm to keep limits on the way, moving no end-effector: root mean square over the piece of the joints' rates together"],
];

// what the last segment that was planned does on its way, the joints following it exactly.
export interface PlannedPath {
  /** inner knots of the joints' splines; 0: one polynomial [1] */
  knots: number;
  /** least distance of a joint from a limit of its position; negative: beyond it [rad or m] */
  position_margin?: number;
  /** largest joint rate over its limit [1] */
  rate_share?: number;
  /** largest joint effort over its limit; only where it was looked at [1] */
  effort_share?: number;
  /** least distance of two bodies, a hand near its grasp point and its target left out; only where it was looked at [m] */
  clearance?: number;
  /** they are this one */
  body_a: string;
  /** and this one */
  body_b: string;
  /** when they are so near [s] */
  clearance_time: number;
  /** whether it is the way of a base that keeps its attitude exactly, as attitude control is taken to have it */
  attitude_kept: boolean;
  /** largest turn of the base from its initial attitude; where the attitude is kept, of the attitude that it is to have [rad] */
  base_turn: number;
  /** what wheels are to hold; empty: it was not looked at */
  wheels: WheelShare[];
}
export const kPlannedWay: FieldNote[] = [
  ["knots","1","inner knots of the joints' splines; 0: one polynomial"],
  ["position_margin","rad or m","least distance of a joint from a limit of its position; negative: beyond it"],
  ["rate_share","1","largest joint rate over its limit"],
  ["effort_share","1","largest joint effort over its limit; only where it was looked at"],
  ["clearance","m","least distance of two bodies, a hand near its grasp point and its target left out; only where it was looked at"],
  ["body_a","","they are this one"],
  ["body_b","","and this one"],
  ["clearance_time","s","when they are so near"],
  ["attitude_kept","","whether it is the way of a base that keeps its attitude exactly, as attitude control is taken to have it"],
  ["base_turn","rad","largest turn of the base from its initial attitude; where the attitude is kept, of the attitude that it is to have"],
  ["wheels","","what wheels are to hold; empty: it was not looked at"],
];

// what a wheel is to hold on a planned way.
export interface WheelShare {
  /** of the robot */
  wheel: string;
  /** largest momentum on the way, over the most that it can hold, while the wheels keep the base's attitude exactly [1] */
  share: number;
}
export const kWheelShare: FieldNote[] = [
  ["wheel","","of the robot"],
  ["share","1","largest momentum on the way, over the most that it can hold, while the wheels keep the base's attitude exactly"],
];

// times of capture within the window, and the one that was chosen.
export interface WindowReport {
  /** of the capture that was chosen; null: none can be reached [s] */
  time: number | null;
  /** before which no grasp can be reached, by distance alone [s] */
  not_before?: number;
  /** all that were looked at, in the order of time */
  points: WindowPoint[];
}
export const kWindowReport: FieldNote[] = [
  ["time","s","of the capture that was chosen; null: none can be reached"],
  ["not_before","s","before which no grasp can be reached, by distance alone"],
  ["points","","all that were looked at, in the order of time"],
];

// a time of capture that was looked at.
export interface WindowPoint {
  /** of the capture [s] */
  time: number;
  /** whether a plan was found for it */
  reachable: boolean;
  /** why not; empty: there is one */
  reason: string;
  /** of the plan; null: there is none [1] */
  objective: number | null;
  /** of the fastest grasp point against the servicer's centre of mass [m/s] */
  speed: number;
  /** largest angle between an approach direction and the way from the arm's first joint to the grasp point; null: no grasp point has a direction [rad] */
  direction_angle: number | null;
  /** largest distance of a grasp point from what its arm and the base can bring there, over their reach; above 1 it cannot be reached [1] */
  reach_share: number;
}
export const kWindowPoint: FieldNote[] = [
  ["time","s","of the capture"],
  ["reachable","","whether a plan was found for it"],
  ["reason","","why not; empty: there is one"],
  ["objective","1","of the plan; null: there is none"],
  ["speed","m/s","of the fastest grasp point against the servicer's centre of mass"],
  ["direction_angle","rad","largest angle between an approach direction and the way from the arm's first joint to the grasp point; null: no grasp point has a direction"],
  ["reach_share","1","largest distance of a grasp point from what its arm and the base can bring there, over their reach; above 1 it cannot be reached"],
];

// a plan of the approach, or of what is left of it, and the estimates it rests on.
export interface NavigationReport {
  /** when it was planned; the first before the approach begins [s] */
  time: number;
  /** whether there is such a motion; if not, the plan before stays */
  found: boolean;
  /** that planning took [1] */
  rhs_evaluations: number;
  /** of the targets, on which it was planned */
  estimates: EstimateReport[];
  /** why there is none; empty otherwise */
  failure: string;
}
export const kNavigationReport: FieldNote[] = [
  ["time","s","when it was planned; the first before the approach begins"],
  ["found","","whether there is such a motion; if not, the plan before stays"],
  ["rhs_evaluations","1","that planning took"],
  ["estimates","","of the targets, on which it was planned"],
  ["failure","","why there is none; empty otherwise"],
];

// how far the estimate of a target is from the truth, at one instant.
export interface EstimateReport {
  /** that is estimated */
  target: string;
  /** distance of the estimated target frame's origin from the true [m] */
  position_error: number;
  /** angle between both frames [rad] */
  orientation_error: number;
  /** of the origin's velocity [m/s] */
  velocity_error: number;
  /** of the angular velocity [rad/s] */
  angular_velocity_error: number;
}
export const kEstimateReport: FieldNote[] = [
  ["target","","that is estimated"],
  ["position_error","m","distance of the estimated target frame's origin from the true"],
  ["orientation_error","rad","angle between both frames"],
  ["velocity_error","m/s","of the origin's velocity"],
  ["angular_velocity_error","rad/s","of the angular velocity"],
];

// hands under impedance control, in a phase.
export interface ImpedanceReport {
  /** when the law begins [s] */
  begin: number;
  /** when it ends [s] */
  end: number;
  /** `rank_lost`: the arms came near a configuration in which they cannot move the hands in all directions that are controlled, a dynamic singularity. `joint_limit`: a joint reached the end of its range. `released`: a target was let go. `running`: the phase ended before */
  ended: LawEnd;
  /** whose range ended it; empty otherwise */
  joint: string;
  /** of a hand from its reference [m] */
  largest_distance: number;
  /** when that was [s] */
  largest_distance_time: number;
  /** the largest of the hands' at the end [m] */
  distance_after: number;
  /** of a hand from its reference; 0 where it is not controlled [rad] */
  largest_angle: number;
  /** when that was [s] */
  largest_angle_time: number;
  /** the largest of the hands' at the end [rad] */
  angle_after: number;
  /** least part of an effort that moves the hands that its joint's limit lets pass [1] */
  least_share: number;
  /** when that was [s] */
  least_share_time: number;
  /** whether these efforts stayed within the limits; if not, they were cut and the hands did not move as asked for */
  within_limits: boolean;
  /** of the hands' motion by the joint rates, through the generalized Jacobian: least singular value over the largest, its least [1] */
  least_condition: number;
  /** when that was [s] */
  least_condition_time: number;
}
export const kImpedanceReport: FieldNote[] = [
  ["begin","s","when the law begins"],
  ["end","s","when it ends"],
  ["ended","","`rank_lost`: the arms came near a configuration in which they cannot move the hands in all directions that are controlled, a dynamic singularity. `joint_limit`: a joint reached the end of its range. `released`: a target was let go. `running`: the phase ended before"],
  ["joint","","whose range ended it; empty otherwise"],
  ["largest_distance","m","of a hand from its reference"],
  ["largest_distance_time","s","when that was"],
  ["distance_after","m","the largest of the hands' at the end"],
  ["largest_angle","rad","of a hand from its reference; 0 where it is not controlled"],
  ["largest_angle_time","s","when that was"],
  ["angle_after","rad","the largest of the hands' at the end"],
  ["least_share","1","least part of an effort that moves the hands that its joint's limit lets pass"],
  ["least_share_time","s","when that was"],
  ["within_limits","","whether these efforts stayed within the limits; if not, they were cut and the hands did not move as asked for"],
  ["least_condition","1","of the hands' motion by the joint rates, through the generalized Jacobian: least singular value over the largest, its least"],
  ["least_condition_time","s","when that was"],
];

export type LawEnd = "running" | "at_rest" | "rank_lost" | "joint_limit" | "released";

// whether the grasps closed.
export interface Capture {
  /** of all grasps; `assumed`, if that is so of at least one and all closed. */
  captured: Captured;
  /** the sentence on the terminal, with the gap and by how much targets were moved */
  verdict: string;
  /** when those were to close that close together [s] */
  time: number;
  /** per grasp of the scenario */
  grasps: GraspOutcome[];
}
export const kCapture: FieldNote[] = [
  ["captured","","of all grasps; `assumed`, if that is so of at least one and all closed."],
  ["verdict","","the sentence on the terminal, with the gap and by how much targets were moved"],
  ["time","s","when those were to close that close together"],
  ["grasps","","per grasp of the scenario"],
];

export type Captured = "yes" | "assumed" | "no";

// whether one grasp closes at the instant of capture: what success means. The angle is 0 if the grasp leaves it free (that between the frames is `gap_angle` of `GraspImpulse`).
export interface GraspOutcome {
  /** that is to grasp */
  end_effector: string;
  /** that is to be grasped */
  target: string;
  /** on the target */
  grasp_point: string;
  /** whether this grasp closed. */
  captured: Captured;
  /** whether an envelope with a position judged it */
  judged: boolean;
  /** in words: which tolerance of the envelope was kept or missed. A contact is never captured: how fast it parted, or that it was still compressed, by how much and with what energy, when `impact.longest` ended it */
  reason: string;
  /** the key of the envelope (`position`, `angle`, `velocity`, `angular_velocity`) that was missed by the largest factor; empty if none was */
  limiting: string;
  /** distance from the grasp point when it was to close [m] */
  distance: number | null;
  /** angle from what the grasp's orientation asks for, at that instant [rad] */
  angle: number | null;
  /** relative to the grasp point, at that instant [m/s] */
  velocity: number | null;
  /** relative to the target, at that instant [rad/s] */
  angular_velocity: number | null;
  /** when this grasp closed, or was to close. The deviations above are those of this instant; of a grasp that never came so far those of the run's end, null after a failure [s] */
  time: number | null;
  /** by which `contact.gap: translate_target` moved its target so that it closes [m] */
  target_moved: number;
  /** when it was released; absent if it was not [s] */
  released?: number;
}
export const kGraspOutcome: FieldNote[] = [
  ["end_effector","","that is to grasp"],
  ["target","","that is to be grasped"],
  ["grasp_point","","on the target"],
  ["captured","","whether this grasp closed."],
  ["judged","","whether an envelope with a position judged it"],
  ["reason","","in words: which tolerance of the envelope was kept or missed. A contact is never captured: how fast it parted, or that it was still compressed, by how much and with what energy, when `impact.longest` ended it"],
  ["limiting","","the key of the envelope (`position`, `angle`, `velocity`, `angular_velocity`) that was missed by the largest factor; empty if none was"],
  ["distance","m","distance from the grasp point when it was to close"],
  ["angle","rad","angle from what the grasp's orientation asks for, at that instant"],
  ["velocity","m/s","relative to the grasp point, at that instant"],
  ["angular_velocity","rad/s","relative to the target, at that instant"],
  ["time","s","when this grasp closed, or was to close. The deviations above are those of this instant; of a grasp that never came so far those of the run's end, null after a failure"],
  ["target_moved","m","by which `contact.gap: translate_target` moved its target so that it closes"],
  ["released","s","when it was released; absent if it was not"],
];

// an impact: what changes at once when grasps close and contacts touch.
export interface ImpactReport {
  /** as in the scenario. `as_published`: the velocities after it are the thesis's, and momentum is not conserved */
  law: string;
  /** when it begins [s] */
  time: number;
  /** over which mean forces are taken: `impact.duration` of the scenario, while the impact itself takes no time. Law `compliant`: how long it took [s] */
  duration: number;
  /** grasps that closed, and contacts that touched */
  grasps: GraspImpulse[];
  /** independent ones among the rows [1] */
  rank: number;
  /** conditions that the grasps pose [1] */
  rows: number;
  /** `rows` - `rank` self-stresses: impulses that change no velocity and may be added to the grasps' */
  null_space: ImpulseSet[];
  /** per further grasp of a target, against its first */
  loops: LoopGap[];
  /** per body */
  body_impulses: BodyImpulse[];
  /** of robot and targets, just before the impact [J] */
  kinetic_energy_before: number;
  /** just after it [J] */
  kinetic_energy_after: number;
  /** of the base's origin, in the impact, in W [m/s] */
  base_velocity_change: [number, number, number];
  /** of the base, in the impact, in W [rad/s] */
  base_angular_velocity_change: [number, number, number];
  /** of `joint_velocity_change` */
  joint_names: string[];
  /** of the joints, in the impact [rad/s or m/s] */
  joint_velocity_change: number[];
  /** what they pass on */
  joints: JointImpulse[];
  /** what the arms passed to the base */
  base_reaction: BaseReaction;
  /** just before the impact */
  targets_before: BodyMotion[];
  /** just after it */
  targets_after: BodyMotion[];
  /** the thesis's (3.8)-(3.13) for the same capture */
  as_published?: AsPublished;
  /** instead of `as_published`: why it is not defined here */
  as_published_absent?: string;
  /** whether the scenario asks for `as_published` (`output.as_published`, or its own law): only then the terminal, the report and figures show it */
  show_as_published: boolean;
  /** where joints are locked after the grasp */
  brake?: BrakeReport;
  /** `free`, `braked` or `driven`: what `impact.joints` asked for */
  joints_during: string;
  /** that brakes or drives held, or were to hold */
  held_joints: HeldJoint[];
  /** whether simultaneous contacts share the impulse in one way only (if not: `spread` of `ContactRebound`) */
  unique: boolean;
  /** true: the result has more energy than there was (Newton's hypothesis with friction); it is not altered, and a warning says so */
  energy_created: boolean;
  /** of contacts: `stronge`, `poisson` or `newton`; absent where there were none */
  hypothesis?: string;
  /** law `bilateral_restitution`: the rows in which no motion has the restitution asked for; absent if there are none */
  inconsistent?: string;
  /** law `compliant` */
  compliant?: CompliantReport;
  /** of contacts, law `compliant`; absent without them */
  effective_masses?: EffectiveMass[];
  /** impulses over the modes that can answer; absent where nothing bends, and with other laws than `plastic` */
  by_modes?: RetainedModes[];
  /** of the configuration; absent with law `compliant` */
  measures?: ImpactMeasures;
  /** with law `plastic`, else empty */
  sensitivities: ImpactSensitivity[];
  /** against the robot's ratings; empty where the robot file has none */
  margins: ImpactMargin[];
  /** per grasp whose arm has ratings */
  speed_limits: SpeedLimit[];
}
export const kImpactReport: FieldNote[] = [
  ["law","","as in the scenario. `as_published`: the velocities after it are the thesis's, and momentum is not conserved"],
  ["time","s","when it begins"],
  ["duration","s","over which mean forces are taken: `impact.duration` of the scenario, while the impact itself takes no time. Law `compliant`: how long it took"],
  ["grasps","","grasps that closed, and contacts that touched"],
  ["rank","1","independent ones among the rows"],
  ["rows","1","conditions that the grasps pose"],
  ["null_space","","`rows` - `rank` self-stresses: impulses that change no velocity and may be added to the grasps'"],
  ["loops","","per further grasp of a target, against its first"],
  ["body_impulses","","per body"],
  ["kinetic_energy_before","J","of robot and targets, just before the impact"],
  ["kinetic_energy_after","J","just after it"],
  ["base_velocity_change","m/s","of the base's origin, in the impact, in W"],
  ["base_angular_velocity_change","rad/s","of the base, in the impact, in W"],
  ["joint_names","","of `joint_velocity_change`"],
  ["joint_velocity_change","rad/s or m/s","of the joints, in the impact"],
  ["joints","","what they pass on"],
  ["base_reaction","","what the arms passed to the base"],
  ["targets_before","","just before the impact"],
  ["targets_after","","just after it"],
  ["as_published","","the thesis's (3.8)-(3.13) for the same capture"],
  ["as_published_absent","","instead of `as_published`: why it is not defined here"],
  ["show_as_published","","whether the scenario asks for `as_published` (`output.as_published`, or its own law): only then the terminal, the report and figures show it"],
  ["brake","","where joints are locked after the grasp"],
  ["joints_during","","`free`, `braked` or `driven`: what `impact.joints` asked for"],
  ["held_joints","","that brakes or drives held, or were to hold"],
  ["unique","","whether simultaneous contacts share the impulse in one way only (if not: `spread` of `ContactRebound`)"],
  ["energy_created","","true: the result has more energy than there was (Newton's hypothesis with friction); it is not altered, and a warning says so"],
  ["hypothesis","","of contacts: `stronge`, `poisson` or `newton`; absent where there were none"],
  ["inconsistent","","law `bilateral_restitution`: the rows in which no motion has the restitution asked for; absent if there are none"],
  ["compliant","","law `compliant`"],
  ["effective_masses","","of contacts, law `compliant`; absent without them"],
  ["by_modes","","impulses over the modes that can answer; absent where nothing bends, and with other laws than `plastic`"],
  ["measures","","of the configuration; absent with law `compliant`"],
  ["sensitivities","","with law `plastic`, else empty"],
  ["margins","","against the robot's ratings; empty where the robot file has none"],
  ["speed_limits","","per grasp whose arm has ratings"],
];

// one grasp or contact of the impact. Impulses act **on the robot** at the contact point; the target gets the opposite there.
export interface GraspImpulse {
  /** of the grasp or contact */
  end_effector: string;
  /** of the grasp or contact */
  target: string;
  /** on the target */
  grasp_point: string;
  /** `rigid` (6 rows), `hinge` (5), `point` (3), `contact` (does not hold) */
  model: string;
  /** common to end-effector and target, in W [m] */
  contact_point: [number, number, number];
  /** distance of end-effector and grasp point when they were joined [m] */
  gap: number;
  /** angle between their frames when they were joined [rad] */
  gap_angle: number;
  /** by which `contact.gap: translate_target` moved the target, in W [m] */
  target_displacement: [number, number, number];
  /** on the robot at the contact point, in W [N s] */
  impulse: [number, number, number];
  /** on the robot about the contact point, in W [N m s] */
  angular_impulse: [number, number, number];
  /** of the impulse [N s] */
  impulse_magnitude: number;
  /** impulse over impact.duration; law compliant: over profile.duration [N] */
  mean_force: number;
  /** six, per component, angular x, y, z then linear x, y, z, in W: unique, or open to a self-stress of closed loops */
  determined: boolean[];
  /** end-effector minus target at the contact point, before, in W [m/s] */
  relative_velocity_before: [number, number, number];
  /** end-effector minus target, before, in W [rad/s] */
  relative_angular_velocity_before: [number, number, number];
  /** the same afterwards: zero in what a grasp holds [m/s] */
  relative_velocity_after: [number, number, number];
  /** likewise [rad/s] */
  relative_angular_velocity_after: [number, number, number];
  /** of a contact under `restitution` or `friction` */
  rebound?: ContactRebound;
  /** law `compliant` */
  profile?: ForceProfile;
}
export const kGraspImpulse: FieldNote[] = [
  ["end_effector","","of the grasp or contact"],
  ["target","","of the grasp or contact"],
  ["grasp_point","","on the target"],
  ["model","","`rigid` (6 rows), `hinge` (5), `point` (3), `contact` (does not hold)"],
  ["contact_point","m","common to end-effector and target, in W"],
  ["gap","m","distance of end-effector and grasp point when they were joined"],
  ["gap_angle","rad","angle between their frames when they were joined"],
  ["target_displacement","m","by which `contact.gap: translate_target` moved the target, in W"],
  ["impulse","N s","on the robot at the contact point, in W"],
  ["angular_impulse","N m s","on the robot about the contact point, in W"],
  ["impulse_magnitude","N s","of the impulse"],
  ["mean_force","N","impulse over impact.duration; law compliant: over profile.duration"],
  ["determined","","six, per component, angular x, y, z then linear x, y, z, in W: unique, or open to a self-stress of closed loops"],
  ["relative_velocity_before","m/s","end-effector minus target at the contact point, before, in W"],
  ["relative_angular_velocity_before","rad/s","end-effector minus target, before, in W"],
  ["relative_velocity_after","m/s","the same afterwards: zero in what a grasp holds"],
  ["relative_angular_velocity_after","rad/s","likewise"],
  ["rebound","","of a contact under `restitution` or `friction`"],
  ["profile","","law `compliant`"],
];

// a contact that does not hold: how it rebounded.
export interface ContactRebound {
  /** unit, from the target to the robot, in W [1] */
  normal: [number, number, number];
  /** along the normal [N s] */
  normal_impulse: number;
  /** of friction, in W [N s] */
  tangential_impulse: [number, number, number];
  /** of the normal impulse, while the bodies approach [N s] */
  compression: number;
  /** done on the bodies by the normal impulse [J] */
  normal_work: number;
  /** done on them by friction [J] */
  friction_work: number;
  /** `separated`, `sticking`, `sliding`, `reversed`: in the order in which they came */
  modes: string[];
  /** of the normal impulse over other orders of simultaneous contacts, relative; null: not known [1] */
  spread: number | null;
}
export const kContactRebound: FieldNote[] = [
  ["normal","1","unit, from the target to the robot, in W"],
  ["normal_impulse","N s","along the normal"],
  ["tangential_impulse","N s","of friction, in W"],
  ["compression","N s","of the normal impulse, while the bodies approach"],
  ["normal_work","J","done on the bodies by the normal impulse"],
  ["friction_work","J","done on them by friction"],
  ["modes","","`separated`, `sticking`, `sliding`, `reversed`: in the order in which they came"],
  ["spread","1","of the normal impulse over other orders of simultaneous contacts, relative; null: not known"],
];

// a contact or grasp that was resolved in time.
export interface ForceProfile {
  /** largest force in the impact [N] */
  peak_force: number;
  /** when that is, from the impact's beginning [s] */
  peak_force_time: number;
  /** largest moment in the impact [N m] */
  peak_moment: number;
  /** when that is, from the impact's beginning [s] */
  peak_moment_time: number;
  /** of the contact or the grasp's spring [m] */
  largest_deformation: number;
  /** in touch, or until the grasp was at rest [s] */
  duration: number;
  /** by damping and friction [J] */
  energy_lost: number;
  /** how often the bodies came together [1] */
  touches: number;
}
export const kForceProfile: FieldNote[] = [
  ["peak_force","N","largest force in the impact"],
  ["peak_force_time","s","when that is, from the impact's beginning"],
  ["peak_moment","N m","largest moment in the impact"],
  ["peak_moment_time","s","when that is, from the impact's beginning"],
  ["largest_deformation","m","of the contact or the grasp's spring"],
  ["duration","s","in touch, or until the grasp was at rest"],
  ["energy_lost","J","by damping and friction"],
  ["touches","1","how often the bodies came together"],
];

// impulses at all grasps together, scaled so that the largest component is 1 (N s or N m s).
export interface ImpulseSet {
  /** in the order of the impact's grasps; in words of `GraspImpulse` */
  grasps: ImpulseAtGrasp[];
}
export const kImpulseSet: FieldNote[] = [
  ["grasps","","in the order of the impact's grasps; in words of `GraspImpulse`"],
];

// a part of an `ImpulseSet`.
export interface ImpulseAtGrasp {
  /** whose grasp it is */
  end_effector: string;
  /** as in `GraspImpulse` [N s] */
  impulse: [number, number, number];
  /** as in `GraspImpulse` [N m s] */
  angular_impulse: [number, number, number];
}
export const kImpulseAtGrasp: FieldNote[] = [
  ["end_effector","","whose grasp it is"],
  ["impulse","N s","as in `GraspImpulse`"],
  ["angular_impulse","N m s","as in `GraspImpulse`"],
];

// a further grasp of a target against the first: whether both can be where they are meant to be.
export interface LoopGap {
  /** that both hold */
  target: string;
  /** the first grasp's, the further one's */
  end_effectors: [string, string];
  /** likewise */
  grasp_points: [string, string];
  /** between the end-effectors when they closed [m] */
  end_effector_distance: number;
  /** between the grasp points that they are to hold [m] */
  grasp_point_distance: number;
  /** by how much these differ. No motion of the target changes either: so much remains, and is held as found [m] */
  gap: number;
}
export const kLoopGap: FieldNote[] = [
  ["target","","that both hold"],
  ["end_effectors","","the first grasp's, the further one's"],
  ["grasp_points","","likewise"],
  ["end_effector_distance","m","between the end-effectors when they closed"],
  ["grasp_point_distance","m","between the grasp points that they are to hold"],
  ["gap","m","by how much these differ. No motion of the target changes either: so much remains, and is held as found"],
];

// all that a body received, from joints and grasps together: unique, also where the impulses of single grasps are not.
export interface BodyImpulse {
  /** that received it */
  body: string;
  /** in W [N s] */
  impulse: [number, number, number];
  /** about the body's centre of mass, in W [N m s] */
  angular_impulse: [number, number, number];
}
export const kBodyImpulse: FieldNote[] = [
  ["body","","that received it"],
  ["impulse","N s","in W"],
  ["angular_impulse","N m s","about the body's centre of mass, in W"],
];

// what a joint passes on during the impact.
export interface JointImpulse {
  /** that passes it on */
  joint: string;
  /** that the joint carries */
  body: string;
  /** passed on at the joint's origin, from parent to child, in W [N s] */
  impulse: [number, number, number];
  /** about the joint's origin, likewise [N m s] */
  angular_impulse: [number, number, number];
  /** that the joint passes on along its axis: zero for a free joint without rotor [N m s or N s] */
  along_axis: number;
  /** law `compliant`: the largest of what it passes on, over the samples; else 0 [N] */
  peak_force: number;
  /** likewise [N m] */
  peak_moment: number;
  /** likewise, along the axis [N m or N] */
  peak_driving: number;
}
export const kJointImpulse: FieldNote[] = [
  ["joint","","that passes it on"],
  ["body","","that the joint carries"],
  ["impulse","N s","passed on at the joint's origin, from parent to child, in W"],
  ["angular_impulse","N m s","about the joint's origin, likewise"],
  ["along_axis","N m s or N s","that the joint passes on along its axis: zero for a free joint without rotor"],
  ["peak_force","N","law `compliant`: the largest of what it passes on, over the samples; else 0"],
  ["peak_moment","N m","likewise"],
  ["peak_driving","N m or N","likewise, along the axis"],
];

// what the arms passed to the base.
export interface BaseReaction {
  /** in W [N s] */
  impulse: [number, number, number];
  /** about the base's origin, in W [N m s] */
  angular_impulse: [number, number, number];
}
export const kBaseReaction: FieldNote[] = [
  ["impulse","N s","in W"],
  ["angular_impulse","N m s","about the base's origin, in W"],
];

// the thesis's own estimate, (3.8)-(3.13), for the same capture.
export interface AsPublished {
  /** per grasp */
  grasps: PublishedImpulse[];
  /** (3.11), in the order of `joint_names` of the impact [rad/s or m/s] */
  joint_velocity_after: number[];
  /** total after minus before, its magnitude [N s] */
  linear_momentum_error: number;
  /** likewise [N m s] */
  angular_momentum_error: number;
  /** over the ledger's scale; null: nothing moves [1] */
  relative_linear_momentum_error: number | null;
  /** likewise [1] */
  relative_angular_momentum_error: number | null;
}
export const kAsPublished: FieldNote[] = [
  ["grasps","","per grasp"],
  ["joint_velocity_after","rad/s or m/s","(3.11), in the order of `joint_names` of the impact"],
  ["linear_momentum_error","N s","total after minus before, its magnitude"],
  ["angular_momentum_error","N m s","likewise"],
  ["relative_linear_momentum_error","1","over the ledger's scale; null: nothing moves"],
  ["relative_angular_momentum_error","1","likewise"],
];

// one grasp's impulse by the thesis's formulas.
export interface PublishedImpulse {
  /** of the grasp */
  end_effector: string;
  /** as in `GraspImpulse` [N s] */
  impulse: [number, number, number];
  /** as in `GraspImpulse` [N m s] */
  angular_impulse: [number, number, number];
  /** of the impulse [N s] */
  impulse_magnitude: number;
}
export const kPublishedImpulse: FieldNote[] = [
  ["end_effector","","of the grasp"],
  ["impulse","N s","as in `GraspImpulse`"],
  ["angular_impulse","N m s","as in `GraspImpulse`"],
  ["impulse_magnitude","N s","of the impulse"],
];

// joints locked at once after the grasp: a second impulse with its own checks. `targets_after` and the impact's own changes are before the brake; the second sample of `contact` in the time series is after it.
export interface BrakeReport {
  /** that are locked */
  joints: string[];
  /** per joint, along or about its axis [N m s or N s] */
  impulse: number[];
  /** of everything, before the brake [J] */
  kinetic_energy_before: number;
  /** after it [J] */
  kinetic_energy_after: number;
  /** per grasp that holds */
  grasps: BrakeGrasp[];
  /** of the base's origin, by the brake alone, in W [m/s] */
  base_velocity_change: [number, number, number];
  /** by the brake alone, in W [rad/s] */
  base_angular_velocity_change: [number, number, number];
}
export const kBrakeReport: FieldNote[] = [
  ["joints","","that are locked"],
  ["impulse","N m s or N s","per joint, along or about its axis"],
  ["kinetic_energy_before","J","of everything, before the brake"],
  ["kinetic_energy_after","J","after it"],
  ["grasps","","per grasp that holds"],
  ["base_velocity_change","m/s","of the base's origin, by the brake alone, in W"],
  ["base_angular_velocity_change","rad/s","by the brake alone, in W"],
];

// what a grasp passes on because of the brake, besides the impulse of the impact.
export interface BrakeGrasp {
  /** of the grasp */
  end_effector: string;
  /** of the grasp */
  target: string;
  /** on the robot at the contact point, in W [N s] */
  impulse: [number, number, number];
  /** about the contact point, in W [N m s] */
  angular_impulse: [number, number, number];
  /** of the impulse [N s] */
  impulse_magnitude: number;
}
export const kBrakeGrasp: FieldNote[] = [
  ["end_effector","","of the grasp"],
  ["target","","of the grasp"],
  ["impulse","N s","on the robot at the contact point, in W"],
  ["angular_impulse","N m s","about the contact point, in W"],
  ["impulse_magnitude","N s","of the impulse"],
];

// a joint that a brake or a drive held during the impact, or was to hold. Law `compliant`: it gives way when the grasps become rigid; `impulse` and `work` are until then.
export interface HeldJoint {
  /** that was held, or was to be held */
  joint: string;
  /** on it, along or about its axis [N m s or N s] */
  impulse: number;
  /** done by it [J] */
  work: number;
  /** that it was to hold [rad/s or m/s] */
  commanded_rate: number;
  /** that it has after the impact [rad/s or m/s] */
  rate_after: number;
  /** the grasps did not allow all rates that drives were told, and this one had to give way, as little as possible (docs/theory, section 7). A warning says so too */
  was_overpowered: boolean;
}
export const kHeldJoint: FieldNote[] = [
  ["joint","","that was held, or was to be held"],
  ["impulse","N m s or N s","on it, along or about its axis"],
  ["work","J","done by it"],
  ["commanded_rate","rad/s or m/s","that it was to hold"],
  ["rate_after","rad/s or m/s","that it has after the impact"],
  ["was_overpowered","","the grasps did not allow all rates that drives were told, and this one had to give way, as little as possible (docs/theory, section 7). A warning says so too"],
];

// an impact that was resolved in time.
export interface CompliantReport {
  /** `separated` (contacts only), `settled` (grasps are at rest), `time_over` (`impact.longest`) */
  end: string;
  /** of the impact [s] */
  duration: number;
  /** by dampers and friction [J] */
  energy_lost: number;
  /** left in springs at the end; given up when grasps become rigid. With `time_over` the impact was cut off: this energy is missing, and the ledger's `compliant_energy_residual` fails if a contact is still compressed or grasps hold more than a thousandth of the kinetic energy before [J] */
  elastic_energy_after: number;
  /** largest impulse that then takes out what relative motion is left [N s] */
  residual_impulse: number;
  /** of the balance of energy, over the kinetic energy before of the bodies that take part [1] */
  energy_residual: number;
  /** of joints that a law drives meanwhile (`impact.joints: impedance`) [J] */
  motor_work: number;
  /** of the integration [1] */
  rhs_evaluations: number;
  /** of vibration of what bends, in the posture in which the bodies met, joints as in the impact, grasps open [1] */
  modes: number;
  /** of these, whose period is longer than `duration` [1] */
  slower_modes: number;
  /** of the slowest of them; 0 where nothing bends [s] */
  slowest_period: number;
  /** of the fastest. Modes with periods much shorter than the contact hardly answer it [s] */
  fastest_period: number;
}
export const kCompliantReport: FieldNote[] = [
  ["end","","`separated` (contacts only), `settled` (grasps are at rest), `time_over` (`impact.longest`)"],
  ["duration","s","of the impact"],
  ["energy_lost","J","by dampers and friction"],
  ["elastic_energy_after","J","left in springs at the end; given up when grasps become rigid. With `time_over` the impact was cut off: this energy is missing, and the ledger's `compliant_energy_residual` fails if a contact is still compressed or grasps hold more than a thousandth of the kinetic energy before"],
  ["residual_impulse","N s","largest impulse that then takes out what relative motion is left"],
  ["energy_residual","1","of the balance of energy, over the kinetic energy before of the bodies that take part"],
  ["motor_work","J","of joints that a law drives meanwhile (`impact.joints: impedance`)"],
  ["rhs_evaluations","1","of the integration"],
  ["modes","1","of vibration of what bends, in the posture in which the bodies met, joints as in the impact, grasps open"],
  ["slower_modes","1","of these, whose period is longer than `duration`"],
  ["slowest_period","s","of the slowest of them; 0 where nothing bends"],
  ["fastest_period","s","of the fastest. Modes with periods much shorter than the contact hardly answer it"],
];

// hand and target as a contact meets them.
export interface EffectiveMass {
  /** of the contact */
  end_effector: string;
  /** that it meets */
  target: string;
  /** of the hand along the contact's normal, without control, the joints free [kg] */
  hand: number;
  /** of the hand by the impedance law; null where no such law acts that senses the force [kg] */
  apparent: number | null;
  /** of the target along it [kg] */
  of_target: number;
  /** e of a central contact of such masses: the target is stopped where e times the hand's mass is its own [1] */
  restitution: number;
  /** of the target's point along the normal towards the hand, relative to that [m/s] */
  target_speed_before: number;
  /** of the target's point afterwards, relative to the hand's velocity before [m/s] */
  target_speed_after: number;
}
export const kEffectiveMass: FieldNote[] = [
  ["end_effector","","of the contact"],
  ["target","","that it meets"],
  ["hand","kg","of the hand along the contact's normal, without control, the joints free"],
  ["apparent","kg","of the hand by the impedance law; null where no such law acts that senses the force"],
  ["of_target","kg","of the target along it"],
  ["restitution","1","e of a central contact of such masses: the target is stopped where e times the hand's mass is its own"],
  ["target_speed_before","m/s","of the target's point along the normal towards the hand, relative to that"],
  ["target_speed_after","m/s","of the target's point afterwards, relative to the hand's velocity before"],
];

// the plastic impact if nothing bent but these modes.
export interface RetainedModes {
  /** that can answer, the slowest of base and joints as they are in the impact [1] */
  modes: number;
  /** of the fastest of them; 0 without any [Hz] */
  frequency: number;
  /** magnitudes, in the order of `grasps` [N s] */
  impulses: number[];
}
export const kModesKept: FieldNote[] = [
  ["modes","1","that can answer, the slowest of base and joints as they are in the impact"],
  ["frequency","Hz","of the fastest of them; 0 without any"],
  ["impulses","N s","magnitudes, in the order of `grasps`"],
];

// what the configuration makes of impulses, at the contact points, everything free but joints that are held. Twists and impulses are [angular; linear] in W; matrices are six rows of six.
export interface ImpactMeasures {
  /** per grasp */
  end_effectors: EndEffectorMeasure[];
  /** of all grasps together: impulse that a relative motion brings at worst; 1: as against an immovable robot [1] */
  largest_impulse: number | null;
  /** likewise, at best [1] */
  smallest_impulse: number | null;
  /** likewise, of the present motion [1] */
  coupled_index: number | null;
  /** of the resultant of all impulses, from the robot's centre of mass [m] */
  miss_of_robot_com: number | null;
  /** the same from that of robot and targets [m] */
  miss_of_system_com: number | null;
  /** per grasp: change of the base's twist per impulse there; zero in directions that the grasp leaves free [1/(kg m^2), 1/(kg m), 1/kg] */
  base_response: [number, number, number, number, number, number][][];
  /** a basis of the impulses that leave the base's twist alone */
  zero_disturbance: ImpulseSet[];
  /** a basis of those that leave its angular velocity alone */
  zero_base_angular_velocity: ImpulseSet[];
}
export const kImpactMeasures: FieldNote[] = [
  ["end_effectors","","per grasp"],
  ["largest_impulse","1","of all grasps together: impulse that a relative motion brings at worst; 1: as against an immovable robot"],
  ["smallest_impulse","1","likewise, at best"],
  ["coupled_index","1","likewise, of the present motion"],
  ["miss_of_robot_com","m","of the resultant of all impulses, from the robot's centre of mass"],
  ["miss_of_system_com","m","the same from that of robot and targets"],
  ["base_response","1/(kg m^2), 1/(kg m), 1/kg","per grasp: change of the base's twist per impulse there; zero in directions that the grasp leaves free"],
  ["zero_disturbance","","a basis of the impulses that leave the base's twist alone"],
  ["zero_base_angular_velocity","","a basis of those that leave its angular velocity alone"],
];

// what an impulse at one grasp does, and what the present motion asks for, at the contact point.
export interface EndEffectorMeasure {
  /** of the grasp or contact */
  end_effector: string;
  /** change of the end-effector's twist per impulse on it: six rows of six [1/(kg m^2), 1/(kg m), 1/kg] */
  inverse_inertia: [number, number, number, number, number, number][];
  /** of its twist relative to the target, impulse on it and opposite on the target [1/(kg m^2), 1/(kg m), 1/kg] */
  pair_inverse_inertia: [number, number, number, number, number, number][];
  /** of the impulse ellipsoid: unit vectors in W [1] */
  linear_axes: [number, number, number][];
  /** its semi-axes along them, descending [kg] */
  linear_mass: number[];
  /** the same of angular impulses [1] */
  angular_axes: [number, number, number][];
  /** the same of angular impulses [kg m^2] */
  angular_inertia: number[];
  /** impulse of a point contact that stops all of the present relative velocity, per speed; 0 where there is none [kg] */
  impulse_index: number | null;
  /** of a frictionless contact along the present relative velocity: of the end-effector alone; null: nothing yields [kg] */
  robot_effective_mass: number | null;
  /** the same of end-effector and target [kg] */
  pair_effective_mass: number | null;
  /** of the line of impulse from the robot's centre of mass; 0 for no impulse, null for a pure couple [m] */
  miss_of_robot_com: number | null;
  /** the same from that of robot and target [m] */
  miss_of_system_com: number | null;
}
export const kEndEffectorMeasure: FieldNote[] = [
  ["end_effector","","of the grasp or contact"],
  ["inverse_inertia","1/(kg m^2), 1/(kg m), 1/kg","change of the end-effector's twist per impulse on it: six rows of six"],
  ["pair_inverse_inertia","1/(kg m^2), 1/(kg m), 1/kg","of its twist relative to the target, impulse on it and opposite on the target"],
  ["linear_axes","1","of the impulse ellipsoid: unit vectors in W"],
  ["linear_mass","kg","its semi-axes along them, descending"],
  ["angular_axes","1","the same of angular impulses"],
  ["angular_inertia","kg m^2","the same of angular impulses"],
  ["impulse_index","kg","impulse of a point contact that stops all of the present relative velocity, per speed; 0 where there is none"],
  ["robot_effective_mass","kg","of a frictionless contact along the present relative velocity: of the end-effector alone; null: nothing yields"],
  ["pair_effective_mass","kg","the same of end-effector and target"],
  ["miss_of_robot_com","m","of the line of impulse from the robot's centre of mass; 0 for no impulse, null for a pure couple"],
  ["miss_of_system_com","m","the same from that of robot and target"],
];

// derivatives of the impact with respect to something that is uncertain.
export interface ImpactSensitivity {
  /** such as `target mass` */
  parameter: string;
  /** of the parameter */
  unit: string;
  /** whose parameter it is */
  end_effector: string;
  /** likewise */
  target: string;
  /** instead of what follows: why there is none */
  undefined?: string;
  /** per grasp, in W [N s per unit] */
  impulse?: [number, number, number][];
  /** per grasp, in W [N m s per unit] */
  angular_impulse?: [number, number, number][];
  /** per grasp [N s per unit] */
  impulse_magnitude?: number[];
  /** in W [m/s per unit] */
  base_velocity_change?: [number, number, number];
  /** in W [rad/s per unit] */
  base_angular_velocity_change?: [number, number, number];
}
export const kImpactSensitivity: FieldNote[] = [
  ["parameter","","such as `target mass`"],
  ["unit","","of the parameter"],
  ["end_effector","","whose parameter it is"],
  ["target","","likewise"],
  ["undefined","","instead of what follows: why there is none"],
  ["impulse","N s per unit","per grasp, in W"],
  ["angular_impulse","N m s per unit","per grasp, in W"],
  ["impulse_magnitude","N s per unit","per grasp"],
  ["base_velocity_change","m/s per unit","in W"],
  ["base_angular_velocity_change","rad/s per unit","in W"],
];

// a load of the impact for which the robot file has a rating.
export interface ImpactMargin {
  /** joint or end-effector */
  of: string;
  /** `force`, `moment`, `impulse`, `angular_impulse`, `driving` or `driving_impulse` */
  quantity: string;
  /** forces and moments are peaks of an impact resolved in time, else impulses over `duration` [N, N m, N s or N m s] */
  load: number;
  /** of the robot file [as `load`] */
  rating: number;
  /** 1 - load over rating; negative: exceeded [1] */
  margin: number;
  /** the load is a mean over `duration`, which is an assumption; the peak may be larger */
  assumed_duration: boolean;
}
export const kImpactMargin: FieldNote[] = [
  ["of","","joint or end-effector"],
  ["quantity","","`force`, `moment`, `impulse`, `angular_impulse`, `driving` or `driving_impulse`"],
  ["load","N, N m, N s or N m s","forces and moments are peaks of an impact resolved in time, else impulses over `duration`"],
  ["rating","as `load`","of the robot file"],
  ["margin","1","1 - load over rating; negative: exceeded"],
  ["assumed_duration","","the load is a mean over `duration`, which is an assumption; the peak may be larger"],
];

// by how much all relative motion of the impact may grow, scaled alike, until the first rating of an arm (gripper, and joints down to the base) is reached. null: nothing bears a load.
export interface SpeedLimit {
  /** of the arm */
  end_effector: string;
  /** by which relative velocities may grow until a rating of the arm is reached [1] */
  factor: number | null;
  /** relative speed at which a rating of the arm is reached [m/s] */
  largest_speed: number | null;
  /** joint or end-effector whose rating is reached first */
  of: string;
  /** which of its ratings */
  quantity: string;
}
export const kSpeedLimit: FieldNote[] = [
  ["end_effector","","of the arm"],
  ["factor","1","by which relative velocities may grow until a rating of the arm is reached"],
  ["largest_speed","m/s","relative speed at which a rating of the arm is reached"],
  ["of","","joint or end-effector whose rating is reached first"],
  ["quantity","","which of its ratings"],
];

// grasps that are released together.
export interface ReleaseReport {
  /** when they were released [s] */
  time: number;
  /** that released their targets */
  end_effectors: string[];
  /** that each of them held */
  targets: string[];
}
export const kReleaseReport: FieldNote[] = [
  ["time","s","when they were released"],
  ["end_effectors","","that released their targets"],
  ["targets","","that each of them held"],
];

// the motion after the impact, or of a run without one.
export interface PostImpact {
  /** at the end of the motion */
  end?: PhaseEnd;
  /** that have ended, in the order of time */
  phases: MotionPhaseReport[];
  /** absent where no loop was closed */
  loops?: LoopReport[];
  /** per phase and grasp; absent where nothing was held */
  grasp_loads?: GraspLoad[];
  /** absent without it */
  detumbling?: DetumblingReport;
  /** absent without it */
  base_keeping?: BaseKeepingReport;
  /** absent without it */
  identification?: IdentificationReport;
  /** absent without it */
  impedance?: ImpedanceReport;
  /** absent without it */
  grasp_force?: GraspForceReport;
  /** absent where the scenario states no rates */
  at_rest?: RestReport;
}
export const kPostImpact: FieldNote[] = [
  ["end","","at the end of the motion"],
  ["phases","","that have ended, in the order of time"],
  ["loops","","absent where no loop was closed"],
  ["grasp_loads","","per phase and grasp; absent where nothing was held"],
  ["detumbling","","absent without it"],
  ["base_keeping","","absent without it"],
  ["identification","","absent without it"],
  ["impedance","","absent without it"],
  ["grasp_force","","absent without it"],
  ["at_rest","","absent where the scenario states no rates"],
];

// a phase of the motion after the approach that has ended.
export interface MotionPhaseReport {
  /** of the phase; its samples in the time series have it, pieces after an event NAME_2, ... */
  name: string;
  /** of the phase [s] */
  begin: number;
  /** of the phase [s] */
  end: number;
  /** `duration`: after its duration. `condition`: what it is `until` held before */
  ended: MotionPhaseEnd;
  /** at its end */
  state?: PhaseEnd;
}
export const kMotionPhaseReport: FieldNote[] = [
  ["name","","of the phase; its samples in the time series have it, pieces after an event NAME_2, ..."],
  ["begin","s","of the phase"],
  ["end","s","of the phase"],
  ["ended","","`duration`: after its duration. `condition`: what it is `until` held before"],
  ["state","","at its end"],
];

export type MotionPhaseEnd = "duration" | "condition";

// how loops were kept closed in one phase, also of the approach where a grasp closed before its end. What remains after projection is in the ledger (`loop_closure_...`).
export interface LoopReport {
  /** with closed loops */
  phase: string;
  /** `end-effector - target`: the grasps that close loops of the tree */
  closures: string[];
  /** of all closures [1] */
  rows: number;
  /** as the phase began; smaller than `rows`: some say the same, and internal loads are not all determined [1] */
  rank: number;
  /** largest defect that one step left before projection [m] */
  unprojected_position: number;
  /** likewise [rad] */
  unprojected_angle: number;
  /** the same of its rate [m/s] */
  unprojected_velocity: number;
  /** likewise [rad/s] */
  unprojected_angular_velocity: number;
  /** sum of all corrections, in the norm that judges steps, times the tolerance [1] */
  correction_total: number;
  /** sum of the steps' error estimates in the same measure: larger, or projection would hide faults [1] */
  integration_error: number;
}
export const kLoopReport: FieldNote[] = [
  ["phase","","with closed loops"],
  ["closures","","`end-effector - target`: the grasps that close loops of the tree"],
  ["rows","1","of all closures"],
  ["rank","1","as the phase began; smaller than `rows`: some say the same, and internal loads are not all determined"],
  ["unprojected_position","m","largest defect that one step left before projection"],
  ["unprojected_angle","rad","likewise"],
  ["unprojected_velocity","m/s","the same of its rate"],
  ["unprojected_angular_velocity","rad/s","likewise"],
  ["correction_total","1","sum of all corrections, in the norm that judges steps, times the tolerance"],
  ["integration_error","1","sum of the steps' error estimates in the same measure: larger, or projection would hide faults"],
];

// the load on one grasp while it holds, in one phase. Its course is in the time series `grasps/END_EFFECTOR/force` and `moment`.
export interface GraspLoad {
  /** in which the grasp held */
  phase: string;
  /** of the grasp */
  end_effector: string;
  /** of the grasp */
  target: string;
  /** on the robot, at the grasp [N] */
  largest_force: number;
  /** when that was [s] */
  force_time: number;
  /** about the grasp [N m] */
  largest_moment: number;
  /** when that was [s] */
  moment_time: number;
  /** six, per component, angular x, y, z then linear x, y, z, in W, as the phase began; where a self-stress leaves components open, the least in the metric of the impact is given */
  determined: boolean[];
}
export const kGraspLoad: FieldNote[] = [
  ["phase","","in which the grasp held"],
  ["end_effector","","of the grasp"],
  ["target","","of the grasp"],
  ["largest_force","N","on the robot, at the grasp"],
  ["force_time","s","when that was"],
  ["largest_moment","N m","about the grasp"],
  ["moment_time","s","when that was"],
  ["determined","","six, per component, angular x, y, z then linear x, y, z, in W, as the phase began; where a self-stress leaves components open, the least in the metric of the impact is given"],
];

// a held target that the arms bring to rest.
export interface DetumblingReport {
  /** that is brought to rest */
  target: string;
  /** when the law begins [s] */
  begin: number;
  /** when it ends; from then on the joints hold [s] */
  end: number;
  /** `at_rest`: a millionth of the angular momentum is left. `joint_limit`: a joint reached the end of its range. `released`: the target was let go. `running`: the run ended before. Near configurations in which the arms cannot move the target in all directions (`least_condition`) the law goes on with the others */
  ended: LawEnd;
  /** whose range ended it; empty otherwise */
  joint: string;
  /** on the torque about the target's centre of mass [N m] */
  torque_bound: number;
  /** of the grasps about the target's centre of mass, by the target's motion: at the ends and in the middle of every step [N m] */
  largest_torque: number;
  /** of the target about its centre of mass, at the begin [N m s] */
  angular_momentum_before: number;
  /** at the end [N m s] */
  angular_momentum_after: number;
  /** of the target's centre of mass, relative to that of servicer and held targets [m/s] */
  speed_before: number;
  /** at the end [m/s] */
  speed_after: number;
  /** angular_momentum_before over torque_bound: what it takes where efforts suffice [s] */
  expected_duration: number;
  /** part of the torque bound that effort limits and ratings of grasps allow as the law begins; expected_duration over it is what the detumbling takes at that pace [1] */
  first_scale: number;
  /** minimum part of the torque bound that these limits allow; 1: they always sufficed [1] */
  least_scale: number;
  /** when that was [s] */
  least_scale_time: number;
  /** whether a smaller torque kept all efforts and grasps within their limits; if not, efforts were scaled down and the target did not move as asked for */
  within_limits: boolean;
  /** largest share of an effort limit or of a grasp's rating that the law asked for before efforts were scaled down; above 1: by how much the limits are too small [1] */
  largest_demand: number;
  /** when that was [s] */
  largest_demand_time: number;
  /** which limit that was; empty: nothing has a limit */
  limiting: string;
  /** of the target's accelerations by the efforts: least singular value over the largest, its least [1] */
  least_condition: number;
  /** when that was [s] */
  least_condition_time: number;
}
export const kDetumblingReport: FieldNote[] = [
  ["target","","that is brought to rest"],
  ["begin","s","when the law begins"],
  ["end","s","when it ends; from then on the joints hold"],
  ["ended","","`at_rest`: a millionth of the angular momentum is left. `joint_limit`: a joint reached the end of its range. `released`: the target was let go. `running`: the run ended before. Near configurations in which the arms cannot move the target in all directions (`least_condition`) the law goes on with the others"],
  ["joint","","whose range ended it; empty otherwise"],
  ["torque_bound","N m","on the torque about the target's centre of mass"],
  ["largest_torque","N m","of the grasps about the target's centre of mass, by the target's motion: at the ends and in the middle of every step"],
  ["angular_momentum_before","N m s","of the target about its centre of mass, at the begin"],
  ["angular_momentum_after","N m s","at the end"],
  ["speed_before","m/s","of the target's centre of mass, relative to that of servicer and held targets"],
  ["speed_after","m/s","at the end"],
  ["expected_duration","s","angular_momentum_before over torque_bound: what it takes where efforts suffice"],
  ["first_scale","1","part of the torque bound that effort limits and ratings of grasps allow as the law begins; expected_duration over it is what the detumbling takes at that pace"],
  ["least_scale","1","minimum part of the torque bound that these limits allow; 1: they always sufficed"],
  ["least_scale_time","s","when that was"],
  ["within_limits","","whether a smaller torque kept all efforts and grasps within their limits; if not, efforts were scaled down and the target did not move as asked for"],
  ["largest_demand","1","largest share of an effort limit or of a grasp's rating that the law asked for before efforts were scaled down; above 1: by how much the limits are too small"],
  ["largest_demand_time","s","when that was"],
  ["limiting","","which limit that was; empty: nothing has a limit"],
  ["least_condition","1","of the target's accelerations by the efforts: least singular value over the largest, its least"],
  ["least_condition_time","s","when that was"],
];

// a base whose attitude the joints keep.
export interface BaseKeepingReport {
  /** when the law begins [s] */
  begin: number;
  /** when it ends; from then on the joints hold [s] */
  end: number;
  /** `rank_lost`: the joints came near a configuration in which they cannot turn the base about all the axes that they could. `joint_limit`: a joint reached the end of its range. `running`: the run ended before */
  ended: LawEnd;
  /** whose range ended it; empty otherwise */
  joint: string;
  /** largest turn of the base away from its attitude [rad] */
  largest_angle: number;
  /** when that was [s] */
  largest_angle_time: number;
  /** at the end [rad] */
  angle_after: number;
  /** of the base, at the end [rad/s] */
  angular_velocity_after: number;
  /** axes about which the joints could turn the base, at the begin [1] */
  rank: number;
  /** least part of the motion that does not turn the base that the joints' effort limits let pass [1] */
  least_share: number;
  /** when that was [s] */
  least_share_time: number;
  /** whether what keeps the base stayed within the joints' effort limits; if not, efforts were cut and the base was not kept */
  within_limits: boolean;
  /** of the base's turning by the joint rates: the singular value of that rank over the largest, its least [1] */
  least_condition: number;
  /** when that was [s] */
  least_condition_time: number;
}
export const kBaseKeepingReport: FieldNote[] = [
  ["begin","s","when the law begins"],
  ["end","s","when it ends; from then on the joints hold"],
  ["ended","","`rank_lost`: the joints came near a configuration in which they cannot turn the base about all the axes that they could. `joint_limit`: a joint reached the end of its range. `running`: the run ended before"],
  ["joint","","whose range ended it; empty otherwise"],
  ["largest_angle","rad","largest turn of the base away from its attitude"],
  ["largest_angle_time","s","when that was"],
  ["angle_after","rad","at the end"],
  ["angular_velocity_after","rad/s","of the base, at the end"],
  ["rank","1","axes about which the joints could turn the base, at the begin"],
  ["least_share","1","least part of the motion that does not turn the base that the joints' effort limits let pass"],
  ["least_share_time","s","when that was"],
  ["within_limits","","whether what keeps the base stayed within the joints' effort limits; if not, efforts were cut and the base was not kept"],
  ["least_condition","1","of the base's turning by the joint rates: the singular value of that rank over the largest, its least"],
  ["least_condition_time","s","when that was"],
];

// mass, centre of mass and inertia of a held target, as the sensors show them.
export interface IdentificationReport {
  /** that is identified */
  target: string;
  /** of the samples [s] */
  begin: number;
  /** of the samples [s] */
  end: number;
  /** `done`. `released`: the target was let go before. `running`: the run ended before */
  ended: IdentificationEnd;
  /** instants at which sensors were read [1] */
  samples: number;
  /** whether the iteration on weights and rates did */
  converged: boolean;
  /** of ten: how many numbers the motion has shown [1] */
  rank: number;
  /** largest over smallest singular value that counts [1] */
  condition: number;
  /** near 1 if the noise is what is stated; without noise it is rounding's [1] */
  residual: number;
  /** `determined`; `ratio_only`: known but for one number, on which others depend too; `not_determined` */
  mass: string;
  /** likewise, of the centre of mass */
  com: string;
  /** likewise */
  inertia: string;
  /** the ten numbers, beside the truth */
  parameters: IdentifiedParameter[];
  /** changes of the parameters that no measurement shows, in words */
  unseen: string[];
  /** why no body has these parameters; empty: one can have them */
  impossible: string;
  /** when laws began to work with the estimate; absent: they did not [s] */
  used_from?: number;
}
export const kIdentificationReport: FieldNote[] = [
  ["target","","that is identified"],
  ["begin","s","of the samples"],
  ["end","s","of the samples"],
  ["ended","","`done`. `released`: the target was let go before. `running`: the run ended before"],
  ["samples","1","instants at which sensors were read"],
  ["converged","","whether the iteration on weights and rates did"],
  ["rank","1","of ten: how many numbers the motion has shown"],
  ["condition","1","largest over smallest singular value that counts"],
  ["residual","1","near 1 if the noise is what is stated; without noise it is rounding's"],
  ["mass","","`determined`; `ratio_only`: known but for one number, on which others depend too; `not_determined`"],
  ["com","","likewise, of the centre of mass"],
  ["inertia","","likewise"],
  ["parameters","","the ten numbers, beside the truth"],
  ["unseen","","changes of the parameters that no measurement shows, in words"],
  ["impossible","","why no body has these parameters; empty: one can have them"],
  ["used_from","s","when laws began to work with the estimate; absent: they did not"],
];

export type IdentificationEnd = "running" | "done" | "released";

// one of the ten numbers by which a body resists motion.
export interface IdentifiedParameter {
  /** `mass`, `com_x` ..., `inertia_xx` ..., in the target's frame, the inertia about the centre of mass */
  name: string;
  /** of the numbers */
  unit: string;
  /** null: not determined [`unit`] */
  value: number | null;
  /** standard; null: not determined, or no noise was stated [`unit`] */
  deviation: number | null;
  /** that of the simulated target [`unit`] */
  truth: number;
  /** value less truth [`unit`] */
  error: number | null;
}
export const kIdentifiedParameter: FieldNote[] = [
  ["name","","`mass`, `com_x` ..., `inertia_xx` ..., in the target's frame, the inertia about the centre of mass"],
  ["unit","","of the numbers"],
  ["value","`unit`","null: not determined"],
  ["deviation","`unit`","standard; null: not determined, or no noise was stated"],
  ["truth","`unit`","that of the simulated target"],
  ["error","`unit`","value less truth"],
];

// a target that several grasps hold and squeeze.
export interface GraspForceReport {
  /** that is held */
  target: string;
  /** when the law begins [s] */
  begin: number;
  /** when it ends; from then on the joints hold [s] */
  end: number;
  /** `rank_lost`: the arms came near a configuration in which they cannot move the target in all directions. `joint_limit`: a joint reached the end of its range. `released`: fewer than two grasps hold the target. `running`: the run ended before */
  ended: LawEnd;
  /** whose range ended it; empty otherwise */
  joint: string;
  /** of grasps that squeeze */
  pairs: Squeeze[];
  /** internal directions that the efforts reach beside the target's motion, at the begin [1] */
  internal_rank: number;
  /** largest difference of the grasps' internal wrenches from the reference, of all components, moments over the metric's length [N] */
  other_internal_force: number;
  /** of the target from where it is held; 0 with brake [m] */
  largest_distance: number;
  /** likewise [rad] */
  largest_angle: number;
  /** least part of the internal force that the joints' effort limits let pass [1] */
  least_scale: number;
  /** when that was [s] */
  least_scale_time: number;
  /** whether what moves the target stayed within the joints' effort limits; if not, efforts were cut and it did not move as asked for */
  within_limits: boolean;
  /** of the target's accelerations by the efforts: least singular value over the largest, its least [1] */
  least_condition: number;
  /** when that was [s] */
  least_condition_time: number;
}
export const kGraspForceReport: FieldNote[] = [
  ["target","","that is held"],
  ["begin","s","when the law begins"],
  ["end","s","when it ends; from then on the joints hold"],
  ["ended","","`rank_lost`: the arms came near a configuration in which they cannot move the target in all directions. `joint_limit`: a joint reached the end of its range. `released`: fewer than two grasps hold the target. `running`: the run ended before"],
  ["joint","","whose range ended it; empty otherwise"],
  ["pairs","","of grasps that squeeze"],
  ["internal_rank","1","internal directions that the efforts reach beside the target's motion, at the begin"],
  ["other_internal_force","N","largest difference of the grasps' internal wrenches from the reference, of all components, moments over the metric's length"],
  ["largest_distance","m","of the target from where it is held; 0 with brake"],
  ["largest_angle","rad","likewise"],
  ["least_scale","1","least part of the internal force that the joints' effort limits let pass"],
  ["least_scale_time","s","when that was"],
  ["within_limits","","whether what moves the target stayed within the joints' effort limits; if not, efforts were cut and it did not move as asked for"],
  ["least_condition","1","of the target's accelerations by the efforts: least singular value over the largest, its least"],
  ["least_condition_time","s","when that was"],
];

// the internal force between two grasps.
export interface Squeeze {
  /** the two end-effectors */
  between: string[];
  /** of the force with which they squeeze the target, at the end [N] */
  reference: number;
  /** with which they do, by the multipliers of the closed loops [N] */
  force: number;
  /** largest difference of the two [N] */
  largest_error: number;
  /** when that was [s] */
  largest_error_time: number;
}
export const kSqueeze: FieldNote[] = [
  ["between","","the two end-effectors"],
  ["reference","N","of the force with which they squeeze the target, at the end"],
  ["force","N","with which they do, by the multipliers of the closed loops"],
  ["largest_error","N","largest difference of the two"],
  ["largest_error_time","s","when that was"],
];

// whether the motion after the impact came to rest, post_impact.at_rest.
export interface RestReport {
  /** whether all rates were below their limits from `time` on to the end */
  at_rest: boolean;
  /** from which on they were; null: they were not [s] */
  time: number | null;
  /** of the base, in W, at the end [rad/s] */
  angular_velocity: number;
  /** post_impact.at_rest.angular_velocity [rad/s] */
  angular_velocity_limit: number;
  /** with the largest rate at the end; empty: joints are not evaluated */
  joint: string;
  /** its magnitude at the end [rad/s or m/s] */
  joint_rate: number;
  /** post_impact.at_rest.joint_rate; null: joints are not evaluated [rad/s or m/s] */
  joint_rate_limit: number | null;
}
export const kRestReport: FieldNote[] = [
  ["at_rest","","whether all rates were below their limits from `time` on to the end"],
  ["time","s","from which on they were; null: they were not"],
  ["angular_velocity","rad/s","of the base, in W, at the end"],
  ["angular_velocity_limit","rad/s","post_impact.at_rest.angular_velocity"],
  ["joint","","with the largest rate at the end; empty: joints are not evaluated"],
  ["joint_rate","rad/s or m/s","its magnitude at the end"],
  ["joint_rate_limit","rad/s or m/s","post_impact.at_rest.joint_rate; null: joints are not evaluated"],
];

// the largest of one load in one phase.
export interface PeakLoad {
  /** joint, end-effector, or `base control` */
  of: string;
  /** in motion: `force` and `moment`, the magnitudes of what a joint passes on at its origin, or a grasp at the grasp; `driving`, the effort of a joint's drive or brake along its axis; of base control `driving/x`, `driving/y`, `driving/z`, the torque about the base's axes. In impacts: `impulse`, `angular_impulse`, `driving_impulse`, and `force`, `moment`, `driving`: the peaks of an impact in time, else means over `impact.duration` */
  quantity: string;
  /** impacts are phases too: `contact`, `contact_2`, and brakes: `brake` */
  phase: string;
  /** largest magnitude [N, N m, N s or N m s] */
  peak: number;
  /** when that is [s] */
  time: number;
  /** of the robot file; null: none. Of a drive in motion the smaller of `rating.driving` and `limits.effort` [as `peak`] */
  rating: number | null;
  /** 1 - peak over rating; negative: exceeded; 0 of a drive: saturated at its effort limit; null: no rating [1] */
  margin: number | null;
  /** a mean over `impact.duration`, which is an assumption; the peak may be larger */
  assumed_duration: boolean;
}
export const kPeakLoad: FieldNote[] = [
  ["of","","joint, end-effector, or `base control`"],
  ["quantity","","in motion: `force` and `moment`, the magnitudes of what a joint passes on at its origin, or a grasp at the grasp; `driving`, the effort of a joint's drive or brake along its axis; of base control `driving/x`, `driving/y`, `driving/z`, the torque about the base's axes. In impacts: `impulse`, `angular_impulse`, `driving_impulse`, and `force`, `moment`, `driving`: the peaks of an impact in time, else means over `impact.duration`"],
  ["phase","","impacts are phases too: `contact`, `contact_2`, and brakes: `brake`"],
  ["peak","N, N m, N s or N m s","largest magnitude"],
  ["time","s","when that is"],
  ["rating","as `peak`","of the robot file; null: none. Of a drive in motion the smaller of `rating.driving` and `limits.effort`"],
  ["margin","1","1 - peak over rating; negative: exceeded; 0 of a drive: saturated at its effort limit; null: no rating"],
  ["assumed_duration","","a mean over `impact.duration`, which is an assumption; the peak may be larger"],
];

// a reaction wheel of the base.
export interface WheelReport {
  /** of the wheel */
  name: string;
  /** about its axis [kg m^2] */
  inertia: number;
  /** relative to the base, as the run began [rad/s] */
  rate_before: number;
  /** as it ended [rad/s] */
  rate_after: number;
  /** inertia times rate relative to the base, as it ended [N m s] */
  momentum_after: number;
  /** of either sign, at the instants that were looked at [rad/s] */
  largest_rate: number;
  /** null: none [rad/s] */
  rate_limit: number | null;
  /** of its motor, likewise; null: nobody looked [N m] */
  largest_torque: number | null;
  /** null: none [N m] */
  torque_limit: number | null;
}
export const kWheelReport: FieldNote[] = [
  ["name","","of the wheel"],
  ["inertia","kg m^2","about its axis"],
  ["rate_before","rad/s","relative to the base, as the run began"],
  ["rate_after","rad/s","as it ended"],
  ["momentum_after","N m s","inertia times rate relative to the base, as it ended"],
  ["largest_rate","rad/s","of either sign, at the instants that were looked at"],
  ["rate_limit","rad/s","null: none"],
  ["largest_torque","N m","of its motor, likewise; null: nobody looked"],
  ["torque_limit","N m","null: none"],
];

// the control moment gyros of the base.
export interface GyrosReport {
  /** in the robot's order */
  each: GyroReport[];
  /** least root of det(A Aᵀ), A the momenta's derivatives by the gimbal angles over the largest momentum, at the instants that were looked at; 0: about one axis no torque can be given [1] */
  least_singularity_measure: number;
  /** whether a torque was asked of them */
  steered: boolean;
  /** measure below which they are near a singularity; null: never steered [1] */
  near: number | null;
  /** largest part of the torque asked for that the commanded gimbal rates leave out, near singularities or at largest rates; null: never steered, or nobody looked [N m] */
  largest_torque_lacking: number | null;
  /** times near a singularity while a torque is asked of them */
  hazards: SingularityHazard[];
}
export const kGyrosReport: FieldNote[] = [
  ["each","","in the robot's order"],
  ["least_singularity_measure","1","least root of det(A Aᵀ), A the momenta's derivatives by the gimbal angles over the largest momentum, at the instants that were looked at; 0: about one axis no torque can be given"],
  ["steered","","whether a torque was asked of them"],
  ["near","1","measure below which they are near a singularity; null: never steered"],
  ["largest_torque_lacking","N m","largest part of the torque asked for that the commanded gimbal rates leave out, near singularities or at largest rates; null: never steered, or nobody looked"],
  ["hazards","","times near a singularity while a torque is asked of them"],
];

// a control moment gyro of the base.
export interface GyroReport {
  /** of the gyro */
  name: string;
  /** of its rotor relative to the gimbal [N m s] */
  momentum: number;
  /** of its gimbal, as the run began [rad] */
  angle_before: number;
  /** as it ended [rad] */
  angle_after: number;
  /** of the gimbal, of either sign, at the instants that were looked at [rad/s] */
  largest_rate: number;
  /** largest that is commanded; null: none [rad/s] */
  rate_limit: number | null;
  /** of the gimbal's motor, likewise; null: nobody looked [N m] */
  largest_torque: number | null;
  /** null: none [N m] */
  torque_limit: number | null;
  /** of the motor that keeps the rotor's rate, likewise; null: nobody looked [N m] */
  largest_spin_torque: number | null;
}
export const kGyroReport: FieldNote[] = [
  ["name","","of the gyro"],
  ["momentum","N m s","of its rotor relative to the gimbal"],
  ["angle_before","rad","of its gimbal, as the run began"],
  ["angle_after","rad","as it ended"],
  ["largest_rate","rad/s","of the gimbal, of either sign, at the instants that were looked at"],
  ["rate_limit","rad/s","largest that is commanded; null: none"],
  ["largest_torque","N m","of the gimbal's motor, likewise; null: nobody looked"],
  ["torque_limit","N m","null: none"],
  ["largest_spin_torque","N m","of the motor that keeps the rotor's rate, likewise; null: nobody looked"],
];

// a time in which gyros that are steered are near a singular configuration.
export interface SingularityHazard {
  /** when it began [s] */
  begin: number;
  /** how long it lasted; each integration step counts as its middle is [s] */
  duration: number;
  /** of singularity, in these middles [1] */
  least_measure: number;
  /** part of the torque asked for, likewise [N m] */
  largest_torque_lacking: number;
}
export const kSingularityHazard: FieldNote[] = [
  ["begin","s","when it began"],
  ["duration","s","how long it lasted; each integration step counts as its middle is"],
  ["least_measure","1","of singularity, in these middles"],
  ["largest_torque_lacking","N m","part of the torque asked for, likewise"],
];

// what a joint with sticking friction, stops, or a motor whose electricity is known did in one phase.
export interface JointReport {
  /** in motion */
  phase: string;
  /** of the robot */
  joint: string;
  /** at the phase's end. `moving`: it is free to. `stuck`: friction holds it. `at_lower_stop`, `at_upper_stop`: it rests there. `prescribed`: it moves as prescribed, and neither sticks nor meets its stops */
  mode: JointMode;
  /** times that it came to rest [1] */
  sticks: number;
  /** times that it left it [1] */
  breakaways: number;
  /** largest friction while it was held, at any sample or time step, over its breakaway effort `static`; null: its friction does not stick [1] */
  friction_share: number | null;
  /** false: closed loops left the friction of this joint undetermined while it was held. The values reported are the admissible set with the minimum sum of squared shares of breakaway */
  friction_determined: boolean;
  /** that its friction made, stops apart [J] */
  friction_heat: number;
  /** times that it met a stop [1] */
  stop_impacts: number;
  /** in these impacts, by the whole system [J] */
  stop_energy_lost: number;
  /** mechanical work of its motor on the joint [J] */
  motor_work: number;
  /** current squared times resistance, over time; null: its motor's torque constant is not known [J] */
  copper_loss: number | null;
  /** copper_loss + motor_work: what the motor took, less what it gave back while it braked; null likewise [J] */
  electrical_energy: number | null;
}
export const kJointReport: FieldNote[] = [
  ["phase","","in motion"],
  ["joint","","of the robot"],
  ["mode","","at the phase's end. `moving`: it is free to. `stuck`: friction holds it. `at_lower_stop`, `at_upper_stop`: it rests there. `prescribed`: it moves as prescribed, and neither sticks nor meets its stops"],
  ["sticks","1","times that it came to rest"],
  ["breakaways","1","times that it left it"],
  ["friction_share","1","largest friction while it was held, at any sample or time step, over its breakaway effort `static`; null: its friction does not stick"],
  ["friction_determined","","false: closed loops left the friction of this joint undetermined while it was held. The values reported are the admissible set with the minimum sum of squared shares of breakaway"],
  ["friction_heat","J","that its friction made, stops apart"],
  ["stop_impacts","1","times that it met a stop"],
  ["stop_energy_lost","J","in these impacts, by the whole system"],
  ["motor_work","J","mechanical work of its motor on the joint"],
  ["copper_loss","J","current squared times resistance, over time; null: its motor's torque constant is not known"],
  ["electrical_energy","J","copper_loss + motor_work: what the motor took, less what it gave back while it braked; null likewise"],
];

export type JointMode = "moving" | "stuck" | "at_lower_stop" | "at_upper_stop" | "prescribed";

// a joint that met a stop at the end of its range.
export interface StopImpact {
  /** when it happened [s] */
  time: number;
  /** of the robot */
  joint: string;
  /** whether it was the upper end of its range */
  upper: boolean;
  /** of the joint [rad/s or m/s] */
  rate_before: number;
  /** of the joint [rad/s or m/s] */
  rate_after: number;
  /** of the stop on the joint, along its axis [N m s or N s] */
  impulse: number;
  /** by the whole system [J] */
  energy_lost: number;
}
export const kStopImpact: FieldNote[] = [
  ["time","s","when it happened"],
  ["joint","","of the robot"],
  ["upper","","whether it was the upper end of its range"],
  ["rate_before","rad/s or m/s","of the joint"],
  ["rate_after","rad/s or m/s","of the joint"],
  ["impulse","N m s or N s","of the stop on the joint, along its axis"],
  ["energy_lost","J","by the whole system"],
];

// the thrusters of the base. The robot's mass stays what it is.
export interface ThrustersReport {
  /** in the robot's order */
  each: ThrusterReport[];
  /** used by all [kg] */
  propellant: number;
  /** of the robot file; null: nobody says [kg] */
  at_hand: number | null;
  /** used beyond what is at hand; 0: none [kg] */
  excess: number;
  /** absent without it */
  dumping?: DumpingReport;
  /** plumes that met something */
  hazards: PlumeHazard[];
}
export const kThrustersReport: FieldNote[] = [
  ["each","","in the robot's order"],
  ["propellant","kg","used by all"],
  ["at_hand","kg","of the robot file; null: nobody says"],
  ["excess","kg","used beyond what is at hand; 0: none"],
  ["dumping","","absent without it"],
  ["hazards","","plumes that met something"],
];

// a thruster of the base.
export interface ThrusterReport {
  /** of the thruster */
  name: string;
  /** how often its valve opened [1] */
  firings: number;
  /** how long it was open [s] */
  on_time: number;
  /** on_time over the time of the phases in which thrusters are at work [1] */
  duty: number;
  /** of its force, ramps included [N s] */
  impulse: number;
  /** impulse over specific impulse and 9.80665 m/s^2 [kg] */
  propellant: number;
}
export const kThrusterReport: FieldNote[] = [
  ["name","","of the thruster"],
  ["firings","1","how often its valve opened"],
  ["on_time","s","how long it was open"],
  ["duty","1","on_time over the time of the phases in which thrusters are at work"],
  ["impulse","N s","of its force, ramps included"],
  ["propellant","kg","impulse over specific impulse and 9.80665 m/s^2"],
];

// thrusters take out the wheels' momentum.
export interface DumpingReport {
  /** how often it began [1] */
  begun: number;
  /** when it did first; 0 if never [s] */
  first_begin: number;
  /** how long it went on in all [s] */
  duration: number;
  /** whether it went on as the run ended */
  active: boolean;
  /** largest size of the wheels' momentum at the instants at which pulses may begin [N m s] */
  largest_momentum: number;
}
export const kDumpingReport: FieldNote[] = [
  ["begun","1","how often it began"],
  ["first_begin","s","when it did first; 0 if never"],
  ["duration","s","how long it went on in all"],
  ["active","","whether it went on as the run ended"],
  ["largest_momentum","N m s","largest size of the wheels' momentum at the instants at which pulses may begin"],
];

// a body in the plume of a thruster that fires.
export interface PlumeHazard {
  /** that fires */
  thruster: string;
  /** a link or a target, as the clearance names it */
  body: string;
  /** when it was first so [s] */
  first_time: number;
  /** of firing with one of the body's points in the cone: corners, middles of edges and faces of boxes, ends of cylinders and capsules, centres of all shapes, else its centre of mass; each integration step counts as its middle is [s] */
  duration: number;
}
export const kPlumeHazard: FieldNote[] = [
  ["thruster","","that fires"],
  ["body","","a link or a target, as the clearance names it"],
  ["first_time","s","when it was first so"],
  ["duration","s","of firing with one of the body's points in the cone: corners, middles of edges and faces of boxes, ends of cylinders and capsules, centres of all shapes, else its centre of mass; each integration step counts as its middle is"],
];

// an actuator that was at its limit.
export interface SaturationReport {
  /** kind of actuator */
  actuator: SaturatedActuator;
  /** of the wheel, gyro, thruster or joint; of base control the axis `x`, `y` or `z` */
  name: string;
  /** that is at its limit. */
  quantity: SaturatedQuantity;
  /** of a thruster the share of time 1, of a singularity the measure below which an array is near [rad/s, N m, N or 1] */
  limit: number;
  /** start of the first saturation [s] */
  first_time: number;
  /** total time at the limit, by integration steps [s] */
  duration: number;
  /** duration over the simulated time of all phases of motion [1] */
  share: number;
  /** whether the actuator was at its limit at the end of the run */
  at_end: boolean;
}
export const kSaturationReport: FieldNote[] = [
  ["actuator","","kind of actuator"],
  ["name","","of the wheel, gyro, thruster or joint; of base control the axis `x`, `y` or `z`"],
  ["quantity","","that is at its limit."],
  ["limit","rad/s, N m, N or 1","of a thruster the share of time 1, of a singularity the measure below which an array is near"],
  ["first_time","s","start of the first saturation"],
  ["duration","s","total time at the limit, by integration steps"],
  ["share","1","duration over the simulated time of all phases of motion"],
  ["at_end","","whether the actuator was at its limit at the end of the run"],
];

export type SaturatedActuator = "wheel" | "gyro" | "gyros" | "thruster" | "joint" | "base_control";

export type SaturatedQuantity = "rate" | "torque" | "effort" | "duty" | "singularity";

// stability of the control loops in one phase of motion.
export interface StabilityReport {
  /** of motion */
  phase: string;
  /** of the phase. */
  verdict: Stability;
  /** for the verdict */
  reason: string;
  /** the rate that decides, `base x` or a joint's error of rate; empty: none */
  of: string;
  /** of its oscillation at the end of the phase; 0: it does not oscillate [s] */
  period: number;
  /** largest in the first third of the oscillation, or of the phase [rad/s or m/s] */
  amplitude_before: number;
  /** largest in the last third [rad/s or m/s] */
  amplitude_after: number;
  /** share of the last third in which the actuators of this rate saturated [1] */
  saturated_share: number;
}
export const kStabilityReport: FieldNote[] = [
  ["phase","","of motion"],
  ["verdict","","of the phase."],
  ["reason","","for the verdict"],
  ["of","","the rate that decides, `base x` or a joint's error of rate; empty: none"],
  ["period","s","of its oscillation at the end of the phase; 0: it does not oscillate"],
  ["amplitude_before","rad/s or m/s","largest in the first third of the oscillation, or of the phase"],
  ["amplitude_after","rad/s or m/s","largest in the last third"],
  ["saturated_share","1","share of the last third in which the actuators of this rate saturated"],
];

export type Stability = "unstable" | "not_evaluated" | "stable";

// distances between bodies with shapes.
export interface Clearances {
  /** pairs of bodies that were not checked: the link that grasps and its target until the grasp closes or is missed, and while it holds (an end-effector that passes *through* its own target before is not reported), and pairs ignored by the scenario. From a miss, a rebound or a release on the pair is checked: until it has come to the required clearance, an overlap counts only where it is deeper than when the grasp opened. Neighbours along the tree are not checked */
  unwatched: [string, string][];
  /** of all phases */
  minimum: MinimumClearance;
  /** per phase */
  phases: MinimumClearance[];
  /** bodies too near */
  events: ClearanceEvent[];
}
export const kClearances: FieldNote[] = [
  ["unwatched","","pairs of bodies that were not checked: the link that grasps and its target until the grasp closes or is missed, and while it holds (an end-effector that passes *through* its own target before is not reported), and pairs ignored by the scenario. From a miss, a rebound or a release on the pair is checked: until it has come to the required clearance, an overlap counts only where it is deeper than when the grasp opened. Neighbours along the tree are not checked"],
  ["minimum","","of all phases"],
  ["phases","","per phase"],
  ["events","","bodies too near"],
];

// the minimum distance of any two bodies that are watched, in one phase.
export interface MinimumClearance {
  /** in which bodies with shapes were watched */
  phase: string;
  /** negative: a depth of overlap; null: no pair was watched [m] */
  distance: number | null;
  /** that come nearest */
  bodies: [string, string];
  /** of them that are nearest, in W [m] */
  points: [[number, number, number], [number, number, number]];
  /** when that is [s] */
  time: number;
}
export const kMinimumClearance: FieldNote[] = [
  ["phase","","in which bodies with shapes were watched"],
  ["distance","m","negative: a depth of overlap; null: no pair was watched"],
  ["bodies","","that come nearest"],
  ["points","m","of them that are nearest, in W"],
  ["time","s","when that is"],
];

// a time during which two bodies were nearer to each other than required.
export interface ClearanceEvent {
  /** of this time */
  phase: string;
  /** that were too near */
  bodies: [string, string];
  /** of this time; if it was under way when its phase began, that instant [s] */
  begin: number;
  /** likewise [s] */
  end: number;
  /** the distance that was asked for [m] */
  required: number;
  /** negative: a depth of overlap [m] */
  minimum_distance: number;
  /** when that was [s] */
  minimum_time: number;
  /** when the two begin to overlap, which may be later than `begin`; absent: they do not [s] */
  overlap_begin?: number;
}
export const kClearanceEvent: FieldNote[] = [
  ["phase","","of this time"],
  ["bodies","","that were too near"],
  ["begin","s","of this time; if it was under way when its phase began, that instant"],
  ["end","s","likewise"],
  ["required","m","the distance that was asked for"],
  ["minimum_distance","m","negative: a depth of overlap"],
  ["minimum_time","s","when that was"],
  ["overlap_begin","s","when the two begin to overlap, which may be later than `begin`; absent: they do not"],
];

// limits of joints, drives and base control.
export interface Limits {
  /** in the order of time */
  events: LimitEvent[];
}
export const kLimits: FieldNote[] = [
  ["events","","in the order of time"],
];

// a time during which a joint was beyond one of its limits, or a motor at it. Efforts are looked at in every step of the integrator, as loads are.
export interface LimitEvent {
  /** which limit. */
  kind: LimitKind;
  /** or `base control x`, `y`, `z` */
  joint: string;
  /** of this time */
  phase: string;
  /** of this time [s] */
  begin: number;
  /** likewise [s] */
  end: number;
  /** with its sign: a rate of -0.3 against a limit of 0.2 has the limit -0.2 [as the joint's] */
  limit: number;
  /** rad or m, rad/s or m/s, N m or N [as the joint's] */
  worst_value: number;
  /** when that was [s] */
  worst_time: number;
}
export const kLimitEvent: FieldNote[] = [
  ["kind","","which limit."],
  ["joint","","or `base control x`, `y`, `z`"],
  ["phase","","of this time"],
  ["begin","s","of this time"],
  ["end","s","likewise"],
  ["limit","as the joint's","with its sign: a rate of -0.3 against a limit of 0.2 has the limit -0.2"],
  ["worst_value","as the joint's","rad or m, rad/s or m/s, N m or N"],
  ["worst_time","s","when that was"],
];

export type LimitKind = "position" | "rate" | "effort" | "effort_saturated";

// whether a robot could do this. The motion feels none of it: bodies pass through each other.
export interface Feasibility {
  /** `not checked`: clearance is switched off, bodies lack shapes, nothing moves, or the run failed before its end, and what was looked at was kept. A violation that was found is a `no` whatever else was not looked at. Joints without limits have nothing to check */
  verdict: Verdict;
  /** as on the terminal */
  sentence: string;
  /** the first violation in time; absent if there is none */
  first?: Violation;
  /** the worst of all; absent if there is none */
  worst?: GradedViolation;
  /** the worst of each phase; absent if there is none */
  by_phase?: GradedViolation[];
  /** what nobody looked at, and why */
  not_checked: string[];
  /** when bodies begin to overlap: from then on the motion is beyond what the model can say. Absent: they do not, as far as that was checked [s] */
  valid_until?: number;
}
export const kFeasibility: FieldNote[] = [
  ["verdict","","`not checked`: clearance is switched off, bodies lack shapes, nothing moves, or the run failed before its end, and what was looked at was kept. A violation that was found is a `no` whatever else was not looked at. Joints without limits have nothing to check"],
  ["sentence","","as on the terminal"],
  ["first","","the first violation in time; absent if there is none"],
  ["worst","","the worst of all; absent if there is none"],
  ["by_phase","","the worst of each phase; absent if there is none"],
  ["not_checked","","what nobody looked at, and why"],
  ["valid_until","s","when bodies begin to overlap: from then on the motion is beyond what the model can say. Absent: they do not, as far as that was checked"],
];

export type Verdict = "yes" | "no" | "not checked";

// something that a real robot could not have done.
export interface Violation {
  /** `overlap`; `clearance`: nearer than required; `position`, `rate`, `effort` of a joint */
  kind: string;
  /** in words: which bodies, which joint */
  what: string;
  /** in which it begins */
  phase: string;
  /** when it begins [s] */
  time: number;
}
export const kViolation: FieldNote[] = [
  ["kind","","`overlap`; `clearance`: nearer than required; `position`, `rate`, `effort` of a joint"],
  ["what","","in words: which bodies, which joint"],
  ["phase","","in which it begins"],
  ["time","s","when it begins"],
];

// a violation at its worst. Overlaps count more than distances, these more than limits; then depth, lacking distance, relative excess.
export interface GradedViolation {
  /** as in `Violation` */
  kind: string;
  /** in words, with how far it went */
  what: string;
  /** in which it is */
  phase: string;
  /** of the worst instant [s] */
  time: number;
  /** depth of the overlap, the distance, the joint's value [m, or as the joint's] */
  value: number;
}
export const kGradedViolation: FieldNote[] = [
  ["kind","","as in `Violation`"],
  ["what","","in words, with how far it went"],
  ["phase","","in which it is"],
  ["time","s","of the worst instant"],
  ["value","m, or as the joint's","depth of the overlap, the distance, the joint's value"],
];

// the proof: every check with its bound.
export interface Ledger {
  /** of the whole system */
  scale: LedgerScale;
  /** whether all rows of conservation pass. Where they do not, this run is no result, although everything computed is kept, and `grapnel run` ends with exit code 1 */
  pass: boolean;
  /** the verdict of `Feasibility` */
  feasible: Verdict;
  /** each of the checks, under its name */
  [NAME: string]: LedgerEntry | LedgerScale | boolean | Verdict;
}
export const kLedger: FieldNote[] = [
  ["scale","","of the whole system"],
  ["pass","","whether all rows of conservation pass. Where they do not, this run is no result, although everything computed is kept, and `grapnel run` ends with exit code 1"],
  ["feasible","","the verdict of `Feasibility`"],
];

// a quantity that is conserved or balanced, or a demand on the robot.
export interface LedgerEntry {
  /** the largest deviation found; null: not a number [see `unit`] */
  value: number | null;
  /** what it must not exceed [see `unit`] */
  bound: number;
  /** `value` <= `bound`, or nothing to check; null where nobody looked */
  pass: boolean | null;
  /** `1`: relative to the scale that `note` names */
  unit: string;
  /** what is compared, over which phases; of momentum and energy also the group of bodies that is worst, and its scale */
  note: string;
  /** false: there is nothing to check in this run; `value` is then 0 */
  applies: boolean;
  /** what a failure means. */
  kind: LedgerKind;
  /** why nobody looked, or not at all of it, although there is something to look at */
  not_checked?: string;
  /** of a row of conservation that fails: what mends it, or why nothing does */
  advice?: string;
}
export const kLedgerEntry: FieldNote[] = [
  ["value","see `unit`","the largest deviation found; null: not a number"],
  ["bound","see `unit`","what it must not exceed"],
  ["pass","","`value` <= `bound`, or nothing to check; null where nobody looked"],
  ["unit","","`1`: relative to the scale that `note` names"],
  ["note","","what is compared, over which phases; of momentum and energy also the group of bodies that is worst, and its scale"],
  ["applies","","false: there is nothing to check in this run; `value` is then 0"],
  ["kind","","what a failure means."],
  ["not_checked","","why nobody looked, or not at all of it, although there is something to look at"],
  ["advice","","of a row of conservation that fails: what mends it, or why nothing does"],
];

export type LedgerKind = "conservation" | "feasibility";

// the sizes of the whole system's momenta and energy. Rows are judged per group of bodies that touch, relative to the group's own.
export interface LedgerScale {
  /** largest over time of the sum of all |m v| [N s] */
  linear_momentum: number;
  /** of all (|I w| + |r x m v|), r from the system's centre of mass [N m s] */
  angular_momentum: number;
  /** largest kinetic energy [J] */
  energy: number;
}
export const kLedgerScale: FieldNote[] = [
  ["linear_momentum","N s","largest over time of the sum of all |m v|"],
  ["angular_momentum","N m s","of all (|I w| + |r x m v|), r from the system's centre of mass"],
  ["energy","J","largest kinetic energy"],
];

// what an integration cost.
export interface PhaseCost {
  /** that was integrated */
  phase: string;
  /** of the equations of motion [1] */
  rhs_evaluations: number;
  /** that were taken [1] */
  steps: number;
  /** steps that were repeated with a smaller size [1] */
  rejected: number;
}
export const kPhaseCost: FieldNote[] = [
  ["phase","","that was integrated"],
  ["rhs_evaluations","1","of the equations of motion"],
  ["steps","1","that were taken"],
  ["rejected","1","steps that were repeated with a smaller size"],
];
