#pragma once

/// @file
/// Controllers in Python.

#include <memory>
#include <string>

#include "binding.hpp"
#include "grapnel/simulate/controller_source.hpp"

namespace grapnel::python {

/// A controller for one run, or for each of several: `given` is an object with update(), or a class, of which every run
/// creates an object. The interpreter's lock is held here and when the last reference is released.
std::shared_ptr<const ControllerSource> python_controllers(const py::object& given, const std::string& name);

/// Interrupts all calls of Python controllers: raises KeyboardInterrupt in each of them. The lock is held.
void interrupt_controllers();

void bind_controllers(py::module_& module);

}  // namespace grapnel::python
