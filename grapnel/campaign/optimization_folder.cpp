#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <stdexcept>

#include "grapnel/campaign/campaign_folder.hpp"
#include "grapnel/campaign/optimization_report.hpp"
#include "grapnel/campaign/quantity.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/text/error_text.hpp"

namespace grapnel {
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

OptimizationOutcome search(const Optimization& optimization, const FolderOptions& options, Listener& listener) {
  PoolOptions pool{.threads = threads_of(options.threads), .stop = options.stop};
  if (!options.quiet) {
    listener.points({});
    pool.progress = [&](const CaseProgress& at) { listener.points(at); };
  }
  return optimize(optimization, pool);
}

// Writes the evaluations of a stopped search, and the best of them without simulating it again.
Ending write_stopped(const Optimization& optimization, const OptimizationOutcome& outcome, const fs::path& folder,
                     Listener& listener) {
  if (outcome.evaluations.empty()) {
    listener.remark(optimization.file + ": stopped before the first evaluation was complete; nothing is written");
    return Ending::interrupted;
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
  listener.remark(fmt::format("{}: stopped: {} of {} evaluations are kept in {}{}", optimization.file,
                              outcome.evaluations.size(), optimization.search.evaluations,
                              (folder / "evaluations.csv").string(), best));
  return Ending::interrupted;
}

// Searches and writes the results.
Ending search_and_write(const Optimization& optimization, const FolderOptions& options, const fs::path& folder,
                        Listener& listener) {
  const OptimizationOutcome outcome = search(optimization, options, listener);
  if (options.stop.stop_requested()) return write_stopped(optimization, outcome, folder, listener);
  write_file_atomically(folder / "evaluations.csv", evaluations_csv(optimization, outcome));
  fs::remove(folder / "best.yaml");  // of an earlier search
  std::optional<Evaluation> after;
  try {
    if (outcome.best) after = write_best(optimization, outcome, folder / "best.yaml", options.stop);
  } catch (const EvaluationStopped&) {
    return write_stopped(optimization, outcome, folder, listener);
  }
  const Evaluation* shown = after ? &*after : nullptr;
  write_file_atomically(folder / "comparison.json", comparison_json(optimization, outcome, shown, GRAPNEL_VERSION));
  const FolderReport report = write_folder_report(folder, ResultKind::optimization, options.no_report, listener);
  if (!options.quiet) {
    listener.note(fmt::format("{}\nresults in {}: {}comparison.json, evaluations.csv\n{}",
                              comparison_text(optimization, outcome, shown), folder.string(),
                              shown ? "best.yaml, " : "", report.line));
  }
  if (shown) return report.failed ? Ending::failed : Ending::done;
  listener.error(optimization.file, why_nothing_is_best(optimization, outcome));
  return Ending::failed;
}

}  // namespace

Ending run_optimization_folder(const Optimization& optimization, const fs::path& folder, const FolderOptions& options,
                               Listener& listener) {
  try {
    return search_and_write(optimization, options, folder, listener);
  } catch (const std::exception& error) {
    listener.error("grapnel", error_text(error));
    return Ending::failed;
  }
}

}  // namespace grapnel
