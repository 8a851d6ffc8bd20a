#include "grapnel/plan/arm_starts.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "grapnel/plan/shooting.hpp"

namespace grapnel {

// Frame => maximum length of its chain: sum of the distances between consecutive joints, with prismatic joints at their
// limits.
ArmReach arm_reach(const Model& model, int frame) {
  const Frame& f = model.frames()[frame];
  ArmReach reach{-1, norm(f.X_BE.p)};
  for (int b = f.body; b >= 0 && model.bodies()[b].parent >= 0; b = model.bodies()[b].parent) {
    const JointDescription& joint = model.bodies()[b].description.joint;
    if (slides_along_axis(joint.type)) {
      reach.length += std::max(std::abs(joint.limits.lower), std::abs(joint.limits.upper));
    }
    if (velocity_count(joint.type) == 0) {
      reach.length += norm(model.bodies()[b].description.X_PF.p);
      continue;
    }
    reach.first_body = b;
    // The distance from this joint to its parent's joint belongs to the chain only if there is another joint below.
    bool another = false;
    for (int a = model.bodies()[b].parent; a >= 0; a = model.bodies()[a].parent) {
      another =
          another || (model.bodies()[a].parent >= 0 && velocity_count(model.bodies()[a].description.joint.type) > 0);
    }
    if (!another) break;
    reach.length += norm(model.bodies()[b].description.X_PF.p);
  }
  return reach;
}

namespace {

constexpr int kTrials = 40;     // random initial guesses per arm
constexpr int kKept = 8;        // solutions per arm
constexpr double kGood = 1e-6;  // sufficient, since the base will move [m and rad]

}  // namespace

// Goals => arms: groups of goals whose chains share joints.
std::vector<Arm> split_arms(const FloatingBase& base, std::span<const Goal> goals) {
  std::vector<Arm> arms;
  for (const Goal& goal : goals) {
    Arm arm;
    arm.goals.push_back(goal);
    for (int j = 0; j < base.joints(); ++j) {
      if (base.carries(j, goal.frame)) arm.joints.push_back(j);
    }
    // Arms with common joints are merged.
    for (std::size_t i = arms.size(); i-- > 0;) {
      const bool shared = std::any_of(arms[i].joints.begin(), arms[i].joints.end(), [&](int j) {
        return std::find(arm.joints.begin(), arm.joints.end(), j) != arm.joints.end();
      });
      if (!shared) continue;
      arm.goals.insert(arm.goals.begin(), arms[i].goals.begin(), arms[i].goals.end());
      arm.joints.insert(arm.joints.end(), arms[i].joints.begin(), arms[i].joints.end());
      arms.erase(arms.begin() + static_cast<std::ptrdiff_t>(i));
    }
    std::sort(arm.joints.begin(), arm.joints.end());
    arm.joints.erase(std::unique(arm.joints.begin(), arm.joints.end()), arm.joints.end());
    arms.push_back(std::move(arm));
  }
  return arms;
}

// Initial guess => joint values of the arm for its goals with a fixed base, by damped minimum-norm Newton steps;
// returns whether they converged.
bool still_base_ik(FloatingBase& base, const Posed& X_WB, const Arm& arm, const ReachProblem& problem,
                   std::vector<double>& theta) {
  const std::vector<int>& joints = arm.joints;
  std::vector<double> lower, upper, x;
  for (int j : joints) lower.push_back(problem.lower[j]), upper.push_back(problem.upper[j]), x.push_back(theta[j]);
  Eigen::VectorXd e;
  Eigen::MatrixXd J, unused;
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 60; ++i) {
    for (std::size_t k = 0; k < joints.size(); ++k) theta[joints[k]] = x[k];
    base.place_frames(theta);
    goal_error(base, X_WB, arm.goals, e, J, unused);
    if (!e.allFinite()) return false;
    if (e.lpNorm<Eigen::Infinity>() < kGood) return true;
    if (i % 10 == 9) {
      if (e.norm() > 0.7 * last) return false;
      last = e.norm();
    }
    NewtonStep step = least_norm_step(J(Eigen::all, joints), e, x, lower, upper, 0.02);
    const double longest = step.d.lpNorm<Eigen::Infinity>();
    if (longest > 0.5) step.d *= 0.5 / longest;
    for (std::size_t k = 0; k < joints.size(); ++k) {
      x[k] = std::clamp(x[k] + step.d[static_cast<Eigen::Index>(k)], lower[k], upper[k]);
    }
  }
  return false;
}

