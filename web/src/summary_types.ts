// Made by scripts/tables from the descriptions of results in grapnel/; edit those.

export type FieldNote = readonly [key: string, unit: string, text: string];

// summary of one capture, in SI units and radians.
export interface Summary {
  /** format of this file */
  schema: SummaryFormat;
  /** version of Grapnel */
  version: string;
  /** the simulated scenario */
  scenario: ScenarioNamed;
  /** how the run ended */
  status: CaptureStatus;
  /** body, time and condition of a failure; else empty */
  failure: string;
  /** warnings about the result */
  warnings: string[];
  /** answers of the result, as reports show them */
  verdicts: Answer[];
  /** orbit of the frame W; absent without one */
  orbit?: OrbitReport;
  /** flexible modes; absent without flexible bodies and joints */
  elastic?: Elastic[];
  /** sampled control; absent if control is continuous */
  control?: ControlReport;
  /** sensor readings compared with true values; absent without sensors */
  sensors?: SensorReport[];
  /** motion up to the capture; absent without an approach */
  approach?: Approach;
  /** whether the grasps closed; absent without grasps */
  capture?: Capture;
  /** first impact; absent without an impact */
  impact?: ImpactReport;
  /** impacts of grasps that closed later, in the order of time; absent if there are none */
  later_impacts?: ImpactReport[];
  /** releases of grasps, in the order of time; absent if there are none */
  releases?: ReleaseReport[];
  /** grasps that opened because their load exceeded their limits (`holds`) or that slipped too far, in the order of time; absent if there are none */
  losses?: LossReport[];
  /** slips of grasps beyond their limits, in the order of time; absent if there are none */
  slips?: SlipReport[];
  /** motion after the impact; absent without such motion */
  post_impact?: PostImpact;
  /** motion of a scenario without a capture; else absent */
  motion?: PostImpact;
  /** largest loads of every phase; absent without loads */
  loads?: PeakLoad[];
  /** reaction wheels; absent if there are none */
  wheels?: WheelReport[];
  /** control moment gyros; absent if there are none */
  gyros?: GyrosReport;
  /** actuators of the base of other kinds; absent if there are none */
  actuators?: ActuatorUse[];
  /** tendons with commands; absent if there are none */
  tendons?: TendonReport[];
  /** joints with sticking friction, stops or electrically modelled motors, per phase; absent if there are none */
  joints?: JointReport[];
  /** first hundred impacts of joints on their stops; absent if there are none */
  stop_impacts?: StopImpact[];
  /** number of all impacts on stops [1] */
  stop_impact_count?: number;
  /** thrusters; absent if there are none */
  thrusters?: ThrustersReport;
  /** saturated actuators, the longest saturation first; absent if there are none */
  saturation?: SaturationReport[];
  /** stability of control loops, per phase of motion; absent if it was not evaluated */
  stability?: StabilityReport[];
  /** linear models of the control loops, in the order of time; absent without `--margins` */
  control_loops?: ControlLoopReport[];
  /** entry of `loads` with the smallest margin over all phases; absent without ratings */
  worst_margin?: PeakLoad;
  /** contacts between shapes, one entry per pair of bodies that may touch, in the order of the scenario; absent if there are none */
  contacts?: ContactPairReport[];
  /** stages of captures by contacts, in the order of the scenario; absent if none are stated */
  stages?: StagesReport[];
  /** distances between bodies with shapes; absent if fewer than two bodies have shapes */
  clearance?: Clearances;
  /** limits of joints and drives */
  limits: Limits;
  /** whether a real robot could perform this motion */
  feasibility: Feasibility;
  /** conservation checks */
  ledger: Ledger;
  /** cost of each phase */
  cost: PhaseCost[];
}
export const kSummary: FieldNote[] = [
  ["schema","","format of this file"],
  ["version","","version of Grapnel"],
  ["scenario","","the simulated scenario"],
  ["status","","how the run ended"],
  ["failure","","body, time and condition of a failure; else empty"],
  ["warnings","","warnings about the result"],
  ["verdicts","","answers of the result, as reports show them"],
  ["orbit","","orbit of the frame W; absent without one"],
  ["elastic","","flexible modes; absent without flexible bodies and joints"],
  ["control","","sampled control; absent if control is continuous"],
  ["sensors","","sensor readings compared with true values; absent without sensors"],
  ["approach","","motion up to the capture; absent without an approach"],
  ["capture","","whether the grasps closed; absent without grasps"],
  ["impact","","first impact; absent without an impact"],
  ["later_impacts","","impacts of grasps that closed later, in the order of time; absent if there are none"],
  ["releases","","releases of grasps, in the order of time; absent if there are none"],
  ["losses","","grasps that opened because their load exceeded their limits (`holds`) or that slipped too far, in the order of time; absent if there are none"],
  ["slips","","slips of grasps beyond their limits, in the order of time; absent if there are none"],
  ["post_impact","","motion after the impact; absent without such motion"],
  ["motion","","motion of a scenario without a capture; else absent"],
  ["loads","","largest loads of every phase; absent without loads"],
  ["wheels","","reaction wheels; absent if there are none"],
  ["gyros","","control moment gyros; absent if there are none"],
  ["actuators","","actuators of the base of other kinds; absent if there are none"],
  ["tendons","","tendons with commands; absent if there are none"],
  ["joints","","joints with sticking friction, stops or electrically modelled motors, per phase; absent if there are none"],
  ["stop_impacts","","first hundred impacts of joints on their stops; absent if there are none"],
  ["stop_impact_count","1","number of all impacts on stops"],
  ["thrusters","","thrusters; absent if there are none"],
  ["saturation","","saturated actuators, the longest saturation first; absent if there are none"],
  ["stability","","stability of control loops, per phase of motion; absent if it was not evaluated"],
  ["control_loops","","linear models of the control loops, in the order of time; absent without `--margins`"],
  ["worst_margin","","entry of `loads` with the smallest margin over all phases; absent without ratings"],
  ["contacts","","contacts between shapes, one entry per pair of bodies that may touch, in the order of the scenario; absent if there are none"],
  ["stages","","stages of captures by contacts, in the order of the scenario; absent if none are stated"],
  ["clearance","","distances between bodies with shapes; absent if fewer than two bodies have shapes"],
  ["limits","","limits of joints and drives"],
  ["feasibility","","whether a real robot could perform this motion"],
  ["ledger","","conservation checks"],
  ["cost","","cost of each phase"],
];

export type SummaryFormat = "grapnel-summary/2";

// the simulated scenario.
export interface ScenarioNamed {
  /** name of the scenario */
  name: string;
  /** SHA-256 of the bytes of the scenario, all included files, and overrides */
  sha256: string;
}
export const kScenarioNamed: FieldNote[] = [
  ["name","","name of the scenario"],
  ["sha256","","SHA-256 of the bytes of the scenario, all included files, and overrides"],
];

export type CaptureStatus = "not_run" | "completed" | "failed";

// the answer of the result to one question.
export interface Answer {
  /** `Capture`, `Ledger`, `Feasibility` or `Loads and control` */
  question: string;
  /** kind of the answer. */
  tone: Tone;
  /** the answer in one to three words */
  word: string;
  /** the reason */
  sentence: string;
  /** grasps, failed checks, worst violations or further findings, one each */
  remarks: Remark[];
}
export const kAnswer: FieldNote[] = [
  ["question","","`Capture`, `Ledger`, `Feasibility` or `Loads and control`"],
  ["tone","","kind of the answer."],
  ["word","","the answer in one to three words"],
  ["sentence","","the reason"],
  ["remarks","","grasps, failed checks, worst violations or further findings, one each"],
];

export type Tone = "good" | "bad" | "warn" | "none";

// a line below a verdict.
export interface Remark {
  /** kind of the remark. */
  tone: Tone;
  /** subject of the remark; may be empty */
  of: string;
  /** the remark */
  text: string;
}
export const kRemark: FieldNote[] = [
  ["tone","","kind of the remark."],
  ["of","","subject of the remark; may be empty"],
  ["text","","the remark"],
];

// the orbit of the frame W.
export interface OrbitReport {
  /** central body; `own`: a gravitational parameter of the scenario */
  body: string;
  /** distance from its centre to the reference point, W's origin, at t = 0 [m] */
  radius: number;
  /** angular rate of the radial and along-track directions in W, at t = 0 [rad/s] */
  rate: number;
  /** period of the orbit [s] */
  period: number;
}
export const kOrbitReport: FieldNote[] = [
  ["body","","central body; `own`: a gravitational parameter of the scenario"],
  ["radius","m","distance from its centre to the reference point, W's origin, at t = 0"],
  ["rate","rad/s","angular rate of the radial and along-track directions in W, at t = 0"],
  ["period","s","period of the orbit"],
];

// small vibrations about the posture at one instant; closed loops are not included.
export interface Elastic {
  /** `start`, or `captured`: with the grasped targets */
  at: string;
  /** time of the posture [s] */
  time: number;
  /** number of springs that represent flexible bodies and joints [1] */
  springs: number;
  /** frequency of the fastest mode, base and joints free: it limits the step size [Hz] */
  fastest: number;
  /** the slowest modes, at most 20 */
  modes: ElasticMode[];
}
export const kElastic: FieldNote[] = [
  ["at","","`start`, or `captured`: with the grasped targets"],
  ["time","s","time of the posture"],
  ["springs","1","number of springs that represent flexible bodies and joints"],
  ["fastest","Hz","frequency of the fastest mode, base and joints free: it limits the step size"],
  ["modes","","the slowest modes, at most 20"],
];

// one mode of vibration; the modes are sorted from the slowest.
export interface ElasticMode {
  /** frequency with the base fixed and the joints braked; null: no further modes [Hz] */
  held: number | null;
  /** frequency with the base free and the joints braked [Hz] */
  braked: number | null;
  /** frequency with base and joints free [Hz] */
  free: number | null;
  /** damping ratio of `held` [1] */
  damping_ratio: number;
  /** effective mass of `held`, in the directions of the base's axes; zero for a fixed base [kg] */
  effective_mass: [number, number, number];
  /** effective inertia of `held`, about the base's axes; zero for a fixed base [kg m^2] */
  effective_inertia: [number, number, number];
}
export const kElasticMode: FieldNote[] = [
  ["held","Hz","frequency with the base fixed and the joints braked; null: no further modes"],
  ["braked","Hz","frequency with the base free and the joints braked"],
  ["free","Hz","frequency with base and joints free"],
  ["damping_ratio","1","damping ratio of `held`"],
  ["effective_mass","kg","effective mass of `held`, in the directions of the base's axes; zero for a fixed base"],
  ["effective_inertia","kg m^2","effective inertia of `held`, about the base's axes; zero for a fixed base"],
];

// the on-board computer that samples the control.
export interface ControlReport {
  /** time between samples [s] */
  period: number;
  /** time from a sample to the command computed from it [s] */
  delay: number;
  /** the controller: a library or an FMU as named in the scenario, or the name of a Python class; empty without one */
  plugin: string;
  /** SHA-256 of the library's bytes, or of the source of a Python class; empty without a controller */
  plugin_sha256: string;
}
export const kControlReport: FieldNote[] = [
  ["period","s","time between samples"],
  ["delay","s","time from a sample to the command computed from it"],
  ["plugin","","the controller: a library or an FMU as named in the scenario, or the name of a Python class; empty without one"],
  ["plugin_sha256","","SHA-256 of the library's bytes, or of the source of a Python class; empty without a controller"],
];

// readings of one sensor compared with the true values, at the sample times.
export interface SensorReport {
  /** name of the sensor, such as `joint position`, `gyro` or `force left` */
  sensor: string;
  /** unit of the errors; rad stands for m if a joint is prismatic */
  unit: string;
  /** between readings [s] */
  sample_time: number;
  /** number of values read: instants times channels times components [1] */
  readings: number;
  /** mean of reading minus true value [`unit`] */
  mean_error: number;
  /** root mean square of that error [`unit`] */
  rms_error: number;
  /** largest magnitude of that error [`unit`] */
  largest_error: number;
}
export const kSensorReport: FieldNote[] = [
  ["sensor","","name of the sensor, such as `joint position`, `gyro` or `force left`"],
  ["unit","","unit of the errors; rad stands for m if a joint is prismatic"],
  ["sample_time","s","between readings"],
  ["readings","1","number of values read: instants times channels times components"],
  ["mean_error","`unit`","mean of reading minus true value"],
  ["rms_error","`unit`","root mean square of that error"],
  ["largest_error","`unit`","largest magnitude of that error"],
];

// the motion up to the capture.
export interface Approach {
  /** state at the start of the phase */
  start?: PhaseEnd;
  /** state at the end of the phase */
  end?: PhaseEnd;
  /** planned joint rates at the end of the approach, in the order of `joints.names`; absent without a plan [rad/s or m/s] */
  planned_final_rates?: number[];
  /** plan of the joint motion */
  plan?: PlanReport;
  /** plans and the estimates that they use; absent if targets are known exactly and planned for once */
  navigation?: NavigationReport[];
  /** impedance control; absent without it */
  impedance?: LawReport;
}
export const kApproach: FieldNote[] = [
  ["start","","state at the start of the phase"],
  ["end","","state at the end of the phase"],
  ["planned_final_rates","rad/s or m/s","planned joint rates at the end of the approach, in the order of `joints.names`; absent without a plan"],
  ["plan","","plan of the joint motion"],
  ["navigation","","plans and the estimates that they use; absent if targets are known exactly and planned for once"],
  ["impedance","","impedance control; absent without it"],
];

// the system's state at the beginning or the end of a phase.
export interface PhaseEnd {
  /** time of this state [s] */
  time: number;
  /** motion of the robot's base */
  base: BodyMotion;
  /** motion of the robot's joints */
  joints: JointMotion;
  /** motion of the robot's end-effectors */
  end_effectors: EndEffectorMotion[];
  /** motion of the free bodies that may be grasped */
  targets: BodyMotion[];
}
export const kPhaseEnd: FieldNote[] = [
  ["time","s","time of this state"],
  ["base","","motion of the robot's base"],
  ["joints","","motion of the robot's joints"],
  ["end_effectors","","motion of the robot's end-effectors"],
  ["targets","","motion of the free bodies that may be grasped"],
];

// motion of a free body's frame at one instant.
export interface BodyMotion {
  /** name of the body */
  name: string;
  /** origin of the body's frame, in W [m] */
  position: [number, number, number];
  /** rotation from the body's axes to those of W [1] */
  quaternion_wxyz: [number, number, number, number];
  /** angular velocity of the body, in W [rad/s] */
  angular_velocity: [number, number, number];
  /** velocity of the origin of the body's frame, in W [m/s] */
  velocity: [number, number, number];
}
export const kBodyMotion: FieldNote[] = [
  ["name","","name of the body"],
  ["position","m","origin of the body's frame, in W"],
  ["quaternion_wxyz","1","rotation from the body's axes to those of W"],
  ["angular_velocity","rad/s","angular velocity of the body, in W"],
  ["velocity","m/s","velocity of the origin of the body's frame, in W"],
];

// the robot's joints at one instant.
export interface JointMotion {
  /** names of the joints */
  names: string[];
  /** joint positions in the order of `names`; m for prismatic joints [rad or m] */
  position: number[];
  /** joint velocities in the order of `names`; m/s for prismatic joints [rad/s or m/s] */
  velocity: number[];
}
export const kJointMotion: FieldNote[] = [
  ["names","","names of the joints"],
  ["position","rad or m","joint positions in the order of `names`; m for prismatic joints"],
  ["velocity","rad/s or m/s","joint velocities in the order of `names`; m/s for prismatic joints"],
];

// an end-effector and its motion relative to its grasp point.
export interface EndEffectorMotion {
  /** name of the end-effector */
  name: string;
  /** origin of the end-effector's frame, in W [m] */
  position: [number, number, number];
  /** velocity of that origin, in W [m/s] */
  velocity: [number, number, number];
  /** angular velocity of the end-effector, in W [rad/s] */
  angular_velocity: [number, number, number];
  /** target to grasp; this key and the keys below are absent if the end-effector grasps nothing */
  target?: string;
  /** grasp point on the target */
  grasp_point?: string;
  /** distance from the end-effector's origin to the grasp point [m] */
  miss_distance?: number;
  /** velocity of the end-effector minus that of the grasp point, in W [m/s] */
  relative_velocity?: [number, number, number];
  /** angular velocity of the end-effector minus that of the target, in W [rad/s] */
  relative_angular_velocity?: [number, number, number];
}
export const kEndEffectorMotion: FieldNote[] = [
  ["name","","name of the end-effector"],
  ["position","m","origin of the end-effector's frame, in W"],
  ["velocity","m/s","velocity of that origin, in W"],
  ["angular_velocity","rad/s","angular velocity of the end-effector, in W"],
  ["target","","target to grasp; this key and the keys below are absent if the end-effector grasps nothing"],
  ["grasp_point","","grasp point on the target"],
  ["miss_distance","m","distance from the end-effector's origin to the grasp point"],
  ["relative_velocity","m/s","velocity of the end-effector minus that of the grasp point, in W"],
  ["relative_angular_velocity","rad/s","angular velocity of the end-effector minus that of the target, in W"],
];

