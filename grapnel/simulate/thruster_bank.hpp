#pragma once

/// @file
/// Valves of thrusters: opening and closing, rise and fall of forces, and propellant used. A bank belongs to a run and
/// outlives the run's pieces, like ControlClock. Thread safety: one thread at a time.

#include <limits>
#include <optional>
#include <vector>

#include "grapnel/simulate/thruster_allocation.hpp"

namespace grapnel {

/// How thrusters realize a commanded torque.
struct ThrusterModulation {
  /// pulse_width: in each period of the control clock, each fires for the time that gives the commanded mean. schmitt:
  /// each is on or off, with hysteresis.
  enum class Kind { pulse_width, schmitt };
  Kind kind = Kind::pulse_width;
  /// Fractions of the minimum on-time (pulse_width) or of the force (schmitt): a thruster switches on if its command is
  /// at least level_on, off if it is at most level_off, and keeps its state between them.
  double level_on = 0.75, level_off = 0.25;
};

/// Settings of the thrusters that dump the wheels' momentum.
struct MomentumDumping {
  double above = 0;   // magnitude of the wheels' momentum at which dumping begins [N m s],
  double below = 0;   // and ends
  double torque = 0;  // mean over a period [N m]
};

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

}  // namespace grapnel
