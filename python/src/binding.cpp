#include "binding.hpp"

#include <pybind11/stl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <filesystem>
#include <mutex>
#include <system_error>
#include <thread>

#include "controller.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel::python {

// ---- Work without the interpreter's lock ----

void Unlocked::lock(const std::function<void()>& abandon) noexcept {
  try {
    PyEval_RestoreThread(state_);
  } catch (...) {
    // After its shutdown, Python ends threads that request its lock by pthread_exit(), which would run destructors that
    // request the lock, too. As in Python 3.14 and later, the thread blocks here instead.
    if (abandon) abandon();
    for (;;) ::pause();
  }
}

bool Unlocked::python_raises(const std::function<void()>& abandon, const std::function<void()>& report) {
  lock(abandon);
  // Only the main thread runs signal handlers.
  bool raised = PyErr_CheckSignals() != 0;
  if (!raised && report) {
    try {
      report();
    } catch (py::error_already_set& error) {
      error.restore();
      raised = true;
    } catch (const std::exception& error) {
      PyErr_SetString(PyExc_RuntimeError, error.what());
      raised = true;
    }
  }
  state_ = PyEval_SaveThread();
  return raised;
}

void Unlocked::with_lock(void (*act)()) {
  lock({});
  act();
  state_ = PyEval_SaveThread();
}

void run_interruptibly(const std::function<void(const std::stop_token&)>& work, const std::function<void()>& report) {
  constexpr std::chrono::milliseconds kBetweenChecks(20);
  std::mutex mutex;
  std::condition_variable ended;
  bool done = false;
  std::exception_ptr failure;
  bool interrupted = false;
  {
    Unlocked unlocked;
    std::jthread thread([&](const std::stop_token& stop) {
      try {
        work(stop);
      } catch (const Stopped&) {
      } catch (...) {
        failure = std::current_exception();
      }
      const std::lock_guard lock(mutex);
      done = true;
      ended.notify_all();
    });
    std::unique_lock lock(mutex);
    while (!ended.wait_for(lock, kBetweenChecks, [&] { return done; })) {
      lock.unlock();
      if (!interrupted) {
        interrupted = unlocked.python_raises(
            [&] {
              thread.request_stop();
              thread.join();
            },
            report);
        if (interrupted) thread.request_stop();
      } else {
        unlocked.with_lock(&interrupt_controllers);
      }
      lock.lock();
    }
  }
  if (interrupted) throw py::error_already_set();
  if (failure) std::rethrow_exception(failure);
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

int worker_count(int threads) {
  return threads > 0 ? threads : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

void for_each(std::int64_t count, int threads, std::int64_t grain, const std::stop_token& stop,
              const std::function<void(int, std::int64_t, std::int64_t)>& work) {
  std::atomic<std::int64_t> next{0};
  std::atomic<bool> failed{false};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto run = [&](int worker) {
    try {
      while (!failed) {
        const std::int64_t begin = next.fetch_add(grain);
        if (begin >= count) return;
        if (stop.stop_requested()) throw Stopped{};
        work(worker, begin, std::min(count, begin + grain));
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      failed = true;
    }
  };
  {
    const std::int64_t wanted = std::min<std::int64_t>(worker_count(threads), (count + grain - 1) / grain);
    std::vector<std::jthread> others;
    try {
      for (int i = 1; i < wanted; ++i) others.emplace_back(run, i);
    } catch (const std::system_error&) {
      // The system provides no more threads; the existing ones do the work.
    }
    run(0);
  }
  if (failure) std::rethrow_exception(failure);
}

// ---- Exceptions ----

namespace {

PyObject* input_error_type = nullptr;

void set_input_error(const InputError& error) {
  const py::object type = py::reinterpret_borrow<py::object>(input_error_type);
  const py::object exception = type(error.what());
  exception.attr("faults") = py::cast(error.faults());
  PyErr_SetObject(type.ptr(), exception.ptr());
}

std::string shown(const Fault& fault) { return "<grapnel.Fault " + fault.text() + ">"; }

}  // namespace

InputError input_error(const std::string& source, const std::string& lines) {
  std::vector<Fault> faults;
  for (std::size_t at = 0; at <= lines.size();) {
    const std::size_t end = std::min(lines.find('\n', at), lines.size());
    faults.push_back({source, 0, 0, lines.substr(at, end - at)});
    at = end + 1;
  }
  return InputError(std::move(faults));
}

void bind_faults(py::module_& module) {
  py::class_<Fault>(module, "Fault",
                    "An error in the input, or a warning about valid but implausible input (`is_warning`).")
      .def_readonly("file", &Fault::file,
                    "Path of the file; for a value given in Python, the path of the value, such as 'targets[0].mass'.")
      .def_readonly("line", &Fault::line, "Line, starting at 1; 0 without a location in a file.")
      .def_readonly("column", &Fault::column, "Column in characters, starting at 1; 0 without a location in a file.")
      .def_readonly("message", &Fault::message, "The value, the expected value, and a suggestion.")
      .def_readonly("is_warning", &Fault::is_warning, "Whether the input is accepted.")
      .def("__str__", &Fault::text)
      .def("__repr__", &shown)
      .def(
          "__eq__", [](const Fault& a, const Fault& b) { return a == b; }, py::is_operator())
      .def("__hash__", [](const Fault& fault) { return std::hash<std::string>()(fault.text()); })
      // Required to pass InputError from other processes.
      .def(py::pickle([](const Fault& f) { return py::make_tuple(f.file, f.line, f.column, f.message, f.is_warning); },
                      [](const py::tuple& t) {
                        return Fault{t[0].cast<std::string>(), t[1].cast<int>(), t[2].cast<int>(),
                                     t[3].cast<std::string>(), t[4].cast<bool>()};
                      }));
  static py::handle type = PyErr_NewExceptionWithDoc(
      "grapnel.InputError", "Invalid input. `faults` lists all errors that were found, as grapnel.Fault.",
      PyExc_ValueError, nullptr);
  input_error_type = type.ptr();
  type.attr("faults") = py::list();
  module.attr("InputError") = type;
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      set_input_error(error);
    } catch (const CannotWrite& error) {
      PyErr_SetString(PyExc_OSError, error.what());
    } catch (const std::filesystem::filesystem_error& error) {
      PyErr_SetString(PyExc_OSError, error.what());
    }
  });
}