// the planned joint motion and the record of the search for it.
export interface PlanReport {
  /** joint names */
  joints: string[];
  /** joint reference at the capture; of the closest attempt if planning failed [rad or m] */
  final_position: number[];
  /** joint rate reference at the capture; of the closest attempt if planning failed [rad/s or m/s] */
  final_rates: number[];
  /** largest component of the required final motion that no joint rates produce [m/s or rad/s] */
  unmet_rate: number;
  /** evaluations of the base's motion while planning [1] */
  rhs_evaluations: number;
  /** whether a solution was found; this key and the keys down to `smallest_singular_value` are present only if final values were searched */
  found?: boolean;
  /** name of the minimized objective */
  objective?: string;
  /** minimum value of the objective [1] */
  objective_value?: number | null;
  /** terms of the weighted sum */
  terms?: PlanTerm[];
  /** deviation from the goal, per end-effector */
  miss?: PlannedMiss[];
  /** number of initial guesses [1] */
  starts?: number;
  /** number of initial guesses that led to a solution [1] */
  solutions?: number;
  /** number of solutions that differ by more than 1e-3 rad or m [1] */
  distinct_solutions?: number;
  /** Newton steps, summed over all initial guesses [1] */
  iterations?: number;
  /** smallest singular value of the derivative of the goal errors with respect to the final joint values; small: near a singularity [m/rad] */
  smallest_singular_value?: number | null;
  /** the final straight approach, if the scenario requests one */
  straight_in?: StraightInReport;
  /** properties of the last planned segment, if the trajectory was evaluated */
  path?: PlannedPath;
  /** evaluated capture times, if the scenario gives a window */
  window?: WindowReport;
  /** what the plan assumes of contacts before the capture; this key and `contacts` are present if bodies may touch */
  assumes?: string;
  /** pairs of bodies that touch before the planned capture */
  contacts?: PlannedContact[];
}
export const kPlanReport: FieldNote[] = [
  ["joints","","joint names"],
  ["final_position","rad or m","joint reference at the capture; of the closest attempt if planning failed"],
  ["final_rates","rad/s or m/s","joint rate reference at the capture; of the closest attempt if planning failed"],
  ["unmet_rate","m/s or rad/s","largest component of the required final motion that no joint rates produce"],
  ["rhs_evaluations","1","evaluations of the base's motion while planning"],
  ["found","","whether a solution was found; this key and the keys down to `smallest_singular_value` are present only if final values were searched"],
  ["objective","","name of the minimized objective"],
  ["objective_value","1","minimum value of the objective"],
  ["terms","","terms of the weighted sum"],
  ["miss","","deviation from the goal, per end-effector"],
  ["starts","1","number of initial guesses"],
  ["solutions","1","number of initial guesses that led to a solution"],
  ["distinct_solutions","1","number of solutions that differ by more than 1e-3 rad or m"],
  ["iterations","1","Newton steps, summed over all initial guesses"],
  ["smallest_singular_value","m/rad","smallest singular value of the derivative of the goal errors with respect to the final joint values; small: near a singularity"],
  ["straight_in","","the final straight approach, if the scenario requests one"],
  ["path","","properties of the last planned segment, if the trajectory was evaluated"],
  ["window","","evaluated capture times, if the scenario gives a window"],
  ["assumes","","what the plan assumes of contacts before the capture; this key and `contacts` are present if bodies may touch"],
  ["contacts","","pairs of bodies that touch before the planned capture"],
];

// one term of the sum that is a plan's objective.
export interface PlanTerm {
  /** name of the term, as in approach.plan.weights */
  name: string;
  /** weight, in the reciprocal of the value's unit [1] */
  weight: number;
  /** value of the term [rad^2; effort: (N m)^2; impulse: J; clearance: m; limits, manipulability, impulse_index, wheel_momentum: 1] [1] */
  value: number | null;
}
export const kPlanTerm: FieldNote[] = [
  ["name","","name of the term, as in approach.plan.weights"],
  ["weight","1","weight, in the reciprocal of the value's unit"],
  ["value","1","value of the term [rad^2; effort: (N m)^2; impulse: J; clearance: m; limits, manipulability, impulse_index, wheel_momentum: 1]"],
];

// deviation of an end-effector from its goal when the joints follow the plan exactly. It comes from a forward simulation with all forces where the planner corrects by simulation. If no plan was found, it belongs to the closest attempt.
export interface PlannedMiss {
  /** end-effector that misses */
  end_effector: string;
  /** distance from its goal; null: unknown [m] */
  distance: number | null;
  /** angle from the required grasp orientation; null: unknown [rad] */
  angle: number | null;
  /** deviation of the final relative velocity from final_speed along the approach direction, at the end of a final straight approach [m/s] */
  velocity?: number;
  /** deviation of the final relative angular velocity from zero, in the components that the grasp's orientation and `roll` constrain [rad/s] */
  angular_velocity?: number;
}
export const kPlannedMiss: FieldNote[] = [
  ["end_effector","","end-effector that misses"],
  ["distance","m","distance from its goal; null: unknown"],
  ["angle","rad","angle from the required grasp orientation; null: unknown"],
  ["velocity","m/s","deviation of the final relative velocity from final_speed along the approach direction, at the end of a final straight approach"],
  ["angular_velocity","rad/s","deviation of the final relative angular velocity from zero, in the components that the grasp's orientation and `roll` constrain"],
];

// the final straight approach to the grasp point.
export interface StraightInReport {
  /** start of the final straight approach [s] */
  begin: number;
  /** distance from the grasp point at the start [m] */
  stand_off: number;
  /** speed at which the end-effector meets the grasp point [m/s] */
  final_speed: number;
  /** minimum over the segment of the smallest singular value of the generalized Jacobian's rows in use [m/rad] */
  smallest_singular_value: number | null;
  /** whether joint rates were damped near a singularity */
  damped: boolean;
  /** interval in which rates were damped [s] */
  damped_interval: [number, number];
  /** largest component of the required motion that the joints do not produce, because of damping or a lack of freedom [m/s or rad/s] */
  unmet: number;
  /** time of the largest unmet component [s] */
  unmet_time: number;
  /** error of the series that store the joint motion [rad or m] */
  fit_error: number;
  /** self-motion added to the minimum-norm rates to keep limits, which moves no end-effector: root mean square over the segment of all joint rates together [rad/s or m/s] */
  self_motion: number;
}
export const kStraightInReport: FieldNote[] = [
  ["begin","s","start of the final straight approach"],
  ["stand_off","m","distance from the grasp point at the start"],
  ["final_speed","m/s","speed at which the end-effector meets the grasp point"],
  ["smallest_singular_value","m/rad","minimum over the segment of the smallest singular value of the generalized Jacobian's rows in use"],
  ["damped","","whether joint rates were damped near a singularity"],
  ["damped_interval","s","interval in which rates were damped"],
  ["unmet","m/s or rad/s","largest component of the required motion that the joints do not produce, because of damping or a lack of freedom"],
  ["unmet_time","s","time of the largest unmet component"],
  ["fit_error","rad or m","error of the series that store the joint motion"],
  ["self_motion","rad/s or m/s","self-motion added to the minimum-norm rates to keep limits, which moves no end-effector: root mean square over the segment of all joint rates together"],
];

// properties of the last planned segment when the joints follow it exactly.
export interface PlannedPath {
  /** inner knots of the joint splines; 0: one polynomial [1] */
  knots: number;
  /** minimum distance of a joint from a position limit; negative: beyond it [rad or m] */
  position_margin?: number;
  /** largest joint rate over its limit [1] */
  rate_share?: number;
  /** largest joint effort over its limit; present only if it was evaluated [1] */
  effort_share?: number;
  /** minimum distance of two bodies, without an end-effector near its grasp point and its target; present only if it was evaluated [m] */
  clearance?: number;
  /** first body of the closest pair */
  body_a: string;
  /** second body of the closest pair */
  body_b: string;
  /** time of the minimum clearance [s] */
  clearance_time: number;
  /** whether the trajectory is planned for a base that keeps its attitude exactly, as assumed under attitude control */
  attitude_held: boolean;
  /** largest rotation of the base from its initial attitude, or from its commanded attitude if the attitude is kept [rad] */
  base_turn: number;
  /** predicted loads of the reaction wheels; empty: not evaluated */
  wheels: WheelShare[];
}
export const kPlannedPath: FieldNote[] = [
  ["knots","1","inner knots of the joint splines; 0: one polynomial"],
  ["position_margin","rad or m","minimum distance of a joint from a position limit; negative: beyond it"],
  ["rate_share","1","largest joint rate over its limit"],
  ["effort_share","1","largest joint effort over its limit; present only if it was evaluated"],
  ["clearance","m","minimum distance of two bodies, without an end-effector near its grasp point and its target; present only if it was evaluated"],
  ["body_a","","first body of the closest pair"],
  ["body_b","","second body of the closest pair"],
  ["clearance_time","s","time of the minimum clearance"],
  ["attitude_held","","whether the trajectory is planned for a base that keeps its attitude exactly, as assumed under attitude control"],
  ["base_turn","rad","largest rotation of the base from its initial attitude, or from its commanded attitude if the attitude is kept"],
  ["wheels","","predicted loads of the reaction wheels; empty: not evaluated"],
];

// predicted load of a reaction wheel on the planned trajectory.
export interface WheelShare {
  /** name of the wheel */
  wheel: string;
  /** largest momentum along the trajectory over the wheel's capacity, while the wheels keep the base's attitude exactly [1] */
  share: number;
}
export const kWheelShare: FieldNote[] = [
  ["wheel","","name of the wheel"],
  ["share","1","largest momentum along the trajectory over the wheel's capacity, while the wheels keep the base's attitude exactly"],
];

// capture times within the window, and the selected time.
export interface WindowReport {
  /** selected capture time; null: none is reachable [s] */
  time: number | null;
  /** no grasp is reachable before this time, by distance alone [s] */
  not_before?: number;
  /** all evaluated times, in ascending order */
  points: WindowPoint[];
  /** the selection, as printed on the terminal */
  sentence: string;
}
export const kWindowReport: FieldNote[] = [
  ["time","s","selected capture time; null: none is reachable"],
  ["not_before","s","no grasp is reachable before this time, by distance alone"],
  ["points","","all evaluated times, in ascending order"],
  ["sentence","","the selection, as printed on the terminal"],
];

// a capture time that the planner evaluated.
export interface WindowPoint {
  /** capture time [s] */
  time: number;
  /** whether a plan was found for this time */
  reachable: boolean;
  /** cause if no plan was found; empty otherwise */
  reason: string;
  /** objective of the plan; null: no plan [1] */
  objective: number | null;
  /** speed of the fastest grasp point relative to the servicer's centre of mass [m/s] */
  speed: number;
  /** largest angle between an approach direction and the line from the arm's first joint to the grasp point; null: no grasp point has a direction [rad] */
  direction_angle: number | null;
  /** largest distance of a grasp point that arm and base must cover, over their reach; above 1 the grasp point is unreachable [1] */
  reach_share: number;
}
export const kWindowPoint: FieldNote[] = [
  ["time","s","capture time"],
  ["reachable","","whether a plan was found for this time"],
  ["reason","","cause if no plan was found; empty otherwise"],
  ["objective","1","objective of the plan; null: no plan"],
  ["speed","m/s","speed of the fastest grasp point relative to the servicer's centre of mass"],
  ["direction_angle","rad","largest angle between an approach direction and the line from the arm's first joint to the grasp point; null: no grasp point has a direction"],
  ["reach_share","1","largest distance of a grasp point that arm and base must cover, over their reach; above 1 the grasp point is unreachable"],
];

// a pair of bodies that touches before the planned capture.
export interface PlannedContact {
  /** first body */
  body_a: string;
  /** second body */
  body_b: string;
  /** first contact in the planner's prediction; absent: none [s] */
  predicted?: number;
  /** first contact in the simulation, before the approach ends; absent: none [s] */
  simulated?: number;
  /** whether a link or a grasped target touches in the simulation but not in the prediction */
  disturbs: boolean;
}
export const kPlannedContact: FieldNote[] = [
  ["body_a","","first body"],
  ["body_b","","second body"],
  ["predicted","s","first contact in the planner's prediction; absent: none"],
  ["simulated","s","first contact in the simulation, before the approach ends; absent: none"],
  ["disturbs","","whether a link or a grasped target touches in the simulation but not in the prediction"],
];

// a plan of the approach, or of its remainder, and the estimates that it uses.
export interface NavigationReport {
  /** time of planning; the first plan precedes the approach [s] */
  time: number;
  /** whether a plan was found; if not, the previous plan continues */
  found: boolean;
  /** evaluations of the base's motion while planning [1] */
  rhs_evaluations: number;
  /** estimates of the targets, which the plan uses */
  estimates: EstimateReport[];
  /** cause if no plan was found; empty otherwise */
  failure: string;
}
export const kNavigationReport: FieldNote[] = [
  ["time","s","time of planning; the first plan precedes the approach"],
  ["found","","whether a plan was found; if not, the previous plan continues"],
  ["rhs_evaluations","1","evaluations of the base's motion while planning"],
  ["estimates","","estimates of the targets, which the plan uses"],
  ["failure","","cause if no plan was found; empty otherwise"],
];

// error of the estimate of a target at one instant.
export interface EstimateReport {
  /** name of the target */
  target: string;
  /** distance of the estimated origin of the target frame from the true origin [m] */
  position_error: number;
  /** angle between both frames [rad] */
  orientation_error: number;
  /** error of the velocity of the origin [m/s] */
  velocity_error: number;
  /** error of the angular velocity [rad/s] */
  angular_velocity_error: number;
}
export const kEstimateReport: FieldNote[] = [
  ["target","","name of the target"],
  ["position_error","m","distance of the estimated origin of the target frame from the true origin"],
  ["orientation_error","rad","angle between both frames"],
  ["velocity_error","m/s","error of the velocity of the origin"],
  ["angular_velocity_error","rad/s","error of the angular velocity"],
];

