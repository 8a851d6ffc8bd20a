#include "grapnel/capture/impact_figures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/impact/impulse_measures.hpp"
#include "grapnel/impact/impulse_sensitivity.hpp"

namespace grapnel {

// --- Measures and sensitivities ---

namespace {

Vector3d vector3(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

std::vector<double> row_by_row(const Matrix6d& A) {
  std::vector<double> values;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) values.push_back(A(i, j));
  }
  return values;
}

void put(const ImpulseEllipsoid& ellipsoid, std::vector<Vector3d>& axes, std::vector<double>& semi_axes) {
  for (int i = 0; i < 3; ++i) {
    axes.push_back(vector3(ellipsoid.axes.col(i)));
    semi_axes.push_back(ellipsoid.semi_axes[i]);
  }
}

// The grasps for the measures: contacts have no moment.
std::vector<Grasp> measured_grasps(const ImpactTask& task) {
  std::vector<Grasp> grasps = task.contact.grasps;
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    if (task.problem.grasps[i].contact) grasps[i].model = GraspModel::point;
  }
  return grasps;
}

std::vector<Impulsed> impulses_of(const ImpactReport& report) {
  std::vector<Impulsed> impulses;
  for (const GraspImpulse& g : report.grasps) impulses.push_back({g.angular_impulse, g.impulse});
  return impulses;
}

}  // namespace

std::vector<SelfStress> describe_impulses(std::span<const Grasp> grasps, const Eigen::MatrixXd& columns) {
  std::vector<SelfStress> basis;
  for (Eigen::Index column = 0; column < columns.cols(); ++column) {
    SelfStress stress;
    double largest = 0;
    for (Eigen::Index row = 0; const Grasp& g : grasps) {
      const Eigen::VectorXd P =
          constrained_directions(g).transpose() * columns.col(column).segment(row, row_count(g.model));
      stress.angular_impulse.push_back({P[0], P[1], P[2]});
      stress.impulse.push_back({P[3], P[4], P[5]});
      largest = std::max(largest, P.lpNorm<Eigen::Infinity>());
      row += row_count(g.model);
    }
    if (largest == 0) continue;  // of held rates only
    for (Vector3d& P : stress.impulse) P = (1 / largest) * P;
    for (Vector3d& P : stress.angular_impulse) P = (1 / largest) * P;
    basis.push_back(std::move(stress));
  }
  return basis;
}

void add_measures(const ImpactTask& task, ImpactReport& report) {
  const std::vector<Grasp> grasps = measured_grasps(task);
  const ImpulseMeasures found =
      impulse_measures(task.system.model, task.contact.state, task.system.base, grasps, impulses_of(report), task.held);
  ImpactMeasures m;
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    const EndEffectorMeasures& from = found.end_effectors[i];
    EndEffectorMeasure e;
    e.end_effector = task.problem.grasps[i].end_effector;
    e.inverse_inertia = row_by_row(from.inverse_inertia);
    e.pair_inverse_inertia = row_by_row(from.pair_inverse_inertia);
    put(from.linear, e.linear_axes, e.linear_mass);
    put(from.angular, e.angular_axes, e.angular_inertia);
    e.impulse_index = from.impulse_index;
    e.robot_effective_mass = from.robot_effective_mass;
    e.pair_effective_mass = from.pair_effective_mass;
    e.miss_of_robot_com = found.robot_line[i].miss;
    e.miss_of_system_com = found.system_line[i].miss;
    m.end_effectors.push_back(std::move(e));
  }
  m.largest_impulse = found.largest_impulse, m.smallest_impulse = found.smallest_impulse;
  m.coupled_index = found.coupled_index;
  m.miss_of_robot_com = found.robot_line.back().miss;
  m.miss_of_system_com = found.system_line.back().miss;
  for (Eigen::Index row = 0; const Grasp& g : grasps) {
    const int rows = row_count(g.model);
    m.base_response.push_back(row_by_row(found.base_response.middleCols(row, rows) * constrained_directions(g)));
    row += rows;
  }
  m.zero_disturbance = describe_impulses(grasps, found.zero_disturbance);
  m.zero_base_angular_velocity = describe_impulses(grasps, found.zero_base_angular_velocity);
  report.measures = std::move(m);
}

void add_sensitivities(const ImpactTask& task, ImpactReport& report) {
  const std::vector<ImpulseSensitivity> found =
      impulse_sensitivities(task.system.model, task.contact.state, task.system.base, task.contact.grasps, task.held);
  for (const ImpulseSensitivity& from : found) {
    ImpactSensitivity s;
    s.parameter = from.parameter, s.unit = from.unit, s.undefined = from.undefined;
    s.end_effector = task.problem.grasps[from.grasp].end_effector;
    s.target = task.problem.grasps[from.grasp].target;
    for (std::size_t i = 0; i < from.impulse.size(); ++i) {
      const Vector3d& P = report.grasps[i].impulse;
      s.impulse.push_back(from.impulse[i].linear);
      s.angular_impulse.push_back(from.impulse[i].angular);
      // The magnitude of a zero impulse is not differentiable.
      const double size = norm(P), change = norm(from.impulse[i].linear);
      s.impulse_magnitude.push_back(size > 0 ? dot(P, from.impulse[i].linear) / size : change);
    }
    s.base_velocity_change = from.base.linear;
    s.base_angular_velocity_change = from.base.angular;
    report.sensitivities.push_back(std::move(s));
  }
}

