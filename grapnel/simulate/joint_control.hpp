#pragma once

/// @file
/// Joint control: the table of control laws, and the laws themselves including joint friction, as templates for a
/// single capture (double) and for many in SIMD lanes (packs, grapnel/lanes/). A new law is a value of JointControl,
/// its row in kJointControls and its case in control_law::command().

#include <cstdint>
#include <string_view>

#include "grapnel/simulate/joint_trajectory.hpp"
#include "grapnel/spatial/scalar.hpp"

namespace grapnel {

/// The laws. A joint's sensor reads theta_m = theta + n and rate_m = rate + n'; the trajectory is (theta_d, rate_d, its
/// acceleration theta_dd_d).
///
/// pd: tau = kp (theta_d - theta_m) + kd (rate_d - rate_m) (4.1).
/// computed_torque: the torques that, including the base's response, give all joints under this control the
/// accelerations theta_dd_d + kd (rate_d - rate_m) + kp (theta_d - theta_m). The controller knows the model, its true
/// state and the external forces, but neither friction nor contacts between shapes: they disturb it.
/// prescribed: theta = theta_d - n exactly, with any torque.
/// controller: tau is the output of PhaseSetup::controller (controller.hpp).
/// impedance: a name in files only. A law of all joints (grapnel/control/) is the controller while it acts, else pd.
enum class JointControl : std::uint8_t { free, pd, computed_torque, prescribed, controller, impedance };

/// The output of a law: none; an effort, limited at the joint's limit; the acceleration that efforts of the model
/// produce, limited likewise; the motion itself; or an effort from a controller of all its joints, limited likewise.
enum class ControlOutput : std::uint8_t { none, effort, acceleration, motion, command };

struct JointControlLaw {
  JointControl control;
  ControlOutput output;
  bool reads_acceleration;         // of the trajectory
  std::string_view name_in_files;  // as a mode of tracking; empty: not available in files
};
inline constexpr JointControlLaw kJointControls[] = {
    {JointControl::free, ControlOutput::none, false, ""},
    {JointControl::prescribed, ControlOutput::motion, true, "ideal"},
    {JointControl::pd, ControlOutput::effort, false, "pd"},
    {JointControl::computed_torque, ControlOutput::acceleration, true, "computed_torque"},
    {JointControl::controller, ControlOutput::command, true, "controller"},
    {JointControl::impedance, ControlOutput::effort, false, "impedance"},
};

constexpr const JointControlLaw& law_of(JointControl control) {
  for (const JointControlLaw& law : kJointControls) {
    if (law.control == control) return law;
  }
  return kJointControls[0];
}
constexpr ControlOutput output_of(JointControl control) { return law_of(control).output; }
/// Whether a law has gains kp and kd.
constexpr bool has_gains(JointControl control) {
  return output_of(control) == ControlOutput::effort || output_of(control) == ControlOutput::acceleration;
}
/// Whether the output of a law is an effort within the joint's limit.
GRAPNEL_INLINE constexpr bool works_by_effort(ControlOutput output) {
  return output == ControlOutput::effort || output == ControlOutput::acceleration || output == ControlOutput::command;
}

namespace control_law {

// As for packs: b if either is NaN.
GRAPNEL_INLINE double min(double a, double b) { return a < b ? a : b; }
GRAPNEL_INLINE double max(double a, double b) { return a > b ? a : b; }

/// The reference of a joint less its sensor error n. Accelerations that a law commands are those of the trajectory,
/// since no sensor measures them.
template <class S>
GRAPNEL_INLINE BasicJointPoint<S> reference(ControlOutput output, const BasicJointPoint<S>& desired,
                                            const BasicJointPoint<S>& n) {
  return {desired.position - n.position, desired.rate - n.rate,
          output == ControlOutput::motion ? S(desired.acceleration - n.acceleration) : desired.acceleration};
}

/// The output of a law with gains, of the law's kind of output.
template <class S>
GRAPNEL_INLINE S command(JointControl control, const S& kp, const S& kd, const BasicJointPoint<S>& reference,
                         const S& position, const S& rate) {
  const S correction = kp * S(reference.position - position) + kd * S(reference.rate - rate);
  if (control == JointControl::computed_torque) return reference.acceleration + correction;
  return correction;  // (4.1)
}

/// An effort within the joint's limit; this order of arguments preserves NaN.
template <class S>
GRAPNEL_INLINE S within_limit(const S& effort, const S& limit) {
  return min(limit, max(S(-limit), effort));
}

/// Friction effort at a joint's rate. `slip`: returns tanh(rate / transition rate), called only with Coulomb friction.
template <class S, class Slip>
GRAPNEL_INLINE S friction(bool is_viscous, const S& viscous, bool has_coulomb, const S& coulomb, const S& rate,
                          Slip&& slip) {
  S resistance(0.0);
  if (is_viscous) resistance = viscous * rate;
  if (has_coulomb) resistance += coulomb * slip();
  return -resistance;
}

}  // namespace control_law
}  // namespace grapnel
