#pragma once

/// @file
/// The piece straight in with a self-motion, roughly and with derivatives: what a search goes by (straight_way.hpp).
///
/// (1) to (3) of straight_way.hpp in steps that stay the same, of order 4: the classical method for the first three,
/// then that of Adams, Bashforth and Moulton, which takes one evaluation per step: rates are those at the predicted
/// states. Predictor and corrector together tell how far the integration may be off: by Milne's device 19/270 of their
/// difference per step (Hairer, Norsett, Wanner 1993, III.1).

#include <initializer_list>
#include <utility>

#include "grapnel/plan/straight_way.hpp"

namespace grapnel {

class SelfMotions {
 public:
  static constexpr int kTerms = 8;  // of the self-motion

  /// The motion at the ends of steps, with its derivatives by the unknowns: [where it begins, c].
  struct Node {
    double time = 0;
    std::vector<double> position, rate, acceleration;
    Posed X_WB = Posed::identity();
    PlacedLinks links;
    Eigen::MatrixXd per_position, per_rate, per_acceleration;  // joints x unknowns
    Matrix6Xd per_displacement;                                // of the base, in B
  };

  /// All must outlive the object. `freedom` may be null.
  SelfMotions(FloatingBase& base, const StraightInProblem& problem, const StartFreedom* freedom);

  int start_unknowns() const { return freedom_ ? static_cast<int>(freedom_->position.cols()) : 0; }
  int unknowns() const { return start_unknowns() + n_ * kTerms; }
  // Joint values at the begin count as rates that would bring them about in the piece's duration.
  double start_scale() const { return problem_.end - problem_.begin; }
  bool complete() const { return targets_.size() == times_.size(); }
  int self_motions() const { return self_motions_; }
  bool near_singularity() const { return near_singularity_; }  // at any time, in any integration
  long evaluations() const { return evaluations_; }

  std::vector<double> start(const Eigen::VectorXd& v) const;

  // The farthest that a joint is then from where it was to begin [rad or m].
  double begins_elsewhere_by(const Eigen::VectorXd& v) const;

  // Without derivatives it takes a fraction of the time.
  enum class Derivatives { none, all };
  std::vector<Node> integrate(const Eigen::VectorXd& v, Derivatives derivatives);

  /// How far the last integration may be off: joint values and the base's turn at the end [rad or m], joint rates as a
  /// share of the largest.
  double error() const { return error_; }

  /// Twice as many steps from now on, if there may be more.
  bool refine();

 private:
  struct State {
    std::vector<double> position;
    Quaterniond q_WB;
    Posed X_WB;  // where q_WB has it
    Eigen::MatrixXd per_position;
    Matrix6Xd per_displacement;
  };
  struct Change {
    std::vector<double> rate;
    Quaterniond turn;  // of the base's quaternion
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
  std::vector<double> times_;  // of steps' ends and middles
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
