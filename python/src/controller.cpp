#include "controller.hpp"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <map>

#include "arrays.hpp"
#include "grapnel/plugin/plugin_controller.hpp"

namespace grapnel::python {
namespace {

// ---- Arguments of update() ----

// A copy, which the controller may keep.
py::array_t<double> copied(const double* data, py::ssize_t count) { return py::array_t<double>(count, data); }

struct Input {
  double time;
  int piece, joints;
  py::array_t<double> position, rate, desired_position, desired_rate, desired_acceleration, base_position,
      base_quaternion_wxyz, base_velocity, base_angular_velocity;
  explicit Input(const grapnel_controller_input& in)
      : time(in.time),
        piece(in.piece),
        joints(in.joints),
        position(copied(in.position, joints)),
        rate(copied(in.rate, joints)),
        desired_position(copied(in.desired_position, joints)),
        desired_rate(copied(in.desired_rate, joints)),
        desired_acceleration(copied(in.desired_acceleration, joints)),
        base_position(copied(in.base_position, 3)),
        base_quaternion_wxyz(copied(in.base_quaternion_wxyz, 4)),
        base_velocity(copied(in.base_velocity, 3)),
        base_angular_velocity(copied(in.base_angular_velocity, 3)) {}
};

struct Access {
  const grapnel_controller_access* access;  // null: after update()
  int base_velocities;                      // 6, or 0 for a base fixed to the world

  const grapnel_controller_access& now() const {
    if (!access) throw std::runtime_error("the model is accessible only during update()");
    return *access;
  }
  int velocities() const { return now().velocities(now().context); }
  py::array_t<double> mass_matrix() const {
    const int n = velocities();
    py::array_t<double> H({n, n});
    check(now().mass_matrix(now().context, H.mutable_data()), "H");
    return H;
  }
  py::array_t<double> bias() const {
    py::array_t<double> C(velocities());
    check(now().bias(now().context, C.mutable_data()), "C");
    return C;
  }
  py::array_t<double> momentum() const {
    py::array_t<double> p(6);
    check(now().momentum(now().context, p.mutable_data()), "p");
    return p;
  }
  py::array_t<double> generalized_jacobian(const std::string& frame) const {
    // Large enough for a base fixed to the world, which has no velocities.
    std::vector<double> J(static_cast<std::size_t>(6 * velocities()));
    if (now().generalized_jacobian(now().context, frame.c_str(), J.data()) != 0)
      throw py::key_error("the robot has no end-effector '" + frame + "'");
    const py::ssize_t columns = velocities() - base_velocities;
    py::array_t<double> shaped({py::ssize_t{6}, columns});
    std::copy_n(J.begin(), 6 * columns, shaped.mutable_data());
    return shaped;
  }
  static void check(int failed, const char* what) {
    if (failed != 0) throw std::runtime_error(std::string("the model cannot compute its ") + what);
  }
};

struct Output {
  py::array_t<double> effort, base_torque;
  explicit Output(int joints) : effort(zeros(joints)), base_torque(zeros(3)) {}
  static py::array_t<double> zeros(py::ssize_t count) {
    py::array_t<double> array(count);
    std::fill_n(array.mutable_data(), count, 0.0);
    return array;
  }
  static void assign(py::array_t<double>& array, const py::handle& value, const char* name) {
    const auto given = doubles(value, name);
    if (given.ndim() != 1 || given.shape(0) != array.shape(0))
      throw py::value_error(std::string(name) + " has shape " + shape_text(shape_of(given)) + ", expected " +
                            shape_text(shape_of(array)));
    std::copy_n(given.data(), array.size(), array.mutable_data());
  }
};

struct Setup {
  py::object parameters, model;
  int joints;
  double period, delay;
  bool base_torque;
};

// ---- The interpreter ----

// Threads inside controller calls, with their call depth. Protected by the interpreter's lock.
std::map<unsigned long, int>& threads_inside() {
  static std::map<unsigned long, int> threads;
  return threads;
}

// Python's lock on a thread of the library. After the interpreter has ended there is no lock: the thread blocks here
// until the process ends, as in Unlocked.
class Locked {
 public:
  Locked() noexcept {
    try {
      if (Py_IsInitialized() != 0) {
        state_ = PyGILState_Ensure();
        ++threads_inside()[PyThread_get_thread_ident()];
        return;
      }
    } catch (...) {
    }
    for (;;) ::pause();
  }
  ~Locked() {
    const auto own = threads_inside().find(PyThread_get_thread_ident());
    if (own != threads_inside().end() && --own->second == 0) threads_inside().erase(own);
    PyGILState_Release(state_);
  }
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;

