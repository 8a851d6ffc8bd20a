#pragma once

/// @file
/// Keeps the books of a run: momentum and energy of every sample, body by body from poses and twists, against what was
/// there at the start and what has been put in since. Thread safety: one thread at a time.

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/result/ledger.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {

/// Momentum and energy of the whole system at one instant, in W.
struct SystemBooks {
  Momentumd about_origin;     // total, about the world's origin
  Vector3d com;               // of the system
  Momentumd about_com;        // total, about the system's centre of mass
  double kinetic_energy = 0;  // [J]
  double linear_scale = 0;    // sum |m v|
  double angular_scale = 0;   // sum (|I w| + |r x m v|), r from the system's centre of mass
};
SystemBooks system_books(const Model& model, const Kinematics& kinematics, const State& state);

/// Momentum of some bodies, angular about `p_W`, in W: a target that hangs on an arm still has its own.
Momentumd group_momentum(const Model& model, const Kinematics& kinematics, std::span<const int> bodies,
                         const Vector3d& p_W);

/// What the books need of a phase that somebody else has looked at, as closely as it deserves.
struct PhaseMeasures {
  SystemBooks start;                // as the phase began
  double linear_deviation = 0;      // largest |p(t) - p(start) - external impulse| [N s]
  double angular_deviation = 0;     // the same of the angular momentum, about the system's centre of mass [N m s]
  double work_energy_residual = 0;  // largest |T(t) - T(start) - work of motors, friction and external forces| [J]
  LedgerScale scale;                // largest in the phase
};

class Bookkeeper {
 public:
  /// A phase begins. In a controlled phase motors work and the work-energy balance is kept; in another the energy
  /// itself.
  void begin_phase(bool controlled);
  /// One sample; the first ever defines what is conserved.
  void sample(const SystemBooks& books, const PhaseIntegrals& integrals);
  /// Instead of all samples of a phase: its measures. Deviations add to those that there were at its start.
  void take(const PhaseMeasures& measures);
  /// Whether there has been any sample.
  bool started() const { return started_; }
  /// An instant between phases: momentum is checked, energy may jump.
  void instant(const SystemBooks& books);
  /// The phase's last integrals, so that the next phase goes on from there.
  void end_phase(const PhaseIntegrals& integrals);
  /// Momentum that enters at once from outside: the ground's impulse in an impact, or a target put elsewhere by
  /// contact.gap: translate_target (which is no dynamics). About the world's origin.
  void enter(const Momentumd& momentum);

  /// The rows every run has.
  void write(Ledger& ledger) const;

 private:
  struct Deviation {
    double linear, angular;
  };
  Deviation check_momentum(const SystemBooks& books, const Momentumd& entered);

  bool started_ = false;
  bool controlled_ = false;
  bool any_controlled_ = false, any_uncontrolled_ = false;
  bool phase_started_ = false;
  double phase_energy_ = 0;
  Momentumd expected_ = Momentumd::zero();                          // about the world's origin, at the phase's start
  double linear_ = 0, angular_ = 0, work_energy_ = 0, energy_ = 0;  // largest deviations
  LedgerScale scale_;
};

}  // namespace grapnel
