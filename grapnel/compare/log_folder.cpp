#include "grapnel/compare/log_folder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/compare/compare_log.hpp"
#include "grapnel/compare/comparison_page.hpp"
#include "grapnel/compare/impulse_page.hpp"
#include "grapnel/report/report_html.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/text/error_text.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

struct LogResults {
  std::string scenario;
  std::vector<std::pair<std::string, std::string>> files;  // names and contents, in the order of writing
  std::string page;                                        // its name
  std::function<ReportData()> page_data;
  std::string text;  // for a reader
  Verdict verdict = Verdict::not_checked;
};

// The run's folder without a slash at its end.
fs::path folder_of(const fs::path& run) { return run.has_filename() ? run : run.parent_path(); }

// Whether the file, if it exists, is of an earlier comparison with a log: optimizations have a file of the same name.
bool is_of_comparison(const fs::path& file, Listener& listener) {
  std::error_code unknown;
  if (!fs::exists(file, unknown)) return true;
  try {
    read_json_document(file, "grapnel-log-comparison/1");
    return true;
  } catch (const std::exception&) {
    listener.error("grapnel", fmt::format("'{}' is not a comparison with a log; choose another folder", file.string()));
    return false;
  }
}

Ending write_results(const RunAndLog& input, const LogResults& results, const fs::path& requested,
                     const LogFolderOptions& options, Listener& listener) {
  if (options.stop.stop_requested()) return Ending::interrupted;
  std::vector<fs::path> paths;
  std::vector<std::string> names;
  for (const auto& [name, text] : results.files) names.push_back(name), paths.push_back(requested / name);
  paths.push_back(requested / results.page);
  if (!may_write(paths, listener)) return Ending::bad_input;
  const auto folder = results_folder(requested, input.log, Outputs::images, listener);
  if (!folder) return Ending::bad_input;
  const std::string no_page = options.no_report ? "" : why_no_reports();
  const bool has_page = !options.no_report && no_page.empty();
  try {
    for (const auto& [name, text] : results.files) write_file_atomically(*folder / name, text);
    if (has_page) write_report(results.page_data(), *folder / results.page);
  } catch (const std::exception& error) {
    listener.error("grapnel", error_text(error));
    return Ending::failed;
  }
  if (has_page) names.push_back(results.page);
  if (!options.quiet) {
    listener.note(fmt::format("grapnel {}, run {} (scenario {}), log {}\n\n", GRAPNEL_VERSION,
                              folder_of(input.run).string(), results.scenario, input.log.string()));
    listener.note(results.text);
    listener.note(fmt::format("results in {}: {}\n{}", folder->string(), fmt::join(names, ", "),
                              no_page.empty() ? "" : fmt::format("no page: {}\n", no_page)));
  }
  return results.verdict == Verdict::no ? Ending::failed : Ending::done;
}

// Momentum and energy of the measured motion with the masses of the run's scenario; or why they are not computed.
std::vector<MomentumCurve> add_momentum(const fs::path& run_folder, AlignedLog log, ComparisonReport& report) {
  try {
    const RunModel run(run_folder, {}, {});
    apply_drift(log);
    const MeasuredQuantities measured = measured_quantities(log.quantities, run);
    const bool has_rates = std::any_of(measured.used.begin(), measured.used.end(),
                                       [](const MeasuredQuantity& one) { return one.measures_rates(); });
    if (!has_rates) {
      report.momentum_reason = "no rate with an uncertainty is measured";
      return {};
    }
    std::vector<ContactTime> contacts;
    for (const RunContact& one : run.contacts()) contacts.push_back({one.time, one.end, 0});
    std::vector<MomentumCurve> curves = measured_momentum(run, measured, report.clock.offset, contacts, kMostMomenta);
    report.momentum = momentum_report(curves), report.momentum_reason.clear();
    return curves;
  } catch (const InputError& error) {
    report.momentum_reason = error.faults().empty() ? error_text(error) : error.faults()[0].message;
    return {};
  }
}

}  // namespace

fs::path log_results_folder(const RunAndLog& input, const fs::path& folder, const char* command) {
  return folder.empty() ? folder_of(input.run) / fmt::format("{}-{}", command, input.log.stem().string()) : folder;
}

Ending run_comparison_folder(const RunAndLog& input, const LogFolderOptions& options, Listener& listener) {
  const fs::path run = folder_of(input.run), folder = log_results_folder(input, options.folder, "compare");
  note_results(run);
  const AlignedLog log = read_aligned_log(run, input.log, input.mapping);
  LogComparison comparison = compare_log(log);
  const std::vector<MomentumCurve> momentum = add_momentum(run, log, comparison.report);
  if (!is_of_comparison(folder / "comparison.json", listener)) return Ending::bad_input;
  LogResults results;
  results.scenario = comparison.report.run.scenario;
  results.files = {{"comparison.json", comparison_report_json(comparison.report)},
                   {"comparison.csv", comparison.residuals_csv}};
  if (!momentum.empty()) results.files.emplace_back("momentum.csv", momentum_csv(momentum));
  results.page = "comparison.html", results.page_data = [&] { return comparison_page_data(comparison); };
  results.text = comparison_report_text(comparison.report), results.verdict = comparison.report.verdict;
  return write_results(input, results, folder, options, listener);
}

Ending run_impulses_folder(const RunAndLog& input, const ImpulseOptions& settings, const LogFolderOptions& options,
                           Listener& listener) {
  const fs::path run = folder_of(input.run), folder = log_results_folder(input, options.folder, "impulses");
  note_results(run);
  const MeasuredImpulses impulses = measured_impulses(run, input.log, input.mapping, settings);
  const ImpulseReport& report = impulses.report;
  LogResults results;
  results.scenario = report.scenario;
  results.files = {{"impulses.json", impulse_report_json(report)},
                   {"impulses.csv", impulse_report_csv(report)},
                   {"momentum.csv", momentum_csv(impulses.momentum)}};
  results.page = "impulses.html", results.page_data = [&] { return impulse_page_data(impulses); };
  results.text = impulse_report_text(report), results.verdict = report.verdict;
  return write_results(input, results, folder, options, listener);
}

}  // namespace grapnel
