#include "grapnel/capture/recorder.hpp"

#include <algorithm>
#include <limits>

#include "grapnel/approach/phase_setups.hpp"
#include "grapnel/capture/contact.hpp"
#include "grapnel/capture/internal_loads.hpp"
#include "grapnel/problem/flexible_bodies.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kBlockBytes = 64 << 20;  // size of a block of samples passed to a sink

bool is_shared(const CaptureProblem& problem, const std::string& target) {
  return std::count_if(problem.grasps.begin(), problem.grasps.end(),
                       [&](const GraspSetup& g) { return g.target == target; }) > 1;
}

// Links, and pieces of them.
std::vector<int> seen_bodies(const CaptureSystem& system) {
  std::vector<int> bodies = carried_bodies(system);
  for (int i = 0; i < static_cast<int>(system.model.bodies().size()); ++i) {  // panels of targets
    if (belongs_to_targets(system, i) && !system.addresses[static_cast<std::size_t>(i)].is_target_itself())
      bodies.push_back(i);
  }
  std::erase_if(bodies, [&](int i) { return is_unseen(system.model.bodies()[i].description); });
  return bodies;
}

// Wheels and gimbals are located at the centre of mass of the base, whose mass properties include them at gimbal angles
// of zero. They add angular momentum to that of the base as one rigid body, but no linear momentum.
Vector3d internal_angular_momentum(const CaptureSystem& system, const Kinematics& k) {
  const Model& model = system.model;
  const Posed& X_WB = k.X_WB[system.base];
  Vector3d momentum = Vector3d::zero();
  const auto add = [&](int joint, const Rotationd& R_B0) {
    const int body = model.joints()[joint];
    const Symmetric3d& I = model.bodies()[body].description.inertia;
    momentum += rotate(k.X_WB[body].R, I) * k.V_WB[body].angular;
    momentum -= rotate(X_WB.R * R_B0, I) * k.V_WB[system.base].angular;
  };
  const auto mount = [&](int joint) { return model.bodies()[model.joints()[joint]].description.X_PF.R; };
  for (int wheel : system.wheels) add(wheel, mount(wheel));
  for (const CaptureSystem::Gyro& gyro : system.gyros) {
    add(gyro.gimbal, mount(gyro.gimbal));
    add(gyro.rotor, mount(gyro.gimbal) * mount(gyro.rotor));
  }
  return momentum;
}

const std::vector<std::string> kXyz{"x", "y", "z"};
const std::vector<std::string> kWxyz{"w", "x", "y", "z"};

}  // namespace

// Problem, system => all time series with path, unit, description and components, without values, in the order of
// sample(); also the number of rows that fit one block of a sink.
Recorder::Recorder(const CaptureProblem& problem, const CaptureSystem& system, const MovingFrame& frame,
                   const Observers& observers, TimeSeries& series)
    : problem_(problem), series_(series), observers_(observers), frame_(frame) {
  add_motion(system);
  add_grasps();
  add_joints(system);
  add_observers();
  add_conserved(system);
  if (problem.orbit) add_orbit();
  watches_clearance_ = !make_clearance_model(problem, system).pairs().empty();
  if (watches_clearance_) {
    add("clearance/minimum", "m", "minimum distance of all checked bodies, by their shapes; negative: depth of overlap",
        {"minimum"});
  }
  for (const SensedSeries& s : sensed_series(problem, system)) add(s.path, s.unit, s.description, s.components);
  std::size_t row = sizeof(double) + sizeof(int);
  for (const Series& s : series_.series) row += sizeof(double) * s.components.size();
  block_capacity_ = std::max<std::size_t>(kBlockBytes / row, 1);
}

