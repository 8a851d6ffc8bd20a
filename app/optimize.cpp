#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <stdexcept>

#include "commands.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/study/optimization_report.hpp"
#include "grapnel/study/quantity.hpp"
#include "grapnel/study_files/study_files.hpp"
#include "grapnel/text/error_text.hpp"
#include "output_folder.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

// Maximum difference of the objective between the written file and the point it was written from.
constexpr double kSame = 1e-9;

std::string comment_of(const Optimization& optimization, const OptimizationOutcome& outcome) {
  const Evaluation& best = outcome.evaluations[*outcome.best];
  std::string text = fmt::format(
      "Made by grapnel {} optimize from {} (sha256 {}).\n{}: {:.9g}, in the original scenario {:.9g}; point {} of "
      "{}.\n",
      GRAPNEL_VERSION, fs::path(optimization.file).filename().string(), optimization.sha256.substr(0, 12),
      objective_text(optimization), best.score.objective, outcome.before.score.objective, best.row.index,
      outcome.evaluations.size());
  for (std::size_t k = 0; k < optimization.variables.size(); ++k) {
    const OptimizationVariable& v = optimization.variables[k];
    text += fmt::format("  {}: {:.9g}{}\n", v.name, best.values[k], v.unit.empty() ? "" : " " + v.unit);
  }
  return text;
}

// Writes the best point as a scenario and simulates that file, so that the reported values are those that the user
// obtains.
Evaluation write_best(const Optimization& optimization, const OptimizationOutcome& outcome, const fs::path& file,
                      const std::stop_token& stop) {
  const Evaluation& best = outcome.evaluations[*outcome.best];
  write_file_atomically(file, optimization.scenario_text(best.values, file, comment_of(optimization, outcome)));
  const CaptureProblem written = load_scenario(file);
  const Evaluation after = evaluate(optimization, {written, inward_normals(written)}, stop);
  const double difference = std::abs(after.score.objective - best.score.objective);
  if (!(difference <= kSame * std::abs(best.score.objective) || difference <= kSame) || !after.score.acceptable())
    throw std::runtime_error(fmt::format("{} gives {}, but the search found {}", file.string(), after.score.objective,
                                         best.score.objective));
  return after;
}

OptimizationOutcome search(const Optimization& optimization, const StudyOptions& options, const std::stop_token& stop) {
  Progress progress(options.quiet);
  return optimize(optimization, {.threads = threads_of(options.threads),
                                 .progress = [&](const CaseProgress& at) { progress.report_points(at); },
                                 .stop = stop});
}

// Writes the evaluations of a stopped search, and the best of them without simulating it again.
int keep_stopped(const Optimization& optimization, const OptimizationOutcome& outcome, const fs::path& folder) {
  if (outcome.evaluations.empty()) {
    to_stderr("{}: stopped before the first evaluation was complete; nothing is written\n", optimization.file);
    return kInterrupted;
  }
  write_file_atomically(folder / "evaluations.csv", evaluations_csv(optimization, outcome));
  for (const char* name : {"best.yaml", "comparison.json", "report.html"})
    fs::remove(folder / name);  // of an earlier search
  std::string best;
  if (outcome.best) {
    const fs::path file = folder / "best.yaml";
    write_file_atomically(file, optimization.scenario_text(
                                    outcome.evaluations[*outcome.best].values, file,
                                    comment_of(optimization, outcome) + "The search was stopped before its end.\n"));
    best = fmt::format("; the best of them is {}", file.string());
  }
  to_stderr("{}: stopped: {} of {} evaluations are kept in {}{}\n", optimization.file, outcome.evaluations.size(),
            optimization.search.evaluations, (folder / "evaluations.csv").string(), best);
  return kInterrupted;
}

// Searches and writes the results. Returns the exit code.
int search_and_write(const Optimization& optimization, const StudyOptions& options, const fs::path& folder,
                     const std::stop_token& stop) {
  const OptimizationOutcome outcome = search(optimization, options, stop);
  if (stop.stop_requested()) return keep_stopped(optimization, outcome, folder);
  write_file_atomically(folder / "evaluations.csv", evaluations_csv(optimization, outcome));
  fs::remove(folder / "best.yaml");  // of an earlier search
  std::optional<Evaluation> after;
  try {
    if (outcome.best) after = write_best(optimization, outcome, folder / "best.yaml", stop);
  } catch (const EvaluationStopped&) {
    return keep_stopped(optimization, outcome, folder);
  }
  const Evaluation* shown = after ? &*after : nullptr;
  write_file_atomically(folder / "comparison.json", comparison_json(optimization, outcome, shown, GRAPNEL_VERSION));
  const FolderReport report = write_folder_report(folder, ResultKind::optimization, options.no_report);
  if (!options.quiet) {
    to_stdout("{}\nresults in {}: {}comparison.json, evaluations.csv\n{}",
              comparison_text(optimization, outcome, shown), folder.string(), shown ? "best.yaml, " : "", report.line);
  }
  if (shown) return report.failed ? kSimulationFailed : kDone;
  to_stderr("{}: error: {}\n", options.study.string(), why_nothing_is_best(optimization, outcome));
  return kSimulationFailed;
}

}  // namespace

int optimize(const StudyOptions& options) {
  Optimization optimization;
  try {
    std::vector<Fault> warnings;
    optimization = load_optimization(options.study, &warnings);
    print_errors(warnings);
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  }
  const std::optional<fs::path> made = results_folder(options.output, options.study, Outputs::optimization);
  if (!made) return kBadInput;
  const fs::path& folder = *made;
  if (!may_replace(folder / "best.yaml")) return kBadInput;
  if (!options.quiet) {
    to_stdout("grapnel {}, optimization {} (sha256 {})\n\n", GRAPNEL_VERSION, options.study.string(),
              optimization.sha256.substr(0, 12));
    flush_stdout();
  }
  try {
    const StopSignal stop(options.stop);
    return search_and_write(optimization, options, folder, stop.token());
  } catch (const std::exception& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kSimulationFailed;
  }
}

}  // namespace grapnel::app
