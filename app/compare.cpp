// grapnel compare: residuals of a log of measurements against a run.
#include <fmt/format.h>

#include <string_view>

#include "commands.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/compare/compare_log.hpp"
#include "grapnel/compare/comparison_page.hpp"
#include "grapnel/result/json_document.hpp"
#include "log_results.hpp"
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
    const fs::path folder = log_results_folder(options.output, run, options.log, "compare");
    const LogComparison comparison = compare_log(run, options.log, options.mapping);
    if (!is_of_comparison(folder / "comparison.json")) return kBadInput;
    LogResults results{run, options.log, folder, comparison.report.run.scenario};
    results.files = {{"comparison.json", comparison_report_json(comparison.report)},
                     {"comparison.csv", comparison.residuals_csv}};
    results.page = "comparison.html", results.page_data = [&] { return comparison_page_data(comparison); };
    results.text = comparison_report_text(comparison.report), results.verdict = comparison.report.verdict;
    return write_log_results(results, options.quiet);
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  }
}

}  // namespace grapnel::app
