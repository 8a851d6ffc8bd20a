// grapnel compare: residuals of a log of measurements against a run.
#include <fmt/format.h>

#include <string_view>

#include "commands.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/compare/compare_log.hpp"
#include "grapnel/compare/comparison_page.hpp"
#include "grapnel/report/report_html.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/text/error_text.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

// Whether the file, if it exists, is of an earlier comparison with a log: optimizations have a file of the same name.
bool is_of_comparison(const fs::path& file) {
  std::error_code unknown;
  if (!fs::exists(file, unknown)) return true;
  try {
    read_json_document(file, "grapnel-log-comparison/1");
    return true;
  } catch (const std::exception&) {
    to_stderr("grapnel: error: '{}' is not a comparison with a log; choose another folder with -o\n", file.string());
    return false;
  }
}

}  // namespace

int compare(const CompareOptions& options) {
  fs::path run = options.run;
  if (!run.has_filename()) run = run.parent_path();
  try {
    note_results(run);
    const fs::path folder = options.output.empty() ? run / ("compare-" + options.log.stem().string()) : options.output;
    const fs::path json = folder / "comparison.json", csv = folder / "comparison.csv",
                   page = folder / "comparison.html";
    const LogComparison comparison = compare_log(run, options.log, options.mapping);
    Terminal terminal;
    if (!may_write({json, csv, page}, terminal) || !is_of_comparison(json)) return kBadInput;
    const std::string no_page = why_no_reports();
    try {
      fs::create_directories(folder);
      write_file_atomically(csv, comparison.residuals_csv);
      write_file_atomically(json, comparison_report_json(comparison.report));
      if (no_page.empty()) write_report(comparison_page_data(comparison), page);
    } catch (const std::exception& error) {
      to_stderr("grapnel: error: {}\n", error_text(error));
      return kSimulationFailed;
    }
    if (!options.quiet) {
      to_stdout("grapnel {}, run {} (scenario {}), log {}\n\n", GRAPNEL_VERSION, run.string(),
                comparison.report.run.scenario, options.log.string());
      write_stdout(comparison_report_text(comparison.report));
      to_stdout("results in {}: comparison.json, comparison.csv{}\n{}", folder.string(),
                no_page.empty() ? ", comparison.html" : "",
                no_page.empty() ? "" : fmt::format("no page: {}\n", no_page));
    }
    return comparison.report.verdict == Verdict::no ? kSimulationFailed : kDone;
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  }
}

}  // namespace grapnel::app