// a control law that moves all joints together; which keys it has depends on the law.
export interface LawReport {
  /** target that is detumbled or squeezed */
  target?: string;
  /** start of the control law [s] */
  begin: number;
  /** end of the control law; after the impact the joints then hold [s] */
  end: number;
  /** `running`: the run or the phase ended first. `at_rest`: the angular momentum of the target fell to a millionth. `rank_lost`: the joints came near a configuration in which they cannot move the target or the end-effectors in all controlled directions, or cannot turn the base about all initially controllable axes; detumbling continues in the other directions (`least_condition`). `joint_limit`: a joint reached the end of its range. `released`: the target was released, or fewer than two grasps hold a squeezed target */
  ended: LawEnd;
  /** joint whose range ended the law; empty otherwise */
  joint: string;
  /** bound on the torque about the target's centre of mass [N m] */
  torque_bound?: number;
  /** largest torque of the grasps about the target's centre of mass, from the target's motion: at the ends and in the middle of every step [N m] */
  largest_torque?: number;
  /** angular momentum of the target about its centre of mass, at the start [N m s] */
  angular_momentum_before?: number;
  /** angular momentum of the target about its centre of mass, at the end [N m s] */
  angular_momentum_after?: number;
  /** speed of the target's centre of mass relative to that of servicer and held targets, at the start [m/s] */
  speed_before?: number;
  /** the same speed at the end [m/s] */
  speed_after?: number;
  /** angular_momentum_before over torque_bound: the duration with sufficient efforts [s] */
  expected_duration?: number;
  /** fraction of the torque bound that effort limits and grasp ratings admit at the start; expected_duration over this fraction estimates the duration [1] */
  first_scale?: number;
  /** pairs of grasps that squeeze the target */
  pairs?: Squeeze[];
  /** number of internal directions that the efforts control besides the target's motion, at the start [1] */
  internal_rank?: number;
  /** largest difference of the grasps' internal wrenches from the reference, over all components; moments are divided by the metric's length [N] */
  other_internal_force?: number;
  /** largest distance of an end-effector, or of the squeezed target, from its reference; 0 with brake [m] */
  largest_distance?: number;
  /** time of that distance [s] */
  largest_distance_time?: number;
  /** largest distance of the end-effectors at the end [m] */
  distance_after?: number;
  /** largest angle of an end-effector, of the squeezed target or of the base from its reference; 0 if orientation is not controlled, and with brake [rad] */
  largest_angle?: number;
  /** time of that angle [s] */
  largest_angle_time?: number;
  /** largest angle of the end-effectors, or of the base, at the end [rad] */
  angle_after?: number;
  /** angular velocity of the base, at the end [rad/s] */
  angular_velocity_after?: number;
  /** number of axes about which the joints could turn the base, at the start [1] */
  rank?: number;
  /** minimum fraction of the torque bound that effort limits and grasp ratings admit, or of the internal force that effort limits admit; 1: they were always sufficient [1] */
  least_scale?: number;
  /** time of that minimum [s] */
  least_scale_time?: number;
  /** minimum fraction that the effort limits admit: of the commanded efforts of impedance; of the self-motion that does not turn the base [1] */
  least_share?: number;
  /** time of that minimum [s] */
  least_share_time?: number;
  /** whether the efforts of the commanded motion stayed within the limits, in detumbling with a reduced torque; if not, they were reduced, and target, end-effectors or base deviated from this motion */
  within_limits: boolean;
  /** largest share of an effort limit or of a grasp rating that the law demanded before efforts were scaled down; above 1: factor by which the limits are too small [1] */
  largest_demand?: number;
  /** time of that demand [s] */
  largest_demand_time?: number;
  /** limit with the largest demand; empty: no limits are stated */
  limiting?: string;
  /** minimum ratio of the smallest to the largest singular value of the map from efforts to the target's accelerations, from joint rates to the end-effectors' motion, or, within `rank`, from joint rates to the base's rotation [1] */
  least_condition: number;
  /** time of that minimum [s] */
  least_condition_time: number;
}
export const kLawReport: FieldNote[] = [
  ["target","","target that is detumbled or squeezed"],
  ["begin","s","start of the control law"],
  ["end","s","end of the control law; after the impact the joints then hold"],
  ["ended","","`running`: the run or the phase ended first. `at_rest`: the angular momentum of the target fell to a millionth. `rank_lost`: the joints came near a configuration in which they cannot move the target or the end-effectors in all controlled directions, or cannot turn the base about all initially controllable axes; detumbling continues in the other directions (`least_condition`). `joint_limit`: a joint reached the end of its range. `released`: the target was released, or fewer than two grasps hold a squeezed target"],
  ["joint","","joint whose range ended the law; empty otherwise"],
  ["torque_bound","N m","bound on the torque about the target's centre of mass"],
  ["largest_torque","N m","largest torque of the grasps about the target's centre of mass, from the target's motion: at the ends and in the middle of every step"],
  ["angular_momentum_before","N m s","angular momentum of the target about its centre of mass, at the start"],
  ["angular_momentum_after","N m s","angular momentum of the target about its centre of mass, at the end"],
  ["speed_before","m/s","speed of the target's centre of mass relative to that of servicer and held targets, at the start"],
  ["speed_after","m/s","the same speed at the end"],
  ["expected_duration","s","angular_momentum_before over torque_bound: the duration with sufficient efforts"],
  ["first_scale","1","fraction of the torque bound that effort limits and grasp ratings admit at the start; expected_duration over this fraction estimates the duration"],
  ["pairs","","pairs of grasps that squeeze the target"],
  ["internal_rank","1","number of internal directions that the efforts control besides the target's motion, at the start"],
  ["other_internal_force","N","largest difference of the grasps' internal wrenches from the reference, over all components; moments are divided by the metric's length"],
  ["largest_distance","m","largest distance of an end-effector, or of the squeezed target, from its reference; 0 with brake"],
  ["largest_distance_time","s","time of that distance"],
  ["distance_after","m","largest distance of the end-effectors at the end"],
  ["largest_angle","rad","largest angle of an end-effector, of the squeezed target or of the base from its reference; 0 if orientation is not controlled, and with brake"],
  ["largest_angle_time","s","time of that angle"],
  ["angle_after","rad","largest angle of the end-effectors, or of the base, at the end"],
  ["angular_velocity_after","rad/s","angular velocity of the base, at the end"],
  ["rank","1","number of axes about which the joints could turn the base, at the start"],
  ["least_scale","1","minimum fraction of the torque bound that effort limits and grasp ratings admit, or of the internal force that effort limits admit; 1: they were always sufficient"],
  ["least_scale_time","s","time of that minimum"],
  ["least_share","1","minimum fraction that the effort limits admit: of the commanded efforts of impedance; of the self-motion that does not turn the base"],
  ["least_share_time","s","time of that minimum"],
  ["within_limits","","whether the efforts of the commanded motion stayed within the limits, in detumbling with a reduced torque; if not, they were reduced, and target, end-effectors or base deviated from this motion"],
  ["largest_demand","1","largest share of an effort limit or of a grasp rating that the law demanded before efforts were scaled down; above 1: factor by which the limits are too small"],
  ["largest_demand_time","s","time of that demand"],
  ["limiting","","limit with the largest demand; empty: no limits are stated"],
  ["least_condition","1","minimum ratio of the smallest to the largest singular value of the map from efforts to the target's accelerations, from joint rates to the end-effectors' motion, or, within `rank`, from joint rates to the base's rotation"],
  ["least_condition_time","s","time of that minimum"],
];

export type LawEnd = "running" | "at_rest" | "rank_lost" | "joint_limit" | "released";

// the internal force between two grasps.
export interface Squeeze {
  /** the two end-effectors */
  between: string[];
  /** commanded squeezing force on the target, at the end [N] */
  reference: number;
  /** squeezing force at the end, from the multipliers of the closed loops [N] */
  force: number;
  /** largest difference of the two [N] */
  largest_error: number;
  /** time of that difference [s] */
  largest_error_time: number;
}
export const kSqueeze: FieldNote[] = [
  ["between","","the two end-effectors"],
  ["reference","N","commanded squeezing force on the target, at the end"],
  ["force","N","squeezing force at the end, from the multipliers of the closed loops"],
  ["largest_error","N","largest difference of the two"],
  ["largest_error_time","s","time of that difference"],
];

// whether the grasps closed.
export interface Capture {
  /** verdict over all grasps; `assumed` if all closed and at least one of them is `assumed` */
  captured: Captured;
  /** sentence as printed on the terminal, with the gap and the displacement of moved targets */
  verdict: string;
  /** instant of the grasps that close simultaneously [s] */
  time: number;
  /** one entry per grasp of the scenario */
  grasps: GraspOutcome[];
}
export const kCapture: FieldNote[] = [
  ["captured","","verdict over all grasps; `assumed` if all closed and at least one of them is `assumed`"],
  ["verdict","","sentence as printed on the terminal, with the gap and the displacement of moved targets"],
  ["time","s","instant of the grasps that close simultaneously"],
  ["grasps","","one entry per grasp of the scenario"],
];

export type Captured = "yes" | "assumed" | "no";

// whether one grasp closes at the instant of capture, the criterion of success. The angle is 0 if the grasp leaves it free (that between the frames is `gap_angle` of `GraspImpulse`).
export interface GraspOutcome {
  /** end-effector of the grasp */
  end_effector: string;
  /** target of the grasp */
  target: string;
  /** grasp point on the target */
  grasp_point: string;
  /** whether this grasp closed and was not lost. */
  captured: Captured;
  /** whether an envelope with a position tolerance was evaluated, or the target was settled */
  judged: boolean;
  /** which tolerance of the envelope was met or exceeded. A contact is never a capture: the text states its separation speed, or its compression and energy if `impact.longest` ended the contact */
  reason: string;
  /** key of the envelope (`position`, `angle`, `velocity`, `angular_velocity`) that was exceeded by the largest factor; empty: none */
  limiting: string;
  /** distance from the grasp point at the instant at which it was to close [m] */
  distance: number | null;
  /** angle from the required grasp orientation, at that instant [rad] */
  angle: number | null;
  /** velocity relative to the grasp point, at that instant [m/s] */
  velocity: number | null;
  /** angular velocity relative to the target, at that instant [rad/s] */
  angular_velocity: number | null;
  /** instant at which this grasp closed, or was to close. The deviations above apply to this instant; for a grasp that the run did not reach they apply to the run's end, and are null after a failure [s] */
  time: number | null;
  /** displacement of the target by `contact.gap: translate_target`, which lets the grasp close [m] */
  target_moved: number;
  /** time of release; absent if the grasp was not released [s] */
  released?: number;
  /** time at which the grasp opened, since the load exceeded the limits in `holds` or the slip those of the slip; absent if it did not, or closed again [s] */
  lost?: number;
  /** first onset of slip since the grasp closed; absent: it did not slip [s] */
  slipped?: number;
  /** whether it slips at the end */
  slips?: boolean;
  /** displacement of the gripper relative to the target since closing [m] */
  slip_distance?: number;
  /** rotation likewise [rad] */
  slip_angle?: number;
  /** number of times the grasp closed [1] */
  closings: number;
  /** largest load relative to the limits in `holds`, which is 1 at the limit; absent without limits [1] */
  largest_load?: number;
  /** time of the largest load [s] */
  largest_load_time?: number;
}
export const kGraspOutcome: FieldNote[] = [
  ["end_effector","","end-effector of the grasp"],
  ["target","","target of the grasp"],
  ["grasp_point","","grasp point on the target"],
  ["captured","","whether this grasp closed and was not lost."],
  ["judged","","whether an envelope with a position tolerance was evaluated, or the target was settled"],
  ["reason","","which tolerance of the envelope was met or exceeded. A contact is never a capture: the text states its separation speed, or its compression and energy if `impact.longest` ended the contact"],
  ["limiting","","key of the envelope (`position`, `angle`, `velocity`, `angular_velocity`) that was exceeded by the largest factor; empty: none"],
  ["distance","m","distance from the grasp point at the instant at which it was to close"],
  ["angle","rad","angle from the required grasp orientation, at that instant"],
  ["velocity","m/s","velocity relative to the grasp point, at that instant"],
  ["angular_velocity","rad/s","angular velocity relative to the target, at that instant"],
  ["time","s","instant at which this grasp closed, or was to close. The deviations above apply to this instant; for a grasp that the run did not reach they apply to the run's end, and are null after a failure"],
  ["target_moved","m","displacement of the target by `contact.gap: translate_target`, which lets the grasp close"],
  ["released","s","time of release; absent if the grasp was not released"],
  ["lost","s","time at which the grasp opened, since the load exceeded the limits in `holds` or the slip those of the slip; absent if it did not, or closed again"],
  ["slipped","s","first onset of slip since the grasp closed; absent: it did not slip"],
  ["slips","","whether it slips at the end"],
  ["slip_distance","m","displacement of the gripper relative to the target since closing"],
  ["slip_angle","rad","rotation likewise"],
  ["closings","1","number of times the grasp closed"],
  ["largest_load","1","largest load relative to the limits in `holds`, which is 1 at the limit; absent without limits"],
  ["largest_load_time","s","time of the largest load"],
];

// an impact: instantaneous changes when grasps close and contacts touch, or a compliant impact.
export interface ImpactReport {
  /** as in the scenario. `as_published`: the velocities after the impact follow the thesis, and momentum is not conserved */
  law: string;
  /** start of the impact [s] */
  time: number;
  /** time over which mean forces are taken: `impact.duration` of the scenario for an instantaneous impact. Law `compliant`: duration of the impact [s] */
  duration: number;
  /** grasps that closed, and contacts that touched */
  grasps: GraspImpulse[];
  /** number of independent rows [1] */
  rank: number;
  /** number of constraint rows of the grasps [1] */
  rows: number;
  /** `rows` - `rank` self-stresses: impulses that change no velocity and may be added to those of the grasps */
  null_space: ImpulseSet[];
  /** one entry per further grasp of a target, relative to its first grasp */
  loops: LoopGap[];
  /** total impulses, one entry per body */
  body_impulses: BodyImpulse[];
  /** kinetic energy of robot and targets just before the impact [J] */
  kinetic_energy_before: number;
  /** kinetic energy of robot and targets just after the impact [J] */
  kinetic_energy_after: number;
  /** change of the velocity of the base's origin, in W [m/s] */
  base_velocity_change: [number, number, number];
  /** change of the base's angular velocity, in W [rad/s] */
  base_angular_velocity_change: [number, number, number];
  /** joint names for `joint_velocity_change` */
  joint_names: string[];
  /** changes of the joint rates [rad/s or m/s] */
  joint_velocity_change: number[];
  /** impulses that the joints transmit */
  joints: JointImpulse[];
  /** impulse that the arms transmit to the base */
  base_reaction: BaseReaction;
  /** motion of the targets just before the impact */
  targets_before: BodyMotion[];
  /** motion of the targets just after the impact */
  targets_after: BodyMotion[];
  /** the thesis's estimate, (3.8)-(3.13), for the same capture */
  as_published?: AsPublished;
  /** reason for which `as_published` is undefined here; replaces that key */
  as_published_absent?: string;
  /** whether the scenario requests `as_published` (`output.as_published`, or the law of that name): only then the terminal, the report and figures show it */
  show_as_published: boolean;
  /** present if joints lock after the grasp */
  brake?: BrakeReport;
  /** `free`, `braked` or `driven`, as in `impact.joints` */
  joints_during: string;
  /** joints that brakes or drives held, or were commanded to hold */
  held_joints: HeldJoint[];
  /** whether the distribution of the impulse over simultaneous contacts is unique (if not: `spread` of `ContactRebound`) */
  unique: boolean;
  /** true: the result has more energy than the initial state (Newton's hypothesis with friction); the result is not corrected, and a warning reports it */
  energy_created: boolean;
  /** contact hypothesis: `stronge`, `poisson` or `newton`; absent without contacts */
  hypothesis?: string;
  /** law `bilateral_restitution`: rows for which no motion has the specified restitution; absent if there are none */
  inconsistent?: string;
  /** present with the law `compliant` */
  compliant?: CompliantReport;
  /** effective masses in contacts, law `compliant`; absent without contacts */
  effective_masses?: EffectiveMass[];
  /** pairs of hard bodies that touch and take part in the impact; absent if there are none */
  hard_contacts?: HardContactImpulse[];
  /** impulses against the number of flexible modes; absent without flexible bodies, and with laws other than `plastic` */
  by_modes?: RetainedModes[];
  /** measures of the configuration; absent with law `compliant` */
  measures?: ImpactMeasures;
  /** derivatives with law `plastic`; else empty */
  sensitivities: ImpactSensitivity[];
  /** margins to the robot's ratings; empty without ratings in the robot file */
  margins: ImpactMargin[];
  /** one entry per grasp whose arm has ratings */
  speed_limits: SpeedLimit[];
}
export const kImpactReport: FieldNote[] = [
  ["law","","as in the scenario. `as_published`: the velocities after the impact follow the thesis, and momentum is not conserved"],
  ["time","s","start of the impact"],
  ["duration","s","time over which mean forces are taken: `impact.duration` of the scenario for an instantaneous impact. Law `compliant`: duration of the impact"],
  ["grasps","","grasps that closed, and contacts that touched"],
  ["rank","1","number of independent rows"],
  ["rows","1","number of constraint rows of the grasps"],
  ["null_space","","`rows` - `rank` self-stresses: impulses that change no velocity and may be added to those of the grasps"],
  ["loops","","one entry per further grasp of a target, relative to its first grasp"],
  ["body_impulses","","total impulses, one entry per body"],
  ["kinetic_energy_before","J","kinetic energy of robot and targets just before the impact"],
  ["kinetic_energy_after","J","kinetic energy of robot and targets just after the impact"],
  ["base_velocity_change","m/s","change of the velocity of the base's origin, in W"],
  ["base_angular_velocity_change","rad/s","change of the base's angular velocity, in W"],
  ["joint_names","","joint names for `joint_velocity_change`"],
  ["joint_velocity_change","rad/s or m/s","changes of the joint rates"],
  ["joints","","impulses that the joints transmit"],
  ["base_reaction","","impulse that the arms transmit to the base"],
  ["targets_before","","motion of the targets just before the impact"],
  ["targets_after","","motion of the targets just after the impact"],
  ["as_published","","the thesis's estimate, (3.8)-(3.13), for the same capture"],
  ["as_published_absent","","reason for which `as_published` is undefined here; replaces that key"],
  ["show_as_published","","whether the scenario requests `as_published` (`output.as_published`, or the law of that name): only then the terminal, the report and figures show it"],
  ["brake","","present if joints lock after the grasp"],
  ["joints_during","","`free`, `braked` or `driven`, as in `impact.joints`"],
  ["held_joints","","joints that brakes or drives held, or were commanded to hold"],
  ["unique","","whether the distribution of the impulse over simultaneous contacts is unique (if not: `spread` of `ContactRebound`)"],
  ["energy_created","","true: the result has more energy than the initial state (Newton's hypothesis with friction); the result is not corrected, and a warning reports it"],
  ["hypothesis","","contact hypothesis: `stronge`, `poisson` or `newton`; absent without contacts"],
  ["inconsistent","","law `bilateral_restitution`: rows for which no motion has the specified restitution; absent if there are none"],
  ["compliant","","present with the law `compliant`"],
  ["effective_masses","","effective masses in contacts, law `compliant`; absent without contacts"],
  ["hard_contacts","","pairs of hard bodies that touch and take part in the impact; absent if there are none"],
  ["by_modes","","impulses against the number of flexible modes; absent without flexible bodies, and with laws other than `plastic`"],
  ["measures","","measures of the configuration; absent with law `compliant`"],
  ["sensitivities","","derivatives with law `plastic`; else empty"],
  ["margins","","margins to the robot's ratings; empty without ratings in the robot file"],
  ["speed_limits","","one entry per grasp whose arm has ratings"],
];

