#pragma once

/// @file
/// Radau IIA of order 9 (radau_iia.hpp) as a stepper on a manifold with unit quaternions, with the interface of
/// DormandPrince853. docs/theory/08-after-the-impact.md, stiff motion. Thread safety: a stepper belongs to one thread
/// at a time; different ones are independent.

#include <functional>
#include <span>
#include <vector>

#include "grapnel/integrate/dormand_prince_853.hpp"
#include "grapnel/integrate/radau_iia.hpp"
#include "grapnel/integrate/stepper.hpp"

namespace grapnel {

/// Integrates forwards. Newton's matrix contains the coupled numbers, on which the derivatives depend; the others are
/// sums over the stages. The error estimate, of order h^6, covers the coupled numbers; the error at the end of a step
/// is of order h^10, that of the sums too. If rhs throws, the exception passes through, and the stepper remains at the
/// end of the last accepted step.
class RadauStepper : public Stepper<double> {
 public:
  /// `coupled`: indices of the coupled numbers, increasing. Allocates everything. `control.predictive` has no effect:
  /// step sizes always follow the change of the error. Throws std::invalid_argument as DormandPrince853 does, and if an
  /// index is outside the state or out of order.
  RadauStepper(const Manifold& manifold, const Tolerances& tolerances, const StepControl& control,
               std::vector<int> coupled);
  RadauStepper(const RadauStepper&) = delete;
  RadauStepper& operator=(const RadauStepper&) = delete;

  /// Begins at t0 with y0 (n numbers; quaternions are normalized) towards t_end >= t0. Evaluates rhs once. The status
  /// is then as for DormandPrince853::start. Throws std::invalid_argument if a time is not finite, t_end lies before
  /// t0, or y0 has another size.
  template <RightHandSide<double> Rhs>
  void start(Rhs&& rhs, double t0, std::span<const double> y0, double t_end) {
    refuse_backwards(t0, t_end);
    begin(rhs, t0, y0, t_end);
    restart();
  }

  /// Advances by one accepted step, at most to the end time. Does nothing unless the status is `running`. @return the
  /// new status. Throws only exceptions of rhs.
  template <RightHandSide<double> Rhs>
  StepStatus step(Rhs&& rhs) {
    if (status_ != StepStatus::running) return status_;
    const Derivative derivative = [&rhs](double t, std::span<const double> y, std::span<double> dydt) {
      rhs(t, y, dydt);
    };
    return advance(derivative);
  }

  /// Sets the first size to try in the next step, and takes the derivatives of rhs again. Throws std::invalid_argument
  /// unless it is positive and finite.
  void propose_step(double size);

  /// No effect; part of the common stepper interface. Throws std::logic_error if there is no completed step.
  template <RightHandSide<double> Rhs>
  void prepare_dense_output(Rhs&&) {
    if (!has_step_) throw std::logic_error("dense output: there is no completed step: " + explanation());
  }

  /// The state at a time t of the last step, from the collocation polynomial of order 6 (n numbers, quaternions
  /// normalized). Exact at the ends of the step. Throws std::logic_error if there is no completed step,
  /// std::out_of_range if t lies outside it.
  void interpolate(double t, std::span<double> y) const;

  /// As interpolate(t, y); rhs is not used.
  template <RightHandSide<double> Rhs>
  void interpolate(Rhs&&, double t, std::span<double> y) {
    interpolate(t, y);
  }

  const std::vector<int>& coupled() const { return coupled_; }
  /// Number of factorizations of Newton's matrix since construction.
  long factorizations() const { return radau_.factorizations(); }
  /// The estimated magnitude of the fastest eigenvalue [1/time]; see RadauIIA.
  double spectral_radius() { return radau_.spectral_radius(); }

 private:
  using Derivative = std::function<void(double, std::span<const double>, std::span<double>)>;

  static void refuse_backwards(double t0, double t_end);
  StiffSystem system();
  void restart();
  StepStatus advance(const Derivative& derivative);
  void evaluate_points(std::span<const double> t, std::span<const double> y, std::span<double> dydt);
  void gather(std::span<const double> from, std::span<double> to) const;
  void scatter(std::span<const double> from, std::span<double> to) const;
  void set_tolerances();

  StepControl control_;
  double rtol_;
  std::vector<double> atol_;         // n numbers
  std::vector<int> coupled_;         // indices of the coupled numbers
  std::vector<int> order_;           // these, then those of the others: the order of radau_
  std::vector<bool> in_quaternion_;  // per number
  RadauIIA radau_;
  const Derivative* active_ = nullptr;   // during a step
  std::vector<double> point_, slope_;    // n numbers, in the order of the state
  mutable std::vector<double> ordered_;  // n numbers, in the order of radau_
  std::vector<double> ordered_slope_, step_tolerances_;
};

}  // namespace grapnel
