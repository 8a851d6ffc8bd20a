#include "grapnel/plan/exchanged_grasps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "grapnel/plan/reach_failure.hpp"

namespace grapnel {
namespace {

constexpr double kArrives = 1e-5;  // [m and rad]

// The goals if end-effector `of[i]` takes the place of goal i.
std::vector<Goal> exchanged(std::span<const Goal> goals, std::span<const std::size_t> of) {
  std::vector<Goal> result(goals.begin(), goals.end());
  for (std::size_t i = 0; i < goals.size(); ++i) {
    const Goal& end_effector = goals[of[i]];
    Goal& g = result[i];
    g.frame = end_effector.frame, g.name = end_effector.name, g.axis_E = end_effector.axis_E;
    g.accepted_distance = end_effector.accepted_distance, g.accepted_angle = end_effector.accepted_angle;
  }
  return result;
}

bool all_arrive(FloatingBase& base, const ReachProblem& problem, const std::vector<double>& from) {
  for (const Nearest& n : settle_arms(base, problem, from).nearest) {
    if (n.error.size() > 0 && n.error.lpNorm<Eigen::Infinity>() > kArrives) return false;
  }
  return incompatible_goals(base, problem, from).empty();
}

// Alternative assignments of end-effectors to goals: all for few goals, otherwise exchanges of two.
std::vector<std::vector<std::size_t>> other_assignments(std::size_t goals) {
  constexpr std::size_t kAllOf = 4;
  std::vector<std::size_t> of(goals);
  std::iota(of.begin(), of.end(), std::size_t{0});
  std::vector<std::vector<std::size_t>> found;
  for (std::size_t i = 0; i < goals; ++i) {
    for (std::size_t k = i + 1; k < goals; ++k) {
      found.push_back(of);
      std::swap(found.back()[i], found.back()[k]);
    }
  }
  while (goals <= kAllOf && std::next_permutation(of.begin(), of.end())) {
    if (std::find(found.begin(), found.end(), of) == found.end()) found.push_back(of);
  }
  return found;
}

}  // namespace

// Unreachable goals => message with an assignment of end-effectors that reaches all goals; empty if there is none.
std::string exchange_of_grasps(FloatingBase& base, const ReachProblem& problem, const Posed& X_WB_end,
                               const std::vector<std::vector<std::size_t>>& faulty) {
  const std::vector<double>& from = problem.start.position;
  for (const std::vector<std::size_t>& of : other_assignments(problem.goals.size())) {
    const auto stays = [&](const std::vector<std::size_t>& set) {
      return std::all_of(set.begin(), set.end(), [&](std::size_t g) { return of[g] == g; });
    };
    if (std::any_of(faulty.begin(), faulty.end(), stays)) continue;
    ReachProblem other = problem;
    other.goals = exchanged(problem.goals, of);
    const auto is_beyond = [&](const Goal& g) { return !beyond_reach(base, X_WB_end, g).empty(); };
    if (std::any_of(other.goals.begin(), other.goals.end(), is_beyond)) continue;  // cheaper than a search
    if (!all_arrive(base, other, from)) continue;
    std::string places;
    for (std::size_t i = 0; i < of.size(); ++i) {
      if (of[i] == i) continue;
      const Goal& g = other.goals[i];
      places += fmt::format("{}'{}' at grasp point '{}' of target '{}'", places.empty() ? "" : ", ", g.name, g.point,
                            g.target);
    }
    return fmt::format(
        "the grasps are exchanged between end-effectors: with {} every end-effector reaches its grasp point, with the "
        "stated grasps not; exchange them in grasps",
        places);
  }
  return {};
}

}  // namespace grapnel