// one grasp or contact of the impact. Impulses act **on the robot** at the contact point; the opposite impulses act on the target.
export interface GraspImpulse {
  /** end-effector of the grasp or contact */
  end_effector: string;
  /** target of the grasp or contact */
  target: string;
  /** grasp point on the target */
  grasp_point: string;
  /** `rigid` (6 rows), `hinge` (5), `point` (3), `contact` (does not hold) */
  model: string;
  /** contact point of end-effector and target, in W [m] */
  contact_point: [number, number, number];
  /** distance of end-effector and grasp point when they were joined [m] */
  gap: number;
  /** angle between their frames when they were joined [rad] */
  gap_angle: number;
  /** by which `contact.gap: translate_target` moved the target, in W [m] */
  target_displacement: [number, number, number];
  /** impulse on the robot at the contact point, in W [N s] */
  impulse: [number, number, number];
  /** angular impulse on the robot about the contact point, in W [N m s] */
  angular_impulse: [number, number, number];
  /** magnitude of the impulse [N s] */
  impulse_magnitude: number;
  /** impulse over impact.duration; law compliant: over profile.duration [N] */
  mean_force: number;
  /** six values, one per component, angular x, y, z then linear x, y, z, in W; true: unique; false: open to a self-stress of closed loops */
  determined: boolean[];
  /** velocity of the end-effector minus that of the target at the contact point, before the impact, in W [m/s] */
  relative_velocity_before: [number, number, number];
  /** angular velocity of the end-effector minus that of the target, before the impact, in W [rad/s] */
  relative_angular_velocity_before: [number, number, number];
  /** the same velocity after the impact: zero in the constrained directions of a grasp [m/s] */
  relative_velocity_after: [number, number, number];
  /** the same angular velocity after the impact [rad/s] */
  relative_angular_velocity_after: [number, number, number];
  /** rebound of a contact under `restitution` or `friction` */
  rebound?: ContactRebound;
  /** force history under the law `compliant` */
  profile?: ForceProfile;
}
export const kGraspImpulse: FieldNote[] = [
  ["end_effector","","end-effector of the grasp or contact"],
  ["target","","target of the grasp or contact"],
  ["grasp_point","","grasp point on the target"],
  ["model","","`rigid` (6 rows), `hinge` (5), `point` (3), `contact` (does not hold)"],
  ["contact_point","m","contact point of end-effector and target, in W"],
  ["gap","m","distance of end-effector and grasp point when they were joined"],
  ["gap_angle","rad","angle between their frames when they were joined"],
  ["target_displacement","m","by which `contact.gap: translate_target` moved the target, in W"],
  ["impulse","N s","impulse on the robot at the contact point, in W"],
  ["angular_impulse","N m s","angular impulse on the robot about the contact point, in W"],
  ["impulse_magnitude","N s","magnitude of the impulse"],
  ["mean_force","N","impulse over impact.duration; law compliant: over profile.duration"],
  ["determined","","six values, one per component, angular x, y, z then linear x, y, z, in W; true: unique; false: open to a self-stress of closed loops"],
  ["relative_velocity_before","m/s","velocity of the end-effector minus that of the target at the contact point, before the impact, in W"],
  ["relative_angular_velocity_before","rad/s","angular velocity of the end-effector minus that of the target, before the impact, in W"],
  ["relative_velocity_after","m/s","the same velocity after the impact: zero in the constrained directions of a grasp"],
  ["relative_angular_velocity_after","rad/s","the same angular velocity after the impact"],
  ["rebound","","rebound of a contact under `restitution` or `friction`"],
  ["profile","","force history under the law `compliant`"],
];

// the rebound of a contact, which does not hold.
export interface ContactRebound {
  /** unit normal from the target to the robot, in W [1] */
  normal: [number, number, number];
  /** impulse along the normal [N s] */
  normal_impulse: number;
  /** friction impulse, in W [N s] */
  tangential_impulse: [number, number, number];
  /** part of the normal impulse during compression, while the bodies approach [N s] */
  compression: number;
  /** work of the normal impulse on the bodies [J] */
  normal_work: number;
  /** work of friction on the bodies [J] */
  friction_work: number;
  /** `separated`, `sticking`, `sliding`, `reversed`, in the order of occurrence */
  modes: string[];
  /** relative spread of the normal impulse over other orders of simultaneous contacts; null: unknown [1] */
  spread: number | null;
}
export const kContactRebound: FieldNote[] = [
  ["normal","1","unit normal from the target to the robot, in W"],
  ["normal_impulse","N s","impulse along the normal"],
  ["tangential_impulse","N s","friction impulse, in W"],
  ["compression","N s","part of the normal impulse during compression, while the bodies approach"],
  ["normal_work","J","work of the normal impulse on the bodies"],
  ["friction_work","J","work of friction on the bodies"],
  ["modes","","`separated`, `sticking`, `sliding`, `reversed`, in the order of occurrence"],
  ["spread","1","relative spread of the normal impulse over other orders of simultaneous contacts; null: unknown"],
];

// force history of a contact or grasp in a compliant impact.
export interface ForceProfile {
  /** largest force in the impact [N] */
  peak_force: number;
  /** time of the largest force, from the start of the impact [s] */
  peak_force_time: number;
  /** largest moment in the impact [N m] */
  peak_moment: number;
  /** time of the largest moment, from the start of the impact [s] */
  peak_moment_time: number;
  /** largest deformation of the contact or of the grasp's spring [m] */
  largest_deformation: number;
  /** duration of contact, or time until the grasp was at rest [s] */
  duration: number;
  /** energy dissipated by damping and friction [J] */
  energy_lost: number;
  /** number of times that the bodies came into contact [1] */
  touches: number;
}
export const kForceProfile: FieldNote[] = [
  ["peak_force","N","largest force in the impact"],
  ["peak_force_time","s","time of the largest force, from the start of the impact"],
  ["peak_moment","N m","largest moment in the impact"],
  ["peak_moment_time","s","time of the largest moment, from the start of the impact"],
  ["largest_deformation","m","largest deformation of the contact or of the grasp's spring"],
  ["duration","s","duration of contact, or time until the grasp was at rest"],
  ["energy_lost","J","energy dissipated by damping and friction"],
  ["touches","1","number of times that the bodies came into contact"],
];

// impulses at all grasps together, scaled so that the largest component is 1 (N s or N m s).
export interface ImpulseSet {
  /** impulses in the order of the impact's grasps; keys as in `GraspImpulse` */
  grasps: ImpulseAtGrasp[];
}
export const kImpulseSet: FieldNote[] = [
  ["grasps","","impulses in the order of the impact's grasps; keys as in `GraspImpulse`"],
];

// the part of an `ImpulseSet` at one grasp.
export interface ImpulseAtGrasp {
  /** end-effector of the grasp */
  end_effector: string;
  /** as in `GraspImpulse` [N s] */
  impulse: [number, number, number];
  /** as in `GraspImpulse` [N m s] */
  angular_impulse: [number, number, number];
}
export const kImpulseAtGrasp: FieldNote[] = [
  ["end_effector","","end-effector of the grasp"],
  ["impulse","N s","as in `GraspImpulse`"],
  ["angular_impulse","N m s","as in `GraspImpulse`"],
];

// geometric consistency of a further grasp of a target with its first grasp.
export interface LoopGap {
  /** target that both grasps hold */
  target: string;
  /** end-effector of the first grasp, then that of the further grasp */
  end_effectors: [string, string];
  /** likewise */
  grasp_points: [string, string];
  /** distance between the end-effectors when they closed [m] */
  end_effector_distance: number;
  /** distance between their grasp points [m] */
  grasp_point_distance: number;
  /** difference of these distances. No motion of the target changes either, so this gap remains in the closed loop [m] */
  gap: number;
}
export const kLoopGap: FieldNote[] = [
  ["target","","target that both grasps hold"],
  ["end_effectors","","end-effector of the first grasp, then that of the further grasp"],
  ["grasp_points","","likewise"],
  ["end_effector_distance","m","distance between the end-effectors when they closed"],
  ["grasp_point_distance","m","distance between their grasp points"],
  ["gap","m","difference of these distances. No motion of the target changes either, so this gap remains in the closed loop"],
];

// total impulse on a body, from joints and grasps together: unique, even if the impulses of single grasps are not.
export interface BodyImpulse {
  /** body that received the impulse */
  body: string;
  /** impulse, in W [N s] */
  impulse: [number, number, number];
  /** angular impulse about the body's centre of mass, in W [N m s] */
  angular_impulse: [number, number, number];
}
export const kBodyImpulse: FieldNote[] = [
  ["body","","body that received the impulse"],
  ["impulse","N s","impulse, in W"],
  ["angular_impulse","N m s","angular impulse about the body's centre of mass, in W"],
];

// impulse that a joint transmits during the impact.
export interface JointImpulse {
  /** name of the joint */
  joint: string;
  /** body that the joint carries */
  body: string;
  /** impulse at the joint's origin, from parent to child, in W [N s] */
  impulse: [number, number, number];
  /** angular impulse about the joint's origin, from parent to child, in W [N m s] */
  angular_impulse: [number, number, number];
  /** component along the joint axis: zero for a free joint without rotor [N m s or N s] */
  along_axis: number;
  /** law `compliant`: the largest transmitted force, over the samples; else 0 [N] */
  peak_force: number;
  /** law `compliant`: the largest transmitted moment, over the samples; else 0 [N m] */
  peak_moment: number;
  /** law `compliant`: the largest effort along the axis, over the samples; else 0 [N m or N] */
  peak_driving: number;
}
export const kJointImpulse: FieldNote[] = [
  ["joint","","name of the joint"],
  ["body","","body that the joint carries"],
  ["impulse","N s","impulse at the joint's origin, from parent to child, in W"],
  ["angular_impulse","N m s","angular impulse about the joint's origin, from parent to child, in W"],
  ["along_axis","N m s or N s","component along the joint axis: zero for a free joint without rotor"],
  ["peak_force","N","law `compliant`: the largest transmitted force, over the samples; else 0"],
  ["peak_moment","N m","law `compliant`: the largest transmitted moment, over the samples; else 0"],
  ["peak_driving","N m or N","law `compliant`: the largest effort along the axis, over the samples; else 0"],
];

// impulse that the arms transmit to the base.
export interface BaseReaction {
  /** impulse, in W [N s] */
  impulse: [number, number, number];
  /** angular impulse about the base's origin, in W [N m s] */
  angular_impulse: [number, number, number];
}
export const kBaseReaction: FieldNote[] = [
  ["impulse","N s","impulse, in W"],
  ["angular_impulse","N m s","angular impulse about the base's origin, in W"],
];

// the thesis's own estimate, (3.8)-(3.13), for the same capture.
export interface AsPublished {
  /** impulses, one entry per grasp */
  grasps: PublishedImpulse[];
  /** joint rates after the impact, (3.11), in the order of `joint_names` of the impact [rad/s or m/s] */
  joint_velocity_after: number[];
  /** magnitude of the change of total linear momentum [N s] */
  linear_momentum_error: number;
  /** magnitude of the change of total angular momentum [N m s] */
  angular_momentum_error: number;
  /** over the ledger's scale; null: nothing moves [1] */
  relative_linear_momentum_error: number | null;
  /** likewise [1] */
  relative_angular_momentum_error: number | null;
}
export const kAsPublished: FieldNote[] = [
  ["grasps","","impulses, one entry per grasp"],
  ["joint_velocity_after","rad/s or m/s","joint rates after the impact, (3.11), in the order of `joint_names` of the impact"],
  ["linear_momentum_error","N s","magnitude of the change of total linear momentum"],
  ["angular_momentum_error","N m s","magnitude of the change of total angular momentum"],
  ["relative_linear_momentum_error","1","over the ledger's scale; null: nothing moves"],
  ["relative_angular_momentum_error","1","likewise"],
];

// one grasp's impulse by the thesis's formulas.
export interface PublishedImpulse {
  /** end-effector of the grasp */
  end_effector: string;
  /** as in `GraspImpulse` [N s] */
  impulse: [number, number, number];
  /** as in `GraspImpulse` [N m s] */
  angular_impulse: [number, number, number];
  /** magnitude of the impulse [N s] */
  impulse_magnitude: number;
}
export const kPublishedImpulse: FieldNote[] = [
  ["end_effector","","end-effector of the grasp"],
  ["impulse","N s","as in `GraspImpulse`"],
  ["angular_impulse","N m s","as in `GraspImpulse`"],
  ["impulse_magnitude","N s","magnitude of the impulse"],
];

// joints that lock immediately after the grasp: a second impulse with separate checks. `targets_after` and the changes of the impact are before the brake; the second sample of `contact` in the time series is after it.
export interface BrakeReport {
  /** joints that are locked */
  joints: string[];
  /** impulse per joint, along or about its axis [N m s or N s] */
  impulse: number[];
  /** kinetic energy of all bodies before the brake [J] */
  kinetic_energy_before: number;
  /** kinetic energy of all bodies after the brake [J] */
  kinetic_energy_after: number;
  /** impulses, one entry per grasp that holds */
  grasps: BrakeGrasp[];
  /** change of the velocity of the base's origin by the brake alone, in W [m/s] */
  base_velocity_change: [number, number, number];
  /** change of the base's angular velocity by the brake alone, in W [rad/s] */
  base_angular_velocity_change: [number, number, number];
}
export const kBrakeReport: FieldNote[] = [
  ["joints","","joints that are locked"],
  ["impulse","N m s or N s","impulse per joint, along or about its axis"],
  ["kinetic_energy_before","J","kinetic energy of all bodies before the brake"],
  ["kinetic_energy_after","J","kinetic energy of all bodies after the brake"],
  ["grasps","","impulses, one entry per grasp that holds"],
  ["base_velocity_change","m/s","change of the velocity of the base's origin by the brake alone, in W"],
  ["base_angular_velocity_change","rad/s","change of the base's angular velocity by the brake alone, in W"],
];

// the impulse on a grasp because of the brake, in addition to the impulse of the impact.
export interface BrakeGrasp {
  /** end-effector of the grasp */
  end_effector: string;
  /** target of the grasp */
  target: string;
  /** impulse on the robot at the contact point, in W [N s] */
  impulse: [number, number, number];
  /** angular impulse on the robot about the contact point, in W [N m s] */
  angular_impulse: [number, number, number];
  /** magnitude of the impulse [N s] */
  impulse_magnitude: number;
}
export const kBrakeGrasp: FieldNote[] = [
  ["end_effector","","end-effector of the grasp"],
  ["target","","target of the grasp"],
  ["impulse","N s","impulse on the robot at the contact point, in W"],
  ["angular_impulse","N m s","angular impulse on the robot about the contact point, in W"],
  ["impulse_magnitude","N s","magnitude of the impulse"],
];

// a joint that a brake or a drive held during the impact, or was commanded to hold. Under the law `compliant` it is released when the grasps become rigid; `impulse` and `work` are integrated until then.
export interface HeldJoint {
  /** name of the joint */
  joint: string;
  /** impulse on the joint, along or about its axis [N m s or N s] */
  impulse: number;
  /** work of this impulse [J] */
  work: number;
  /** commanded rate [rad/s or m/s] */
  commanded_rate: number;
  /** rate after the impact [rad/s or m/s] */
  rate_after: number;
  /** true: the drive was overpowered by the constraint. The grasps did not admit all commanded rates, and this one deviates by the minimum amount (docs/theory, section 7). A warning reports it */
  was_overpowered: boolean;
}
export const kHeldJoint: FieldNote[] = [
  ["joint","","name of the joint"],
  ["impulse","N m s or N s","impulse on the joint, along or about its axis"],
  ["work","J","work of this impulse"],
  ["commanded_rate","rad/s or m/s","commanded rate"],
  ["rate_after","rad/s or m/s","rate after the impact"],
  ["was_overpowered","","true: the drive was overpowered by the constraint. The grasps did not admit all commanded rates, and this one deviates by the minimum amount (docs/theory, section 7). A warning reports it"],
];

// an impact that was integrated over time.
export interface CompliantReport {
  /** `separated` (contacts only), `settled` (grasps are at rest), `time_over` (`impact.longest`) */
  end: string;
  /** duration of the impact [s] */
  duration: number;
  /** energy dissipated by dampers and friction [J] */
  energy_lost: number;
  /** energy in springs at the end, which is lost when grasps become rigid. With `time_over` the impact was cut off and this energy is missing; the ledger's `compliant_energy_residual` fails if a contact is still compressed or grasps hold more than a thousandth of the initial kinetic energy [J] */
  elastic_energy_after: number;
  /** largest final impulse that stops the remaining relative motion [N s] */
  residual_impulse: number;
  /** residual of the energy balance over the initial kinetic energy of the bodies that take part [1] */
  energy_residual: number;
  /** work of the joints that a control law drives during the impact (`impact.joints: impedance`) [J] */
  motor_work: number;
  /** evaluations of the equations of motion [1] */
  rhs_evaluations: number;
  /** number of flexible modes in the posture of first contact, joints as in the impact, grasps open [1] */
  modes: number;
  /** number of these modes with a period longer than `duration` [1] */
  slower_modes: number;
  /** period of the slowest mode; 0 without flexible bodies [s] */
  slowest_period: number;
  /** period of the fastest mode. Modes with periods much shorter than the contact barely respond to it [s] */
  fastest_period: number;
}
export const kCompliantReport: FieldNote[] = [
  ["end","","`separated` (contacts only), `settled` (grasps are at rest), `time_over` (`impact.longest`)"],
  ["duration","s","duration of the impact"],
  ["energy_lost","J","energy dissipated by dampers and friction"],
  ["elastic_energy_after","J","energy in springs at the end, which is lost when grasps become rigid. With `time_over` the impact was cut off and this energy is missing; the ledger's `compliant_energy_residual` fails if a contact is still compressed or grasps hold more than a thousandth of the initial kinetic energy"],
  ["residual_impulse","N s","largest final impulse that stops the remaining relative motion"],
  ["energy_residual","1","residual of the energy balance over the initial kinetic energy of the bodies that take part"],
  ["motor_work","J","work of the joints that a control law drives during the impact (`impact.joints: impedance`)"],
  ["rhs_evaluations","1","evaluations of the equations of motion"],
  ["modes","1","number of flexible modes in the posture of first contact, joints as in the impact, grasps open"],
  ["slower_modes","1","number of these modes with a period longer than `duration`"],
  ["slowest_period","s","period of the slowest mode; 0 without flexible bodies"],
  ["fastest_period","s","period of the fastest mode. Modes with periods much shorter than the contact barely respond to it"],
];

