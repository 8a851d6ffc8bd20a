#pragma once

/// @file
/// Radau IIA with five stages: an implicit method of order 9 for stiff mechanical systems, with error control and
/// dense output.
///
/// [Hairer and Wanner 1996], sections IV.5 and IV.8. Stages are those of collocation at the five Radau points c_i, of
/// which the last is 1:
///
///   Z_i = h sum_j a_ij f(t + c_j h, y + Z_j),     y(t + h) = y + Z_5.                                        (12.18)
///
/// The simplified Newton iteration exploits the structure of mechanical systems: positions x change by rates w, x' =
/// X(x, w), w' = W(x, w). X depends on x through rotations alone, which is slow, so dX/dx is omitted from the Newton
/// matrix. The factored matrices then have the size of the rates: one for the real eigenvalue of (a_ij) and one for
/// each of its two complex pairs. Pure quadratures are summed from the stages. docs/theory, (12.18) to (12.23).
/// @warning Not thread-safe: an integrator belongs to one thread.

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace grapnel {

/// The numbers y in order: positions, rates, quadratures.
struct StiffSystem {
  int positions = 0, rates = 0, quadratures = 0;
  /// y'(t, y), all numbers, at as many points as there are times; states and results are stored one after the other.
  /// Called for all stages, or for all columns of the Jacobian, together. Must not throw; a result that is not finite
  /// shortens the step.
  std::function<void(std::span<const double> t, std::span<const double> y, std::span<double> dydt)> derivatives;

  int coupled() const { return positions + rates; }
  int size() const { return coupled() + quadratures; }
};

class RadauIIA {
 public:
  static constexpr int kStages = 5;

  /// Starts from y = `start` at t = 0. `sizes`: typical changes of the coupled numbers, used as increments of finite
  /// differences, none zero. `tolerances`: of the estimated error of a step, of order h^6, per coupled number; the
  /// largest quotient counts. The error at the step's end is of order h^10 if h is small relative to the stiff time
  /// scales, and well below the estimate.
  RadauIIA(StiffSystem system, std::span<const double> start, std::span<const double> sizes,
           std::span<const double> tolerances);

  /// Restarts at the present state with a step of this length, after a change of the derivative.
  void restart(double first_step);
  /// Notes a small jump of the derivative; step size and matrices are kept.
  void jump() { slope_known_ = false; }
  /// Continues from the numbers y at time t, where the derivative is `slope`; step size and matrices are kept.
  void continue_from(double t, std::span<const double> y, std::span<const double> slope);
  /// From the first step on, limits the estimated errors of quadratures by these tolerances too, beyond those due to
  /// the remaining error of Newton's method. Infinite: no limit.
  void limit_quadratures(std::span<const double> tolerances);
  /// Replaces the tolerances, of the coupled numbers and, if they are limited, of the quadratures.
  void set_tolerances(std::span<const double> tolerances);
  /// Newton's method has also converged if it stalls at corrections below this share of the tolerances, because of
  /// rounding errors. Initially 1e-5.
  void accept_rounding(double share) { rounding_ = share; }
  /// For motions that come to rest: Newton's method has converged when the estimated remaining error is this share of
  /// the tolerances, initially 1e-3. Its first values are, number by number, those at the begin where these were nearer
  /// to the last step's solution than the extrapolation. Allocates.
  void expect_rest(double share);
  /// Makes one step, at most to `limit` > time(). False: no step was possible, with the reason in message(). The last
  /// kStages points at which derivatives were evaluated are the stages of this step.
  bool step(double limit);
  /// Repeats the last step such that it ends at `t`, which is not before its begin; its error is not estimated. False:
  /// it could not be solved.
  bool end_at(double t);
  /// Sets the maximum step; 0: no limit.
  void limit_step(double longest) { longest_ = longest; }

  double time() const { return t_; }
  double begin() const { return begin_; }  // of the last step
  std::span<const double> y() const { return y_; }
  /// State at a time within the last step, from the collocation polynomial, of order 6.
  void at(double t, std::span<double> y) const;
  /// Time of stage `i` of the last step.
  double time_of_stage(int i) const;

  long evaluations() const { return evaluations_; }
  long derivatives() const { return jacobians_; }
  long factorizations() const { return factorizations_; }
  long iterations() const { return iterations_; }
  long rejected() const { return rejected_; }  // trial steps
  /// Estimated error of the last step relative to the tolerances, at least 0.01.
  double error() const { return last_error_; }
  std::string message() const { return message_; }
  /// Estimates the largest magnitude of the eigenvalues of Newton's Jacobian by the power method, which continues from
  /// the last call. Zero before the first step.
  double spectral_radius();

 private:
  // L U factors of a matrix, column-major; complex matrices as real and imaginary parts.
  struct Factors {
    std::vector<double> re, im;
    std::vector<int> pivot;
  };
  enum class Newton { converged, failed };

  double* stage(std::vector<double>& of, int i) { return &of[static_cast<std::size_t>(i) * system_.size()]; }
  const double* stage(const std::vector<double>& of, int i) const {
    return &of[static_cast<std::size_t>(i) * system_.size()];
  }
  bool evaluate(std::span<const double> t, std::span<const double> y, std::span<double> dydt);
  void difference();
  bool factorize(double h);
  void predict(double h, double from);
  bool evaluate_stages(double h);
  Newton solve_stages(double h);
  void correct(double h);
  bool add_quadratures(double h);
  void finish(double h, double t_end);
  double error_of(double h, std::span<const double> slope);
  double error_of_quadratures(double h);
  double weighted(std::span<const double> x) const;
  bool limits_quadratures() const { return tolerances_.size() > static_cast<std::size_t>(system_.coupled()); }
  bool fail(const char* why);
  void note_rest();

  StiffSystem system_;
  std::vector<double> sizes_, tolerances_;
  double t_ = 0, begin_ = 0, length_ = 0;  // length_: of the step of the polynomial; 0: none
  double proposed_ = 0, longest_ = 0, rounding_ = 1e-5, newton_share_ = 1e-3;
  double contraction_ = 1, last_error_ = 0, last_length_ = 0;
  bool derivatives_known_ = false, derivatives_fresh_ = false, factors_known_ = false, slow_ = false;
  bool slope_known_ = false;  // derivative at the end
  int iterations_now_ = 0;
  double factored_for_ = 0;
  std::vector<double> y_, y_begin_, slope_, end_slope_, moved_slope_, sum_;
  std::vector<double> times_, moved_, slopes_;        // of simultaneous points: stages or columns
  std::vector<double> Z_, F_, R_, last_Z_, scratch_;  // per stage, all numbers
  std::vector<double> X_w_, W_w_, W_x_, curvature_;   // by columns; curvature_ = W_x X_w
  std::vector<double> G_;  // by columns, of quadratures' rates to the coupled numbers; empty without their tolerances
  std::vector<std::uint8_t> at_rest_;       // per coupled number; empty: all are extrapolated
  std::vector<double> extrapolated_;        // per stage, all numbers, of the last prediction
  std::vector<double> power_, next_power_;  // the power method's vector, coupled numbers
  std::array<Factors, 3> factors_;
  std::vector<double> re_, im_;  // right-hand sides, per factor
  long evaluations_ = 0, jacobians_ = 0, factorizations_ = 0, iterations_ = 0, rejected_ = 0;
  std::string message_;
};

}  // namespace grapnel