void Recorder::add_motion(const CaptureSystem& system) {
  const auto add_body = [&](const std::string& group, const std::string& what) {
    add(group + "/position", "m", "position of " + what + " in W", kXyz);
    add(group + "/quaternion_wxyz", "1", "orientation of " + what + " in W", kWxyz);
    add(group + "/angular_velocity", "rad/s", "angular velocity of " + what + " in W", kXyz);
    add(group + "/velocity", "m/s", "velocity of the origin of " + what + " in W", kXyz);
    previous_.push_back(Quaterniond::identity());
  };
  add_body("base", "the base frame");
  for (int i : seen_bodies(system)) {
    const std::string name = shown_name(system, i);
    add("links/" + name + "/position", "m", "position of the link's frame, at its joint, in W", kXyz);
    add("links/" + name + "/quaternion_wxyz", "1", "orientation of the link's frame in W", kWxyz);
    if (problem_.output_links) {
      add("links/" + name + "/angular_velocity", "rad/s", "angular velocity of the link in W", kXyz);
      add("links/" + name + "/velocity", "m/s", "velocity of the origin of the link's frame in W", kXyz);
    }
    previous_.push_back(Quaterniond::identity());
  }
  if (problem_.output_links && (!system.wheels.empty() || !system.gyros.empty()))
    add("base/internal_angular_momentum", "N m s",
        "angular momentum of wheels and gyros beyond that of the base as one rigid body, in W", kXyz);
  for (int f : system.end_effectors) add_body("end_effectors/" + system.model.frames()[f].name, "the end-effector");
  for (const TargetSetup& t : problem_.targets) add_body("targets/" + t.name, "the target frame");
}

void Recorder::add_grasps() {
  for (const GraspSetup& g : problem_.grasps) {
    add("grasps/" + g.end_effector + "/distance", "m", "distance of the end-effector from its grasp point",
        {"distance"});
    add("grasps/" + g.end_effector + "/holds", "1", "1 while the grasp holds or slips, else 0", {"holds"});
    add("grasps/" + g.end_effector + "/force", "N",
        "force of the grasp on the robot, in W; where closed loops leave it undetermined, with minimum self-stress",
        kXyz);
    add("grasps/" + g.end_effector + "/moment", "N m", "moment of the grasp on the robot, about the grasp, likewise",
        kXyz);
  }
  for (const GraspSetup& g : problem_.grasps) {
    if (!is_shared(problem_, g.target)) continue;
    add("loops/" + g.end_effector + "/position_defect", "m",
        "distance of the grasp's frames on end-effector and target while it closes a loop, else 0",
        {"position_defect"});
    add("loops/" + g.end_effector + "/angle_defect", "rad", "angle between them, likewise", {"angle_defect"});
  }
}

void Recorder::add_joints(const CaptureSystem& system) {
  std::vector<std::string> joints;
  bool prismatic = false;
  for (int j : system.robot_joints) {
    const JointDescription& joint = system.model.bodies()[system.model.joints()[j]].description.joint;
    joints.push_back(joint.name);
    prismatic = prismatic || slides_along_axis(joint.type);
  }
  const std::string mixed = prismatic ? "; m where the joint is prismatic" : "";
  add("joints/position", "rad", "joint positions" + mixed, joints);
  add("joints/velocity", "rad/s", std::string("joint rates") + (prismatic ? "; m/s where the joint is prismatic" : ""),
      joints);
  add("joints/reference_position", "rad",
      "position that each joint follows or holds; NaN for free joints, at impacts, and under laws without a reference" +
          mixed,
      joints);
  add("joints/reference_velocity", "rad/s", "rate of this reference; NaN likewise", joints);
  add("joints/effort", "N m", "motor efforts" + (prismatic ? std::string("; N where the joint is prismatic") : ""),
      joints);
  add("joints/friction", "N m", "friction efforts" + (prismatic ? std::string("; N where the joint is prismatic") : ""),
      joints);
  add("joints/reaction_force", "N",
      "magnitude of the force that each joint transmits, at its origin; NaN at instantaneous impacts", joints);
  add("joints/reaction_moment", "N m", "magnitude of the moment that each joint transmits, at its origin; likewise",
      joints);
  std::vector<std::string> elastic;
  for (int j : system.elastic_joints)
    elastic.push_back(system.model.bodies()[system.model.joints()[j]].description.joint.name);
  if (!elastic.empty()) {
    add("elastic/deflection", "rad", "of the springs of flexible links and gears; m where they are prismatic", elastic);
    add("elastic/velocity", "rad/s", "its rate", elastic);
  }
}

void Recorder::add_observers() {
  controls_base_ = (problem_.approach && problem_.approach->base_control) ||
                   problem_.post_impact.any([](const PostImpactSetup& p) { return p.base_control.has_value(); }) ||
                   (problem_.control && (problem_.control->base_torque || problem_.control->base_actuators ||
                                         (problem_.control->log && problem_.control->log->commands_actuators())));
  if (controls_base_) add("base/control_torque", "N m", "torque that controls the attitude, in the base's axes", kXyz);
  for (const auto& observer : observers_) {
    for (Series& one : observer->series()) series_.series.push_back(std::move(one));
  }
}

