// The Python module _grapnel, the compiled part of the package grapnel.
#include "binding.hpp"
#include "controller.hpp"

PYBIND11_MODULE(_grapnel, module) {
  using namespace grapnel::python;
  module.doc() = "The compiled part of the package grapnel.";
  module.attr("__version__") = GRAPNEL_VERSION;
  bind_faults(module);
  bind_problem(module);
  bind_controllers(module);
  bind_result(module);
  bind_robot(module);
  bind_commands(module);
  bind_linear(module);
  bind_sensitivities(module);
}