// effective masses of end-effector and target in a contact.
export interface EffectiveMass {
  /** end-effector of the contact */
  end_effector: string;
  /** target of the contact */
  target: string;
  /** effective mass of the end-effector along the contact's normal, without control, joints free [kg] */
  of_end_effector: number;
  /** apparent mass of the end-effector under the impedance law; null: no impedance law with a force sensor is active [kg] */
  apparent: number | null;
  /** effective mass of the target along the normal [kg] */
  of_target: number;
  /** coefficient of restitution e of a central contact of such masses: the target stops if e times the end-effector's mass equals its own mass [1] */
  restitution: number;
  /** speed of the target's contact point along the normal towards the end-effector, relative to the end-effector [m/s] */
  target_speed_before: number;
  /** speed of the target's contact point afterwards, relative to the end-effector's velocity before [m/s] */
  target_speed_after: number;
}
export const kEffectiveMass: FieldNote[] = [
  ["end_effector","","end-effector of the contact"],
  ["target","","target of the contact"],
  ["of_end_effector","kg","effective mass of the end-effector along the contact's normal, without control, joints free"],
  ["apparent","kg","apparent mass of the end-effector under the impedance law; null: no impedance law with a force sensor is active"],
  ["of_target","kg","effective mass of the target along the normal"],
  ["restitution","1","coefficient of restitution e of a central contact of such masses: the target stops if e times the end-effector's mass equals its own mass"],
  ["target_speed_before","m/s","speed of the target's contact point along the normal towards the end-effector, relative to the end-effector"],
  ["target_speed_after","m/s","speed of the target's contact point afterwards, relative to the end-effector's velocity before"],
];

// two hard bodies that touch at the instant of the impact and take part in it.
export interface HardContactImpulse {
  /** name of the first body */
  body_a: string;
  /** name of the second body */
  body_b: string;
  /** number of points at which both touch [1] */
  points: number;
  /** sum of the normal impulses [N s] */
  normal_impulse: number;
  /** impulse on the second body, in W [N s] */
  impulse: [number, number, number];
  /** largest approach speed of a point before the impact; negative: both separate [m/s] */
  approach_speed: number;
  /** energy lost by the normal impulses [J] */
  restitution_loss: number;
  /** energy lost by the tangential impulses [J] */
  friction_loss: number;
}
export const kHardContactImpulse: FieldNote[] = [
  ["body_a","","name of the first body"],
  ["body_b","","name of the second body"],
  ["points","1","number of points at which both touch"],
  ["normal_impulse","N s","sum of the normal impulses"],
  ["impulse","N s","impulse on the second body, in W"],
  ["approach_speed","m/s","largest approach speed of a point before the impact; negative: both separate"],
  ["restitution_loss","J","energy lost by the normal impulses"],
  ["friction_loss","J","energy lost by the tangential impulses"],
];

// the plastic impact if only the slowest flexible modes deform.
export interface RetainedModes {
  /** number of flexible modes that respond, the slowest first, with base and joints as in the impact [1] */
  modes: number;
  /** frequency of the fastest of these modes; 0 without modes [Hz] */
  frequency: number;
  /** magnitudes of the impulses, in the order of `grasps` [N s] */
  impulses: number[];
}
export const kRetainedModes: FieldNote[] = [
  ["modes","1","number of flexible modes that respond, the slowest first, with base and joints as in the impact"],
  ["frequency","Hz","frequency of the fastest of these modes; 0 without modes"],
  ["impulses","N s","magnitudes of the impulses, in the order of `grasps`"],
];

// what the configuration makes of impulses, at the contact points, everything free but joints that are held. Twists and impulses are [angular; linear] in W; matrices are six rows of six.
export interface ImpactMeasures {
  /** measures, one entry per grasp */
  end_effectors: EndEffectorMeasure[];
  /** largest impulse over all relative motions, all grasps together; 1: as against an immovable robot [1] */
  largest_impulse: number | null;
  /** smallest impulse over all relative motions [1] */
  smallest_impulse: number | null;
  /** impulse of the present relative motion [1] */
  coupled_index: number | null;
  /** distance of the resultant of all impulses from the robot's centre of mass [m] */
  miss_of_robot_com: number | null;
  /** distance of the resultant of all impulses from the centre of mass of robot and targets [m] */
  miss_of_system_com: number | null;
  /** change of the base's twist per impulse at each grasp; zero in directions that the grasp leaves free [1/(kg m^2), 1/(kg m), 1/kg] */
  base_response: [number, number, number, number, number, number][][];
  /** basis of the impulses that do not change the base's twist */
  zero_disturbance: ImpulseSet[];
  /** basis of the impulses that do not change the base's angular velocity */
  zero_base_angular_velocity: ImpulseSet[];
}
export const kImpactMeasures: FieldNote[] = [
  ["end_effectors","","measures, one entry per grasp"],
  ["largest_impulse","1","largest impulse over all relative motions, all grasps together; 1: as against an immovable robot"],
  ["smallest_impulse","1","smallest impulse over all relative motions"],
  ["coupled_index","1","impulse of the present relative motion"],
  ["miss_of_robot_com","m","distance of the resultant of all impulses from the robot's centre of mass"],
  ["miss_of_system_com","m","distance of the resultant of all impulses from the centre of mass of robot and targets"],
  ["base_response","1/(kg m^2), 1/(kg m), 1/kg","change of the base's twist per impulse at each grasp; zero in directions that the grasp leaves free"],
  ["zero_disturbance","","basis of the impulses that do not change the base's twist"],
  ["zero_base_angular_velocity","","basis of the impulses that do not change the base's angular velocity"],
];

// effect of an impulse at one grasp, and the impulse that the present motion requires, at the contact point.
export interface EndEffectorMeasure {
  /** end-effector of the grasp or contact */
  end_effector: string;
  /** change of the end-effector's twist per impulse on it: 6 x 6, by rows [1/(kg m^2), 1/(kg m), 1/kg] */
  inverse_inertia: [number, number, number, number, number, number][];
  /** change of its twist relative to the target, with the impulse on it and the opposite impulse on the target: 6 x 6, by rows [1/(kg m^2), 1/(kg m), 1/kg] */
  pair_inverse_inertia: [number, number, number, number, number, number][];
  /** axes of the impulse ellipsoid: unit vectors in W [1] */
  linear_axes: [number, number, number][];
  /** semi-axes of the impulse ellipsoid along these axes, descending [kg] */
  linear_mass: number[];
  /** axes of the ellipsoid of angular impulses: unit vectors in W [1] */
  angular_axes: [number, number, number][];
  /** semi-axes of that ellipsoid, descending [kg m^2] */
  angular_inertia: number[];
  /** impulse per speed of a point contact that stops the whole present relative velocity; 0 if there is none [kg] */
  impulse_index: number | null;
  /** effective mass of the end-effector alone for a frictionless contact along the present relative velocity; null: immovable [kg] */
  robot_effective_mass: number | null;
  /** effective mass of end-effector and target, likewise [kg] */
  pair_effective_mass: number | null;
  /** distance of the line of impulse from the robot's centre of mass; 0 for no impulse, null for a pure couple [m] */
  miss_of_robot_com: number | null;
  /** distance of the line of impulse from the centre of mass of robot and target; 0 for no impulse, null for a pure couple [m] */
  miss_of_system_com: number | null;
}
export const kEndEffectorMeasure: FieldNote[] = [
  ["end_effector","","end-effector of the grasp or contact"],
  ["inverse_inertia","1/(kg m^2), 1/(kg m), 1/kg","change of the end-effector's twist per impulse on it: 6 x 6, by rows"],
  ["pair_inverse_inertia","1/(kg m^2), 1/(kg m), 1/kg","change of its twist relative to the target, with the impulse on it and the opposite impulse on the target: 6 x 6, by rows"],
  ["linear_axes","1","axes of the impulse ellipsoid: unit vectors in W"],
  ["linear_mass","kg","semi-axes of the impulse ellipsoid along these axes, descending"],
  ["angular_axes","1","axes of the ellipsoid of angular impulses: unit vectors in W"],
  ["angular_inertia","kg m^2","semi-axes of that ellipsoid, descending"],
  ["impulse_index","kg","impulse per speed of a point contact that stops the whole present relative velocity; 0 if there is none"],
  ["robot_effective_mass","kg","effective mass of the end-effector alone for a frictionless contact along the present relative velocity; null: immovable"],
  ["pair_effective_mass","kg","effective mass of end-effector and target, likewise"],
  ["miss_of_robot_com","m","distance of the line of impulse from the robot's centre of mass; 0 for no impulse, null for a pure couple"],
  ["miss_of_system_com","m","distance of the line of impulse from the centre of mass of robot and target; 0 for no impulse, null for a pure couple"],
];

// derivatives of the impact with respect to an uncertain parameter.
export interface ImpactSensitivity {
  /** parameter, such as `target mass` */
  parameter: string;
  /** unit of the parameter */
  unit: string;
  /** end-effector of the grasp that the parameter belongs to */
  end_effector: string;
  /** likewise */
  target: string;
  /** reason for which the derivatives are undefined; replaces the keys below */
  undefined?: string;
  /** derivative of the impulse, per grasp, in W [N s per unit] */
  impulse?: [number, number, number][];
  /** derivative of the angular impulse, per grasp, in W [N m s per unit] */
  angular_impulse?: [number, number, number][];
  /** derivative of the magnitude of the impulse, per grasp [N s per unit] */
  impulse_magnitude?: number[];
  /** derivative of the change of base velocity, in W [m/s per unit] */
  base_velocity_change?: [number, number, number];
  /** derivative of the change of base angular velocity, in W [rad/s per unit] */
  base_angular_velocity_change?: [number, number, number];
}
export const kImpactSensitivity: FieldNote[] = [
  ["parameter","","parameter, such as `target mass`"],
  ["unit","","unit of the parameter"],
  ["end_effector","","end-effector of the grasp that the parameter belongs to"],
  ["target","","likewise"],
  ["undefined","","reason for which the derivatives are undefined; replaces the keys below"],
  ["impulse","N s per unit","derivative of the impulse, per grasp, in W"],
  ["angular_impulse","N m s per unit","derivative of the angular impulse, per grasp, in W"],
  ["impulse_magnitude","N s per unit","derivative of the magnitude of the impulse, per grasp"],
  ["base_velocity_change","m/s per unit","derivative of the change of base velocity, in W"],
  ["base_angular_velocity_change","rad/s per unit","derivative of the change of base angular velocity, in W"],
];

// a load of the impact for which the robot file has a rating.
export interface ImpactMargin {
  /** joint or end-effector */
  of: string;
  /** `force`, `moment`, `impulse`, `angular_impulse`, `driving` or `driving_impulse` */
  quantity: string;
  /** peak forces and moments of a compliant impact, else impulses over `duration` [N, N m, N s or N m s] */
  load: number;
  /** rating in the robot file [as `load`] */
  rating: number;
  /** 1 - load over rating; negative: exceeded [1] */
  margin: number;
  /** whether the load is a mean over the assumed `duration`; the peak may be larger */
  assumed_duration: boolean;
}
export const kImpactMargin: FieldNote[] = [
  ["of","","joint or end-effector"],
  ["quantity","","`force`, `moment`, `impulse`, `angular_impulse`, `driving` or `driving_impulse`"],
  ["load","N, N m, N s or N m s","peak forces and moments of a compliant impact, else impulses over `duration`"],
  ["rating","as `load`","rating in the robot file"],
  ["margin","1","1 - load over rating; negative: exceeded"],
  ["assumed_duration","","whether the load is a mean over the assumed `duration`; the peak may be larger"],
];

// largest factor by which all relative motion of the impact may be scaled before a rating of an arm (gripper, and joints down to the base) is reached. null: no loads.
export interface SpeedLimit {
  /** end-effector of the arm */
  end_effector: string;
  /** factor on the relative velocities at which a rating of the arm is reached [1] */
  factor: number | null;
  /** relative speed at which a rating of the arm is reached [m/s] */
  largest_speed: number | null;
  /** joint or end-effector whose rating is reached first */
  of: string;
  /** quantity whose rating is reached first */
  quantity: string;
}
export const kSpeedLimit: FieldNote[] = [
  ["end_effector","","end-effector of the arm"],
  ["factor","1","factor on the relative velocities at which a rating of the arm is reached"],
  ["largest_speed","m/s","relative speed at which a rating of the arm is reached"],
  ["of","","joint or end-effector whose rating is reached first"],
  ["quantity","","quantity whose rating is reached first"],
];

// grasps that are released together.
export interface ReleaseReport {
  /** time of the release [s] */
  time: number;
  /** end-effectors that released their targets */
  end_effectors: string[];
  /** targets that these end-effectors held, in their order */
  targets: string[];
}
export const kReleaseReport: FieldNote[] = [
  ["time","s","time of the release"],
  ["end_effectors","","end-effectors that released their targets"],
  ["targets","","targets that these end-effectors held, in their order"],
];

// a grasp that opened because its load exceeded its limits, or that slipped too far.
export interface LossReport {
  /** time at which the grasp opened [s] */
  time: number;
  /** end-effector that lost its target */
  end_effector: string;
  /** target that it held */
  target: string;
  /** force between gripper and target [N] */
  force: number;
  /** moment between them, about the grasp point [N m] */
  moment: number;
  /** load relative to the limits in `holds`, which is 1 at the limit [1] */
  load: number;
  /** whether an impact exceeded the limits: force and moment are then means over `impact.duration`, or the peaks of a compliant impact */
  in_impact: boolean;
  /** whether the grasp slipped farther than its limits permit */
  by_slip: boolean;
}
export const kLossReport: FieldNote[] = [
  ["time","s","time at which the grasp opened"],
  ["end_effector","","end-effector that lost its target"],
  ["target","","target that it held"],
  ["force","N","force between gripper and target"],
  ["moment","N m","moment between them, about the grasp point"],
  ["load","1","load relative to the limits in `holds`, which is 1 at the limit"],
  ["in_impact","","whether an impact exceeded the limits: force and moment are then means over `impact.duration`, or the peaks of a compliant impact"],
  ["by_slip","","whether the grasp slipped farther than its limits permit"],
];

// slip of a grasp whose load exceeded its limits.
export interface SlipReport {
  /** onset of the slip [s] */
  time: number;
  /** end-effector of the grasp */
  end_effector: string;
  /** target that it holds */
  target: string;
  /** force between gripper and target at the onset [N] */
  force: number;
  /** moment between them at the onset, about the grasp point [N m] */
  moment: number;
  /** `sticks`: gripper and target came to rest relative to each other. `lost`: the slip exceeded `lost_distance` or `lost_angle`, or an impact the limit of the part that did not slip. `released`: the grasp was released. `slips`: the run ended */
  ended: SlipEnd;
  /** end of the slip, or of the run [s] */
  until: number;
  /** path of the gripper relative to the target [m] */
  distance: number;
  /** the same for its rotation [rad] */
  angle: number;
  /** energy dissipated by friction [J] */
  energy: number;
}
export const kSlipReport: FieldNote[] = [
  ["time","s","onset of the slip"],
  ["end_effector","","end-effector of the grasp"],
  ["target","","target that it holds"],
  ["force","N","force between gripper and target at the onset"],
  ["moment","N m","moment between them at the onset, about the grasp point"],
  ["ended","","`sticks`: gripper and target came to rest relative to each other. `lost`: the slip exceeded `lost_distance` or `lost_angle`, or an impact the limit of the part that did not slip. `released`: the grasp was released. `slips`: the run ended"],
  ["until","s","end of the slip, or of the run"],
  ["distance","m","path of the gripper relative to the target"],
  ["angle","rad","the same for its rotation"],
  ["energy","J","energy dissipated by friction"],
];

export type SlipEnd = "slips" | "sticks" | "lost" | "released";

