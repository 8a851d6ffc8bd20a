#pragma once

/// @file
/// Valves of thrusters: when they open and close, how their forces rise and fall, and what they have used. It belongs
/// to a run and outlives the run's pieces, as ControlClock does. Thread safety: one thread at a time.

#include <limits>
#include <optional>
#include <vector>

#include "grapnel/simulate/thruster_allocation.hpp"

namespace grapnel {

/// How thrusters give a torque that is asked for.
struct ThrusterModulation {
  /// pulse_width: in every period of the control clock each fires for the time that gives what is asked on the average.
  /// schmitt: each is on or off, with hysteresis.
  enum class Kind { pulse_width, schmitt };
  Kind kind = Kind::pulse_width;
  /// Shares of the least time on (pulse_width) or of the force (schmitt): a thruster that is asked for level_on or more
  /// goes on, for level_off or less off, and stays as it is in between.
  double level_on = 0.75, level_off = 0.25;
};

/// Thrusters take the wheels' momentum out.
struct MomentumDumping {
  double above = 0;   // of the size of the wheels' momentum: where it begins [N m s],
  double below = 0;   // and ends
  double torque = 0;  // mean over a period [N m]
};

class ThrusterBank {
 public:
  /// @throws std::invalid_argument if a direction is no unit vector, a force or specific impulse not positive, or a
  /// time negative.
  ThrusterBank(std::vector<Thruster> thrusters, const Vector3d& about);

  std::size_t size() const { return thrusters_.size(); }
  const std::vector<Thruster>& thrusters() const { return thrusters_; }
  const ThrusterAllocation& allocation() const { return allocation_; }
  const Vector3d& about() const { return about_; }

  // --- Valves; times do not fall ---

  /// A piece of motion begins at t. If nobody has moved the valves until then, as during an impact in time, they have
  /// been closed.
  void begin(double t, double same);
  /// The time is t: valves whose time has come close, and what was used meanwhile is counted. Between two calls no edge
  /// lies (next_edge). Times that differ by up to `same` are one.
  void advance(double t, double same);
  /// The first time after t, and before `end`, at which a valve is to close, has been open for its least time, or a
  /// force has risen or fallen; else `end`.
  double next_edge(double t, double end, double same) const;
  /// Now, at the time of advance(). `for_`: until it closes by itself; infinite: until it is told. One that is open
  /// stays open.
  void open(std::size_t thruster, double for_ = std::numeric_limits<double>::infinity());
  void close(std::size_t thruster);
  bool is_open(std::size_t thruster) const { return valves_[thruster].open; }
  /// Whether it has to stay open, at the time of advance().
  bool is_locked(std::size_t thruster) const;
  /// For how long yet, of one that is locked [s].
  double locked_for(std::size_t thruster) const;

  /// Force at a time from advance() to the next edge, over that at full [1].
  double level(std::size_t thruster, double t) const;

  /// By ThrusterModulation: pulse widths for the torque impulse of a period [N m s], beginning now. What they give of
  /// it on the average, as the controller knows it [N m].
  Vector3d pulse(const Vector3d& torque_impulse, double period, const ThrusterModulation& modulation);
  /// Every valve opens now, for its share of a period (empty: none does), at least for its least time; one with a share
  /// of 1 stays open. Closes the others.
  void pulse_each(std::span<const double> shares, double period);
  /// On or off for a torque [N m], now.
  void trigger(const Vector3d& torque, const ThrusterModulation& modulation);
  /// Positive while trigger() would change nothing.
  double trigger_margin(const Vector3d& torque, const ThrusterModulation& modulation) const;

  // --- What they have used, until t, a time as in level() ---

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

  /// The number of the period whose pulses have begun last; -1: none.
  long last_period = -1;
  /// What its pulses give on the average, for those who counter it [N m].
  Vector3d mean_torque = Vector3d::zero();
  /// Dumping, by a momentum of the wheels. Whether it goes on.
  bool dumps(double momentum, const MomentumDumping& dumping);
  struct Dumped {
    bool active = false;
    long begun = 0;
    double first_begin = 0, last_end = 0;  // [s]
    double time = 0;                       // in which it went on, but for the last one if that is active [s]
    double since = 0;                      // of the last one [s]
    double largest_momentum = 0;           // of the wheels, as pulses begin [N m s]
  };
  const Dumped& dumped() const { return dumped_; }

 private:
  struct Valve {
    bool open = false;
    double since = 0;                                         // of the last edge [s]
    double level = 0;                                         // then
    double opened = 0;                                        // [s]
    double closes = std::numeric_limits<double>::infinity();  // [s]
    bool pulsed = false;                                      // in the last period: hysteresis of pulses
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