 private:
  PyGILState_STATE state_;
};

// ---- A controller with the C interface ----

// The last line of the traceback, and its location.
std::string last_line(py::error_already_set& error) {
  const py::object lines = py::module_::import("traceback").attr("format_exception_only")(error.type(), error.value());
  std::string text = py::str(lines.attr("__getitem__")(-1).attr("strip")());
  py::object trace = error.trace() ? py::reinterpret_borrow<py::object>(error.trace()) : py::none();
  while (!trace.is_none() && !trace.attr("tb_next").is_none()) trace = trace.attr("tb_next");
  if (trace.is_none()) return text;
  const py::object file =
      py::module_::import("os.path").attr("basename")(trace.attr("tb_frame").attr("f_code").attr("co_filename"));
  return text + " (" + std::string(py::str(file)) + ", line " + std::string(py::str(trace.attr("tb_lineno"))) + ")";
}

struct Instance {
  py::object controller;
  int base_velocities = 6;
  std::string error;
};
Instance& at(void* instance) { return *static_cast<Instance*>(instance); }

// Runs `call` under the lock. Returns 0, or 1 with the cause in `error`. All Python objects are released before the
// lock.
template <class Call>
int in_python(std::string& error, const Call& call) {
  const Locked locked;
  try {
    call();
    return 0;
  } catch (py::error_already_set& raised) {
    error = last_line(raised);
  } catch (const std::exception& thrown) {
    error = thrown.what();
  }
  return 1;
}

// The object of which create() makes an instance; create() runs on the thread that requests it.
thread_local const py::object* t_given = nullptr;

int create(const grapnel_controller_setup* setup, void** instance, char* error, std::size_t error_size) {
  std::string why;
  const int failed = in_python(why, [&] {
    auto own = std::make_unique<Instance>();
    own->controller = PyType_Check(t_given->ptr()) ? (*t_given)() : *t_given;
    const py::object loads = py::module_::import("json").attr("loads");
    const py::object model = loads(setup->model);
    own->base_velocities = model["base"]["is_free"].cast<bool>() ? 6 : 0;
    if (py::hasattr(own->controller, "create"))
      own->controller.attr("create")(
          Setup{loads(setup->parameters), model, setup->joints, setup->period, setup->delay, setup->base_torque != 0});
    *instance = own.release();
  });
  if (failed != 0) std::snprintf(error, error_size, "%s", why.c_str());
  return failed;
}

int reset(void* instance, double time) {
  return in_python(at(instance).error, [&] {
    if (py::hasattr(at(instance).controller, "reset")) at(instance).controller.attr("reset")(time);
  });
}

int update(void* instance, const grapnel_controller_input* input, const grapnel_controller_access* access,
           grapnel_controller_output* output) {
  return in_python(at(instance).error, [&] {
    const py::object seen = py::cast(Input(*input)), said = py::cast(Output(input->joints)),
                     model = py::cast(Access{access, at(instance).base_velocities});
    struct Ends {
      Access& access;
      ~Ends() { access.access = nullptr; }
    } const ends{model.cast<Access&>()};
    const py::object returned = at(instance).controller.attr("update")(seen, model, said);
    if (!returned.is_none())
      throw py::type_error("update() returned " + std::string(py::str(py::type::of(returned))) +
                           "; expected None: assign commands to output.effort and output.base_torque");
    const auto& out = said.cast<const Output&>();
    std::copy_n(out.effort.data(), input->joints, output->effort);
    std::copy_n(out.base_torque.data(), 3, output->base_torque);
  });
}

void destroy(void* instance) {
  const Locked locked;
  delete static_cast<Instance*>(instance);
}

const char* last_error(void* instance) { return at(instance).error.c_str(); }

constexpr grapnel_controller_plugin kFunctions = {sizeof(grapnel_controller_plugin),
                                                  GRAPNEL_CONTROLLER_VERSION,
                                                  create,
                                                  reset,
                                                  update,
                                                  nullptr,
                                                  nullptr,
                                                  destroy,
                                                  last_error};

class PythonControllers final : public ControllerSource {
 public:
  PythonControllers(py::object given, const std::string& name)
      : given_(std::move(given)),
        functions_(std::make_shared<const ControllerPlugin>(kFunctions, "the Python controller '" + name + "'")) {}

