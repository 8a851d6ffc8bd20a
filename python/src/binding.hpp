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

/// The interpreter's lock is free while it lives. Where the interpreter ends meanwhile, which it does while its daemon
/// threads still work, there is no lock to come back to: the thread then stays in the destructor until the process is
/// gone.
class Unlocked {
 public:
  Unlocked() : state_(PyEval_SaveThread()) {}
  ~Unlocked() { lock({}); }
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;
  /// Takes the lock for a moment to look for signals: whether one of Python's handlers has raised. `abandon` is called
  /// where the interpreter has ended, and this function then never returns.
  bool signals_raise(const std::function<void()>& abandon);
  /// Takes the lock for a moment.
  void with_lock(void (*act)());

 private:
  void lock(const std::function<void()>& abandon) noexcept;
  PyThreadState* state_;
};

/// Runs `work` on a thread of its own without the interpreter's lock, and meanwhile looks for signals: where Python's
/// handler raises, as on Ctrl-C, the work is asked to stop, and when it has ended that exception goes on. What `work`
/// throws goes on too. Called with the lock held.
void run_interruptibly(const std::function<void(const std::stop_token&)>& work);

/// Thrown by work that has been asked to stop, through whatever turns exceptions into results: derived from nothing.
struct Stopped {};

/// Calls work(worker, begin, end) for all numbers below `count`, `grain` at a time, on at most `threads` threads (0:
/// one per processor), each with a number of its own from 0 on. @throws Stopped after a stop request, or what `work`
/// throws.
void for_each(std::int64_t count, int threads, std::int64_t grain, const std::stop_token& stop,
              const std::function<void(int worker, std::int64_t begin, std::int64_t end)>& work);
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
