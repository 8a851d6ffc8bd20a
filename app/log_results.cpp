#include "log_results.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "commands.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/report/report_html.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/text/error_text.hpp"
#include "terminal.hpp"

namespace grapnel::app {

namespace fs = std::filesystem;

fs::path log_results_folder(const fs::path& output, const fs::path& run, const fs::path& log,
                            const std::string& command) {
  return output.empty() ? run / (command + "-" + log.stem().string()) : output;
}

int write_log_results(const LogResults& results, bool quiet) {
  Terminal terminal;
  std::vector<fs::path> paths;
  std::vector<std::string> names;
  for (const auto& [name, text] : results.files) names.push_back(name), paths.push_back(results.folder / name);
  paths.push_back(results.folder / results.page);
  if (!may_write(paths, terminal)) return kBadInput;
  const std::string no_page = why_no_reports();
  try {
    fs::create_directories(results.folder);
    for (const auto& [name, text] : results.files) write_file_atomically(results.folder / name, text);
    if (no_page.empty()) write_report(results.page_data(), results.folder / results.page);
  } catch (const std::exception& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kSimulationFailed;
  }
  if (no_page.empty()) names.push_back(results.page);
  if (!quiet) {
    to_stdout("grapnel {}, run {} (scenario {}), log {}\n\n", GRAPNEL_VERSION, results.run.string(), results.scenario,
              results.log.string());
    write_stdout(results.text);
    to_stdout("results in {}: {}\n{}", results.folder.string(), fmt::join(names, ", "),
              no_page.empty() ? "" : fmt::format("no page: {}\n", no_page));
  }
  return results.verdict == Verdict::no ? kSimulationFailed : kDone;
}

}  // namespace grapnel::app
