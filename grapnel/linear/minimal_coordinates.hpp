#pragma once

/// @file
/// Private to this module: deviations of a state from an operating point, in the coordinates that loops, couplings and
/// held joints leave independent.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/constraint/constrained_dynamics.hpp"
#include "grapnel/dynamics/state.hpp"
#include "grapnel/dynamics/workspace.hpp"

namespace grapnel {

/// x = [xi; dv] as in Linearization (dynamics/linearization.hpp), but only of the independent velocities. Thread
/// safety: one thread at a time. The model must outlive it.
class MinimalCoordinates {
 public:
  /// `fixed`: per velocity, whether it and its position do not deviate.
  MinimalCoordinates(const Model& model, std::span<const LoopClosure> closures, State at,
                     std::vector<std::uint8_t> fixed);

  const State& at() const { return at_; }
  const std::vector<std::uint8_t>& fixed() const { return fixed_; }
  /// Independent velocities: indices in State::v. x has twice as many entries.
  const std::vector<int>& independent() const { return independent_; }
  Eigen::Index size() const { return 2 * static_cast<Eigen::Index>(independent_.size()); }
  /// All velocities by the independent ones, at the operating point.
  const Eigen::MatrixXd& basis() const { return basis_; }

  /// The state whose deviation is about `step` along entry `i` of x; loops are closed.
  State moved(Eigen::Index i, double step);
  /// The state whose deviation is about [xi; dv] of all velocities; loops are closed.
  State moved_by(const Eigen::VectorXd& xi, const Eigen::VectorXd& dv);
  /// The deviation of all velocities' coordinates, [xi; dv].
  Eigen::VectorXd deviation(const State& state) const;
  /// The independent entries of such a vector.
  Eigen::VectorXd independent_of(const Eigen::VectorXd& all) const;
  /// xi' by [xi; dv] to first order: dv - ad_v xi.
  Eigen::VectorXd position_rates(const Eigen::VectorXd& deviation) const;
  /// Accelerations by generalized forces alone, at rest in this configuration; fixed velocities remain.
  Eigen::VectorXd response(const State& state, const Eigen::VectorXd& force);

 private:
  void find_independent(int count, const Eigen::MatrixXd& allowed);

  const Model& model_;
  State at_;
  std::vector<std::uint8_t> fixed_;
  Workspace workspace_;
  std::optional<LoopSolver> loops_;
  std::vector<int> independent_;
  Eigen::MatrixXd basis_;
};

}  // namespace grapnel