ArmStarts::ArmStarts(FloatingBase& base, const ReachProblem& problem, const Posed& X_WB)
    : base_(base), problem_(problem), random_(problem.seed ^ 0x9e3779b97f4a7c15ull) {
  for (Arm& arm : split_arms(base, problem.goals)) {
    arms_.push_back({std::move(arm), {}});
    solve(arms_.back(), X_WB);
  }
}

bool ArmStarts::complete() const {
  return std::all_of(arms_.begin(), arms_.end(), [](const Solved& s) { return !s.solutions.empty(); });
}

double ArmStarts::uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

// Random values within the limits; without limits, within half a turn (or 1 m) of the joint's initial value.
std::vector<double> ArmStarts::random_values() {
  std::vector<double> theta(base_.joints());
  for (std::size_t j = 0; j < theta.size(); ++j) {
    const double start = problem_.start.position[j];
    double low = std::max(problem_.lower[j], start - std::numbers::pi);
    double high = std::min(problem_.upper[j], start + std::numbers::pi);
    if (!(low <= high)) low = problem_.lower[j], high = problem_.upper[j];
    theta[j] = low + (high - low) * uniform();
  }
  return theta;
}

// Fills the solutions of one arm from random initial guesses and ranks them by the objective.
void ArmStarts::solve(Solved& solved, const Posed& X_WB) {
  const Arm& arm = solved.arm;
  if (arm.joints.empty()) return;
  std::vector<std::pair<double, std::vector<double>>> found;
  for (int trial = 0; trial < kTrials && static_cast<int>(found.size()) < 2 * kKept; ++trial) {
    std::vector<double> theta = problem_.guess;
    const std::vector<double> random = random_values();
    // The first trials are close to the guess.
    const double spread = trial == 0 ? 0 : std::min(1.0, 0.1 * trial);
    for (int j : arm.joints) theta[j] = (1 - spread) * theta[j] + spread * random[j];
    if (!still_base_ik(base_, X_WB, arm, problem_, theta)) continue;
    const double objective = problem_.objective.value(base_, arm.goals, theta, {}, nullptr);
    std::vector<double> values;
    for (int j : arm.joints) values.push_back(theta[j]);
    const bool known = std::any_of(found.begin(), found.end(), [&](const auto& f) {
      double apart = 0;
      for (std::size_t k = 0; k < values.size(); ++k) apart = std::max(apart, std::abs(values[k] - f.second[k]));
      return apart < 1e-3;
    });
    if (!known) found.emplace_back(objective, std::move(values));
  }
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  if (found.size() > kKept) found.resize(kKept);
  for (auto& f : found) solved.solutions.push_back(std::move(f.second));
}

// Next combination of the arms' solutions as an initial guess, random values where an arm has none.
std::vector<double> ArmStarts::next() {
  std::vector<double> theta = problem_.guess;
  const std::vector<double> random = random_values();
  std::size_t stride = served_;
  for (const Solved& solved : arms_) {
    const Arm& arm = solved.arm;
    const std::size_t count = solved.solutions.size();
    // First the k-th solutions of all arms, later mixed combinations; then random initial guesses.
    const bool fresh = count > 0 && served_ < 2 * count;
    const std::size_t pick = count > 0 ? stride % count : 0;
    for (std::size_t k = 0; k < arm.joints.size(); ++k) {
      const int j = arm.joints[k];
      theta[j] = fresh ? solved.solutions[pick][k] : random[j];
    }
    if (served_ >= count) ++stride;
  }
  ++served_;
  return theta;
}

}  // namespace grapnel