void Recorder::add_conserved(const CaptureSystem& system) {
  add("system/center_of_mass", "m", "centre of mass of servicer and targets in W", kXyz);
  add("system/linear_momentum", "N s", "total linear momentum in W", kXyz);
  add("system/angular_momentum", "N m s", "total angular momentum about the system's centre of mass, in W", kXyz);
  const auto add_momentum = [&](const std::string& group, const std::string& what) {
    add(group + "/linear_momentum", "N s", "linear momentum of " + what + " in W", kXyz);
    add(group + "/angular_momentum", "N m s",
        "angular momentum of " + what + " about the system's centre of mass, in W", kXyz);
  };
  add_momentum("robot", "the robot without targets");
  for (const TargetSetup& t : problem_.targets) add_momentum("targets/" + t.name, "the target");
  add("system/kinetic_energy", "J", "total kinetic energy, rotors included", {"kinetic_energy"});
  if (!system.elastic_joints.empty())
    add("system/elastic_energy", "J", "elastic energy of all springs", {"elastic_energy"});
  add("system/motor_work", "J", "work of the motors since the start", {"motor_work"});
  add("system/friction_work", "J", "work of joint friction since the start (negative)", {"friction_work"});
  add("system/external_work", "J",
      std::string("work of ") + (problem_.orbit ? "the orbit's field" : "gravity") +
          ", loads, attitude control and a holding wrench since the start",
      {"external_work"});
  add("system/external_impulse", "N s",
      "impulse since the start of these and of the ground, in W; without what enters at the impact", kXyz);
  add("system/external_angular_impulse", "N m s", "the same about the world's origin", kXyz);
}

void Recorder::add_orbit() {
  const std::vector<std::string> turning{"radial", "along_track", "cross_track"};
  add("orbit/radius", "m", "distance of the reference point from the central body's centre", {"radius"});
  add("orbit/radial", "1", "direction from the central body's centre to the reference point, in W", kXyz);
  add("orbit/along_track", "1",
      "direction perpendicular to it in the orbit's plane, in the direction of orbital motion, in W", kXyz);
  const auto add_orbital = [&](const std::string& group, const std::string& what) {
    add(group + "/orbital_position", "m",
        "position of " + what + " from the reference point, in the axes that turn with the orbit", turning);
    add(group + "/orbital_velocity", "m/s", "its rate of change in these axes", turning);
  };
  add_orbital("base", "the base frame");
  for (const TargetSetup& t : problem_.targets) add_orbital("targets/" + t.name, "the target frame");
}

// Problem => number of columns and estimated number of samples of its time series, from the durations and the output
// interval.
ExpectedSeries expected_series(const CaptureProblem& problem) {
  TimeSeries names;
  const CaptureSystem free = make_capture_system(problem);
  const MotionObservers observers(problem, free, {});
  const Recorder recorder(problem, free, {}, observers.all, names);
  ExpectedSeries expected;
  expected.columns = 1;  // the time
  for (const Series& s : names.series) expected.columns += s.width();
  const auto add = [&](double duration) {
    expected.samples += 2 + (problem.output_interval > 0 ? duration / problem.output_interval : 0);
  };
  if (problem.approach) add(problem.approach->duration);
  for (const PostImpactSetup& phase : problem.post_impact) add(phase.duration);
  return expected;
}

void Recorder::add(std::string path, std::string unit, std::string description, std::vector<std::string> components) {
  series_.series.push_back({std::move(path), std::move(unit), std::move(description), std::move(components), {}});
}

void Recorder::begin_phase(const std::string& name) {
  series_.phases.push_back(name);
  phase_start_.reset();
}

// q and -q are one orientation: the one closer to the previous sample is written, for plots and interpolation.
void Recorder::put(const Rotationd& R, Quaterniond& previous) {
  Quaterniond q = quaternion_from(R);
  if (q.w * previous.w + q.x * previous.x + q.y * previous.y + q.z * previous.z < 0) q = {-q.w, -q.x, -q.y, -q.z};
  previous = q;
  row_.put_all(std::initializer_list<double>{q.w, q.x, q.y, q.z});
}

