#pragma once

/// @file
/// The time series of a run.

#include "grapnel/capture/conservation_monitor.hpp"
#include "grapnel/capture/contact.hpp"
#include "grapnel/capture/motion_observer.hpp"
#include "grapnel/capture/safety_monitor.hpp"
#include "grapnel/capture/sensor_run.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/result/time_series.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// The expected size of a run's time series: the number of samples from durations and the output interval. Phases that
/// end earlier give fewer, impacts a few more.
struct ExpectedSeries {
  double samples = 0, columns = 0;
  double bytes() const { return 8 * samples * columns; }
};
ExpectedSeries expected_series(const CaptureProblem& problem);

/// The system at one instant, in the frame of the computation.
struct RecordedInstant {
  const CaptureSystem& system;
  const Kinematics& kinematics;
  const ConservedQuantities& quantities;
  const PhaseSample& sample;
  std::span<const GraspSample> grasps;    // per grasp of the problem; empty: none holds
  double clearance;                       // minimum of all pairs [m]; NaN: not evaluated
  std::span<const Wrenchd> through = {};  // transmitted by joints, per body; empty: unknown, recorded as NaN
};

/// Collects samples of all phases under the same names.
class Recorder {
 public:
  using Observers = std::vector<std::unique_ptr<MotionObserver>>;

  /// `frame`: that of the problem and the states; the series are in W. The monitors outlive this.
  Recorder(const CaptureProblem& problem, const CaptureSystem& system, const MovingFrame& frame,
           const Observers& observers, TimeSeries& series);
  /// Passes samples to the sink in blocks, without keeping them. Null: all are kept.
  void stream_to(SeriesSink* sink) { sink_ = sink; }
  /// Sets the sensors whose readings are recorded; they outlive this. Null: none.
  void observe(const SensorRun* sensors) { sensors_ = sensors; }
  void begin_phase(const std::string& name);
  void sample(const RecordedInstant& instant);
  /// Adds the work of the phase that ends to the totals.
  void end_phase(const PhaseIntegrals& integrals);

 private:
  void add(std::string path, std::string unit, std::string description, std::vector<std::string> components);
  void add_motion(const CaptureSystem& system);
  void add_grasps();
  void add_joints(const CaptureSystem& system);
  void add_observers();
  void add_conserved(const CaptureSystem& system);
  void add_orbit();
  void put_motion(const CaptureSystem& system, const Kinematics& kinematics);
  void put_orbit(const CaptureSystem& system, const Kinematics& kinematics, double time);
  void put_conserved(const CaptureSystem& system, const Kinematics& kinematics, const ConservedQuantities& quantities,
                     const PhaseSample& sample);
  Vector3d late_impulse(const ConservedQuantities& quantities, const PhaseSample& sample) const;
  void put_references(const CaptureSystem& system, const PhaseSample& s);
  void put_grasps(const std::vector<GraspGap>& gaps, std::span<const GraspSample> grasps);
  void put_momenta(const CaptureSystem& system, const Kinematics& kinematics, const Vector3d& com);
  void put(double value) { row_.put(value); }
  void put(const Vector3d& v) { row_.put(v); }
  void put(const Rotationd& R, Quaterniond& previous);

  const CaptureProblem& problem_;
  TimeSeries& series_;
  SeriesSink* sink_ = nullptr;
  const SensorRun* sensors_ = nullptr;
  std::size_t block_capacity_ = 0;  // maximum number of samples of a block
  const Observers& observers_;
  SeriesRow row_{series_};             // of the current sample
  std::vector<Quaterniond> previous_;  // for continuous signs of quaternions
  const MovingFrame frame_;
  PhaseIntegrals finished_;  // sums over finished phases
  /// Of the external impulse, weighted with time [N s^2]: of finished phases, and since the phase's start.
  Vector3d finished_late_ = Vector3d::zero(), late_ = Vector3d::zero();
  /// The phase's first sample.
  struct PhaseStart {
    double time;
    Vector3d com, momentum;
  };
  std::optional<PhaseStart> phase_start_;
  bool watches_clearance_ = false, controls_base_ = false;
};

}  // namespace grapnel