// ---- Values ----

namespace {

Node node_at(Node::Kind kind, const std::string& path) {
  Node node;
  node.kind = kind;
  node.mark.source = std::make_shared<const std::string>(path.empty() ? "the scenario" : path);
  return node;
}

Node scalar_at(const std::string& path, std::string text, bool plain) {
  Node node = node_at(Node::Kind::scalar, path);
  node.text = std::move(text);
  node.plain = plain;
  return node;
}

// A string stays a string: text that a file would read as another type is quoted.
Node text_at(const std::string& path, const std::string& text) {
  Node node = scalar_at(path, text, true);
  const bool is_empty = text.empty() || text == "~" || text == "null" || text == "Null" || text == "NULL";
  node.plain = !is_empty && is_text(node) && text.find_first_of("\n\t") == std::string::npos;
  return node;
}

std::string below(const std::string& path, const std::string& key) { return path.empty() ? key : path + "." + key; }

// @throws py::value_error for text that UTF-8 cannot encode.
std::string text_of(const py::handle& text, const std::string& path) {
  Py_ssize_t size = 0;
  if (const char* utf8 = PyUnicode_AsUTF8AndSize(text.ptr(), &size)) return {utf8, static_cast<std::size_t>(size)};
  PyErr_Clear();
  throw py::value_error((path.empty() ? std::string("the scenario") : path) +
                        " has a string with an unpaired surrogate, which UTF-8 cannot encode");
}

class TreeMaker {
 public:
  Node make(const py::handle& value, const std::string& path, int depth) {
    if (depth > kDeepest) throw py::value_error(path + ": nested deeper than " + std::to_string(kDeepest) + " levels");
    if (++count_ > kMostValues) throw py::value_error(path + ": more than " + std::to_string(kMostValues) + " values");
    if (value.is_none()) return node_at(Node::Kind::null, path);
    if (py::isinstance<py::bool_>(value)) return scalar_at(path, value.cast<bool>() ? "true" : "false", true);
    if (py::isinstance<py::int_>(value)) return scalar_at(path, py::str(value), true);
    if (py::isinstance<py::float_>(value)) return number_at(path, value.cast<double>());
    if (py::isinstance<py::str>(value)) return text_at(path, text_of(value, path));
    if (py::isinstance<py::dict>(value)) return mapping(value, path, depth);
    if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value)) return sequence(value, path, depth);
    if (py::hasattr(value, "tolist")) return make(value.attr("tolist")(), path, depth + 1);  // NumPy
    if (py::hasattr(value, "__fspath__")) return text_at(path, py::str(value.attr("__fspath__")()));
    throw py::type_error((path.empty() ? std::string("the value") : path) + " is " +
                         std::string(py::str(py::type::of(value))) +
                         "; expected dictionaries, lists, numbers, strings, True, False and None");
  }

 private:
  static Node number_at(const std::string& path, double value) {
    if (std::isnan(value)) return scalar_at(path, ".nan", true);
    if (std::isinf(value)) return scalar_at(path, value > 0 ? ".inf" : "-.inf", true);
    return scalar_at(path, number_node(value).text, true);
  }
  Node mapping(const py::handle& value, const std::string& path, int depth) {
    Node node = node_at(Node::Kind::mapping, path);
    for (const auto& [key, item] : py::reinterpret_borrow<py::dict>(value)) {
      if (!py::isinstance<py::str>(key))
        throw py::type_error((path.empty() ? std::string("the scenario") : path) + ": the key " +
                             std::string(py::repr(key)) + " is not a string");
      const std::string name = text_of(key, path);
      Node entry = make(item, below(path, name), depth + 1);
      const Mark mark = entry.mark;
      node.entries.push_back({name, mark, std::move(entry)});
    }
    return node;
  }
  Node sequence(const py::handle& value, const std::string& path, int depth) {
    Node node = node_at(Node::Kind::sequence, path);
    std::size_t i = 0;
    for (const py::handle& item : value)
      node.items.push_back(make(item, path + "[" + std::to_string(i++) + "]", depth + 1));
    return node;
  }

  std::size_t count_ = 0;
};

bool is_whole(const std::string& text) {
  const std::size_t digits = text.find_first_not_of("+-") == std::string::npos ? 0 : text.find_first_not_of("+-");
  return text.size() > digits && text.size() - digits < 16 &&
         std::all_of(text.begin() + static_cast<std::ptrdiff_t>(digits), text.end(),
                     [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

Node tree_of(const py::handle& value, const std::string& path) { return TreeMaker().make(value, path, 0); }

py::object value_of(const Node& node) {
  switch (node.kind) {
    case Node::Kind::null:
      return py::none();
    case Node::Kind::sequence: {
      py::list list;
      for (const Node& item : node.items) list.append(value_of(item));
      return list;
    }
    case Node::Kind::mapping: {
      py::dict mapping;
      for (const NodeEntry& entry : node.entries) mapping[py::str(entry.key)] = value_of(entry.value);
      return mapping;
    }
    case Node::Kind::scalar:
      break;
  }
  if (const auto truth = boolean_of(node)) return py::bool_(*truth);
  if (const auto number = number_of(node)) {
    if (is_whole(node.text)) return py::int_(static_cast<long long>(*number));
    return py::float_(*number);
  }
  return py::str(node.text);
}

}  // namespace grapnel::python
