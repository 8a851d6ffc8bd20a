// grapnel sensitivities: derivatives of the outcomes of a capture, and their first-order uncertainty.
#include "grapnel/campaign/sensitivities.hpp"

#include <fmt/format.h>

#include "commands.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/text/error_text.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

// "a,b" => a, b
std::vector<std::string> separated(const std::vector<std::string>& lists) {
  std::vector<std::string> items;
  for (const std::string& list : lists) {
    for (std::size_t begin = 0; begin <= list.size();) {
      const std::size_t end = std::min(list.find(',', begin), list.size());
      if (end > begin) items.push_back(list.substr(begin, end - begin));
      begin = end + 1;
    }
  }
  return items;
}

SensitivityChoice choice_of(const SensitivitiesCommandOptions& options) {
  SensitivityChoice choice;
  choice.by = separated(options.by), choice.of = separated(options.of);
  choice.mode = options.impact_only ? StudyMode::impact : StudyMode::run;
  choice.plan = options.plan_once ? CampaignPlan::nominal : CampaignPlan::per_case;
  for (const std::string& one : options.overrides) choice.overrides.push_back(parse_override(one));
  return choice;
}

int compute(const SensitivityTask& task, const SensitivitiesCommandOptions& options, Terminal& terminal) {
  const StopSignal stop;
  SensitivityOptions computing{.threads = threads_of(options.threads), .stop = stop.token()};
  if (!options.quiet) computing.progress = [&](const CaseProgress& at) { terminal.points(at); };
  const SensitivityReport report = sensitivities(task, computing);
  if (!options.quiet) to_stdout("{}", sensitivities_text(report));
  if (options.output.empty()) return kDone;
  write_file_atomically(options.output / "sensitivities.json", sensitivities_json(report));
  write_file_atomically(options.output / "sensitivities.csv", sensitivities_csv(report));
  if (!options.quiet) to_stdout("results in {}: sensitivities.json, sensitivities.csv\n", options.output.string());
  return kDone;
}

}  // namespace

int sensitivities(const SensitivitiesCommandOptions& options) {
  const std::string file = options.file.string();
  try {
    std::vector<Fault> warnings;
    const SensitivityTask task = load_sensitivities(options.file, choice_of(options), &warnings);
    print_errors(warnings);
    Terminal terminal;
    if (!options.output.empty() && !results_folder(options.output, options.file, Outputs::sensitivities, terminal))
      return kBadInput;
    return compute(task, options, terminal);
  } catch (const SensitivitiesStopped&) {
    to_stderr("{}: stopped; nothing is written\n", file);
    return kInterrupted;
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  } catch (const CaptureProblemError& error) {
    to_stderr("grapnel: error: {}: {}\n", file, error_text(error));
    return kBadInput;
  } catch (const SensitivitiesFailed& error) {
    to_stderr("grapnel: error: {}: the capture has no outcomes to differentiate: {}\n", file, error_text(error));
    return kSimulationFailed;
  } catch (const std::runtime_error& error) {
    to_stderr("grapnel: error: {}: {}\n", file, error_text(error));
    return kSimulationFailed;
  }
}

}  // namespace grapnel::app