  std::shared_ptr<Controller> make(const ControlTiming& timing, const std::string& parameters, ControlledRobot robot,
                                   const Model& model) const override {
    t_given = &given_;
    return std::make_shared<PluginController>(functions_, timing, parameters, std::move(robot), model);
  }

 private:
  py::object given_;
  std::shared_ptr<const ControllerPlugin> functions_;
};

}  // namespace

std::shared_ptr<const ControllerSource> python_controllers(const py::object& given, const std::string& name) {
  return std::make_shared<const PythonControllers>(given, name);
}

void interrupt_controllers() {
  for (const auto& [thread, depth] : threads_inside()) {
    if (thread != PyThread_get_thread_ident()) PyThreadState_SetAsyncExc(thread, PyExc_KeyboardInterrupt);
  }
}

void bind_controllers(py::module_& module) {
  py::class_<Setup>(module, "ControllerSetup", "Argument of a controller's create(): a description of the run.")
      .def_readonly("parameters", &Setup::parameters, "control.parameters of the scenario: a dictionary.")
      .def_readonly("model", &Setup::model,
                    "The robot as a dictionary, as described in grapnel_controller.h: 'base', 'joints', 'bodies', "
                    "'end_effectors'.")
      .def_readonly("joints", &Setup::joints, "Number of joints: the length of arrays.")
      .def_readonly("period", &Setup::period, "Sample time between updates [s].")
      .def_readonly("delay", &Setup::delay, "Time from an update until its command acts [s].")
      .def_readonly("base_torque", &Setup::base_torque, "Whether the controller commands the base torque.");
  py::class_<Input>(module, "ControllerInput", "Input of a controller at a sample; arrays are copies.")
      .def_readonly("time", &Input::time, "Scenario time [s].")
      .def_readonly("piece", &Input::piece,
                    "Index of the segment of the run, from 0; increases when grasps close or open.")
      .def_readonly("joints", &Input::joints, "Number of joints.")
      .def_readonly("position", &Input::position, "(joints,): sensor readings, noise included [rad or m].")
      .def_readonly("rate", &Input::rate, "(joints,): sensor readings [rad/s or m/s].")
      .def_readonly("desired_position", &Input::desired_position, "(joints,): reference [rad or m].")
      .def_readonly("desired_rate", &Input::desired_rate, "(joints,): reference [rad/s or m/s].")
      .def_readonly("desired_acceleration", &Input::desired_acceleration, "(joints,): reference [rad/s^2 or m/s^2].")
      .def_readonly("base_position", &Input::base_position, "(3,): of B's origin, in W [m].")
      .def_readonly("base_quaternion_wxyz", &Input::base_quaternion_wxyz, "(4,): R_WB, of unit norm.")
      .def_readonly("base_velocity", &Input::base_velocity, "(3,): of B's origin, in W [m/s].")
      .def_readonly("base_angular_velocity", &Input::base_angular_velocity, "(3,): of B, in B's axes [rad/s].");
  py::class_<Access>(module, "ControllerAccess",
                     "Queries of the true model during update(): the servicer with all bodies that it "
                     "holds. Velocities: six of a free base [angular; linear] in B, joints, then joints of grasps.")
      .def("velocities", &Access::velocities, "N: the number of velocities.")
      .def("mass_matrix", &Access::mass_matrix, "H, (N, N), rotors included.")
      .def("bias", &Access::bias, "C, (N,): forces at zero acceleration, gravity included.")
      .def("momentum", &Access::momentum, "p, (6,): [angular about the centre of mass; linear] in W.")
      .def("generalized_jacobian", &Access::generalized_jacobian, py::arg("frame"),
           "J*, (6, N - 6) (fixed base: (6, N)), of an end-effector by name: its twist [angular; linear] in W at zero "
           "momentum.");
  py::class_<Output>(module, "ControllerOutput", "Commands of a controller at a sample; zero before update().")
      .def_property(
          "effort", [](const Output& out) { return out.effort; },
          [](Output& out, const py::object& value) { Output::assign(out.effort, value, "output.effort"); },
          "(joints,): effort of each joint [N m or N]; saturated at the joint's limit.")
      .def_property(
          "base_torque", [](const Output& out) { return out.base_torque; },
          [](Output& out, const py::object& value) { Output::assign(out.base_torque, value, "output.base_torque"); },
          "(3,): torque on the base, in B's axes [N m]; ignored without control.base_torque.");
}

}  // namespace grapnel::python
