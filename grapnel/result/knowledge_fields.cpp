// The fields of summary.json that say what the on-board computer knew: readings of sensors, estimates of targets,
// replanning, identification.
#include "grapnel/result/result_documents.hpp"

namespace grapnel {

template <>
const Type& type_of<SensorReport>() {
  using S = SensorReport;
  static constexpr Field fields[] = {
      field<&S::sensor>("sensor", "as `joint position`, `gyro` or `force left`"),
      field<&S::unit>("unit", "of the errors; rad stands for m where a joint is prismatic"),
      field<&S::sample_time>("sample_time", "s", "between readings"),
      field<&S::readings>("readings", "1", "numbers read: instants times channels times components"),
      field<&S::mean_error>("mean_error", "`unit`", "mean of reading less truth"),
      field<&S::rms_error>("rms_error", "`unit`", "root of its mean square"),
      field<&S::largest_error>("largest_error", "`unit`", "largest of either sign"),
  };
  static constexpr Type type =
      structure<S>("SensorReport", "readings of one sensor against the truth, at the instants of reading.", fields);
  return type;
}

template <>
const Type& type_of<EstimateReport>() {
  using E = EstimateReport;
  static constexpr Field fields[] = {
      field<&E::target>("target", "that is estimated"),
      field<&E::position_error>("position_error", "m", "distance of the estimated target frame's origin from the true"),
      field<&E::orientation_error>("orientation_error", "rad", "angle between both frames"),
      field<&E::velocity_error>("velocity_error", "m/s", "of the origin's velocity"),
      field<&E::angular_velocity_error>("angular_velocity_error", "rad/s", "of the angular velocity"),
  };
  static constexpr Type type =
      structure<E>("EstimateReport", "how far the estimate of a target is from the truth, at one instant.", fields);
  return type;
}

template <>
const Type& type_of<NavigationReport>() {
  using N = NavigationReport;
  static constexpr Field fields[] = {
      field<&N::time>("time", "s", "when it was planned; the first before the approach begins"),
      field<&N::found>("found", "whether there is such a motion; if not, the plan before stays"),
      field<&N::rhs_evaluations>("rhs_evaluations", "1", "that planning took"),
      field<&N::estimates>("estimates", "of the targets, on which it was planned"),
      field<&N::failure>("failure", "why there is none; empty otherwise"),
  };
  static constexpr Type type = structure<N>(
      "NavigationReport", "a plan of the approach, or of what is left of it, and the estimates it rests on.", fields);
  return type;
}

template <>
const Type& type_of<IdentifiedParameter>() {
  using P = IdentifiedParameter;
  static constexpr Field fields[] = {
      field<&P::name>("name",
                      "`mass`, `com_x` ..., `inertia_xx` ..., in the target's frame, the inertia about the "
                      "centre of mass"),
      field<&P::unit>("unit", "of the numbers"),
      field<&P::value>("value", "`unit`", "null: not determined").or_null(),
      field<&P::deviation>("deviation", "`unit`", "standard; null: not determined, or no noise was stated").or_null(),
      field<&P::truth>("truth", "`unit`", "that of the simulated target"),
      derived<[](const P& p) { return p.error(); }>("error", "`unit`", "value less truth").or_null(),
  };
  static constexpr Type type =
      structure<P>("IdentifiedParameter", "one of the ten numbers by which a body resists motion.", fields);
  return type;
}

template <>
const Type& type_of<IdentificationEnd>() {
  static constexpr Choice choices[] = {choice(IdentificationEnd::running, "running"),
                                       choice(IdentificationEnd::done, "done"),
                                       choice(IdentificationEnd::released, "released")};
  static constexpr Type type = enumeration<IdentificationEnd>("IdentificationEnd", choices);
  return type;
}

template <>
const Type& type_of<IdentificationReport>() {
  using I = IdentificationReport;
  static constexpr Field fields[] = {
      field<&I::target>("target", "that is identified"),
      field<&I::begin>("begin", "s", "of the samples"),
      field<&I::end>("end", "s", "of the samples"),
      field<&I::ended>("ended", "`done`. `released`: the target was let go before. `running`: the run ended before"),
      field<&I::samples>("samples", "1", "instants at which sensors were read"),
      field<&I::converged>("converged", "whether the iteration on weights and rates did"),
      field<&I::rank>("rank", "1", "of ten: how many numbers the motion has shown"),
      field<&I::condition>("condition", "1", "largest over smallest singular value that counts"),
      field<&I::residual>("residual", "1", "near 1 if the noise is what is stated; without noise it is rounding's"),
      field<&I::mass>("mass",
                      "`determined`; `ratio_only`: known but for one number, on which others depend too; "
                      "`not_determined`"),
      field<&I::com>("com", "likewise, of the centre of mass"),
      field<&I::inertia>("inertia", "likewise"),
      field<&I::parameters>("parameters", "the ten numbers, beside the truth"),
      field<&I::unseen>("unseen", "changes of the parameters that no measurement shows, in words"),
      field<&I::impossible>("impossible", "why no body has these parameters; empty: one can have them"),
      field<&I::used_from>("used_from", "s", "when laws began to work with the estimate; absent: they did not"),
  };
  static constexpr Type type = structure<I>(
      "IdentificationReport", "mass, centre of mass and inertia of a held target, as the sensors show them.", fields);
  return type;
}

}  // namespace grapnel