// the motion after the impact, or the motion of a run without impact.
export interface PostImpact {
  /** state at the end of the motion */
  end?: PhaseEnd;
  /** completed phases, in the order of time */
  phases: MotionPhaseReport[];
  /** closed loops; absent without closed loops */
  loops?: LoopReport[];
  /** loads per phase and grasp; absent without grasps */
  grasp_loads?: GraspLoad[];
  /** detumbling law; absent without it */
  detumbling?: LawReport;
  /** base attitude control by the joints; absent without it */
  base_keeping?: LawReport;
  /** identification of a held target; absent without it */
  identification?: IdentificationReport;
  /** impedance control; absent without it */
  impedance?: LawReport;
  /** grasp force control; absent without it */
  grasp_force?: LawReport;
  /** final rates; absent if the scenario states no limits */
  at_rest?: RestReport;
}
export const kPostImpact: FieldNote[] = [
  ["end","","state at the end of the motion"],
  ["phases","","completed phases, in the order of time"],
  ["loops","","closed loops; absent without closed loops"],
  ["grasp_loads","","loads per phase and grasp; absent without grasps"],
  ["detumbling","","detumbling law; absent without it"],
  ["base_keeping","","base attitude control by the joints; absent without it"],
  ["identification","","identification of a held target; absent without it"],
  ["impedance","","impedance control; absent without it"],
  ["grasp_force","","grasp force control; absent without it"],
  ["at_rest","","final rates; absent if the scenario states no limits"],
];

// a completed phase of the motion after the approach.
export interface MotionPhaseReport {
  /** name of the phase and of its samples in the time series; after an event these continue as NAME_2, ... */
  name: string;
  /** start of the phase [s] */
  begin: number;
  /** end of the phase [s] */
  end: number;
  /** `duration`: the phase lasted for its duration. `condition`: its `until` condition was met earlier */
  ended: MotionPhaseEnd;
  /** state at the end of the phase */
  state?: PhaseEnd;
}
export const kMotionPhaseReport: FieldNote[] = [
  ["name","","name of the phase and of its samples in the time series; after an event these continue as NAME_2, ..."],
  ["begin","s","start of the phase"],
  ["end","s","end of the phase"],
  ["ended","","`duration`: the phase lasted for its duration. `condition`: its `until` condition was met earlier"],
  ["state","","state at the end of the phase"],
];

export type MotionPhaseEnd = "duration" | "condition";

// closure of the kinematic loops in one phase, including an approach in which a grasp closed before its end. The ledger has the defect that remains after projection (`loop_closure_...`).
export interface LoopReport {
  /** phase with closed loops */
  phase: string;
  /** `end-effector - target`: the grasps that close loops of the tree; then the joints that follow others */
  closures: string[];
  /** constraint rows of all closures and couplings of joints [1] */
  rows: number;
  /** rank of these rows at the start of the phase; less than `rows`: some rows are redundant, and internal loads are not all determined [1] */
  rank: number;
  /** largest position defect of one step before projection [m] */
  unprojected_position: number;
  /** largest angle defect of one step before projection [rad] */
  unprojected_angle: number;
  /** largest velocity defect of one step before projection [m/s] */
  unprojected_velocity: number;
  /** largest angular velocity defect of one step before projection [rad/s] */
  unprojected_angular_velocity: number;
  /** sum of all corrections, in the error norm of the integrator, times the tolerance [1] */
  correction_total: number;
  /** sum of the error estimates of all steps in the same measure; if it is smaller than `correction_total`, projection may hide errors [1] */
  integration_error: number;
}
export const kLoopReport: FieldNote[] = [
  ["phase","","phase with closed loops"],
  ["closures","","`end-effector - target`: the grasps that close loops of the tree; then the joints that follow others"],
  ["rows","1","constraint rows of all closures and couplings of joints"],
  ["rank","1","rank of these rows at the start of the phase; less than `rows`: some rows are redundant, and internal loads are not all determined"],
  ["unprojected_position","m","largest position defect of one step before projection"],
  ["unprojected_angle","rad","largest angle defect of one step before projection"],
  ["unprojected_velocity","m/s","largest velocity defect of one step before projection"],
  ["unprojected_angular_velocity","rad/s","largest angular velocity defect of one step before projection"],
  ["correction_total","1","sum of all corrections, in the error norm of the integrator, times the tolerance"],
  ["integration_error","1","sum of the error estimates of all steps in the same measure; if it is smaller than `correction_total`, projection may hide errors"],
];

// the load on one grasp in one phase while it holds. The time series `grasps/END_EFFECTOR/force` and `moment` have its history.
export interface GraspLoad {
  /** phase in which the grasp held */
  phase: string;
  /** end-effector of the grasp */
  end_effector: string;
  /** target of the grasp */
  target: string;
  /** largest force on the robot at the grasp [N] */
  largest_force: number;
  /** time of the largest force [s] */
  force_time: number;
  /** largest moment about the grasp [N m] */
  largest_moment: number;
  /** time of the largest moment [s] */
  moment_time: number;
  /** six values, one per component, angular x, y, z then linear x, y, z, in W, at the start of the phase; false: a self-stress leaves the component undetermined, and the minimum in the metric of the impact is reported */
  determined: boolean[];
}
export const kGraspLoad: FieldNote[] = [
  ["phase","","phase in which the grasp held"],
  ["end_effector","","end-effector of the grasp"],
  ["target","","target of the grasp"],
  ["largest_force","N","largest force on the robot at the grasp"],
  ["force_time","s","time of the largest force"],
  ["largest_moment","N m","largest moment about the grasp"],
  ["moment_time","s","time of the largest moment"],
  ["determined","","six values, one per component, angular x, y, z then linear x, y, z, in W, at the start of the phase; false: a self-stress leaves the component undetermined, and the minimum in the metric of the impact is reported"],
];

// mass, centre of mass and inertia of a held target, as identified from sensor readings.
export interface IdentificationReport {
  /** target that is identified */
  target: string;
  /** start of the samples [s] */
  begin: number;
  /** end of the samples [s] */
  end: number;
  /** `done`. `released`: the target was released first. `running`: the run ended first */
  ended: IdentificationEnd;
  /** number of sensor samples [1] */
  samples: number;
  /** whether the iteration on weights and rates converged */
  converged: boolean;
  /** number of parameters, of ten, that the motion determined [1] */
  rank: number;
  /** largest over smallest significant singular value [1] */
  condition: number;
  /** near 1 if the stated noise is correct; rounding error if there is no noise [1] */
  residual: number;
  /** `determined`; `ratio_only`: determined up to one factor, which also affects other parameters; `not_determined` */
  mass: string;
  /** status of the centre of mass, likewise */
  com: string;
  /** status of the inertia, likewise */
  inertia: string;
  /** the ten parameters, with the true values */
  parameters: IdentifiedParameter[];
  /** changes of the parameters that no measurement detects */
  unseen: string[];
  /** reason for which no body has these parameters; empty: they are physically possible */
  impossible: string;
  /** time from which control laws used the estimate; absent: they did not [s] */
  used_from?: number;
}
export const kIdentificationReport: FieldNote[] = [
  ["target","","target that is identified"],
  ["begin","s","start of the samples"],
  ["end","s","end of the samples"],
  ["ended","","`done`. `released`: the target was released first. `running`: the run ended first"],
  ["samples","1","number of sensor samples"],
  ["converged","","whether the iteration on weights and rates converged"],
  ["rank","1","number of parameters, of ten, that the motion determined"],
  ["condition","1","largest over smallest significant singular value"],
  ["residual","1","near 1 if the stated noise is correct; rounding error if there is no noise"],
  ["mass","","`determined`; `ratio_only`: determined up to one factor, which also affects other parameters; `not_determined`"],
  ["com","","status of the centre of mass, likewise"],
  ["inertia","","status of the inertia, likewise"],
  ["parameters","","the ten parameters, with the true values"],
  ["unseen","","changes of the parameters that no measurement detects"],
  ["impossible","","reason for which no body has these parameters; empty: they are physically possible"],
  ["used_from","s","time from which control laws used the estimate; absent: they did not"],
];

export type IdentificationEnd = "running" | "done" | "released";

// one of the ten inertial parameters of a body.
export interface IdentifiedParameter {
  /** `mass`, `com_x` ..., `inertia_xx` ..., in the target's frame; inertia about the centre of mass */
  name: string;
  /** unit of the values */
  unit: string;
  /** null: not determined [`unit`] */
  value: number | null;
  /** standard deviation; null: not determined, or no noise was stated [`unit`] */
  deviation: number | null;
  /** value of the simulated target [`unit`] */
  truth: number;
  /** value minus true value [`unit`] */
  error: number | null;
}
export const kIdentifiedParameter: FieldNote[] = [
  ["name","","`mass`, `com_x` ..., `inertia_xx` ..., in the target's frame; inertia about the centre of mass"],
  ["unit","","unit of the values"],
  ["value","`unit`","null: not determined"],
  ["deviation","`unit`","standard deviation; null: not determined, or no noise was stated"],
  ["truth","`unit`","value of the simulated target"],
  ["error","`unit`","value minus true value"],
];

// whether the motion after the impact came to rest (post_impact.at_rest).
export interface RestReport {
  /** whether all rates stayed below their limits from `time` to the end */
  at_rest: boolean;
  /** time from which they stayed below; null: they did not [s] */
  time: number | null;
  /** angular velocity of the base, in W, at the end [rad/s] */
  angular_velocity: number;
  /** post_impact.at_rest.angular_velocity [rad/s] */
  angular_velocity_limit: number;
  /** joint with the largest rate at the end; empty: joints are not evaluated */
  joint: string;
  /** magnitude of that rate at the end [rad/s or m/s] */
  joint_rate: number;
  /** post_impact.at_rest.joint_rate; null: joints are not evaluated [rad/s or m/s] */
  joint_rate_limit: number | null;
}
export const kRestReport: FieldNote[] = [
  ["at_rest","","whether all rates stayed below their limits from `time` to the end"],
  ["time","s","time from which they stayed below; null: they did not"],
  ["angular_velocity","rad/s","angular velocity of the base, in W, at the end"],
  ["angular_velocity_limit","rad/s","post_impact.at_rest.angular_velocity"],
  ["joint","","joint with the largest rate at the end; empty: joints are not evaluated"],
  ["joint_rate","rad/s or m/s","magnitude of that rate at the end"],
  ["joint_rate_limit","rad/s or m/s","post_impact.at_rest.joint_rate; null: joints are not evaluated"],
];

// the largest value of one load in one phase.
export interface PeakLoad {
  /** joint, end-effector, or `base control` */
  of: string;
  /** in motion: `force` and `moment`, the magnitudes that a joint transmits at its origin, or a grasp at the grasp; `driving`, the effort of a joint's drive or brake along its axis; for base control `driving/x`, `driving/y`, `driving/z`, the torque about the base's axes; of impacts of hard contacts `impulse`, `angular_impulse`, `driving_impulse`. In impacts of grasps: `impulse`, `angular_impulse`, `driving_impulse`, and `force`, `moment`, `driving`: the peaks of a compliant impact, else means over `impact.duration` */
  quantity: string;
  /** phase of the load; impacts are phases too: `contact`, `contact_2`, and brakes: `brake` */
  phase: string;
  /** largest magnitude [N, N m, N s or N m s] */
  peak: number;
  /** time of the peak [s] */
  time: number;
  /** rating in the robot file; null: none. For a drive in motion the smaller of `rating.driving` and `limits.effort` [as `peak`] */
  rating: number | null;
  /** 1 - peak over rating; negative: exceeded; 0 for a drive: saturated at its effort limit; null: no rating [1] */
  margin: number | null;
  /** whether the load is a mean over the assumed `impact.duration`; the peak may be larger */
  assumed_duration: boolean;
}
export const kPeakLoad: FieldNote[] = [
  ["of","","joint, end-effector, or `base control`"],
  ["quantity","","in motion: `force` and `moment`, the magnitudes that a joint transmits at its origin, or a grasp at the grasp; `driving`, the effort of a joint's drive or brake along its axis; for base control `driving/x`, `driving/y`, `driving/z`, the torque about the base's axes; of impacts of hard contacts `impulse`, `angular_impulse`, `driving_impulse`. In impacts of grasps: `impulse`, `angular_impulse`, `driving_impulse`, and `force`, `moment`, `driving`: the peaks of a compliant impact, else means over `impact.duration`"],
  ["phase","","phase of the load; impacts are phases too: `contact`, `contact_2`, and brakes: `brake`"],
  ["peak","N, N m, N s or N m s","largest magnitude"],
  ["time","s","time of the peak"],
  ["rating","as `peak`","rating in the robot file; null: none. For a drive in motion the smaller of `rating.driving` and `limits.effort`"],
  ["margin","1","1 - peak over rating; negative: exceeded; 0 for a drive: saturated at its effort limit; null: no rating"],
  ["assumed_duration","","whether the load is a mean over the assumed `impact.duration`; the peak may be larger"],
];

// a reaction wheel of the base.
export interface WheelReport {
  /** name of the wheel */
  name: string;
  /** moment of inertia about its axis [kg m^2] */
  inertia: number;
  /** rate relative to the base at the start of the run [rad/s] */
  rate_before: number;
  /** rate relative to the base at the end of the run [rad/s] */
  rate_after: number;
  /** inertia times rate relative to the base, at the end of the run [N m s] */
  momentum_after: number;
  /** largest magnitude of the rate at the evaluated instants [rad/s] */
  largest_rate: number;
  /** limit of the rate; null: none [rad/s] */
  rate_limit: number | null;
  /** largest magnitude of the motor torque at the evaluated instants; null: not evaluated [N m] */
  largest_torque: number | null;
  /** limit of the motor torque; null: none [N m] */
  torque_limit: number | null;
}
export const kWheelReport: FieldNote[] = [
  ["name","","name of the wheel"],
  ["inertia","kg m^2","moment of inertia about its axis"],
  ["rate_before","rad/s","rate relative to the base at the start of the run"],
  ["rate_after","rad/s","rate relative to the base at the end of the run"],
  ["momentum_after","N m s","inertia times rate relative to the base, at the end of the run"],
  ["largest_rate","rad/s","largest magnitude of the rate at the evaluated instants"],
  ["rate_limit","rad/s","limit of the rate; null: none"],
  ["largest_torque","N m","largest magnitude of the motor torque at the evaluated instants; null: not evaluated"],
  ["torque_limit","N m","limit of the motor torque; null: none"],
];

// the control moment gyros of the base.
export interface GyrosReport {
  /** gyros in the robot's order */
  each: GyroReport[];
  /** minimum of the root of det(A Aᵀ) at the evaluated instants, A the derivatives of the momenta with respect to the gimbal angles over the largest momentum; 0: no torque is available about one axis [1] */
  least_singularity_measure: number;
  /** whether the gyros were commanded a torque */
  steered: boolean;
  /** measure below which the gyros are near a singularity; null: never steered [1] */
  near: number | null;
  /** largest part of the commanded torque that the commanded gimbal rates do not produce, near singularities or at rate limits; null: never steered, or not evaluated [N m] */
  largest_torque_lacking: number | null;
  /** intervals near a singularity while a torque is commanded */
  hazards: SingularityHazard[];
}
export const kGyrosReport: FieldNote[] = [
  ["each","","gyros in the robot's order"],
  ["least_singularity_measure","1","minimum of the root of det(A Aᵀ) at the evaluated instants, A the derivatives of the momenta with respect to the gimbal angles over the largest momentum; 0: no torque is available about one axis"],
  ["steered","","whether the gyros were commanded a torque"],
  ["near","1","measure below which the gyros are near a singularity; null: never steered"],
  ["largest_torque_lacking","N m","largest part of the commanded torque that the commanded gimbal rates do not produce, near singularities or at rate limits; null: never steered, or not evaluated"],
  ["hazards","","intervals near a singularity while a torque is commanded"],
];

// a control moment gyro of the base.
export interface GyroReport {
  /** name of the gyro */
  name: string;
  /** momentum of its rotor relative to the gimbal [N m s] */
  momentum: number;
  /** gimbal angle at the start of the run [rad] */
  angle_before: number;
  /** gimbal angle at the end of the run [rad] */
  angle_after: number;
  /** largest magnitude of the gimbal rate at the evaluated instants [rad/s] */
  largest_rate: number;
  /** largest rate that is commanded; null: none [rad/s] */
  rate_limit: number | null;
  /** largest magnitude of the gimbal motor's torque at the evaluated instants; null: not evaluated [N m] */
  largest_torque: number | null;
  /** limit of the gimbal motor's torque; null: none [N m] */
  torque_limit: number | null;
  /** largest magnitude of the torque of the rotor's motor, which keeps the rotor's rate; null: not evaluated [N m] */
  largest_spin_torque: number | null;
}
export const kGyroReport: FieldNote[] = [
  ["name","","name of the gyro"],
  ["momentum","N m s","momentum of its rotor relative to the gimbal"],
  ["angle_before","rad","gimbal angle at the start of the run"],
  ["angle_after","rad","gimbal angle at the end of the run"],
  ["largest_rate","rad/s","largest magnitude of the gimbal rate at the evaluated instants"],
  ["rate_limit","rad/s","largest rate that is commanded; null: none"],
  ["largest_torque","N m","largest magnitude of the gimbal motor's torque at the evaluated instants; null: not evaluated"],
  ["torque_limit","N m","limit of the gimbal motor's torque; null: none"],
  ["largest_spin_torque","N m","largest magnitude of the torque of the rotor's motor, which keeps the rotor's rate; null: not evaluated"],
];