// Momenta of the robot, then of each target, also if it hangs on an arm.
void Recorder::put_momenta(const CaptureSystem& system, const Kinematics& k, const Vector3d& com) {
  const Model& model = system.model;
  std::vector<int> robot = carried_bodies(system);
  robot.push_back(system.base);
  for (int j : system.wheels) robot.push_back(model.joints()[j]);
  for (const CaptureSystem::Gyro& gyro : system.gyros)
    for (int j : {gyro.gimbal, gyro.rotor}) robot.push_back(model.joints()[j]);
  const auto put_group = [&](const std::vector<int>& bodies) {
    const Momentumd h = group_momentum(model, k, bodies, com);
    put(h.linear);
    put(h.angular);
  };
  put_group(robot);
  for (std::size_t t = 0; t < problem_.targets.size(); ++t) put_group(bodies_of_target(system, t));
}

// The references of the phase's drives; a law that moves joints together has no joint references.
void Recorder::put_references(const CaptureSystem& system, const PhaseSample& s) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> positions, rates;
  for (int j : system.robot_joints) {
    JointPoint reference{kNone, kNone, 0};
    const JointDrive drive = s.dynamics ? s.dynamics->setup().drives[j] : JointDrive{};
    if (drive.control != JointControl::free && !drive.trajectory.segments.empty())
      reference = evaluate(drive.trajectory, s.time);
    positions.push_back(reference.position);
    rates.push_back(reference.rate);
  }
  row_.put_all(positions);
  row_.put_all(rates);
}

// Gaps and samples of all grasps => distance, whether the grasp holds, force and moment on the robot; then the defects
// of shared targets. Without samples the latter are zero.
void Recorder::put_grasps(const std::vector<GraspGap>& gaps, std::span<const GraspSample> grasps) {
  const GraspSample none;
  const auto of = [&](std::size_t i) -> const GraspSample& { return grasps.empty() ? none : grasps[i]; };
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    put(gaps[i].distance);
    put(of(i).holds ? 1.0 : 0.0);
    put(of(i).F_WC.linear);
    put(of(i).F_WC.angular);
  }
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    if (!is_shared(problem_, problem_.grasps[i].target)) continue;
    const ClosureDefect defect = of(i).defect.value_or(ClosureDefect{});
    put(defect.position);
    put(defect.angle);
  }
}

// Poses and twists in W => values of base, links, end-effectors and targets; twists of links only with output of links.
void Recorder::put_motion(const CaptureSystem& system, const Kinematics& k) {
  const Model& model = system.model;
  std::size_t body = 0;
  const auto put_body = [&](const Posed& X, const Twistd& V) {
    put(X.p);
    put(X.R, previous_[body++]);
    put(V.angular);
    put(V.linear);
  };
  put_body(k.X_WB[system.base], k.V_WB[system.base]);
  for (int i : seen_bodies(system)) {
    put(k.X_WB[i].p);
    put(k.X_WB[i].R, previous_[body++]);
    if (!problem_.output_links) continue;
    put(k.V_WB[i].angular);
    put(k.V_WB[i].linear);
  }
  if (problem_.output_links && (!system.wheels.empty() || !system.gyros.empty()))
    put(internal_angular_momentum(system, k));
  for (int f : system.end_effectors) put_body(frame_pose(model, k, f), frame_twist(model, k, f));
  for (int f : system.target_frames) put_body(frame_pose(model, k, f), frame_twist(model, k, f));
}

// The integral of t dH since the phase's start, with H the external impulse: t H(t) less the integral of H, which is
// the mass times the deviation of the centre of mass from its uniform motion. `quantities`: in the frame of the
// computation.
Vector3d Recorder::late_impulse(const ConservedQuantities& quantities, const PhaseSample& s) const {
  double mass = 0;
  for (const GroupQuantities& tree : quantities.trees) mass += tree.size.mass;
  const Vector3d beyond =
      mass * (quantities.com - phase_start_->com) - (s.time - phase_start_->time) * phase_start_->momentum;
  return s.time * s.integrals.external_impulse.linear - beyond;
}

// `k`: in the frame of the computation, as the problem's orbit is.
void Recorder::put_orbit(const CaptureSystem& system, const Kinematics& k, double time) {
  const ReferenceOrbit orbit = reference_orbit(*problem_.orbit);
  const OrbitPoint at = orbit_point(orbit, time);
  put(at.radius);
  put(at.R_WO.column(0));
  put(at.R_WO.column(1));
  const auto put_body = [&](const Posed& X, const Twistd& V) {
    const OrbitalMotion motion = orbital_motion(orbit, at, X.p, V.linear);
    put(motion.position);
    put(motion.velocity);
  };
  put_body(k.X_WB[system.base], k.V_WB[system.base]);
  for (int f : system.target_frames) put_body(frame_pose(system.model, k, f), frame_twist(system.model, k, f));
}

