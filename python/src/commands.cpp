// Campaigns, sweeps, optimizations, reports, figures of result folders, and logs of measurements.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <chrono>
#include <mutex>
#include <optional>
#include <utility>

#include "binding.hpp"
#include "grapnel/campaign/campaign_folder.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/compare/identification_folder.hpp"
#include "grapnel/compare/log_folder.hpp"
#include "grapnel/result/campaign_table.hpp"
#include "grapnel/text/input_files.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel::python {
namespace {

namespace fs = std::filesystem;

// Collects the messages of work, and holds its latest progress for another thread.
class Messages : public Listener {
 public:
  void message(const Message& message) override {
    messages_.push_back({message.kind, printable_lines(message.text)});
    has_error_ = has_error_ || message.kind == Message::Kind::error;
  }
  void points(const CaseProgress& at) override { take(at); }
  void cases(const CaseProgress& at) override { take(at); }

  bool has_error() const { return has_error_; }
  std::vector<std::string> texts() const {
    std::vector<std::string> texts;
    for (const Message& message : messages_) texts.push_back(message.text);
    return texts;
  }
  /// The progress since the last call. Any thread may call it.
  std::optional<CaseProgress> news() {
    const std::lock_guard lock(mutex_);
    return std::exchange(latest_, std::nullopt);
  }

 private:
  void take(const CaseProgress& at) {
    // Remarks before the first case state the expected duration, which the progress shows.
    if (at.total == 0)
      std::erase_if(messages_, [](const Message& message) { return message.kind == Message::Kind::remark; });
    const std::lock_guard lock(mutex_);
    if (at.total > 0) latest_ = at;
  }