// --- Margins ---

namespace {}  // namespace

double limit_of(const LoadRating& rating, std::string_view quantity) {
  constexpr const char* kQuantities[] = {"force", "moment", "impulse", "angular_impulse", "driving"};
  constexpr double LoadRating::*kLimits[] = {&LoadRating::force,   &LoadRating::moment,
                                             &LoadRating::impulse, &LoadRating::angular_impulse,
                                             &LoadRating::driving, &LoadRating::driving_impulse};
  return rating.*kLimits[std::ranges::find(kQuantities, quantity) - std::begin(kQuantities)];
}

namespace {

// Names of the joints between an end-effector and the base.
std::vector<std::string> arm_joints(const RobotSetup& robot, const std::string& end_effector) {
  std::vector<std::string> joints;
  std::string body;
  for (const EndEffectorSetup& e : robot.end_effectors) {
    if (e.name == end_effector) body = e.body;
  }
  for (std::size_t guard = 0; guard < robot.bodies.size() && body != robot.base; ++guard) {
    for (const BodyDescription& b : robot.bodies) {
      if (b.name != body) continue;
      joints.push_back(b.joint.name);
      body = b.parent;
      break;
    }
  }
  return joints;
}

}  // namespace

// Forces and moments are peaks of a compliant impact, otherwise impulses over the stated duration (docs/theory,
// section 7, Mean force).
std::vector<PeakLoad> impact_loads(const ImpactReport& report, std::span<const JointPeakTimes> peaks) {
  std::vector<PeakLoad> loads;
  const auto add = [&](const std::string& of, const char* quantity, double value, double after = 0) {
    loads.push_back({of, quantity, {}, value, report.time + after});
  };
  const auto mean = [&](const std::string& of, const char* quantity, double impulse) {
    add(of, quantity, impulse / report.duration);
    loads.back().assumed_duration = true;
  };
  for (std::size_t i = 0; i < report.joints.size(); ++i) {
    const JointImpulse& j = report.joints[i];
    const double impulse = norm(j.impulse), angular = norm(j.angular_impulse), driving = std::abs(j.along_axis);
    add(j.joint, "impulse", impulse), add(j.joint, "angular_impulse", angular),
        add(j.joint, "driving_impulse", driving);
    if (report.compliant) {
      const JointPeakTimes times = i < peaks.size() ? peaks[i] : JointPeakTimes{};
      add(j.joint, "force", j.peak_force, times.force);
      add(j.joint, "moment", j.peak_moment, times.moment);
      add(j.joint, "driving", j.peak_driving, times.driving);
    } else {
      mean(j.joint, "force", impulse), mean(j.joint, "moment", angular), mean(j.joint, "driving", driving);
    }
  }
  for (const GraspImpulse& g : report.grasps) {
    const double impulse = norm(g.impulse), angular = norm(g.angular_impulse);
    add(g.end_effector, "impulse", impulse), add(g.end_effector, "angular_impulse", angular);
    if (g.profile) {
      add(g.end_effector, "force", g.profile->peak_force, g.profile->peak_force_time);
      add(g.end_effector, "moment", g.profile->peak_moment, g.profile->peak_moment_time);
    } else {
      mean(g.end_effector, "force", impulse), mean(g.end_effector, "moment", angular);
    }
  }
  return loads;
}

void add_margins(const CaptureProblem& problem, ImpactReport& report) {
  const std::vector<PeakLoad> loads = impact_loads(report);
  const auto of_joints = std::span(loads).first(6 * report.joints.size());
  const auto of_grasps = std::span(loads).subspan(of_joints.size());
  const auto compare = [&](const std::string& of, const LoadRating& rating, std::span<const PeakLoad> any) {
    for (const char* quantity : {"force", "moment", "impulse", "angular_impulse", "driving", "driving_impulse"}) {
      const double limit = limit_of(rating, quantity);
      for (const PeakLoad& load : any) {
        if (load.of == of && load.quantity == quantity && std::isfinite(limit))
          report.margins.push_back({of, quantity, load.peak, limit});
      }
    }
  };
  for (const auto& [joint, rating] : problem.robot.ratings) compare(joint, rating, of_joints);
  for (const GraspImpulse& g : report.grasps) {
    for (const EndEffectorSetup& e : problem.robot.end_effectors) {
      if (e.name == g.end_effector) compare(e.name, e.rating, of_grasps);
    }
  }
  // Brakes that stop the arms' own motion load them even if they meet the target slowly.
  if (report.joints_during == "braked") return;
  for (const GraspImpulse& g : report.grasps) {
    const std::vector<std::string> joints = arm_joints(problem.robot, g.end_effector);
    SpeedLimit limit{g.end_effector, std::numeric_limits<double>::infinity(), 0, {}, {}};
    bool rated = false;
    for (const LoadMargin& m : report.margins) {
      if (m.of != g.end_effector && std::find(joints.begin(), joints.end(), m.of) == joints.end()) continue;
      rated = true;
      const double factor = m.rating / m.load;
      if (factor < limit.factor) limit.factor = factor, limit.of = m.of, limit.quantity = m.quantity;
    }
    if (!rated) continue;
    const double speed = norm(g.relative_velocity_before);
    limit.largest_speed = speed > 0 ? limit.factor * speed : 0;
    report.speed_limits.push_back(std::move(limit));
  }
}

}  // namespace grapnel
