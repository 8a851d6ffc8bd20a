#pragma once

/// @file
/// Response of the accelerations of a free-floating robot to its joint efforts, including closed loops and couplings.
/// Used by laws that control the motion of a body through the arms.

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/constraint/loop_closure.hpp"
#include "grapnel/dynamics/branch_cholesky.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/workspace.hpp"

namespace grapnel {

/// vdot = free + response tau (15.1), tau the efforts of the driven joints. Thread safety: one thread at a time.
class EffortResponse {
 public:
  /// `joints`: positions in Model::joints() of the driven joints, in the order of the efforts. The model must outlive
  /// this. `steady`: joints whose rates are held by their own motors (gyros). @throws std::invalid_argument if there is
  /// no such joint.
  EffortResponse(const Model& model, std::vector<int> joints, std::vector<LoopClosure> closures,
                 const std::vector<int>& steady = {});

  /// Evaluates at a state. `force`: generalized forces in addition to the efforts (per velocity; empty: none); likewise
  /// `wrenches`.
  void update(const State& state, std::span<const double> force, const Vector3d& gravity,
              std::span<const ExternalWrench> wrenches = {});

  const Model& model() const { return model_; }
  const std::vector<int>& joints() const { return joints_; }
  /// Index into State::v of a driven joint's rate.
  int velocity(std::size_t joint) const { return velocities_[joint]; }
  int coordinate(std::size_t joint) const { return coordinates_[joint]; }
  /// Effort limits of the driven joints.
  const std::vector<double>& limits() const { return limits_; }

  // Of the last update():
  const Kinematics& kinematics() const { return workspace_.kinematics; }
  const Eigen::VectorXd& free() const { return free_; }          // accelerations without efforts
  const Eigen::MatrixXd& response() const { return response_; }  // velocities x driven joints
  /// Closure multipliers without efforts, and their change per effort (15.2), on bodies b, in C's axes; minimum-norm if
  /// rows are redundant. Rows x driven joints.
  const Eigen::VectorXd& free_multipliers() const { return free_multipliers_; }
  const Eigen::MatrixXd& multiplier_response() const { return multiplier_response_; }
  const std::vector<LoopClosure>& closures() const { return closures_; }
  /// Velocity-dependent accelerations of the bodies: Jdot v.
  const std::vector<BodyAcceleration>& velocity_terms() const { return velocity_terms_; }

 private:
  void close_loops();

  const Model& model_;
  std::vector<int> joints_, velocities_, coordinates_;
  std::vector<double> limits_;
  std::vector<std::uint8_t> steady_;  // per velocity
  std::vector<LoopClosure> closures_;
  Workspace workspace_;
  BranchCholesky inertia_;
  std::vector<double> beside_, zero_, vdot_;
  std::vector<BodyAcceleration> velocity_terms_;
  Eigen::MatrixXd mass_, response_, rows_;
  Eigen::MatrixXd unit_;  // velocities x driven joints
  Eigen::VectorXd free_, row_terms_, free_multipliers_;
  Eigen::MatrixXd multiplier_response_;
};

/// The largest share, up to `most`, for which |fixed + share * varied| is within the limits (infinite: none); absent if
/// no share of at least 0 is.
std::optional<double> largest_share(const Eigen::VectorXd& fixed, const Eigen::VectorXd& varied,
                                    std::span<const double> limits, double most);

}  // namespace grapnel
