// Simultaneous motions of one model under given joint efforts.
#include "grapnel/lanes/rollout.hpp"

#include <pybind11/stl.h>

#include "grapnel/spatial/dispatch.hpp"
#include "grapnel/text/message_text.hpp"
#include "robot.hpp"

namespace grapnel::python {
namespace {

lanes::RolloutMethod method_named(const std::string& name) {
  if (name == "rk4") return lanes::RolloutMethod::rk4;
  if (name == "euler") return lanes::RolloutMethod::euler;
  throw py::value_error("method is " + in_quotes(name) + suggestion(name, {"rk4", "euler"}));
}

// Thread safety: immutable.
class RolloutOfRobot {
 public:
  RolloutOfRobot(std::shared_ptr<Robot> robot, double step, int substeps, const std::string& method,
                 const std::array<double, 3>& gravity, bool friction, bool hold_base)
      : robot_(std::move(robot)),
        rollout_(robot_->model(), setup(*robot_, step, substeps, method, gravity, friction, hold_base)) {}

  /// initial (n, nq + nv), control (n, steps, nu) or None with `steps`; states (n, steps, nq + nv), or (n, nq + nv) of
  /// the last.
  py::array_t<double> run(const py::object& initial_given, const py::object& control_given, py::ssize_t steps,
                          bool only_last, int threads) const {
    const py::ssize_t state = rollout_.state_size(), controls = rollout_.control_size();
    const auto initial = doubles(initial_given, "initial_state");
    if (initial.ndim() != 2 || initial.shape(1) != state)
      throw py::value_error("initial_state has shape " + shape_text(shape_of(initial)) + ", expected (n, " +
                            std::to_string(state) + "): q and v of n cases");
    check_finite(initial, "initial_state");
    check_quaternions(initial);
    const py::ssize_t cases = initial.shape(0);
    py::array_t<double, py::array::c_style | py::array::forcecast> control(std::vector<py::ssize_t>{0});
    if (!control_given.is_none()) {
      control = doubles(control_given, "control");
      if (control.ndim() != 3 || control.shape(0) != cases || control.shape(2) != controls)
        throw py::value_error("control has shape " + shape_text(shape_of(control)) + ", expected (" +
                              std::to_string(cases) + ", steps, " + std::to_string(controls) +
                              "): an effort per case, step and joint");
      check_finite(control, "control");
      steps = control.shape(1);
    }
    if (steps < 1) throw py::value_error("there are " + std::to_string(steps) + " steps; expected at least one");
    py::array_t<double> result(only_last ? std::vector<py::ssize_t>{cases, state}
                                         : std::vector<py::ssize_t>{cases, steps, state});
    const std::span<double> out(result.mutable_data(), static_cast<std::size_t>(result.size()));
    lanes::RolloutData data;
    data.cases = cases, data.steps = steps;
    data.initial = {initial.data(), static_cast<std::size_t>(initial.size())};
    data.control = {control.data(), static_cast<std::size_t>(control.size())};
    (only_last ? data.last : data.states) = out;
    run_interruptibly([&](const std::stop_token& stop) { rollout_.run(data, threads, stop); });
    return result;
  }

 private:
  static lanes::RolloutSetup setup(const Robot& robot, double step, int substeps, const std::string& method,
                                   const std::array<double, 3>& gravity, bool friction, bool hold_base) {
    lanes::RolloutSetup setup;
    setup.step = step, setup.substeps = substeps, setup.method = method_named(method);
    setup.gravity = {gravity[0], gravity[1], gravity[2]};
    setup.friction = friction;
    if (hold_base && robot.model().has_free_root(robot.root())) setup.held.push_back(robot.root());
    return setup;
  }
  void check_quaternions(const py::array_t<double>& initial) const {
    // The first numbers of a row are coordinates.
    const auto q = initial.attr("__getitem__")(
        py::make_tuple(py::slice(py::none(), py::none(), py::none()), py::slice(0, robot_->model().coordinates(), 1)));
    robot_->check_quaternions(Rows(q, "initial_state", robot_->model().coordinates(), "coordinates"));
  }

  std::shared_ptr<Robot> robot_;
  lanes::Rollout rollout_;
};

}  // namespace

void bind_rollout(py::module_& module) {
  py::class_<RolloutOfRobot>(module, "Rollout")
      .def(
          py::init<std::shared_ptr<Robot>, double, int, const std::string&, const std::array<double, 3>&, bool, bool>(),
          py::arg("robot"), py::arg("step"), py::arg("substeps"), py::arg("method"), py::arg("gravity"),
          py::arg("friction"), py::arg("hold_base"))
      .def("run", &RolloutOfRobot::run, py::arg("initial_state"), py::arg("control"), py::arg("steps"),
           py::arg("only_last"), py::arg("threads"));
  module.def(
      "instruction_set",
      [] {
        const auto set = lanes::best_instruction_set();
        return std::string(lanes::name(set.value_or(lanes::InstructionSet::one_lane)));
      },
      "The SIMD instruction set of rollouts and of functions of robots: 'avx512' (8 lanes), 'avx2' (4), 'sse2' (2) or "
      "'one_lane'. The environment variable GRAPNEL_LANES selects another one.");
}

}  // namespace grapnel::python