// an interval in which steered gyros are near a singular configuration.
export interface SingularityHazard {
  /** start of the interval [s] */
  begin: number;
  /** duration of the interval; each integration step counts by the state at its middle [s] */
  duration: number;
  /** minimum singularity measure at these middles [1] */
  least_measure: number;
  /** largest missing part of the commanded torque at these middles [N m] */
  largest_torque_lacking: number;
}
export const kSingularityHazard: FieldNote[] = [
  ["begin","s","start of the interval"],
  ["duration","s","duration of the interval; each integration step counts by the state at its middle"],
  ["least_measure","1","minimum singularity measure at these middles"],
  ["largest_torque_lacking","N m","largest missing part of the commanded torque at these middles"],
];

// an actuator of the base of a kind without its own report.
export interface ActuatorUse {
  /** path of its time series */
  quantity: string;
  /** of the actuator */
  name: string;
  /** of the numbers below */
  unit: string;
  /** largest magnitude [unit] */
  largest: number;
  /** maximum magnitude [unit] */
  limit: number;
  /** total time at the limit, by integration steps [s] */
  saturated: number;
  /** start of the first saturation; 0 without any [s] */
  first_saturated: number;
}
export const kActuatorUse: FieldNote[] = [
  ["quantity","","path of its time series"],
  ["name","","of the actuator"],
  ["unit","","of the numbers below"],
  ["largest","unit","largest magnitude"],
  ["limit","unit","maximum magnitude"],
  ["saturated","s","total time at the limit, by integration steps"],
  ["first_saturated","s","start of the first saturation; 0 without any"],
];

// a tendon over all phases with its command.
export interface TendonReport {
  /** of the tendon */
  name: string;
  /** largest tension [N] */
  largest_tension: number;
  /** work of the tendon on its joints, part of the motors' work in the ledger [J] */
  work: number;
  /** sum of moment arm times joint value where its first command begins [m] */
  excursion_before: number;
  /** the same where its last command ends [m] */
  excursion_after: number;
}
export const kTendonReport: FieldNote[] = [
  ["name","","of the tendon"],
  ["largest_tension","N","largest tension"],
  ["work","J","work of the tendon on its joints, part of the motors' work in the ledger"],
  ["excursion_before","m","sum of moment arm times joint value where its first command begins"],
  ["excursion_after","m","the same where its last command ends"],
];

// motion in one phase of a joint with sticking friction, stops, or an electrically modelled motor.
export interface JointReport {
  /** phase of motion */
  phase: string;
  /** name of the joint */
  joint: string;
  /** state at the end of the phase. `moving`: free to move. `stuck`: held by friction. `at_lower_stop`, `at_upper_stop`: resting on a stop. `prescribed`: on a prescribed motion, which neither sticks nor meets stops */
  mode: JointMode;
  /** number of transitions to sticking [1] */
  sticks: number;
  /** number of breakaways [1] */
  breakaways: number;
  /** largest friction while held, at any sample or time step, over its breakaway effort `static`; null: its friction does not stick [1] */
  friction_share: number | null;
  /** false: closed loops left the friction of this joint undetermined while it was held. The reported values are the admissible set with the minimum sum of squared shares of breakaway */
  friction_determined: boolean;
  /** heat from joint friction, without stops [J] */
  friction_heat: number;
  /** number of impacts on a stop [1] */
  stop_impacts: number;
  /** energy that the whole system lost in these impacts [J] */
  stop_energy_lost: number;
  /** mechanical work of its motor on the joint [J] */
  motor_work: number;
  /** current squared times resistance, over time; null: the motor's torque constant is not given [J] */
  copper_loss: number | null;
  /** copper_loss + motor_work: energy drawn by the motor minus energy returned while braking; null: the motor's torque constant is not given [J] */
  electrical_energy: number | null;
}
export const kJointReport: FieldNote[] = [
  ["phase","","phase of motion"],
  ["joint","","name of the joint"],
  ["mode","","state at the end of the phase. `moving`: free to move. `stuck`: held by friction. `at_lower_stop`, `at_upper_stop`: resting on a stop. `prescribed`: on a prescribed motion, which neither sticks nor meets stops"],
  ["sticks","1","number of transitions to sticking"],
  ["breakaways","1","number of breakaways"],
  ["friction_share","1","largest friction while held, at any sample or time step, over its breakaway effort `static`; null: its friction does not stick"],
  ["friction_determined","","false: closed loops left the friction of this joint undetermined while it was held. The reported values are the admissible set with the minimum sum of squared shares of breakaway"],
  ["friction_heat","J","heat from joint friction, without stops"],
  ["stop_impacts","1","number of impacts on a stop"],
  ["stop_energy_lost","J","energy that the whole system lost in these impacts"],
  ["motor_work","J","mechanical work of its motor on the joint"],
  ["copper_loss","J","current squared times resistance, over time; null: the motor's torque constant is not given"],
  ["electrical_energy","J","copper_loss + motor_work: energy drawn by the motor minus energy returned while braking; null: the motor's torque constant is not given"],
];

export type JointMode = "moving" | "stuck" | "at_lower_stop" | "at_upper_stop" | "prescribed";

// impact of a joint on a stop at the end of its range.
export interface StopImpact {
  /** time of the impact [s] */
  time: number;
  /** name of the joint */
  joint: string;
  /** true: upper end of the range; false: lower end */
  upper: boolean;
  /** joint rate before the impact [rad/s or m/s] */
  rate_before: number;
  /** joint rate after the impact [rad/s or m/s] */
  rate_after: number;
  /** impulse of the stop on the joint, along its axis [N m s or N s] */
  impulse: number;
  /** energy that the whole system lost [J] */
  energy_lost: number;
}
export const kStopImpact: FieldNote[] = [
  ["time","s","time of the impact"],
  ["joint","","name of the joint"],
  ["upper","","true: upper end of the range; false: lower end"],
  ["rate_before","rad/s or m/s","joint rate before the impact"],
  ["rate_after","rad/s or m/s","joint rate after the impact"],
  ["impulse","N m s or N s","impulse of the stop on the joint, along its axis"],
  ["energy_lost","J","energy that the whole system lost"],
];

// the thrusters of the base. The robot's mass remains constant.
export interface ThrustersReport {
  /** thrusters in the robot's order */
  each: ThrusterReport[];
  /** propellant used by all thrusters [kg] */
  propellant: number;
  /** available propellant of the robot file; null: not given [kg] */
  available: number | null;
  /** propellant used beyond the available mass; 0: none [kg] */
  excess: number;
  /** unloading of the wheels; absent if it is not requested */
  dumping?: DumpingReport;
  /** plumes that met a body */
  hazards: PlumeHazard[];
}
export const kThrustersReport: FieldNote[] = [
  ["each","","thrusters in the robot's order"],
  ["propellant","kg","propellant used by all thrusters"],
  ["available","kg","available propellant of the robot file; null: not given"],
  ["excess","kg","propellant used beyond the available mass; 0: none"],
  ["dumping","","unloading of the wheels; absent if it is not requested"],
  ["hazards","","plumes that met a body"],
];

// a thruster of the base.
export interface ThrusterReport {
  /** name of the thruster */
  name: string;
  /** number of valve openings [1] */
  firings: number;
  /** total time with an open valve [s] */
  on_time: number;
  /** on_time over the time of the phases in which thrusters are active [1] */
  duty: number;
  /** impulse of its force, including ramps [N s] */
  impulse: number;
  /** propellant mass: impulse over specific impulse and 9.80665 m/s^2 [kg] */
  propellant: number;
}
export const kThrusterReport: FieldNote[] = [
  ["name","","name of the thruster"],
  ["firings","1","number of valve openings"],
  ["on_time","s","total time with an open valve"],
  ["duty","1","on_time over the time of the phases in which thrusters are active"],
  ["impulse","N s","impulse of its force, including ramps"],
  ["propellant","kg","propellant mass: impulse over specific impulse and 9.80665 m/s^2"],
];

// unloading of the wheels' momentum by thrusters.
export interface DumpingReport {
  /** number of times that unloading began [1] */
  begun: number;
  /** first start of unloading; 0: never [s] */
  first_begin: number;
  /** total duration of unloading [s] */
  duration: number;
  /** whether unloading was active at the end of the run */
  active: boolean;
  /** largest magnitude of the wheels' momentum at the instants at which pulses may begin [N m s] */
  largest_momentum: number;
}
export const kDumpingReport: FieldNote[] = [
  ["begun","1","number of times that unloading began"],
  ["first_begin","s","first start of unloading; 0: never"],
  ["duration","s","total duration of unloading"],
  ["active","","whether unloading was active at the end of the run"],
  ["largest_momentum","N m s","largest magnitude of the wheels' momentum at the instants at which pulses may begin"],
];

// a body in the plume of a firing thruster.
export interface PlumeHazard {
  /** name of the thruster */
  thruster: string;
  /** link or target, named as in the clearance report */
  body: string;
  /** start of the first interval in the plume [s] */
  first_time: number;
  /** duration of firing with one of the body's points in the plume cone: corners, midpoints of edges and faces of boxes, ends of cylinders and capsules, centres of all shapes, else its centre of mass; each integration step counts by the state at its middle [s] */
  duration: number;
}
export const kPlumeHazard: FieldNote[] = [
  ["thruster","","name of the thruster"],
  ["body","","link or target, named as in the clearance report"],
  ["first_time","s","start of the first interval in the plume"],
  ["duration","s","duration of firing with one of the body's points in the plume cone: corners, midpoints of edges and faces of boxes, ends of cylinders and capsules, centres of all shapes, else its centre of mass; each integration step counts by the state at its middle"],
];

// an actuator that was at its limit.
export interface SaturationReport {
  /** kind of actuator */
  actuator: SaturatedActuator;
  /** of the wheel, gyro, thruster or joint; of base control the axis `x`, `y` or `z` */
  name: string;
  /** saturated quantity. */
  quantity: SaturatedQuantity;
  /** limit of the quantity: the share of time 1 for a thruster; for a singularity the measure below which the array is near it [rad/s, N m, N or 1] */
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
  ["quantity","","saturated quantity."],
  ["limit","rad/s, N m, N or 1","limit of the quantity: the share of time 1 for a thruster; for a singularity the measure below which the array is near it"],
  ["first_time","s","start of the first saturation"],
  ["duration","s","total time at the limit, by integration steps"],
  ["share","1","duration over the simulated time of all phases of motion"],
  ["at_end","","whether the actuator was at its limit at the end of the run"],
];

export type SaturatedActuator = "wheel" | "gyro" | "gyros" | "thruster" | "joint" | "base_control";

export type SaturatedQuantity = "rate" | "torque" | "effort" | "duty" | "singularity";

// stability of the control loops in one phase of motion.
export interface StabilityReport {
  /** phase of motion */
  phase: string;
  /** verdict for the phase. */
  verdict: Stability;
  /** reason for the verdict */
  reason: string;
  /** decisive rate, `base x` or a joint's rate error; empty: none */
  of: string;
  /** period of its oscillation at the end of the phase; 0: no oscillation [s] */
  period: number;
  /** largest amplitude in the first third of the oscillation, or of the phase [rad/s or m/s] */
  amplitude_before: number;
  /** largest amplitude in the last third [rad/s or m/s] */
  amplitude_after: number;
  /** share of the last third in which the actuators of this rate saturated [1] */
  saturated_share: number;
  /** start of the growth, or of the saturated oscillation; null: the verdict is not `unstable` [s] */
  since: number | null;
}
export const kStabilityReport: FieldNote[] = [
  ["phase","","phase of motion"],
  ["verdict","","verdict for the phase."],
  ["reason","","reason for the verdict"],
  ["of","","decisive rate, `base x` or a joint's rate error; empty: none"],
  ["period","s","period of its oscillation at the end of the phase; 0: no oscillation"],
  ["amplitude_before","rad/s or m/s","largest amplitude in the first third of the oscillation, or of the phase"],
  ["amplitude_after","rad/s or m/s","largest amplitude in the last third"],
  ["saturated_share","1","share of the last third in which the actuators of this rate saturated"],
  ["since","s","start of the growth, or of the saturated oscillation; null: the verdict is not `unstable`"],
];

export type Stability = "unstable" | "not_evaluated" | "stable";

// linear model of the scenario's controllers at the start or end of a phase.
export interface ControlLoopReport {
  /** time of the linear model [s] */
  time: number;
  /** phase of motion that begins or continues there */
  phase: string;
  /** the laws that act */
  laws: string[];
  /** verdict of the eigenvalues, as of `grapnel linearize` */
  verdict: LinearStability;
  /** reason of the verdict, or why there is no closed loop */
  reason: string;
  /** whether the laws are sampled */
  sampled: boolean;
  /** margins of each channel */
  margins: LoopMargin[];
  /** why there are none; empty: there are */
  margins_absent: string;
}
export const kControlLoopReport: FieldNote[] = [
  ["time","s","time of the linear model"],
  ["phase","","phase of motion that begins or continues there"],
  ["laws","","the laws that act"],
  ["verdict","","verdict of the eigenvalues, as of `grapnel linearize`"],
  ["reason","","reason of the verdict, or why there is no closed loop"],
  ["sampled","","whether the laws are sampled"],
  ["margins","","margins of each channel"],
  ["margins_absent","","why there are none; empty: there are"],
];

export type LinearStability = "stable" | "marginal" | "unstable" | "not decided";

// margins of a channel of the scenario's controllers.
export interface LoopMargin {
  /** the input whose loop is opened, while all others are closed */
  channel: string;
  /** unit of the input */
  unit: string;
  /** factor on the gains of the channel above which the loop is unstable; absent: no limit [1] */
  gain_maximum?: number;
  /** factor below which it is unstable; absent: no limit [1] */
  gain_minimum?: number;
  /** of the oscillation at the factor that is nearest to 1 [rad/s] */
  gain_frequency?: number;
  /** smallest phase margin, by magnitude; absent: the loop gain is nowhere 1 [rad] */
  phase?: number;
  /** its frequency [rad/s] */
  phase_frequency?: number;
  /** smallest added delay of the channel with which the loop is unstable [s] */
  delay?: number;
}
export const kLoopMargin: FieldNote[] = [
  ["channel","","the input whose loop is opened, while all others are closed"],
  ["unit","","unit of the input"],
  ["gain_maximum","1","factor on the gains of the channel above which the loop is unstable; absent: no limit"],
  ["gain_minimum","1","factor below which it is unstable; absent: no limit"],
  ["gain_frequency","rad/s","of the oscillation at the factor that is nearest to 1"],
  ["phase","rad","smallest phase margin, by magnitude; absent: the loop gain is nowhere 1"],
  ["phase_frequency","rad/s","its frequency"],
  ["delay","s","smallest added delay of the channel with which the loop is unstable"],
];

// contact between two bodies over the whole run. The normal force is the sum over all places where they touch.
export interface ContactPairReport {
  /** pair of bodies, or of a body and an obstacle */
  bodies: [string, string];
  /** number of times that the contact began [1] */
  touches: number;
  /** whether the bodies touched at the end of the run */
  touches_at_end: boolean;
  /** start of the first contact; absent: no contact [s] */
  first_time?: number;
  /** total time with contact [s] */
  duration: number;
  /** time integral of the normal force, with the impulses of hard contact [N s] */
  impulse: number;
  /** largest normal force [N] */
  peak_force: number;
  /** time of the largest normal force; absent: no contact that lasts [s] */
  peak_time?: number;
  /** centre of the normal forces at that time, in W; absent: no contact that lasts [m] */
  peak_point?: [number, number, number];
  /** largest penetration, of both surfaces together [m] */
  largest_depth: number;
  /** path of the largest slip velocity during contact [m] */
  slip_distance: number;
  /** energy dissipated by the normal forces [J] */
  damping_loss: number;
  /** energy dissipated by friction [J] */
  friction_loss: number;
  /** elastic energy of the surfaces at the end of the run [J] */
  elastic_energy: number;
  /** whether an overlap was too deep for the contact model; then forces are not reliable */
  beyond_model: boolean;
  /** start of the first such overlap: forces and the motion are not reliable from then on; absent: no overlap was too deep [s] */
  beyond_model_since?: number;
  /** penetration at that time; absent: no overlap was too deep [m] */
  beyond_model_depth?: number;
  /** impacts of hard contact; absent: the contact is compliant */
  hard?: HardContactReport;
}
export const kContactPairReport: FieldNote[] = [
  ["bodies","","pair of bodies, or of a body and an obstacle"],
  ["touches","1","number of times that the contact began"],
  ["touches_at_end","","whether the bodies touched at the end of the run"],
  ["first_time","s","start of the first contact; absent: no contact"],
  ["duration","s","total time with contact"],
  ["impulse","N s","time integral of the normal force, with the impulses of hard contact"],
  ["peak_force","N","largest normal force"],
  ["peak_time","s","time of the largest normal force; absent: no contact that lasts"],
  ["peak_point","m","centre of the normal forces at that time, in W; absent: no contact that lasts"],
  ["largest_depth","m","largest penetration, of both surfaces together"],
  ["slip_distance","m","path of the largest slip velocity during contact"],
  ["damping_loss","J","energy dissipated by the normal forces"],
  ["friction_loss","J","energy dissipated by friction"],
  ["elastic_energy","J","elastic energy of the surfaces at the end of the run"],
  ["beyond_model","","whether an overlap was too deep for the contact model; then forces are not reliable"],
  ["beyond_model_since","s","start of the first such overlap: forces and the motion are not reliable from then on; absent: no overlap was too deep"],
  ["beyond_model_depth","m","penetration at that time; absent: no overlap was too deep"],
  ["hard","","impacts of hard contact; absent: the contact is compliant"],
];

