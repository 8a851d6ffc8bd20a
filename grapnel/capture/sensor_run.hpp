#pragma once

/// @file
/// The sensors of a run: their readings at the clock's sample times, the values that laws receive, and their errors
/// (docs/theory, 18.1-18.4). Thread safety: one thread at a time.

#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/approach/target_motion.hpp"
#include "grapnel/capture/identification_run.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/sensor_reader.hpp"

namespace grapnel {

/// A series of readings in the time series of a run, in addition to the true values.
struct SensedSeries {
  std::string path, unit, description;
  std::vector<std::string> components;
};
/// All of them, in the order of SensorRun::sensed_values(). Empty without sensors.
std::vector<SensedSeries> sensed_series(const CaptureProblem& problem, const CaptureSystem& system);

class SensorRun : public SensorReader {
 public:
  /// All of these must outlive it. The problem has a clock.
  SensorRun(const CaptureProblem& problem, IdentificationRun& identification);

  /// A motion segment begins; `system` lives until it ends.
  void begin_piece(const CaptureSystem& system);

  /// The state at `time`, between two motion segments, with joint positions and the base's attitude as known to a law
  /// that takes its set point from them: from the reading due at `time`, otherwise from the last one. Other values, and
  /// those without a sensor, are the true ones. Takes no reading.
  State known_posture(const CaptureSystem& system, const State& truth, double time) const;
  /// A sample time at which only joints, gyro, attitude and wheels are read, in the current piece's system. Thread
  /// safety as read().
  void read_motion(double time, const State& truth, State& seen);

  bool needs_forces() const override;
  void read(const PhaseSample& sample, State& seen) override;
  const SensorReadings& readings() const override { return readings_; }

  /// A target's pose at the last reading of its relative pose, in the frame of the computation, if the reading is
  /// available at `time`; absent: no such sensor, or no reading yet.
  struct Fix {
    double time;
    TargetMotion motion;
  };
  std::optional<Fix> fix(std::size_t target, double time);

  /// The last sensor readings, series by series; NaN before the first reading.
  std::vector<std::vector<double>> sensed_values() const;
  std::vector<SensorReport> reports() const;

 private:
  // Values of a sensor that are read together, held until the next reading, and their errors.
  struct Channels {
    std::string name, unit;
    std::uint32_t sensor = 0;  // for the noise
    long every = 1;            // in sample times of the clock
    double sample_time = 0;    // [s]
    long taken = 0;            // readings so far
    std::vector<double> held;  // empty: none yet
    double sum = 0, squares = 0, largest = 0;
    long count = 0;
  };
  struct Pending {
    double usable, time;
    SensorReadings::Target reading;
    TargetMotion motion;
  };

  Channels channels(std::string name, std::string unit, double sample_time);
  bool due(const Channels& channels, long tick) const { return tick % channels.every == 0; }
  double normal(const Channels& channels, std::size_t channel) const;
  static void note(Channels& channels, double error);
  bool takes_reading_at(const Channels& channels, double time, double last_time) const;
  std::vector<double> joint_readings(const CaptureSystem& system, const State& truth) const;
  Quaterniond attitude_reading(const Rotationd& R_WB) const;
  void read_joints(long tick, double time, const State& truth, State& seen);
  void read_joint_rates(double time, const State& truth);
  void read_gyro(long tick, const State& truth, State& seen);
  void read_attitude(long tick, double time, const State& truth, State& seen);
  void read_wheels(long tick, const State& truth, State& seen);
  void read_wrists(long tick, const PhaseSample& sample);
  void read_targets(long tick, double time, const State& truth);
  void read_target(std::size_t sensor, double time, const State& truth);
  void let_arrive(double time);

  const CaptureProblem& problem_;
  const SensorSetup setup_;
  const double period_;
  IdentificationRun& identification_;
  const CaptureSystem* system_ = nullptr;
  std::optional<Channels> joints_, rates_, gyro_, attitude_, wheels_;
  double joints_time_ = 0, attitude_time_ = 0;  // of the last readings
  std::vector<double> last_position_;
  std::vector<Channels> forces_, torques_;                // per wrist sensor
  std::vector<Channels> positions_, turns_, velocities_;  // per relative pose sensor
  std::vector<std::deque<Pending>> pending_;              // likewise
  std::vector<std::optional<Fix>> fixes_;                 // likewise
  SensorReadings readings_;
};

}  // namespace grapnel
