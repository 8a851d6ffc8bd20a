// The fields of summary.json that report saturation, stability and rest.
#include <cmath>
#include <optional>

#include "grapnel/result/result_documents.hpp"

namespace grapnel {

template <>
const Type& type_of<SaturationReport::Actuator>() {
  using A = SaturationReport::Actuator;
  static constexpr Choice choices[] = {choice(A::wheel, "wheel"), choice(A::gyro, "gyro"),
                                       choice(A::gyros, "gyros"), choice(A::thruster, "thruster"),
                                       choice(A::joint, "joint"), choice(A::base_control, "base_control")};
  static constexpr Type type = enumeration<A>("SaturatedActuator", choices);
  return type;
}

template <>
const Type& type_of<SaturationReport::Quantity>() {
  using Q = SaturationReport::Quantity;
  static constexpr Choice choices[] = {
      choice(Q::rate, "rate", "of a wheel or gimbal."), choice(Q::torque, "torque", "of a motor or of base control."),
      choice(Q::effort, "effort", "of a joint's drive."),
      choice(Q::duty, "duty", "a thruster is on all the time and less is given than is commanded."),
      choice(Q::singularity, "singularity", "an array of gyros that is steered is near a singularity.")};
  static constexpr Type type = enumeration<Q>("SaturatedQuantity", choices);
  return type;
}

template <>
const Type& type_of<SaturationReport>() {
  using S = SaturationReport;
  static constexpr Field fields[] = {
      field<&S::actuator>("actuator", "kind of actuator"),
      field<&S::name>("name", "of the wheel, gyro, thruster or joint; of base control the axis `x`, `y` or `z`"),
      field<&S::quantity>("quantity", "saturated quantity."),
      field<&S::limit>("limit", "rad/s, N m, N or 1",
                       "limit of the quantity: the share of time 1 for a thruster; for a singularity the measure below "
                       "which the array is near it"),
      field<&S::first_time>("first_time", "s", "start of the first saturation"),
      field<&S::duration>("duration", "s", "total time at the limit, by integration steps"),
      field<&S::share>("share", "1", "duration over the simulated time of all phases of motion"),
      field<&S::at_end>("at_end", "whether the actuator was at its limit at the end of the run"),
  };
  static constexpr Type type = structure<S>("SaturationReport", "an actuator that was at its limit.", fields);
  return type;
}

template <>
const Type& type_of<ActuatorUse>() {
  using A = ActuatorUse;
  static constexpr Field fields[] = {
      field<&A::quantity>("quantity", "path of its time series"),
      field<&A::name>("name", "of the actuator"),
      field<&A::unit>("unit", "of the numbers below"),
      field<&A::largest>("largest", "unit", "largest magnitude"),
      field<&A::limit>("limit", "unit", "maximum magnitude"),
      field<&A::saturated>("saturated", "s", "total time at the limit, by integration steps"),
      field<&A::first_saturated>("first_saturated", "s", "start of the first saturation; 0 without any"),
  };
  static constexpr Type type =
      structure<A>("ActuatorUse", "an actuator of the base of a kind without its own report.", fields);
  return type;
}

template <>
const Type& type_of<TendonReport>() {
  using T = TendonReport;
  static constexpr Field fields[] = {
      field<&T::name>("name", "of the tendon"),
      field<&T::largest_tension>("largest_tension", "N", "largest tension"),
      field<&T::work>("work", "J", "work of the tendon on its joints, part of the motors' work in the ledger"),
      field<&T::excursion_before>("excursion_before", "m",
                                  "sum of moment arm times joint value where its first command begins"),
      field<&T::excursion_after>("excursion_after", "m", "the same where its last command ends"),
  };
  static constexpr Type type = structure<T>("TendonReport", "a tendon over all phases with its command.", fields);
  return type;
}

template <>
const Type& type_of<Stability>() {
  static constexpr Choice choices[] = {
      choice(Stability::unstable, "unstable",
             "a controlled rate oscillates and grows, oscillates without decay while its actuator saturates, or grows "
             "exponentially."),
      choice(Stability::not_evaluated, "not_evaluated",
             "no feedback, or neither instability nor decay is established."),
      choice(Stability::stable, "stable", "every controlled rate has decayed at the end of the phase.")};
  static constexpr Type type = enumeration<Stability>("Stability", choices);
  return type;
}

template <>
const Type& type_of<StabilityReport>() {
  using S = StabilityReport;
  static constexpr Field fields[] = {
      field<&S::phase>("phase", "phase of motion"),
      field<&S::verdict>("verdict", "verdict for the phase."),
      field<&S::reason>("reason", "reason for the verdict"),
      field<&S::of>("of", "decisive rate, `base x` or a joint's rate error; empty: none"),
      field<&S::period>("period", "s", "period of its oscillation at the end of the phase; 0: no oscillation"),
      field<&S::amplitude_before>("amplitude_before", "rad/s or m/s",
                                  "largest amplitude in the first third of the oscillation, or of the phase"),
      field<&S::amplitude_after>("amplitude_after", "rad/s or m/s", "largest amplitude in the last third"),
      field<&S::saturated_share>("saturated_share", "1",
                                 "share of the last third in which the actuators of this rate saturated"),
      field<&S::since>("since", "s",
                       "start of the growth, or of the saturated oscillation; null: the verdict is not `unstable`")
          .or_null(),
  };
  static constexpr Type type =
      structure<S>("StabilityReport", "stability of the control loops in one phase of motion.", fields);
  return type;
}

template <>
const Type& type_of<LoopMargin>() {
  using T = LoopMargin;
  static constexpr Field fields[] = {
      field<&T::channel>("channel", "the input whose loop is opened, while all others are closed"),
      field<&T::unit>("unit", "unit of the input"),
      field<&T::gain_maximum>("gain_maximum", "1",
                              "factor on the gains of the channel above which the loop is unstable; absent: no limit"),
      field<&T::gain_minimum>("gain_minimum", "1", "factor below which it is unstable; absent: no limit"),
      field<&T::gain_frequency>("gain_frequency", "rad/s", "of the oscillation at the factor that is nearest to 1"),
      field<&T::phase>("phase", "rad", "smallest phase margin, by magnitude; absent: the loop gain is nowhere 1"),
      field<&T::phase_frequency>("phase_frequency", "rad/s", "its frequency"),
      field<&T::delay>("delay", "s", "smallest added delay of the channel with which the loop is unstable"),
  };
  static constexpr Type type =
      structure<T>("LoopMargin", "margins of a channel of the scenario's controllers.", fields);
  return type;
}

template <>
const Type& type_of<LinearStability>() {
  using S = LinearStability;
  static constexpr Choice choices[] = {choice(S::stable, "stable"), choice(S::marginal, "marginal"),
                                       choice(S::unstable, "unstable"), choice(S::undecided, "not decided")};
  static constexpr Type type = enumeration<S>("LinearStability", choices);
  return type;
}

template <>
const Type& type_of<ControlLoopReport>() {
  using C = ControlLoopReport;
  static constexpr Field fields[] = {
      field<&C::time>("time", "s", "time of the linear model"),
      field<&C::phase>("phase", "phase of motion that begins or continues there"),
      field<&C::laws>("laws", "the laws that act"),
      field<&C::verdict>("verdict", "verdict of the eigenvalues, as of `grapnel linearize`"),
      field<&C::reason>("reason", "reason of the verdict, or why there is no closed loop"),
      field<&C::sampled>("sampled", "whether the laws are sampled"),
      field<&C::margins>("margins", "margins of each channel"),
      field<&C::margins_absent>("margins_absent", "why there are none; empty: there are"),
  };
  static constexpr Type type = structure<C>(
      "ControlLoopReport", "linear model of the scenario's controllers at the start or end of a phase.", fields);
  return type;
}

template <>
const Type& type_of<RestReport>() {
  using R = RestReport;
  static constexpr Field fields[] = {
      field<&R::at_rest>("at_rest", "whether all rates stayed below their limits from `time` to the end"),
      field<&R::time>("time", "s", "time from which they stayed below; null: they did not").or_null(),
      field<&R::angular_velocity>("angular_velocity", "rad/s", "angular velocity of the base, in W, at the end"),
      field<&R::angular_velocity_limit>("angular_velocity_limit", "rad/s", "post_impact.at_rest.angular_velocity"),
      field<&R::joint>("joint", "joint with the largest rate at the end; empty: joints are not evaluated"),
      field<&R::joint_rate>("joint_rate", "rad/s or m/s", "magnitude of that rate at the end"),
      field<&R::joint_rate_limit>("joint_rate_limit", "rad/s or m/s",
                                  "post_impact.at_rest.joint_rate; null: joints are not evaluated")
          .or_null(),
  };
  static constexpr Type type =
      structure<R>("RestReport", "whether the motion after the impact came to rest (post_impact.at_rest).", fields);
  return type;
}

}  // namespace grapnel