// `quantities`: in the frame of the computation.
void Recorder::put_conserved(const CaptureSystem& system, const Kinematics& k, const ConservedQuantities& quantities,
                             const PhaseSample& s) {
  const ConservedQuantities in_world = frame_.is_world() ? quantities : conserved_quantities(system.model, k, s.state);
  put(in_world.com);
  put(in_world.about_com.linear);
  put(in_world.about_com.angular);
  put_momenta(system, k, in_world.com);
  put(in_world.kinetic_energy);
  if (!system.elastic_joints.empty()) put(in_world.elastic_energy);
  put(finished_.motor_work + s.integrals.motor_work);
  put(finished_.friction_work + s.integrals.friction_work);
  const Momentumd impulse = finished_.external_impulse + s.integrals.external_impulse;
  if (!phase_start_) phase_start_ = {s.time, quantities.com, quantities.about_com.linear};
  if (dot(impulse.linear, impulse.linear) > 0) late_ = late_impulse(quantities, s);
  put(finished_.external_work + s.integrals.external_work + dot(frame_.velocity, impulse.linear));
  put(impulse.linear);
  put(impulse.angular + cross(frame_.origin, impulse.linear) + cross(frame_.velocity, finished_late_ + late_));
}

// System at one instant, in the frame of the computation => one row of all series, in W, in the constructor's order;
// passes the rows to the sink when a block is full.
void Recorder::sample(const RecordedInstant& instant) {
  const CaptureSystem& system = instant.system;
  const Kinematics& k = instant.kinematics;
  const PhaseSample& s = instant.sample;
  const Model& model = system.model;
  series_.time.push_back(s.time);
  series_.phase.push_back(static_cast<int>(series_.phases.size()) - 1);
  row_ = SeriesRow(series_);
  Kinematics shifted;
  if (!frame_.is_world()) {
    shifted = k;
    to_world(frame_, s.time, shifted);
  }
  const Kinematics& in_world = frame_.is_world() ? k : shifted;
  put_motion(system, in_world);
  put_grasps(grasp_gaps(problem_, system, k), instant.grasps);
  const auto put_joints = [&](auto value) {
    row_.put_each(system.robot_joints.size(), [&](std::size_t i) { return value(system.robot_joints[i]); });
  };
  put_joints([&](int j) { return s.state.q[model.bodies()[model.joints()[j]].q]; });
  put_joints([&](int j) { return s.state.v[model.bodies()[model.joints()[j]].v]; });
  put_references(system, s);
  put_joints([&](int j) { return s.motor[j]; });
  put_joints([&](int j) { return s.friction[j]; });
  const auto reaction = [&](int j, Vector3d Wrenchd::*part) {
    return instant.through.empty() ? std::numeric_limits<double>::quiet_NaN()
                                   : norm(instant.through[model.joints()[j]].*part);
  };
  put_joints([&](int j) { return reaction(j, &Wrenchd::linear); });
  put_joints([&](int j) { return reaction(j, &Wrenchd::angular); });
  if (!system.elastic_joints.empty()) {
    const auto put_elastic = [&](auto value) {
      row_.put_each(system.elastic_joints.size(),
                    [&](std::size_t i) { return value(model.bodies()[model.joints()[system.elastic_joints[i]]]); });
    };
    put_elastic([&](const Body& b) { return s.state.q[b.q] - b.description.joint.spring->rest; });
    put_elastic([&](const Body& b) { return s.state.v[b.v]; });
  }
  if (controls_base_) put(s.dynamics ? s.dynamics->control_torque() : Vector3d::zero());
  for (const auto& observer : observers_) observer->put(system, s, row_);
  put_conserved(system, in_world, instant.quantities, s);
  if (problem_.orbit) put_orbit(system, k, s.time);
  if (watches_clearance_) put(instant.clearance);
  if (sensors_ && problem_.sensors) {
    for (const std::vector<double>& values : sensors_->sensed_values()) row_.put_all(values);
  }
  if (!sink_) return;
  sink_->sampled(series_);
  if (series_.time.size() >= block_capacity_) sink_->take(series_);
}

void Recorder::end_phase(const PhaseIntegrals& integrals) {
  finished_.motor_work += integrals.motor_work;
  finished_.friction_work += integrals.friction_work;
  finished_.external_work += integrals.external_work;
  finished_.external_impulse += integrals.external_impulse;
  finished_late_ += late_;
  late_ = Vector3d::zero();
}

}  // namespace grapnel
