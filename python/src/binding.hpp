#pragma once

/// @file
/// What the parts of Python's module share: pybind11, work that Ctrl-C ends, exceptions, values of YAML.

#include <pybind11/pybind11.h>

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "grapnel/text/faults.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel::python {

namespace py = pybind11;

// ---- Work without the interpreter's lock ----

/// Runs `work` on a thread of its own without the interpreter's lock, and meanwhile looks for signals: where Python's
/// handler raises, as on Ctrl-C, the work is asked to stop, and when it has ended that exception goes on. What `work`
/// throws goes on too. Called with the lock held.
void run_interruptibly(const std::function<void(const std::stop_token&)>& work);

/// Thrown by work that has been asked to stop, through whatever turns exceptions into results: derived from nothing.
struct Stopped {};

/// Calls work(worker, i) for every i below `count` on at most `threads` threads (0: one per processor), each with a
/// number of its own from 0 on; by one thread at least `grain` of them. @throws Stopped after a stop request, or what
/// `work` throws.
void for_each(std::int64_t count, int threads, std::int64_t grain, const std::stop_token& stop,
              const std::function<void(int worker, std::int64_t i)>& work);
/// How many workers for_each() may number.
int worker_count(int threads);

// ---- Exceptions ----

/// grapnel.Fault, grapnel.InputError and how C++'s exceptions become Python's.
void bind_faults(py::module_& module);

/// Faults without a place in a file: one per line of the text.
InputError input_error(const std::string& source, const std::string& lines);

// ---- Values ----

/// Dictionaries, lists, numbers, texts, truth values and None (NumPy's too) as a tree in which every value's mark names
/// its path: "targets[0].mass". `path` is that of the value itself. @throws py::type_error, py::value_error naming the
/// path.
Node tree_of(const py::handle& value, const std::string& path);
/// The other way round.
py::object value_of(const Node& node);

// ---- The parts of the module ----

void bind_problem(py::module_& module);
void bind_result(py::module_& module);
void bind_robot(py::module_& module);
void bind_commands(py::module_& module);

}  // namespace grapnel::python
