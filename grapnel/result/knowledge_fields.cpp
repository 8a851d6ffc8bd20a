// The fields of summary.json about the knowledge of the on-board computer: sensor readings, estimates of targets,
// replanning, identification.
#include "grapnel/result/result_documents.hpp"

namespace grapnel {

template <>
const Type& type_of<SensorReport>() {
  using S = SensorReport;
  static constexpr Field fields[] = {
      field<&S::sensor>("sensor", "name of the sensor, such as `joint position`, `gyro` or `force left`"),
      field<&S::unit>("unit", "unit of the errors; rad stands for m if a joint is prismatic"),
      field<&S::sample_time>("sample_time", "s", "between readings"),
      field<&S::readings>("readings", "1", "number of values read: instants times channels times components"),
      field<&S::mean_error>("mean_error", "`unit`", "mean of reading minus true value"),
      field<&S::rms_error>("rms_error", "`unit`", "root mean square of that error"),
      field<&S::largest_error>("largest_error", "`unit`", "largest magnitude of that error"),
  };
  static constexpr Type type = structure<S>(
      "SensorReport", "readings of one sensor compared with the true values, at the sample times.", fields);
  return type;
}

template <>
const Type& type_of<EstimateReport>() {
  using E = EstimateReport;
  static constexpr Field fields[] = {
      field<&E::target>("target", "name of the target"),
      field<&E::position_error>("position_error", "m",
                                "distance of the estimated origin of the target frame from the true origin"),
      field<&E::orientation_error>("orientation_error", "rad", "angle between both frames"),
      field<&E::velocity_error>("velocity_error", "m/s", "error of the velocity of the origin"),
      field<&E::angular_velocity_error>("angular_velocity_error", "rad/s", "error of the angular velocity"),
  };
  static constexpr Type type =
      structure<E>("EstimateReport", "error of the estimate of a target at one instant.", fields);
  return type;
}

template <>
const Type& type_of<NavigationReport>() {
  using N = NavigationReport;
  static constexpr Field fields[] = {
      field<&N::time>("time", "s", "time of planning; the first plan precedes the approach"),
      field<&N::found>("found", "whether a plan was found; if not, the previous plan continues"),
      field<&N::rhs_evaluations>("rhs_evaluations", "1", "evaluations of the base's motion while planning"),
      field<&N::estimates>("estimates", "estimates of the targets, which the plan uses"),
      field<&N::failure>("failure", "cause if no plan was found; empty otherwise"),
  };
  static constexpr Type type = structure<N>(
      "NavigationReport", "a plan of the approach, or of its remainder, and the estimates that it uses.", fields);
  return type;
}

template <>
const Type& type_of<IdentifiedParameter>() {
  using P = IdentifiedParameter;
  static constexpr Field fields[] = {
      field<&P::name>("name",
                      "`mass`, `com_x` ..., `inertia_xx` ..., in the target's frame; inertia about the centre of mass"),
      field<&P::unit>("unit", "unit of the values"),
      field<&P::value>("value", "`unit`", "null: not determined").or_null(),
      field<&P::deviation>("deviation", "`unit`", "standard deviation; null: not determined, or no noise was stated")
          .or_null(),
      field<&P::truth>("truth", "`unit`", "value of the simulated target"),
      derived<[](const P& p) { return p.error(); }>("error", "`unit`", "value minus true value").or_null(),
  };
  static constexpr Type type =
      structure<P>("IdentifiedParameter", "one of the ten inertial parameters of a body.", fields);
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
      field<&I::target>("target", "target that is identified"),
      field<&I::begin>("begin", "s", "start of the samples"),
      field<&I::end>("end", "s", "end of the samples"),
      field<&I::ended>("ended", "`done`. `released`: the target was released first. `running`: the run ended first"),
      field<&I::samples>("samples", "1", "number of sensor samples"),
      field<&I::converged>("converged", "whether the iteration on weights and rates converged"),
      field<&I::rank>("rank", "1", "number of parameters, of ten, that the motion determined"),
      field<&I::condition>("condition", "1", "largest over smallest significant singular value"),
      field<&I::residual>("residual", "1",
                          "near 1 if the stated noise is correct; rounding error if there is no noise"),
      field<&I::mass>("mass",
                      "`determined`; `ratio_only`: determined up to one factor, which also affects other parameters; "
                      "`not_determined`"),
      field<&I::com>("com", "status of the centre of mass, likewise"),
      field<&I::inertia>("inertia", "status of the inertia, likewise"),
      field<&I::parameters>("parameters", "the ten parameters, with the true values"),
      field<&I::unseen>("unseen", "changes of the parameters that no measurement detects"),
      field<&I::impossible>("impossible",
                            "reason for which no body has these parameters; empty: they are physically possible"),
      field<&I::used_from>("used_from", "s", "time from which control laws used the estimate; absent: they did not"),
  };
  static constexpr Type type =
      structure<I>("IdentificationReport",
                   "mass, centre of mass and inertia of a held target, as identified from sensor readings.", fields);
  return type;
}

}  // namespace grapnel
