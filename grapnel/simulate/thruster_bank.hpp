#pragma once

/// @file
/// Valves of thrusters: opening and closing, rise and fall of forces, and propellant used. A bank belongs to a run and
/// outlives the run's pieces, like ControlClock. Thread safety: one thread at a time.

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "grapnel/simulate/base_effector.hpp"
#include "grapnel/simulate/reaction_wheels.hpp"
#include "grapnel/simulate/thruster_allocation.hpp"

namespace grapnel {

class ThrusterBank {
 public:
  /// @throws std::invalid_argument if a direction is not a unit vector, a force or specific impulse is not positive, or
  /// a time is negative.
  ThrusterBank(std::vector<Thruster> thrusters, const Vector3d& about);

  std::size_t size() const { return thrusters_.size(); }
  const std::vector<Thruster>& thrusters() const { return thrusters_; }
  const ThrusterAllocation& allocation() const { return allocation_; }
  const Vector3d& about() const { return about_; }

  // --- Valves; times must not decrease ---

  /// Begins a motion segment at t. If the valves were not advanced up to then, as during a compliant impact, they were
  /// closed in between.
  void begin(double t, double same);
  /// Advances to the time t: due valves close, and the propellant used is added up. No edge lies between two calls
  /// (next_edge). Times that differ by at most `same` are equal.
  void advance(double t, double same);
  /// The first time after t, and before `end`, at which a valve closes, has been open for its minimum time, or a force
  /// has risen or fallen; otherwise `end`.
  double next_edge(double t, double end, double same) const;
  /// Opens a valve at the time of advance(). `for_`: until it closes automatically; infinite: until commanded. An open
  /// valve stays open.
  void open(std::size_t thruster, double for_ = std::numeric_limits<double>::infinity());
  void close(std::size_t thruster);
  bool is_open(std::size_t thruster) const { return valves_[thruster].open; }
  /// Whether it must stay open, at the time of advance().
  bool is_locked(std::size_t thruster) const;
  /// The remaining time of a locked valve [s].
  double locked_for(std::size_t thruster) const;

  /// Force at a time from advance() to the next edge, relative to full force [1].
  double level(std::size_t thruster, double t) const;

  /// Starts pulses by ThrusterModulation: pulse widths for the torque impulse of a period [N m s]. Returns their mean
  /// torque, as known to the controller [N m].
  Vector3d pulse(const Vector3d& torque_impulse, double period, const ThrusterModulation& modulation);
  /// Opens every valve for its share of a period (empty: none), at least for its minimum time; one with a share of 1
  /// stays open. Closes the others.
  void pulse_each(std::span<const double> shares, double period);
  /// Switches thrusters on or off for a torque [N m].
  void trigger(const Vector3d& torque, const ThrusterModulation& modulation);
  /// Positive while trigger() would change nothing.
  double trigger_margin(const Vector3d& torque, const ThrusterModulation& modulation) const;

  // --- Use, up to t, a time as in level() ---

  struct Use {
    long firings = 0;
    double on_time = 0;  // of the valve [s]
    double impulse = 0;  // [N s]
  };
  Use use(std::size_t thruster, double t) const;
  Use use(std::size_t thruster) const { return use(thruster, time_); }
  double propellant(double t) const;  // of all [kg]
  double time() const { return time_; }

  // --- Dumping, and the clock's periods ---

  /// The index of the period whose pulses began last; -1: none.
  long last_period = -1;
  /// The mean torque of its pulses, for compensation by wheels [N m].
  Vector3d mean_torque = Vector3d::zero();
  /// Starts or ends dumping by the wheels' momentum. Returns whether it is active.
  bool dumps(double momentum, const MomentumDumping& dumping);
  struct Dumped {
    bool active = false;
    long begun = 0;
    double first_begin = 0, last_end = 0;  // [s]
    double time = 0;                       // active time, without the last interval if that is active [s]
    double since = 0;                      // start of the last interval [s]
    double largest_momentum = 0;           // of the wheels, at the start of pulses [N m s]
  };
  const Dumped& dumped() const { return dumped_; }

 private:
  struct Valve {
    bool open = false;
    double since = 0;                                         // time of the last edge [s]
    double level = 0;                                         // at that time
    double opened = 0;                                        // [s]
    double closes = std::numeric_limits<double>::infinity();  // [s]
    bool pulsed = false;                                      // in the last period: for the hysteresis of pulses
    Use use;
  };
  double until_steady(const Valve& valve, const Thruster& thruster) const;

  std::vector<Thruster> thrusters_;
  Vector3d about_ = Vector3d::zero();
  ThrusterAllocation allocation_;
  std::vector<Valve> valves_;
  double time_ = 0;
  bool begun_ = false;
  Dumped dumped_;
};

/// How thrusters are commanded.
struct ThrusterCommands {
  ThrusterModulation modulation = {};
  /// Dumping of the momentum of these wheels, by pulse widths; absent: the thrusters give the commanded torque.
  std::optional<MomentumDumping> dumping = {};
  std::vector<ReactionWheel> dumped = {};
  bool one_by_one = false;  // a controller commands each valve
};

/// Thrusters as actuators of the base: their wrenches act on it, and valves switch at events.
class ThrusterEffector final : public BaseEffector {
 public:
  /// `clock`: of the commands; null: the thrusters switch by the state.
  ThrusterEffector(std::shared_ptr<ThrusterBank> bank, ThrusterCommands commands, std::shared_ptr<ControlClock> clock);

  const ThrusterBank& bank() const { return *bank_; }
  /// Forces in the last evaluation [N].
  std::span<const double> thrusts() const { return thrusts_; }
  /// See BaseActuation::thrust_at().
  Wrenchd thrust_at(double t) const;

  bool drives() const override { return !commands_.dumping; }
  std::size_t wrench_count() const override { return bank_->size(); }
  void push(double t, int root, const Posed& X_WB, std::span<ExternalWrench> wrenches) override;
  void drive(const BaseMoment& at, const BaseCommand& command, std::span<double> effort,
             std::span<double> force) override;
  void add_beside(const BaseMoment& at, const Vector3d& torque, std::span<double> effort,
                  std::span<double> beside) override;
  const Vector3d& given() const override { return given_; }
  void begin(double t, double same) override;
  void reach(double t) override { bank_->advance(t, same_time_); }
  double next_edge(double t, double end) const override { return bank_->next_edge(t, end, same_time_); }
  bool switches() const override { return true; }
  double margin(std::span<const double> v, const Evaluation& evaluate) override;
  void choose_modes(double t, std::span<const double> v, const Evaluation& evaluate) override;

 private:
  void evaluate_thrusts(double t);
  void pulse_in_period(double period);

  std::shared_ptr<ThrusterBank> bank_;
  ThrusterCommands commands_;
  WheelArray dumped_;
  std::shared_ptr<ControlClock> clock_;
  double same_time_ = 0;
  std::vector<double> thrusts_;
  Vector3d torque_ = Vector3d::zero();         // commanded
  Vector3d thrust_torque_ = Vector3d::zero();  // about the bank's point
  Vector3d given_ = Vector3d::zero();          // the same in the last drive()
  Wrenchd thrust_ = Wrenchd::zero();           // about the root's origin, in its axes
};

}  // namespace grapnel
