#pragma once

/// @file
/// Identification of a held target in a run: samples at the clock's sample times, the estimate, and the model that laws
/// use before and after (docs/theory, section 16 and 18.6-18.8). Thread safety: one thread at a time.

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "grapnel/identify/identify_target.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// Mass, centre of mass and inertia about it, in a target's frame.
struct TargetInertia {
  double mass;          // [kg]
  Vector3d com;         // [m]
  Symmetric3d inertia;  // [kg m^2]
};
/// The model of a system with another inertia of one target: same structure, same indices.
std::shared_ptr<const Model> with_inertia(const CaptureSystem& system, std::size_t target,
                                          const TargetInertia& inertia);

/// Standard deviations of rates, from the sensors' settings.
RateNoise rate_noise_of(const CaptureProblem& problem);

class IdentificationRun {
 public:
  /// The problem must outlive this.
  explicit IdentificationRun(const CaptureProblem& problem);

  void begin_post_impact(double time);
  /// Begins a motion segment. Samples of another model are discarded.
  void begin_piece(const CaptureSystem& system, double time);
  /// The model that the laws use in that piece; null: the true one.
  std::shared_ptr<const Model> law_model(const CaptureSystem& system) const;
  /// Takes a sample; `seen` holds the sensor readings.
  void take(const CaptureSystem& system, const PhaseSample& sample, const State& seen);
  /// Ends the piece: adds external impulses.
  void end_piece(const PhaseIntegrals& integrals);
  /// The end time of the samples; infinite: none [s].
  double next_event() const;
  /// Computes and reports the estimate at that time.
  void conclude(const CaptureSystem& system, double time);
  void write(CaptureResult& result) const;

 private:
  bool is_held(const CaptureSystem& system) const;
  IdentificationTask task(const CaptureSystem& system) const;
  void report(const IdentifiedBody& found);

  const CaptureProblem& problem_;
  std::optional<IdentifySetup> setup_;           // of the first phase after the approach; absent: none
  std::size_t assumed_target_ = 0, target_ = 0;  // in the problem
  std::optional<TargetInertia> assumed_, estimated_;
  LawModel model_ = LawModel::truth;
  double begin_ = std::numeric_limits<double>::infinity(), end_ = begin_;  // of the samples
  long every_ = 1;                                                         // ticks
  Momentumd finished_impulse_ = Momentumd::zero(), first_impulse_ = Momentumd::zero();
  std::optional<Momentumd> first_momentum_;
  std::vector<MotionSample> samples_;
  std::vector<std::size_t> grasps_;  // those that held at the first sample
  std::optional<IdentificationReport> report_;
};

}  // namespace grapnel