// instantaneous impacts of two hard bodies over the whole run.
export interface HardContactReport {
  /** number of impacts in an instant [1] */
  impacts: number;
  /** largest approach speed of an impact [m/s] */
  fastest_impact: number;
  /** time of the last impact; absent: no impact [s] */
  last_time?: number;
  /** sum of the normal impulses of all impacts [N s] */
  impulse: number;
  /** energy lost in impacts by the normal impulses [J] */
  restitution_loss: number;
  /** energy lost in impacts by friction [J] */
  friction_loss: number;
  /** start of the first contact that lasted; absent: every contact was an impact [s] */
  persistent_since?: number;
}
export const kHardContactReport: FieldNote[] = [
  ["impacts","1","number of impacts in an instant"],
  ["fastest_impact","m/s","largest approach speed of an impact"],
  ["last_time","s","time of the last impact; absent: no impact"],
  ["impulse","N s","sum of the normal impulses of all impacts"],
  ["restitution_loss","J","energy lost in impacts by the normal impulses"],
  ["friction_loss","J","energy lost in impacts by friction"],
  ["persistent_since","s","start of the first contact that lasted; absent: every contact was an impact"],
];

// stages of the capture of one target by contacts.
export interface StagesReport {
  /** target */
  target: string;
  /** last stage that was reached */
  reached: CaptureStage;
  /** first contact of gripper and target; absent: none [s] */
  contact_time?: number;
  /** start of closing; absent: it did not begin [s] */
  closing_time?: number;
  /** end of closing, if the gripper touched the target then; absent otherwise [s] */
  closed_time?: number;
  /** time at which the target had moved less than stated for the stated time; absent: never [s] */
  settled_time?: number;
  /** time at which a grasp of the target closed; absent: none [s] */
  latched_time?: number;
  /** last search of an escape path. `caged`: there is none. `can_leave`: one was found. `undecided`: neither was shown */
  cage: CageVerdict;
  /** time of this search [s] */
  cage_time?: number;
  /** time of the first search that found a cage; absent: none [s] */
  caged_time?: number;
  /** overlap of shapes that counted as free in the last search [m] */
  cage_allowance?: number;
  /** poses evaluated in the last search [1] */
  cage_poses?: number;
  /** `no_contact`: the gripper did not touch the target. `closed_on_nothing`: nor when it had closed. `pushed_away`: after contact the target moved away. `not_settled`: it moves near or in the gripper. `jammed`: the target is settled, but an escape path was found. `slipped`: the settled target moved again. `lost`: it lost contact */
  failure: StageFailure;
  /** time of the failure; absent: none [s] */
  failure_time?: number;
  /** sum of the normal forces of the gripper on the target, at the end of the run or when a grasp closed [N] */
  grip_force: number;
  /** smallest share of friction that was left while the target was settled, over the pairs of the gripper; 0: one slips; absent: not settled [1] */
  least_friction_margin?: number;
}
export const kStagesReport: FieldNote[] = [
  ["target","","target"],
  ["reached","","last stage that was reached"],
  ["contact_time","s","first contact of gripper and target; absent: none"],
  ["closing_time","s","start of closing; absent: it did not begin"],
  ["closed_time","s","end of closing, if the gripper touched the target then; absent otherwise"],
  ["settled_time","s","time at which the target had moved less than stated for the stated time; absent: never"],
  ["latched_time","s","time at which a grasp of the target closed; absent: none"],
  ["cage","","last search of an escape path. `caged`: there is none. `can_leave`: one was found. `undecided`: neither was shown"],
  ["cage_time","s","time of this search"],
  ["caged_time","s","time of the first search that found a cage; absent: none"],
  ["cage_allowance","m","overlap of shapes that counted as free in the last search"],
  ["cage_poses","1","poses evaluated in the last search"],
  ["failure","","`no_contact`: the gripper did not touch the target. `closed_on_nothing`: nor when it had closed. `pushed_away`: after contact the target moved away. `not_settled`: it moves near or in the gripper. `jammed`: the target is settled, but an escape path was found. `slipped`: the settled target moved again. `lost`: it lost contact"],
  ["failure_time","s","time of the failure; absent: none"],
  ["grip_force","N","sum of the normal forces of the gripper on the target, at the end of the run or when a grasp closed"],
  ["least_friction_margin","1","smallest share of friction that was left while the target was settled, over the pairs of the gripper; 0: one slips; absent: not settled"],
];

export type CaptureStage = "approach" | "contact" | "closed" | "caged" | "settled" | "latched";

export type CageVerdict = "not_searched" | "caged" | "can_leave" | "undecided";

export type StageFailure = "none" | "no_contact" | "closed_on_nothing" | "pushed_away" | "not_settled" | "jammed" | "slipped" | "lost";

// distances between bodies with shapes.
export interface Clearances {
  /** pairs of bodies that are not checked: pairs that the scenario ignores, and the grasping link with its target until the grasp closes or is missed, and while it holds (an end-effector that passes *through* its own target before that is not reported). After a miss, a rebound or a release the pair is checked: until it reaches the required clearance, an overlap counts only if it is deeper than when the grasp opened. Neighbouring links are not checked */
  unwatched: [string, string][];
  /** minimum over all phases */
  minimum: MinimumClearance;
  /** minimum of each phase */
  phases: MinimumClearance[];
  /** intervals in which bodies were too close */
  events: ClearanceEvent[];
}
export const kClearances: FieldNote[] = [
  ["unwatched","","pairs of bodies that are not checked: pairs that the scenario ignores, and the grasping link with its target until the grasp closes or is missed, and while it holds (an end-effector that passes *through* its own target before that is not reported). After a miss, a rebound or a release the pair is checked: until it reaches the required clearance, an overlap counts only if it is deeper than when the grasp opened. Neighbouring links are not checked"],
  ["minimum","","minimum over all phases"],
  ["phases","","minimum of each phase"],
  ["events","","intervals in which bodies were too close"],
];

// the minimum distance of any two monitored bodies in one phase.
export interface MinimumClearance {
  /** phase in which bodies with shapes were monitored */
  phase: string;
  /** minimum distance; negative: a depth of overlap; null: no pair was monitored [m] */
  distance: number | null;
  /** closest pair */
  bodies: [string, string];
  /** closest points of this pair, in W [m] */
  points: [[number, number, number], [number, number, number]];
  /** time of the minimum [s] */
  time: number;
}
export const kMinimumClearance: FieldNote[] = [
  ["phase","","phase in which bodies with shapes were monitored"],
  ["distance","m","minimum distance; negative: a depth of overlap; null: no pair was monitored"],
  ["bodies","","closest pair"],
  ["points","m","closest points of this pair, in W"],
  ["time","s","time of the minimum"],
];

// an interval in which two bodies were closer than required.
export interface ClearanceEvent {
  /** phase of the interval */
  phase: string;
  /** pair of bodies */
  bodies: [string, string];
  /** start of the interval, at the earliest the start of its phase [s] */
  begin: number;
  /** end of the interval, at the latest the end of its phase [s] */
  end: number;
  /** required distance [m] */
  required: number;
  /** minimum distance in the interval; negative: a depth of overlap [m] */
  minimum_distance: number;
  /** time of the minimum [s] */
  minimum_time: number;
  /** start of the overlap, which may be later than `begin`; absent: no overlap [s] */
  overlap_begin?: number;
}
export const kClearanceEvent: FieldNote[] = [
  ["phase","","phase of the interval"],
  ["bodies","","pair of bodies"],
  ["begin","s","start of the interval, at the earliest the start of its phase"],
  ["end","s","end of the interval, at the latest the end of its phase"],
  ["required","m","required distance"],
  ["minimum_distance","m","minimum distance in the interval; negative: a depth of overlap"],
  ["minimum_time","s","time of the minimum"],
  ["overlap_begin","s","start of the overlap, which may be later than `begin`; absent: no overlap"],
];

// limits of joints, drives and base control.
export interface Limits {
  /** intervals, in the order of time */
  events: LimitEvent[];
}
export const kLimits: FieldNote[] = [
  ["events","","intervals, in the order of time"],
];

// an interval in which a joint exceeded a limit, or a motor was saturated. Efforts are evaluated in every step of the integrator, as loads are.
export interface LimitEvent {
  /** violated limit. */
  kind: LimitKind;
  /** name of the joint, or `base control x`, `y`, `z` */
  joint: string;
  /** phase of the interval */
  phase: string;
  /** start of the interval [s] */
  begin: number;
  /** end of the interval [s] */
  end: number;
  /** limit with its sign: a rate of -0.3 against a limit of 0.2 has the limit -0.2 [as the joint's] */
  limit: number;
  /** largest excess value: rad or m, rad/s or m/s, N m or N [as the joint's] */
  worst_value: number;
  /** time of that value [s] */
  worst_time: number;
}
export const kLimitEvent: FieldNote[] = [
  ["kind","","violated limit."],
  ["joint","","name of the joint, or `base control x`, `y`, `z`"],
  ["phase","","phase of the interval"],
  ["begin","s","start of the interval"],
  ["end","s","end of the interval"],
  ["limit","as the joint's","limit with its sign: a rate of -0.3 against a limit of 0.2 has the limit -0.2"],
  ["worst_value","as the joint's","largest excess value: rad or m, rad/s or m/s, N m or N"],
  ["worst_time","s","time of that value"],
];

export type LimitKind = "position" | "rate" | "effort" | "effort_saturated";

// whether a real robot could perform this motion. Violations do not affect the simulated motion: bodies pass through each other.
export interface Feasibility {
  /** `not checked`: clearance is switched off, bodies lack shapes, nothing moves, or the run failed before its end, and no violation was found. A detected violation gives `no`, even if other checks were not evaluated. Joints without limits need no check */
  verdict: Verdict;
  /** the verdict, as printed on the terminal */
  sentence: string;
  /** the first violation in time; absent if there is none */
  first?: Violation;
  /** the worst violation; absent if there is none */
  worst?: GradedViolation;
  /** the worst violation of each phase; absent if there is none */
  by_phase?: GradedViolation[];
  /** checks that were not evaluated, with the reason */
  not_checked: string[];
  /** start of the first overlap: from then on the model is not valid. Absent: no overlap, as far as it was checked [s] */
  valid_until?: number;
}
export const kFeasibility: FieldNote[] = [
  ["verdict","","`not checked`: clearance is switched off, bodies lack shapes, nothing moves, or the run failed before its end, and no violation was found. A detected violation gives `no`, even if other checks were not evaluated. Joints without limits need no check"],
  ["sentence","","the verdict, as printed on the terminal"],
  ["first","","the first violation in time; absent if there is none"],
  ["worst","","the worst violation; absent if there is none"],
  ["by_phase","","the worst violation of each phase; absent if there is none"],
  ["not_checked","","checks that were not evaluated, with the reason"],
  ["valid_until","s","start of the first overlap: from then on the model is not valid. Absent: no overlap, as far as it was checked"],
];

export type Verdict = "yes" | "no" | "not checked";

// a violation that makes the motion infeasible for a real robot.
export interface Violation {
  /** `overlap`; `clearance`: closer than required; `position`, `rate`, `effort` of a joint */
  kind: string;
  /** the bodies or the joint, as a sentence */
  what: string;
  /** phase in which it begins */
  phase: string;
  /** start of the violation [s] */
  time: number;
}
export const kViolation: FieldNote[] = [
  ["kind","","`overlap`; `clearance`: closer than required; `position`, `rate`, `effort` of a joint"],
  ["what","","the bodies or the joint, as a sentence"],
  ["phase","","phase in which it begins"],
  ["time","s","start of the violation"],
];

// a violation at its worst instant. Overlaps rank before distances, distances before limits; within a rank by depth, missing distance, or relative excess.
export interface GradedViolation {
  /** as in `Violation` */
  kind: string;
  /** the violation with its size, as a sentence */
  what: string;
  /** phase of the violation */
  phase: string;
  /** time of the worst instant [s] */
  time: number;
  /** depth of the overlap, the distance, or the joint's value [m, or as the joint's] */
  value: number;
}
export const kGradedViolation: FieldNote[] = [
  ["kind","","as in `Violation`"],
  ["what","","the violation with its size, as a sentence"],
  ["phase","","phase of the violation"],
  ["time","s","time of the worst instant"],
  ["value","m, or as the joint's","depth of the overlap, the distance, or the joint's value"],
];

// all checks of the result, with their bounds.
export interface Ledger {
  /** scale of the whole system */
  scale: LedgerScale;
  /** whether all rows of conservation pass. Where they do not, this run is no result, although everything computed is kept, and `grapnel run` ends with exit code 1 */
  pass: boolean;
  /** verdict of `Feasibility` */
  feasible: Verdict;
  /** each of the checks, under its name */
  [NAME: string]: LedgerEntry | LedgerScale | boolean | Verdict;
}
export const kLedger: FieldNote[] = [
  ["scale","","scale of the whole system"],
  ["pass","","whether all rows of conservation pass. Where they do not, this run is no result, although everything computed is kept, and `grapnel run` ends with exit code 1"],
  ["feasible","","verdict of `Feasibility`"],
];

// a conserved or balanced quantity, or a requirement on the robot.
export interface LedgerEntry {
  /** largest deviation; null: not a number [see `unit`] */
  value: number | null;
  /** bound on the deviation [see `unit`] */
  bound: number;
  /** `value` <= `bound`, or nothing to check; null: not evaluated */
  pass: boolean | null;
  /** `1`: relative to the scale named in `note` */
  unit: string;
  /** compared quantities and phases; for momentum and energy also the group of bodies with the largest deviation, and its scale */
  note: string;
  /** false: this run has nothing to check; `value` is then 0 */
  applies: boolean;
  /** meaning of a failure. */
  kind: LedgerKind;
  /** reason for which the check was not evaluated, or only in part */
  not_checked?: string;
  /** for a failed conservation row: how to correct it, or why no correction exists */
  advice?: string;
}
export const kLedgerEntry: FieldNote[] = [
  ["value","see `unit`","largest deviation; null: not a number"],
  ["bound","see `unit`","bound on the deviation"],
  ["pass","","`value` <= `bound`, or nothing to check; null: not evaluated"],
  ["unit","","`1`: relative to the scale named in `note`"],
  ["note","","compared quantities and phases; for momentum and energy also the group of bodies with the largest deviation, and its scale"],
  ["applies","","false: this run has nothing to check; `value` is then 0"],
  ["kind","","meaning of a failure."],
  ["not_checked","","reason for which the check was not evaluated, or only in part"],
  ["advice","","for a failed conservation row: how to correct it, or why no correction exists"],
];

export type LedgerKind = "conservation" | "feasibility";

// magnitudes of the whole system's momenta and energy. Rows are evaluated per group of bodies in contact, relative to the group's scale.
export interface LedgerScale {
  /** maximum over time of the sum of all |m v| [N s] */
  linear_momentum: number;
  /** maximum over time of the sum of all (|I w| + |r x m v|), r from the system's centre of mass [N m s] */
  angular_momentum: number;
  /** maximum kinetic energy [J] */
  energy: number;
}
export const kLedgerScale: FieldNote[] = [
  ["linear_momentum","N s","maximum over time of the sum of all |m v|"],
  ["angular_momentum","N m s","maximum over time of the sum of all (|I w| + |r x m v|), r from the system's centre of mass"],
  ["energy","J","maximum kinetic energy"],
];

// cost of an integration.
export interface PhaseCost {
  /** integrated phase */
  phase: string;
  /** evaluations of the equations of motion [1] */
  rhs_evaluations: number;
  /** accepted steps [1] */
  steps: number;
  /** steps that were repeated with a smaller step size [1] */
  rejected: number;
  /** accepted steps of the implicit method [1] */
  implicit_steps: number;
  /** begins and ends of the intervals that the implicit method integrated [s] */
  implicit_spans: [number, number][];
}
export const kPhaseCost: FieldNote[] = [
  ["phase","","integrated phase"],
  ["rhs_evaluations","1","evaluations of the equations of motion"],
  ["steps","1","accepted steps"],
  ["rejected","1","steps that were repeated with a smaller step size"],
  ["implicit_steps","1","accepted steps of the implicit method"],
  ["implicit_spans","s","begins and ends of the intervals that the implicit method integrated"],
];
