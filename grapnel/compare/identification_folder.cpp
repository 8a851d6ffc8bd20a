#include "grapnel/compare/identification_folder.hpp"

#include <fmt/format.h>

#include "grapnel/campaign/campaign_folder.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/compare/comparison_page.hpp"
#include "grapnel/compare/identification_report.hpp"
#include "grapnel/report/report_html.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/text/error_text.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kUsualEvaluations = 8;  // of a search, for the progress

std::string fitted_text(const Identification& identification, const LogFit& fit, const fs::path& file,
                        const std::string& note) {
  std::string comment =
      fmt::format("Made by grapnel {} identify from {} (sha256 {}).\n", GRAPNEL_VERSION,
                  fs::path(identification.file).filename().string(), identification.sha256.substr(0, 12));
  for (std::size_t k = 0; k < fit.best.size(); ++k) {
    const FittedParameter& p = identification.problem.parameters[k];
    const bool has = k < fit.parameters.size() && fit.parameters[k].uncertainty;
    comment += fmt::format("  {}: {:.9g}{}{}\n", p.name, fit.best[k], p.unit.empty() ? "" : " " + p.unit,
                           has ? fmt::format(", standard uncertainty {:.3g}", *fit.parameters[k].uncertainty)
                               : std::string(", without an uncertainty"));
  }
  return identification.scenario_text(fit.best, file, comment + note);
}

void write_comparison(const Identification::Log& log, LogEstimate& one, const fs::path& folder, bool no_page) {
  one.comparison.report.version = GRAPNEL_VERSION;
  one.comparison.report.run = log.run, one.comparison.report.log = log.log;
  const fs::path own = folder / "logs" / log.name;
  fs::create_directories(own);
  write_file_atomically(own / "comparison.csv", one.comparison.residuals_csv);
  write_file_atomically(own / "comparison.json", comparison_report_json(one.comparison.report));
  if (no_page)
    fs::remove(own / "comparison.html");  // of an earlier fit
  else
    write_report(comparison_page_data(one.comparison), own / "comparison.html");
}

Ending write_stopped(const Identification& identification, const LogFit& fit, const fs::path& folder,
                     Listener& listener) {
  if (fit.best.empty()) {
    listener.remark(identification.file + ": stopped before the first evaluation was complete; nothing is written");
    return Ending::interrupted;
  }
  fs::remove(folder / "identification.json");  // of an earlier fit
  write_file_atomically(folder / "evaluations.csv", identification_evaluations_csv(identification, fit));
  const fs::path file = folder / "fitted.yaml";
  write_file_atomically(file, fitted_text(identification, fit, file, "The search was stopped before its end.\n"));
  listener.remark(fmt::format("{}: stopped: {} evaluations are kept in {}; the best of them is {}", identification.file,
                              fit.evaluations.size(), (folder / "evaluations.csv").string(), file.string()));
  return Ending::interrupted;
}

Ending fit_and_write(const Identification& identification, const fs::path& folder, const FolderOptions& options,
                     Listener& listener) {
  FitOptions fitting{.threads = threads_of(options.threads), .stop = options.stop};
  if (!options.quiet) {
    const std::size_t most = identification.problem.settings.starts * kUsualEvaluations;
    fitting.progress = [&listener, most](std::size_t, std::size_t evaluations) {
      CaseProgress progress;
      progress.done = evaluations, progress.total = std::max(most, evaluations);
      listener.points(progress);
    };
  }
  LogFit fit = fit_logs(identification.problem, fitting);
  if (fit.stopped) return write_stopped(identification, fit, folder, listener);
  write_file_atomically(folder / "evaluations.csv", identification_evaluations_csv(identification, fit));
  if (!fit.failure.empty()) {
    listener.error(identification.file, "no start can be simulated: " + fit.failure);
    return Ending::failed;
  }
  const fs::path file = folder / "fitted.yaml";
  write_file_atomically(file, fitted_text(identification, fit, file, ""));
  const std::string no_page = why_no_reports();
  for (std::size_t i = 0; i < fit.logs.size(); ++i)
    write_comparison(identification.logs[i], fit.logs[i], folder, options.no_report || !no_page.empty());
  const FittedLogsReport report = identification_report(identification, fit, GRAPNEL_VERSION);
  write_file_atomically(folder / "identification.json", identification_json(report));
  if (!options.quiet) {
    listener.note(fmt::format("{}results in {}: identification.json, fitted.yaml, evaluations.csv, logs/\n{}",
                              identification_text(report), folder.string(),
                              no_page.empty() ? "" : fmt::format("no pages: {}\n", no_page)));
  }
  if (fit.stopped_validating) {
    listener.remark(identification.file + ": stopped during the cross-validation; the fit is complete");
    return Ending::interrupted;
  }
  return fit.agrees == Verdict::no ? Ending::failed : Ending::done;
}

}  // namespace

std::vector<fs::path> identification_files(const Identification& identification, const fs::path& folder) {
  std::vector<fs::path> files{folder / "identification.json", folder / "fitted.yaml", folder / "evaluations.csv"};
  for (const Identification::Log& log : identification.logs) {
    for (const char* name : {"comparison.json", "comparison.csv", "comparison.html"})
      files.push_back(folder / "logs" / log.name / name);
  }
  return files;
}

Ending run_identification_folder(const Identification& identification, const fs::path& folder,
                                 const FolderOptions& options, Listener& listener) {
  try {
    return fit_and_write(identification, folder, options, listener);
  } catch (const std::exception& error) {
    listener.error("grapnel", error_text(error));
    return Ending::failed;
  }
}

}  // namespace grapnel
