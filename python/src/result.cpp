#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <mutex>
#include <optional>
#include <tuple>

#include "binding.hpp"
#include "controller.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/campaign/run_scenario.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/report/report_html.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_table.hpp"
#include "grapnel/result/verdicts.hpp"
#include "problem.hpp"

namespace grapnel::python {
namespace {

namespace fs = std::filesystem;

// A simulated capture, with its problem, which the result folder needs. Immutable.
struct Run {
  std::shared_ptr<const CaptureProblem> problem;
  CaptureResult result;  // warnings of the input first, as in summary.json
};

// A Python controller and its name in results; without a source: no controller.
struct GivenController {
  std::shared_ptr<const ControllerSource> source;
  std::string name, sha256;
};
using Given = std::tuple<py::object, std::string, std::string>;  // the object or class, its name, the digest

// One per scenario; the lock is held. @throws py::value_error if a scenario requests no controller.
std::vector<GivenController> given_controllers(const std::vector<Scenario>& scenarios,
                                               const std::vector<Given>& given) {
  std::vector<GivenController> controllers(scenarios.size());
  for (std::size_t i = 0; i < given.size(); ++i) {
    const auto& [object, name, sha256] = given[i];
    if (object.is_none()) continue;
    const std::optional<ControlSetup>& control = scenarios[i].problem().control;
    if (!control || !control->external)
      throw py::value_error("the scenario '" + scenarios[i].problem().name +
                            "' requests no Python controller; expected control.external: true, and controller "
                            "in approach.tracking.mode or post_impact.joints");
    controllers[i] = {python_controllers(object, name), name, sha256};
  }
  return controllers;
}

// Computes the same as `grapnel run`, or `grapnel run --margins`.
std::shared_ptr<Run> simulate(const Scenario& scenario, const GivenController& given, bool margins,
                              const std::stop_token& stop) {
  std::vector<std::string> warnings;
  for (const Fault& warning : scenario.warnings()) warnings.push_back(warning.message);
  const auto follow = [&](const std::string&, double, double) {
    if (stop.stop_requested()) throw Stopped{};
  };
  auto run = std::make_shared<Run>();
  run->problem = scenario.shared_problem();
  std::optional<CaptureProblem> controlled;
  if (given.source) {
    controlled = *run->problem;
    controlled->control->source = given.source;
    controlled->control->plugin = given.name, controlled->control->sha256 = given.sha256;
  }
  const CaptureProblem& problem = controlled ? *controlled : *run->problem;
  try {
    run->result = simulate_run(problem, warnings, follow);
    if (margins) add_margins(problem, follow, run->result);
  } catch (const CaptureProblemError& error) {
    throw input_error(scenario.file().string(), error.what());
  } catch (const ModelError& error) {
    throw input_error(scenario.file().string(), error.what());
  }
  run->result.warnings.insert(run->result.warnings.begin(), warnings.begin(), warnings.end());
  return run;
}

std::vector<std::shared_ptr<Run>> simulate_many(const std::vector<std::shared_ptr<Scenario>>& scenarios, int threads,
                                                const std::vector<Given>& controllers, bool margins,
                                                const py::object& progress) {
  // Other threads may change a scenario during its simulation: copy its present state.
  std::vector<Scenario> now;
  for (const auto& scenario : scenarios) now.push_back(*scenario);
  const std::vector<GivenController> given = given_controllers(now, controllers);
  std::vector<std::shared_ptr<Run>> runs(now.size());
  std::atomic<std::size_t> done = 0;
  std::function<void()> report;  // `progress` is None, or a function of the numbers of simulated and of all problems
  if (!progress.is_none()) {
    report = [&, last = std::size_t{0}]() mutable {
      if (const std::size_t count = done; count != last) progress(last = count, now.size());
    };
  }
  const auto work = [&](const std::stop_token& stop) {
    for_each(static_cast<std::int64_t>(now.size()), threads, 1, stop, [&](int, std::int64_t i, std::int64_t) {
      const auto k = static_cast<std::size_t>(i);
      runs[k] = simulate(now[k], given[k], margins, stop);
      ++done;
    });
  };
  run_interruptibly(work, report);
  if (report) report();
  return runs;
}

// ---- Folders and reports ----

// The files of `grapnel run`, without its report. @throws CannotWrite that names each missing file
void write_files(const Run& run, const fs::path& folder) {
  const CaptureResult& result = run.result;
  const auto write_series = [&](const fs::path& file) {
    write_timeseries_hdf5(result.series, {GRAPNEL_VERSION, result.scenario_name, result.scenario_sha256}, file);
  };
  const Written written = write_results(*run.problem, result, !result.series.time.empty(), write_series, folder);
  if (written.faults.empty()) return;
  std::string faults;
  for (const std::string& fault : written.faults) faults += (faults.empty() ? "" : "\n") + fault;
  throw CannotWrite(faults);
}

void write_page(const fs::path& folder, const fs::path& file) {
  if (const std::string why = why_no_reports(); !why.empty()) throw std::runtime_error("no report: " + why);
  write_report(report_data(folder, GRAPNEL_VERSION, ResultKind::run), file);
}

void save(const Run& run, const fs::path& folder, std::optional<bool> report) {
  const bool wanted = report.value_or(why_no_reports().empty());
  run_interruptibly([&](const std::stop_token&) {
    fs::create_directories(folder);
    write_files(run, folder);
    std::error_code ignored;
    fs::remove(folder / "report.html", ignored);  // of earlier results
    if (wanted) write_page(folder, folder / "report.html");
  });
}

void report(const Run& run, const fs::path& file) {
  run_interruptibly([&](const std::stop_token&) {
    const ScratchFolder folder;
    write_files(run, folder.path());
    write_page(folder.path(), file);
  });
}

// ---- Numbers ----

// A view of memory that the run owns and that lives as long as the array. It is read-only, because reports and files
// use the same numbers.
template <class Number>
py::array view(const std::shared_ptr<const Run>& run, const std::vector<Number>& data, std::vector<py::ssize_t> shape) {
  py::array_t<Number> array(std::move(shape), data.data(), py::cast(std::const_pointer_cast<Run>(run)));
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

const Series& series_named(const Run& run, const std::string& path) {
  for (const Series& series : run.result.series.series)
    if (series.path == path) return series;
  throw py::key_error("no series is named '" + path + "'");
}

py::array series_view(const std::shared_ptr<Run>& run, const std::string& path) {
  const Series& series = series_named(*run, path);
  std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(run->result.series.time.size())};
  if (series.width() != 1) shape.push_back(series.width());
  return view(run, series.data, std::move(shape));
}

std::vector<std::string> series_names(const Run& run) {
  std::vector<std::string> names;
  for (const Series& series : run.result.series.series)
    if (series.width() > 0) names.push_back(series.path);  // as in timeseries.h5
  return names;
}

const char* status_name(CaptureStatus status) {
  return status == CaptureStatus::completed ? "completed" : status == CaptureStatus::failed ? "failed" : "not_run";
}

// ---- Bindings ----

void bind_ledger(py::module_& module) {
  py::class_<LedgerEntry>(module, "Check", "One row of the ledger: a check and its maximum deviation.")
      .def_readonly("name", &LedgerEntry::name, "Key in summary.json.")
      .def_readonly("value", &LedgerEntry::value, "Maximum deviation in the whole run, in `unit`.")
      .def_readonly("bound", &LedgerEntry::bound, "Maximum permissible value.")
      .def_readonly("unit", &LedgerEntry::unit, "'1' if the value is relative to a scale, see `note`.")
      .def_readonly("note", &LedgerEntry::note, "The compared quantities and the phases.")
      .def_readonly("applies", &LedgerEntry::applies, "False: the check does not apply to this run.")
      .def_readonly("not_checked", &LedgerEntry::not_checked, "Reason why the check was not evaluated; '' if it was.")
      .def_readonly("advice", &LedgerEntry::advice,
                    "For a failed conservation check: the remedy, or why there is none; else ''.")
      .def_property_readonly("passed", &LedgerEntry::pass, "Whether the value is within its bound.")
      .def_property_readonly(
          "kind",
          [](const LedgerEntry& e) {
            return e.kind == LedgerEntry::Kind::conservation ? "conservation" : "feasibility";
          },
          "'conservation': a failure means that the result is not valid. 'feasibility': a failure means that a robot "
          "cannot perform this motion.")
      .def("__repr__", [](const LedgerEntry& e) {
        return py::str("<Check {}: {:.3g} of at most {:.3g} {}, {}>")
            .format(e.name, e.value, e.bound, e.unit, e.pass() ? "passed" : "FAILED");
      });
}

}  // namespace

void bind_result(py::module_& module) {
  bind_ledger(module);
  py::class_<Run, std::shared_ptr<Run>>(module, "Run")
      .def_property_readonly("status", [](const Run& run) { return status_name(run.result.status); })
      .def_property_readonly("failure", [](const Run& run) { return run.result.failure; })
      .def_property_readonly("name", [](const Run& run) { return run.result.scenario_name; })
      .def_property_readonly("sha256", [](const Run& run) { return run.result.scenario_sha256; })
      .def_property_readonly("warnings", [](const Run& run) { return run.result.warnings; })
      .def_property_readonly("captured",
                             [](const Run& run) { return std::string(name_of(run.result.capture_verdict())); })
      .def_property_readonly("feasible",
                             [](const Run& run) { return std::string(name_of(run.result.ledger.feasibility())); })
      .def_property_readonly("conserved", [](const Run& run) { return run.result.ledger.pass(); })
      .def_property_readonly("ledger", [](const Run& run) { return run.result.ledger.entries; })
      .def_property_readonly("summary_json", [](const Run& run) { return summary_json(run.result, GRAPNEL_VERSION); })
      .def_property_readonly("table", [](const Run& run) { return result_table(run.result); })
      .def_property_readonly(
          "verdict",
          [](const Run& run) {
            return std::vector<std::string>{capture_sentence(run.result), feasibility_sentence(run.result)};
          })
      .def_property_readonly("time",
                             [](const std::shared_ptr<Run>& run) {
                               const auto& time = run->result.series.time;
                               return view(run, time, {static_cast<py::ssize_t>(time.size())});
                             })
      .def_property_readonly("phase",
                             [](const std::shared_ptr<Run>& run) {
                               const auto& phase = run->result.series.phase;
                               return view(run, phase, {static_cast<py::ssize_t>(phase.size())});
                             })
      .def_property_readonly("phases", [](const Run& run) { return run.result.series.phases; })
      .def_property_readonly("names", &series_names)
      .def("series", &series_view, py::arg("name"))
      .def(
          "unit", [](const Run& run, const std::string& name) { return series_named(run, name).unit; }, py::arg("name"))
      .def(
          "description", [](const Run& run, const std::string& name) { return series_named(run, name).description; },
          py::arg("name"))
      .def(
          "components", [](const Run& run, const std::string& name) { return series_named(run, name).components; },
          py::arg("name"))
      .def("save", &save, py::arg("folder"), py::arg("report"))
      .def("report", &report, py::arg("file"));
  module.def("simulate_many", &simulate_many, py::arg("problems"), py::arg("threads"), py::arg("controllers"),
             py::arg("margins"), py::arg("progress"));
  module.def("has_reports", [] { return why_no_reports().empty(); });
}

}  // namespace grapnel::python
