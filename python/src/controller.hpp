#pragma once

/// @file
/// Controllers that are objects of Python.

#include <memory>
#include <string>

#include "binding.hpp"
#include "grapnel/simulate/controller_source.hpp"

namespace grapnel::python {

/// A controller for one run, or for each of several: `given` is an object with update(), or a class, of which every run
/// makes an object. The interpreter's lock is held here, and where the last user lets go of it.
std::shared_ptr<const ControllerSource> python_controllers(const py::object& given, const std::string& name);

/// Ends calls into Python's controllers that have been interrupted: in each of them KeyboardInterrupt is raised. The
/// lock is held.
void interrupt_controllers();

void bind_controllers(py::module_& module);

}  // namespace grapnel::python
