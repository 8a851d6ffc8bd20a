#include "grapnel/capture/sampled_gains.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/control/effort_response.hpp"
#include "grapnel/control/sampled_loop.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/model/coupling.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

// The place of the gains in the input, their name and the quantity they act on.
struct Gains {
  std::string path;  // of kp and kd
  std::vector<double> kp, kd;
  bool of_accelerations = false;  // computed torque: the law already divides by the inertia
};

SampledLoop loop_of(const Gains& gains, const Eigen::MatrixXd& response, const ControlTiming& timing) {
  const auto n = static_cast<Eigen::Index>(gains.kp.size());
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n);
  return {gains.of_accelerations ? one : response, as_vector(gains.kp), as_vector(gains.kd), timing};
}

// A description of the loop if it is unstable.
std::string describe(const SampledLoop& loop, const Gains& gains, const std::vector<std::string>& names) {
  constexpr double kUnstable = 1 + 1e-6;
  const double growth = growth_per_tick(loop);
  if (!(growth > kUnstable)) return {};
  const double T = loop.timing.period, lag = T + 2 * loop.timing.delay;
  // kd T/I of the worst one; if kp T/2 exceeds kd, no smaller gains are stable.
  Eigen::Index worst = 0, stiff = -1;
  const auto damping = [&](Eigen::Index j) { return loop.kd[j] * loop.response(j, j) * lag; };
  for (Eigen::Index j = 0; j < loop.kd.size(); ++j) {
    if (damping(j) > damping(worst)) worst = j;
    if (0.5 * loop.kp[j] * lag > loop.kd[j]) stiff = j;
  }
  const double share = largest_stable_share(loop);
  const Eigen::Index named = share > 0 || stiff < 0 ? worst : stiff;
  const auto at = static_cast<std::size_t>(named);
  const std::string inertia =
      gains.of_accelerations ? "" : fmt::format(", inertia {:.4g}", 1 / loop.response(named, named));
  const std::string period = fmt::format(
      "control.period {:.4g} s{}", T, loop.timing.delay > 0 ? fmt::format(", delay {:.4g} s", loop.timing.delay) : "");
  const std::string remedy =
      share > 0
          ? fmt::format("use gains at most {:.3g} times as large (kd {:.4g}, kp {:.4g} there), or a shorter period",
                        share, share * loop.kd[named], share * loop.kp[named])
          : fmt::format(
                "kp (period + 2 delay)/2 = {:.4g} exceeds kd = {:.4g} there: use a larger kd, a smaller kp, or "
                "a shorter period",
                0.5 * loop.kp[named] * lag, loop.kd[named]);
  return fmt::format(
      "{}: the sampled loop is unstable, errors grow {:.3g} times per sample: kd T/I = {:.3g} at {} (kd {:.4g}, "
      "{}{}), "
      "but a single loop is stable only below 2; {}",
      gains.path, growth, loop.kd[named] * loop.response(named, named) * T, names[at], gains.kd[at], period, inertia,
      remedy);
}

// Accelerations of the driven joints by their efforts.
Eigen::MatrixXd joint_response(const CaptureSystem& system, const State& state) {
  EffortResponse response(system.model, system.robot_joints, system.closures);
  response.update(state, {}, Vector3d::zero());
  const auto n = static_cast<Eigen::Index>(system.robot_joints.size());
  Eigen::MatrixXd own(n, n);
  for (Eigen::Index j = 0; j < n; ++j)
    own.row(j) = response.response().row(response.velocity(static_cast<std::size_t>(j)));
  return 0.5 * (own + own.transpose());
}

// Angular accelerations of a free base per torque about its axes. `locked`: with joints at fixed positions, as an
// approximation of stiff joint control.
Eigen::MatrixXd base_response(const CaptureSystem& system, const State& state, bool locked) {
  const Eigen::MatrixXd M = mass_matrix(system.model, state);
  std::vector<bool> left_out(static_cast<std::size_t>(M.rows()), false);
  for (int j : system.robot_joints) {
    if (locked) left_out[system.model.joint_body(j).v] = true;
  }
  std::vector<int> retained;
  Eigen::Index base = 0;  // index of its rotation among them
  for (int v = 0; v < static_cast<int>(M.rows()); ++v) {
    if (v == system.model.bodies()[system.base].v) base = static_cast<Eigen::Index>(retained.size());
    if (!left_out[v]) retained.push_back(v);
  }
  Eigen::MatrixXd torques = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(retained.size()), 3);
  torques.middleRows(base, 3) = Eigen::Matrix3d::Identity();
  const Eigen::MatrixXd reduced = M(retained, retained);
  return Eigen::MatrixXd(Cholesky(reduced).solve(torques)).middleRows(base, 3);
}

}  // namespace

// Run, whether for the approach => a message per unstable sampled loop of joints and base attitude, at the current
// configuration, with a remedy (docs/theory, section 15, Sampled gains); empty for continuous control.
std::vector<std::string> unstable_gains(const CaptureRun& run, bool approach) {
  const CaptureProblem& problem = run.problem;
  std::vector<std::string> found;
  if (!problem.control) return found;
  const ControlTiming& timing = problem.control->timing;
  const CaptureSystem& system = run.bodies.system;
  Gains gains;
  if (approach) {
    const TrackingSetup& tracking = problem.approach->tracking;
    const bool is_pd = tracking.mode == JointControl::pd || tracking.mode == JointControl::computed_torque;
    if (is_pd) gains = {"approach.tracking", tracking.kp, tracking.kd, tracking.mode == JointControl::computed_torque};
  } else if (has_gains(problem.post_impact->joints)) {
    const PostImpactSetup& post = *problem.post_impact;
    gains = {"post_impact", post.kp, post.kd, post.joints == PostImpactSetup::Joints::computed_torque};
  }
  const auto report_if_unstable = [&](const Gains& what, const Eigen::MatrixXd& response,
                                      const std::vector<std::string>& names) {
    const std::string text = describe(loop_of(what, response, timing), what, names);
    if (!text.empty()) found.push_back(text);
  };
  if (!gains.kp.empty() && gains.kp.size() == system.robot_joints.size()) {
    std::vector<std::string> names;
    for (std::size_t j = 0; j < system.robot_joints.size(); ++j) {
      const Body& body = system.model.joint_body(system.robot_joints[j]);
      names.push_back(fmt::format("joint '{}'", body.description.joint.name));
      const std::string& joint = body.description.joint.name;
      const bool by_tendon = !approach && is_pulled(problem.robot, *problem.post_impact, joint);
      if (follows_others(body) || by_tendon) gains.kp[j] = gains.kd[j] = 0;
    }
    report_if_unstable(gains, joint_response(system, run.bodies.state), names);
  }
  const auto& base = approach ? problem.approach->base_control : problem.post_impact->base_control;
  if (!base || !system.model.has_free_root(system.base)) return found;
  const bool are_free = !approach && problem.post_impact->joints == PostImpactSetup::Joints::free;
  if (are_free && !system.closures.empty()) return found;
  Gains attitude{approach ? "approach.base_control" : "post_impact.base_control",
                 {base->kp[0], base->kp[1], base->kp[2]},
                 {base->kd[0], base->kd[1], base->kd[2]}};
  report_if_unstable(attitude, base_response(system, run.bodies.state, !are_free),
                     {"the base's x axis", "the base's y axis", "the base's z axis"});
  return found;
}

}  // namespace grapnel
