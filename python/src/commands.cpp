// Campaigns, sweeps, optimizations, reports and figures: the commands of the program, with their stderr output as
// messages.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <chrono>
#include <mutex>

#include "binding.hpp"
#include "commands.hpp"
#include "grapnel/result/campaign_table.hpp"
#include "grapnel/study_files/study_files.hpp"
#include "grapnel/text/input_files.hpp"
#include "terminal.hpp"

namespace grapnel::python {
namespace {

namespace fs = std::filesystem;

// Exit code and messages of a command. On Ctrl-C the command ends and keeps its complete results, and the exception
// propagates.
std::pair<int, std::string> said_by(const std::function<int(const std::stop_token&)>& command) {
  std::pair<int, std::string> said;
  constexpr std::chrono::milliseconds kBetweenChecks(20);
  static std::timed_mutex one_at_a_time;  // required by BufferedMessages
  run_interruptibly([&](const std::stop_token& stop) {
    std::unique_lock lock(one_at_a_time, std::defer_lock);
    while (!lock.try_lock_for(kBetweenChecks))
      if (stop.stop_requested()) throw Stopped{};
    const app::BufferedMessages messages;
    const InputFiles inputs;
    said.first = command(stop);
    said.second = messages.lines();
  });
  return said;
}

app::CampaignRunOptions campaign_options(const fs::path& file, const fs::path& folder, int threads, bool report,
                                         bool csv, std::uint64_t extend, bool map) {
  app::CampaignRunOptions options;
  options.study = file, options.output = folder, options.threads = threads;
  options.quiet = true, options.no_report = !report, options.no_csv = !csv;
  options.extend = extend, options.map = map;
  options.command = options.resume = "repeat the call with the same file and folder";
  return options;
}

app::StudyOptions study_options(const fs::path& file, const fs::path& folder, int threads, bool report) {
  app::StudyOptions options;
  options.study = file, options.output = folder, options.threads = threads;
  options.quiet = true, options.no_report = !report;
  return options;
}

// Warnings of a campaign, study or optimization file, before any output is written.
template <class Load>
std::vector<Fault> warnings_of(Load load, const fs::path& file) {
  std::vector<Fault> warnings;
  run_interruptibly([&](const std::stop_token&) { load(file, &warnings); });
  return warnings;
}

template <class Number>
py::array array_of(const std::vector<Number>& numbers) {
  return py::array_t<Number>(static_cast<py::ssize_t>(numbers.size()), numbers.data());
}

// A design axis with labels stores indices into them.
py::object values_of(const CampaignTable::Head& head, const std::vector<double>& numbers) {
  if (head.labels.empty()) return array_of(numbers);
  py::list labels;
  for (const double number : numbers) {
    const auto i = static_cast<std::size_t>(number);
    labels.append(number >= 0 && i < head.labels.size() ? py::object(py::str(head.labels[i])) : py::object(py::none()));
  }
  return labels;
}

// Name, values and unit of every column of a folder's table.h5.
py::list read_table(const fs::path& folder) {
  const CampaignTable table(folder / "table.h5");
  py::list columns;
  const auto add = [&](const std::string& name, const py::object& values, const std::string& unit) {
    columns.append(py::make_tuple(name, values, unit));
  };
  add("case", array_of(table.indices()), "1");
  py::list status, success;
  for (const std::uint8_t s : table.status()) status.append(table.status_names().at(s));
  for (const std::uint8_t s : table.success()) success.append(py::bool_(s != 0));
  add("status", status, "1");
  add("success", success, "1");
  py::list reasons;
  for (const std::string& reason : table.reason_texts(table.reasons())) reasons.append(reason);
  add("reason", reasons, "1");
  for (const auto* heads : {&table.design(), &table.inputs(), &table.columns()})
    for (const CampaignTable::Head& head : *heads) add(head.name, values_of(head, table.numbers(head)), head.unit);
  return columns;
}

}  // namespace

void bind_commands(py::module_& module) {
  module.def(
      "campaign",
      [](const fs::path& file, const fs::path& folder, int threads, bool report, bool csv, std::uint64_t extend,
         bool map) {
        auto options = campaign_options(file, folder, threads, report, csv, extend, map);
        return said_by([&](const std::stop_token& stop) { return options.stop = stop, app::campaign(options); });
      },
      py::arg("file"), py::arg("folder"), py::arg("threads"), py::arg("report"), py::arg("csv"), py::arg("extend"),
      py::arg("map"));
  module.def(
      "sweep",
      [](const fs::path& file, const fs::path& folder, int threads, bool report) {
        auto options = study_options(file, folder, threads, report);
        return said_by([&](const std::stop_token& stop) { return options.stop = stop, app::sweep(options); });
      },
      py::arg("file"), py::arg("folder"), py::arg("threads"), py::arg("report"));
  module.def(
      "optimize",
      [](const fs::path& file, const fs::path& folder, int threads, bool report) {
        auto options = study_options(file, folder, threads, report);
        return said_by([&](const std::stop_token& stop) { return options.stop = stop, app::optimize(options); });
      },
      py::arg("file"), py::arg("folder"), py::arg("threads"), py::arg("report"));
  module.def(
      "report",
      [](const fs::path& folder, const fs::path& second, const fs::path& file) {
        return said_by([&](const std::stop_token&) { return app::report({folder, second, file}); });
      },
      py::arg("folder"), py::arg("second"), py::arg("file"));
  module.def(
      "figure",
      [](const fs::path& folder, const std::string& what, const fs::path& file, double width, double height) {
        app::FigureOptions options;
        options.folder = folder, options.what = what, options.output = file;
        options.width = width, options.height = height;
        options.command = "grapnel.figure in Python";
        return said_by([&](const std::stop_token&) { return app::figure(options); });
      },
      py::arg("folder"), py::arg("what"), py::arg("file"), py::arg("width"), py::arg("height"));
  module.def(
      "check_study",
      [](const fs::path& file) {
        return warnings_of([](const fs::path& f, std::vector<Fault>* w) { load_study(f, w); }, file);
      },
      py::arg("file"));
  module.def(
      "check_campaign",
      [](const fs::path& file) {
        return warnings_of([](const fs::path& f, std::vector<Fault>* w) { load_campaign(f, w); }, file);
      },
      py::arg("file"));
  module.def(
      "check_optimization",
      [](const fs::path& file) {
        return warnings_of([](const fs::path& f, std::vector<Fault>* w) { load_optimization(f, w); }, file);
      },
      py::arg("file"));
  module.def("read_table", &read_table, py::arg("folder"));
}

}  // namespace grapnel::python
