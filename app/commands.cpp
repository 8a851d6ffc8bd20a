#include "commands.hpp"

#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/describe/contract.hpp"
#include "grapnel/report/gltf_export.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_fields.hpp"
#include "grapnel/result/series_export.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/study/optimization_report.hpp"
#include "grapnel/study_files/study_files.hpp"
#include "output_folder.hpp"
#include "process.hpp"
#include "run_problem.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

// Reports all faults on stderr, one a line.
int bad_input(const InputError& error) {
  say_faults(error.faults());
  return kBadInput;
}

std::vector<std::string> messages_of(const std::vector<Fault>& warnings) {
  std::vector<std::string> messages;
  for (const Fault& doubt : warnings) messages.push_back(doubt.message);
  return messages;
}

std::vector<Override> parse_overrides(const std::vector<std::string>& arguments) {
  std::vector<Override> overrides;
  for (const std::string& a : arguments) overrides.push_back(parse_override(a));
  return overrides;
}

std::vector<std::string> kinds_of_results() {
  std::vector<std::string> kinds;
  for (const ResultContract& one : result_contracts()) kinds.emplace_back(one.kind);
  return kinds;
}

}  // namespace

int run(const RunOptions& options) {
  CaptureProblem problem;
  std::vector<Fault> warnings;
  try {
    problem = load_scenario(options.scenario, parse_overrides(options.overrides), &warnings);
  } catch (const InputError& error) {
    return bad_input(error);
  }
  if (!options.quiet) {
    to_stdout("grapnel {}, scenario {} (sha256 {})\n\n", GRAPNEL_VERSION, options.scenario.string(),
              problem.sha256.substr(0, 12));
    flush_stdout();
  }
  const std::optional<fs::path> made = results_folder(options.output, options.scenario);
  if (!made) return kBadInput;
  say_faults(warnings);
  const StopSignal stop;
  return run_problem(problem, options.scenario, *made,
                     {.quiet = options.quiet,
                      .no_report = options.no_report,
                      .warnings = messages_of(warnings),
                      .stop = stop.token()});
}

int check(const fs::path& scenario, const std::vector<std::string>& overrides) {
  try {
    std::vector<Fault> warnings;
    const CaptureProblem problem = load_scenario(scenario, parse_overrides(overrides), &warnings);
    say_faults(warnings);
    to_stdout("{}: no faults{} ({}, sha256 {})\n", scenario.string(),
              warnings.empty() ? "" : fmt::format(", {} warning{}", warnings.size(), warnings.size() == 1 ? "" : "s"),
              problem.name, problem.sha256.substr(0, 12));
    return kDone;
  } catch (const InputError& error) {
    return bad_input(error);
  }
}

std::span<const ResultContract> result_contracts() {
  static constexpr ResultContract all[] = {
      {"summary", "summary", "Grapnel summary, version 2", &type_of<Summary>},
      {"scene", "scene", "Grapnel scene, version 1", &type_of<SceneDocument>},
      {"study-table", "study", "Grapnel study table, version 1", &type_of<SweepReport>},
      {"campaign-report", "campaign", "Grapnel campaign report, version 1", &type_of<CampaignReport>},
      {"optimization-result", "optimization", "Grapnel optimization result, version 1", &type_of<OptimizationReport>}};
  return all;
}

std::vector<std::string> schema_kinds() {
  std::vector<std::string> kinds{"scenario", "robot", "study", "optimization", "campaign"};
  for (const std::string& kind : kinds_of_results()) kinds.push_back(kind);
  return kinds;
}

int print_schema(const SchemaOptions& options) {
  const std::string& kind = options.kind;
  const ResultContract* result = nullptr;
  for (const ResultContract& one : result_contracts()) {
    if (one.kind == kind) result = &one;
  }
  const bool is_other = !options.page.empty() || options.typescript;
  if (is_other && !result) {
    to_stderr("grapnel: error: --typescript and --page are for results: {}\n", fmt::join(kinds_of_results(), ", "));
    return kBadInput;
  }
  try {
    write_stdout(options.typescript       ? typescript_types(result->document(), kOriginOfTypes)
                 : !options.page.empty()  ? page_with_tables(file_bytes(options.page), result->document())
                 : result                 ? json_schema(result->document(), result->title)
                 : kind == "robot"        ? robot_schema()
                 : kind == "study"        ? study_schema()
                 : kind == "optimization" ? optimization_schema()
                 : kind == "campaign"     ? campaign_schema()
                                          : scenario_schema());
    return kDone;
  } catch (const std::runtime_error& error) {  // of the page
    to_stderr("grapnel: error: {}\n", error.what());
    return kBadInput;
  }
}

int export_result(const fs::path& folder, bool csv, bool mat, bool glb) {
  try {
    if (csv) to_stdout("{}\n", export_csv(folder).string());
    if (mat) to_stdout("{}\n", export_mat(folder).string());
    if (glb) to_stdout("{}\n", export_glb(folder, GRAPNEL_VERSION).string());
    return kDone;
  } catch (const CannotWrite& error) {
    to_stderr("grapnel: error: {}\n", error.what());
    return kSimulationFailed;
  } catch (const std::exception& error) {  // of what is read
    to_stderr("grapnel: error: {}\n", error.what());
    return kBadInput;
  }
}

}  // namespace grapnel::app