  std::vector<Message> messages_;
  bool has_error_ = false;
  std::mutex mutex_;
  std::optional<CaseProgress> latest_;
};

// How work ended, as the exit code of the program's command, and its messages.
using Outcome = std::pair<int, std::vector<std::string>>;

// On Ctrl-C the work ends and keeps its complete results, and the exception propagates. Exceptions of `work` propagate.
// `progress`: None, or a function of numbers of cases: done, total, successes, not ok, and done at the start.
Outcome outcome_of(const std::function<Ending(Messages& messages, const std::stop_token& stop)>& work,
                   const py::object& progress = py::none()) {
  constexpr std::chrono::milliseconds kBetweenChecks(20);
  static std::timed_mutex one_at_a_time;  // the inputs of a command are those of the process
  int code = 0;
  Messages messages;
  std::function<void()> report;
  if (!progress.is_none()) {
    report = [&] {
      if (const std::optional<CaseProgress> at = messages.news())
        progress(at->done, at->total, at->successes, at->not_ok, at->begun_with);
    };
  }
  run_interruptibly(
      [&](const std::stop_token& stop) {
        std::unique_lock lock(one_at_a_time, std::defer_lock);
        while (!lock.try_lock_for(kBetweenChecks))
          if (stop.stop_requested()) throw Stopped{};
        const InputFiles inputs;
        code = static_cast<int>(work(messages, stop));
      },
      report);
  if (report) report();
  return {code, messages.texts()};
}

// What `load` reads; the listener gets the warnings. @throws InputError
template <class Read>
Read loaded(const fs::path& file, Read (*load)(const fs::path&, std::vector<Fault>*), Listener& listener) {
  std::vector<Fault> warnings;
  Read read = load(file, &warnings);
  listener.faults(warnings);
  return read;
}

FolderOptions folder_options(int threads, bool report, const std::stop_token& stop, bool quiet = true) {
  return {.threads = threads, .quiet = quiet, .no_report = !report, .stop = stop};
}

Outcome campaign(const fs::path& file, const fs::path& folder, int threads, bool report, bool csv, std::uint64_t extend,
                 bool map, const py::object& progress) {
  const bool quiet = progress.is_none();
  const auto work = [&](Listener& listener, const std::stop_token& stop) {
    Campaign campaign = loaded(file, load_campaign, listener);
    if (!can_run(campaign, map, listener) || !results_folder(folder, file, Outputs::campaign, listener))
      return Ending::bad_input;
    CampaignFolderOptions options;
    static_cast<FolderOptions&>(options) = folder_options(threads, report, stop, quiet);
    options.no_csv = !csv, options.extend = extend;
    options.command = options.resume = "repeat the call with the same file and folder";
    return run_campaign_folder(std::move(campaign), folder, options, listener);
  };
  return outcome_of(work, progress);
}

Outcome sweep(const fs::path& file, const fs::path& folder, int threads, bool report, const py::object& progress) {
  const bool quiet = progress.is_none();
  const auto work = [&](Listener& listener, const std::stop_token& stop) {
    const Campaign study = loaded(file, load_study, listener);
    if (!results_folder(folder, file, Outputs::sweep, listener)) return Ending::bad_input;
    return run_sweep_folder(study, folder, folder_options(threads, report, stop, quiet), listener);
  };
  return outcome_of(work, progress);
}

Outcome optimize(const fs::path& file, const fs::path& folder, int threads, bool report, const py::object& progress) {
  const bool quiet = progress.is_none();
  const auto work = [&](Listener& listener, const std::stop_token& stop) {
    const Optimization optimization = loaded(file, load_optimization, listener);
    if (!results_folder(folder, file, Outputs::optimization, listener) || !may_replace(folder / "best.yaml", listener))
      return Ending::bad_input;
    return run_optimization_folder(optimization, folder, folder_options(threads, report, stop, quiet), listener);
  };
  return outcome_of(work, progress);
}

// A disagreement with the model is a result, not an error.
Ending without_verdict(Ending ending, const Messages& messages) {
  return ending == Ending::failed && !messages.has_error() ? Ending::done : ending;
}

Outcome compare(const RunAndLog& input, LogFolderOptions options) {
  return outcome_of([&](Messages& messages, const std::stop_token& stop) {
    options.stop = stop;
    return without_verdict(run_comparison_folder(input, options, messages), messages);
  });
}

Outcome impulses(const RunAndLog& input, const ImpulseOptions& settings, LogFolderOptions options) {
  return outcome_of([&](Messages& messages, const std::stop_token& stop) {
    options.stop = stop;
    return without_verdict(run_impulses_folder(input, settings, options, messages), messages);
  });
}

Outcome identify_from_logs(const fs::path& file, const fs::path& folder, int threads, bool report) {
  return outcome_of([&](Messages& messages, const std::stop_token& stop) {
    try {
      std::vector<Fault> warnings;
      const Identification identification = load_identification(file, stop, &warnings);
      messages.faults(warnings);
      if (!results_folder(folder, file, Outputs::images, messages) ||
          !may_write(identification_files(identification, folder), messages) ||
          !may_replace(folder / "fitted.yaml", messages))
        return Ending::bad_input;
      return without_verdict(
          run_identification_folder(identification, folder, folder_options(threads, report, stop), messages), messages);
    } catch (const FitStopped&) {
      return Ending::interrupted;
    }
  });
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
  module.def("campaign", &campaign, py::arg("file"), py::arg("folder"), py::arg("threads"), py::arg("report"),
             py::arg("csv"), py::arg("extend"), py::arg("map"), py::arg("progress"));
  module.def("sweep", &sweep, py::arg("file"), py::arg("folder"), py::arg("threads"), py::arg("report"),
             py::arg("progress"));
  module.def("optimize", &optimize, py::arg("file"), py::arg("folder"), py::arg("threads"), py::arg("report"),
             py::arg("progress"));
  const auto options_of = [](const fs::path& folder, bool report) {
    LogFolderOptions options;
    options.folder = folder, options.quiet = true, options.no_report = !report;
    return options;
  };
  module.def(
      "compare",
      [options_of](const fs::path& run, const fs::path& log, const fs::path& mapping, const fs::path& folder,
                   bool report) {
        return compare({run, log, mapping}, options_of(folder, report));
      },
      py::arg("run"), py::arg("log"), py::arg("mapping"), py::arg("folder"), py::arg("report"));
  module.def(
      "impulses",
      [options_of](const fs::path& run, const fs::path& log, const fs::path& mapping, const fs::path& folder,
                   bool report, const std::vector<std::pair<double, double>>& contacts, std::optional<double> window,
                   double false_alarms, const fs::path& scenario,
                   const std::vector<std::pair<std::string, std::string>>& changes) {
        ImpulseOptions settings;
        for (const auto& [begin, duration] : contacts) settings.contacts.push_back({begin, begin + duration, 0});
        settings.window = window, settings.false_alarms = false_alarms, settings.scenario = scenario;
        for (const auto& [path, value] : changes) settings.overrides.push_back({path, value});
        return impulses({run, log, mapping}, settings, options_of(folder, report));
      },
      py::arg("run"), py::arg("log"), py::arg("mapping"), py::arg("folder"), py::arg("report"), py::arg("contacts"),
      py::arg("window"), py::arg("false_alarms"), py::arg("scenario"), py::arg("changes"));
  module.def("identify_from_logs", &identify_from_logs, py::arg("file"), py::arg("folder"), py::arg("threads"),
             py::arg("report"));
  module.def(
      "report",
      [](const fs::path& folder, const fs::path& second, const fs::path& file) {
        return outcome_of([&](Listener& listener, const std::stop_token&) {
          return write_report_of(folder, second, file, listener);
        });
      },
      py::arg("folder"), py::arg("second"), py::arg("file"));
  module.def(
      "figure",
      [](const fs::path& folder, const std::string& what, const fs::path& file, double width, double height) {
        FigureRequest request;
        request.folder = folder, request.what = what;
        request.width = width, request.height = height;
        request.command = "grapnel.figure in Python";
        return outcome_of(
            [&](Listener& listener, const std::stop_token&) { return draw_figure(request, file, listener); });
      },
      py::arg("folder"), py::arg("what"), py::arg("file"), py::arg("width"), py::arg("height"));
  module.def("read_table", &read_table, py::arg("folder"));
}

}  // namespace grapnel::python
