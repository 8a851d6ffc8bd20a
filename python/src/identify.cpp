// Identification of a held body from measured rates.
#include <pybind11/stl.h>

#include <algorithm>
#include <limits>

#include "grapnel/identify/identify_target.hpp"
#include "grapnel/text/message_text.hpp"
#include "robot.hpp"

namespace grapnel::python {
namespace {

MeasuredBase base_named(const std::string& name) {
  if (name == "twist") return MeasuredBase::twist;
  if (name == "rotation") return MeasuredBase::rotation;
  throw py::value_error("base is " + in_quotes(name) + suggestion(name, {"twist", "rotation"}));
}

int frame_named(const Robot& robot, const std::string& name) {
  std::vector<std::string> names;
  for (const Frame& frame : robot.model().frames()) names.push_back(frame.name);
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end())
    throw py::value_error("frame is " + in_quotes(name) + suggestion(name, names) +
                          "; expected one of the robot's frames");
  return static_cast<int>(at - names.begin());
}

const char* word(Identified known) {
  switch (known) {
    case Identified::determined:
      return "determined";
    case Identified::ratio_only:
      return "ratio_only";
    case Identified::not_determined:
      break;
  }
  return "not_determined";
}

template <class Momentum6>
Momentum6 six(const double* x) {
  return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
}

py::array_t<double> numbers(const std::array<std::optional<double>, kInertialParameters>& values) {
  py::array_t<double> array(kInertialParameters);
  for (int i = 0; i < kInertialParameters; ++i)
    array.mutable_at(i) = values.at(static_cast<std::size_t>(i)).value_or(std::numeric_limits<double>::quiet_NaN());
  return array;
}

py::dict as_dictionary(const IdentifiedBody& body) {
  py::dict out;
  out["converged"] = body.converged, out["iterations"] = body.iterations;
  out["rank"] = body.rank, out["condition"] = body.condition, out["residual"] = body.residual;
  out["value"] = numbers(body.value), out["deviation"] = numbers(body.deviation);
  out["mass"] = word(body.mass), out["com"] = word(body.com), out["inertia"] = word(body.inertia);
  py::list unseen;
  for (const UnseenChange& change : body.unseen) unseen.append(unseen_text(change));
  out["unseen"] = unseen, out["impossible"] = body.impossible;
  return out;
}

py::dict identify(const Robot& robot, const std::string& frame, const py::object& q_given, const py::object& v_given,
                  const py::object& impulse_given, const std::string& base, const py::object& momentum_given,
                  double angular_velocity, double velocity, double joint_rate) {
  const Rows q = robot.coordinates(q_given), v = robot.velocities(v_given);
  const Rows impulse = impulse_given.is_none()
                           ? Rows("impulse", 6)
                           : Rows(impulse_given, "impulse", 6, "[angular; linear] since the first sample");
  const Cases cases = cases_of({&q, &v, &impulse});
  IdentificationTask task{robot.model(), frame_named(robot, frame), {}};
  task.base = base_named(base);
  task.noise = {angular_velocity, velocity, joint_rate};
  if (!momentum_given.is_none()) {
    const Rows momentum(momentum_given, "momentum", 6, "[angular; linear] at the first sample");
    if (momentum.is_batch()) throw py::value_error("momentum has shape " + momentum.shape() + ", expected (6,)");
    task.momentum = six<Momentumd>(momentum.row(0));
  }
  for (std::int64_t i = 0; i < cases.count; ++i) {
    MotionSample& sample = task.samples.emplace_back();
    sample.state = zero_state(robot.model());
    robot.put_coordinates(q, i, sample.state.q.data());
    std::copy_n(v.row(i), v.width(), sample.state.v.begin());
    sample.impulse = six<Impulsed>(impulse.row(i));
  }
  IdentifiedBody body;
  {
    const py::gil_scoped_release others_go_on;
    body = identify_target(task);
  }
  return as_dictionary(body);
}

}  // namespace

void bind_identify(py::class_<Robot, std::shared_ptr<Robot>>& robot, py::module_& module) {
  robot.def("holding", &Robot::holding, py::arg("q"));
  module.def("identify", &identify, py::arg("robot"), py::arg("frame"), py::arg("q"), py::arg("v"), py::arg("impulse"),
             py::arg("base"), py::arg("momentum"), py::arg("angular_velocity"), py::arg("velocity"),
             py::arg("joint_rate"));
  module.def("inertial_parameters", [] {
    std::vector<std::string> names;
    for (int i = 0; i < kInertialParameters; ++i) names.emplace_back(inertial_parameter_name(i));
    return names;
  });
}

}  // namespace grapnel::python
