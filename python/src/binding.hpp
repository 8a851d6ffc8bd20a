#pragma once

/// @file
/// Common parts of the Python module: pybind11, interruptible work, exceptions, YAML values.

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

/// Releases the interpreter's lock during its lifetime. If the interpreter ends during this time, as it does with
/// running daemon threads, the lock no longer exists: the thread then blocks in the destructor until the process ends.
class Unlocked {
 public:
  Unlocked() : state_(PyEval_SaveThread()) {}
  ~Unlocked() { lock({}); }
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;
  /// Takes the lock briefly to run signal handlers and `report`, if there is one; returns whether one of them raised a
  /// Python exception. If the interpreter has ended, `abandon` is called and this function does not return.
  bool python_raises(const std::function<void()>& abandon, const std::function<void()>& report);
  /// Takes the lock briefly and calls `act`.
  void with_lock(void (*act)());

 private:
  void lock(const std::function<void()>& abandon) noexcept;
  PyThreadState* state_;
};

/// Runs `work` on a separate thread without the interpreter's lock, and checks for signals during this time. If a
/// Python handler raises an exception, as on Ctrl-C, it requests a stop of the work and rethrows the exception after
/// its end. Exceptions of `work` propagate, too. Called with the lock held. `report` runs in the calling thread with
/// the lock, every 20 ms until the work ends; a Python exception of it stops the work as a signal does.
void run_interruptibly(const std::function<void(const std::stop_token&)>& work,
                       const std::function<void()>& report = {});

/// Thrown by work after a stop request. It has no base class, so handlers that turn exceptions into results ignore it.
struct Stopped {};

/// Calls work(worker, begin, end) for all numbers below `count`, `grain` at a time, on at most `threads` threads (0:
/// one per processor), numbered from 0. @throws Stopped after a stop request, or the exception of `work`.
void for_each(std::int64_t count, int threads, std::int64_t grain, const std::stop_token& stop,
              const std::function<void(int worker, std::int64_t begin, std::int64_t end)>& work);
/// The maximum number of workers of for_each().
int worker_count(int threads);

// ---- Exceptions ----

/// Binds grapnel.Fault and grapnel.InputError, and the translation of C++ exceptions to Python.
void bind_faults(py::module_& module);

/// Errors without a location in a file: one per line of the text.
InputError input_error(const std::string& source, const std::string& lines);

// ---- Values ----

/// Dictionaries, lists, numbers, strings, booleans and None (NumPy's too) as a tree, in which the mark of every value
/// names its path: "targets[0].mass". `path` is that of the value itself. @throws py::type_error, py::value_error
/// naming the path.
Node tree_of(const py::handle& value, const std::string& path);
/// The inverse of tree_of().
py::object value_of(const Node& node);

// ---- The parts of the module ----

void bind_problem(py::module_& module);
void bind_result(py::module_& module);
void bind_robot(py::module_& module);
void bind_commands(py::module_& module);
void bind_linear(py::module_& module);
void bind_sensitivities(py::module_& module);

}  // namespace grapnel::python
