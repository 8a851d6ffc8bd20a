// Made by scripts/tables from the descriptions of results in grapnel/: change those.

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
  /** absent where control is continuous */
  control?: ControlReport;
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
  /** the largest loads of every phase; absent if nothing was loaded */
  loads?: PeakLoad[];
  /** reaction wheels; absent if there are none */
  wheels?: WheelReport[];
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

export type SummaryFormat = "grapnel-summary/2";

// what was simulated.
export interface ScenarioNamed {
  /** the scenario's name */
  name: string;
  /** of the bytes of the scenario, all files it includes, and overrides */
  sha256: string;
}

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

// the on-board computer that samples the control.
export interface ControlReport {
  /** between samples [s] */
  period: number;
  /** from a sample to the command that follows from it [s] */
  delay: number;
  /** the controller's library, as the scenario names it; empty without one */
  plugin: string;
  /** of its bytes; empty without one */
  plugin_sha256: string;
}

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
}

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

// the robot's joints at one instant.
export interface JointMotion {
  /** of the joints */
  names: string[];
  /** in the order of `names`; m of prismatic joints [rad or m] */
  position: number[];
  /** likewise [rad/s or m/s] */
  velocity: number[];
}

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
  /** per end-effector */
  miss?: PlannedMiss[];
  /** initial guesses tried [1] */
  starts?: number;
  /** how many of them led to a solution [1] */
  solutions?: number;
  /** Newton steps over all of them [1] */
  iterations?: number;
  /** of the goals' error against final joint values; small: near a singularity [m/rad] */
  smallest_singular_value?: number | null;
  /** the last piece, where the scenario asks for one */
  straight_in?: StraightInReport;
}

// how far an end-effector stays from its goal when the plan is followed exactly; where nothing was found, in the closest attempt.
export interface PlannedMiss {
  /** whose miss it is */
  end_effector: string;
  /** from its goal; null: unknown [m] */
  distance: number | null;
  /** from what the grasp's orientation asks for; null: unknown [rad] */
  angle: number | null;
}

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
}

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
  /** of the configuration; absent with law `compliant` */
  measures?: ImpactMeasures;
  /** with law `plastic`, else empty */
  sensitivities: ImpactSensitivity[];
  /** against the robot's ratings; empty where the robot file has none */
  margins: ImpactMargin[];
  /** per grasp whose arm has ratings */
  speed_limits: SpeedLimit[];
}

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

// impulses at all grasps together, scaled so that the largest component is 1 (N s or N m s).
export interface ImpulseSet {
  /** in the order of the impact's grasps; in words of `GraspImpulse` */
  grasps: ImpulseAtGrasp[];
}

// a part of an `ImpulseSet`.
export interface ImpulseAtGrasp {
  /** whose grasp it is */
  end_effector: string;
  /** as in `GraspImpulse` [N s] */
  impulse: [number, number, number];
  /** as in `GraspImpulse` [N m s] */
  angular_impulse: [number, number, number];
}

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

// all that a body received, from joints and grasps together: unique, also where the impulses of single grasps are not.
export interface BodyImpulse {
  /** that received it */
  body: string;
  /** in W [N s] */
  impulse: [number, number, number];
  /** about the body's centre of mass, in W [N m s] */
  angular_impulse: [number, number, number];
}

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

// what the arms passed to the base.
export interface BaseReaction {
  /** in W [N s] */
  impulse: [number, number, number];
  /** about the base's origin, in W [N m s] */
  angular_impulse: [number, number, number];
}

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

// a joint that a brake or a drive held during the impact, or was to hold. Law `compliant`: it gives way when the grasps become rigid; `impulse` and `work` are until then.
export interface HeldJoint {
  /** that was held, or was to be held */
  joint: string;
  /** on it, along or about its axis [N m s or N s] */
  impulse: number;
  /** done by it [J] */
  work: number;
  /** that it was to hold [rad/s or m/s] */
  told_rate: number;
  /** that it has after the impact [rad/s or m/s] */
  rate_after: number;
  /** the grasps did not allow all rates that drives were told, and this one had to give way, as little as possible (docs/theory.md, section 7). A warning says so too */
  gave_way: boolean;
}

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
  /** of the integration [1] */
  rhs_evaluations: number;
}

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

// grasps that are released together.
export interface ReleaseReport {
  /** when they were released [s] */
  time: number;
  /** that released their targets */
  end_effectors: string[];
  /** that each of them held */
  targets: string[];
}

// the motion after the impact.
export interface PostImpact {
  /** at the end of the motion */
  end?: PhaseEnd;
  /** absent where no loop was closed */
  loops?: LoopReport[];
  /** per phase and grasp; absent where nothing was held */
  grasp_loads?: GraspLoad[];
  /** absent without it */
  detumbling?: DetumblingReport;
  /** absent without it */
  base_keeping?: BaseKeepingReport;
}

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

// a held target that the arms bring to rest.
export interface DetumblingReport {
  /** that is brought to rest */
  target: string;
  /** when the law begins [s] */
  begin: number;
  /** when it ends; from then on the joints hold [s] */
  end: number;
  /** `at_rest`: a millionth of the angular momentum is left. `rank_lost`: the arms came near a configuration in which they cannot move the target in all directions. `joint_limit`: a joint reached the end of its range. `released`: the target was let go. `running`: the run ended before */
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
  /** least part of the torque bound that the joints' effort limits let pass; 1: they always sufficed [1] */
  least_scale: number;
  /** when that was [s] */
  least_scale_time: number;
  /** whether a smaller torque kept all efforts within their limits; if not, efforts were cut and the target did not move as asked for */
  within_limits: boolean;
  /** of the target's accelerations by the efforts: least singular value over the largest, its least [1] */
  least_condition: number;
  /** when that was [s] */
  least_condition_time: number;
}

export type LawEnd = "running" | "at_rest" | "rank_lost" | "joint_limit" | "released";

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
  /** of the robot file; null: none. Of a drive in motion the smaller of `rating.driving` and `limits.effort`, of base control its `limit` [as `peak`] */
  rating: number | null;
  /** 1 - peak over rating; negative: exceeded; 0: a drive ran at its limit; null: no rating [1] */
  margin: number | null;
  /** a mean over `impact.duration`, which is an assumption; the peak may be larger */
  assumed_duration: boolean;
}

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

// distances between bodies with shapes.
export interface Clearances {
  /** pairs of bodies that were not watched: the link that grasps and its target (they are to touch, so that an end-effector that goes *through* its own target is not noticed), and pairs ignored by the scenario. Neighbours along the tree are not watched either */
  unwatched: [string, string][];
  /** of all phases */
  minimum: MinimumClearance;
  /** per phase */
  phases: MinimumClearance[];
  /** bodies too near */
  events: ClearanceEvent[];
}

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

// limits of joints, drives and base control.
export interface Limits {
  /** in the order of time */
  events: LimitEvent[];
}

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
