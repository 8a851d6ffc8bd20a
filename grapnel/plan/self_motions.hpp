#pragma once

/// @file
/// Fast integration of the final straight approach with a self-motion and its derivatives, for the search of
/// constrained_straight_in.hpp.
///
/// Integrates (1) to (3) of constrained_straight_in.hpp with fixed steps of order 4: the classical Runge-Kutta method
/// for the first three steps, then the Adams-Bashforth-Moulton method with one evaluation per step, at the predicted
/// states. The difference of predictor and corrector estimates the error: 19/270 of it per step by Milne's device
/// (Hairer, Norsett, Wanner 1993, III.1).

#include <initializer_list>
#include <utility>

#include "grapnel/plan/constrained_straight_in.hpp"

namespace grapnel {

class SelfMotions {
 public:
  static constexpr int kTerms = 8;  // of the self-motion

  /// The motion at the ends of steps, with derivatives with respect to the unknowns: [initial state, c].
  struct Node {
    double time = 0;
    std::vector<double> position, rate, acceleration;
    Posed X_WB = Posed::identity();
    PlacedLinks links;
    Eigen::MatrixXd per_position, per_rate, per_acceleration;  // joints x unknowns
    Matrix6Xd per_displacement;                                // of the base, in B
  };

  /// All arguments must outlive the object. `freedom` may be null.
  SelfMotions(FloatingBase& base, const StraightInProblem& problem, const StartFreedom* freedom);

  int start_unknowns() const { return freedom_ ? static_cast<int>(freedom_->position.cols()) : 0; }
  int unknowns() const { return start_unknowns() + n_ * kTerms; }
  // Initial joint values are scaled as rates that produce them within the segment's duration.
  double start_scale() const { return problem_.end - problem_.begin; }
  bool complete() const { return targets_.size() == times_.size(); }
  int self_motions() const { return self_motions_; }
  bool near_singularity() const { return near_singularity_; }  // at any time, in any integration
  long evaluations() const { return evaluations_; }

  std::vector<double> start(const Eigen::VectorXd& v) const;

  // Largest change of an initial joint value [rad or m].
  double begins_elsewhere_by(const Eigen::VectorXd& v) const;

  // Integration without derivatives costs a fraction of the time.
  enum class Derivatives { none, all };
  std::vector<Node> integrate(const Eigen::VectorXd& v, Derivatives derivatives);

  /// Error estimate of the last integration: final joint values and base rotation [rad or m], joint rates as a share of
  /// the largest.
  double error() const { return error_; }

  /// Doubles the number of steps for following integrations; false at the maximum.
  bool refine();

 private:
  struct State {
    std::vector<double> position;
    Quaterniond q_WB;
    Posed X_WB;  // base pose that corresponds to q_WB
    Eigen::MatrixXd per_position;
    Matrix6Xd per_displacement;
  };
  struct Change {
    std::vector<double> rate;
    Quaterniond turn;  // rotation of the base, as a quaternion
    Eigen::MatrixXd per_position;
    Matrix6Xd per_displacement;
  };

  double step() const { return (problem_.end - problem_.begin) / static_cast<double>(steps_); }
  void place_targets();
  void settle(State& s, double time);
  State begin(const Eigen::VectorXd& v);
  State after(const State& s, const Change& k, double h, int at);
  Change change(const State& s, int at, const Eigen::VectorXd& v);
  Eigen::VectorXd rates_nearest_to(const Eigen::VectorXd& z, const Posed& X_WB, const Momentumd& h_B,
                                   const std::vector<Goal>& goals);
  static Change sum(std::initializer_list<std::pair<double, const Change&>> terms);
  void add_accelerations(std::vector<Node>& nodes) const;

  FloatingBase& base_;
  const StraightInProblem& problem_;
  const StartFreedom* freedom_;
  int n_;
  std::size_t steps_;
  std::vector<double> times_;  // ends and midpoints of the steps
  std::vector<std::vector<FreeBody>> targets_;
  PlacedLinks links_;
  Eigen::MatrixXd G_;
  Eigen::VectorXd b_;
  bool derivatives_ = true, near_singularity_ = false;
  int self_motions_ = 0;
  double error_ = 0;
  long evaluations_ = 0;
};

}  // namespace grapnel
