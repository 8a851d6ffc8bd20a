#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <exception>

#include "commands.hpp"

// Argument parsing only; what the subcommands do is in commands.hpp.
int main(int argc, char** argv) {
  using namespace grapnel::app;
  CLI::App app{"Grapnel: what happens when a space robot catches a tumbling object"};
  app.name("grapnel");
  app.require_subcommand(1);
  app.set_version_flag("--version", "grapnel " GRAPNEL_VERSION);
  int code = kDone;

  RunOptions run_options;
  CLI::App* run_command = app.add_subcommand("run", "Simulate one capture; writes summary.json and timeseries.h5");
  run_command->add_option("scenario", run_options.scenario, "Scenario file (YAML)")->required();
  run_command->add_option("-o,--output", run_options.output, "Result folder (default: out/NAME-OF-THE-SCENARIO)");
  run_command->add_option("--set", run_options.overrides, "Replace a value: path=value, e.g. approach.duration=10")
      ->allow_extra_args(false);
  run_command->add_flag("--quiet", run_options.quiet, "Print errors and warnings only");
  run_command->callback([&] { code = run(run_options); });

  SweepOptions sweep_options;
  CLI::App* sweep_command =
      app.add_subcommand("sweep", "Simulate a grid of captures; writes table.csv, table.h5 and study.json");
  sweep_command->add_option("study", sweep_options.study, "Study file (YAML)")->required();
  sweep_command->add_option("-o,--output", sweep_options.output, "Result folder (default: out/NAME-OF-THE-STUDY)");
  sweep_command->add_option("-j,--jobs", sweep_options.threads, "Threads (default: one per processor)")
      ->check(CLI::Range(1, 4096));
  sweep_command->add_flag("--quiet", sweep_options.quiet, "Print errors and warnings only");
  sweep_command->callback([&] { code = sweep(sweep_options); });

  OptimizeOptions optimize_options;
  CLI::App* optimize_command = app.add_subcommand(
      "optimize", "Look for the best of many captures; writes best.yaml, comparison.json and evaluations.csv");
  optimize_command->add_option("study", optimize_options.study, "Optimization file (YAML)")->required();
  optimize_command->add_option("-o,--output", optimize_options.output, "Result folder (default: out/NAME-OF-THE-STUDY)");
  optimize_command->add_option("-j,--jobs", optimize_options.threads, "Threads (default: one per processor)")
      ->check(CLI::Range(1, 4096));
  optimize_command->add_flag("--quiet", optimize_options.quiet, "Print errors and warnings only");
  optimize_command->callback([&] { code = optimize(optimize_options); });

  std::string scenario;
  std::vector<std::string> overrides;
  CLI::App* check_command = app.add_subcommand("check", "Report every fault of a scenario at once");
  check_command->add_option("scenario", scenario, "Scenario file (YAML)")->required();
  check_command->add_option("--set", overrides, "Replace a value: path=value")->allow_extra_args(false);
  check_command->callback([&] { code = check(scenario, overrides); });

  std::string which = "scenario";
  CLI::App* schema_command = app.add_subcommand("schema", "Print the JSON Schema of a kind of file");
  schema_command->add_option("kind", which, "scenario, robot, study or optimization")
      ->check(CLI::IsMember({"scenario", "robot", "study", "optimization"}));
  schema_command->callback([&] { code = print_schema(which); });

  std::string folder;
  bool csv = false, mat = false;
  CLI::App* export_command = app.add_subcommand("export", "Write a result folder's time series in another format");
  export_command->add_option("folder", folder, "Result folder of grapnel run")->required();
  auto* formats = export_command->add_option_group("formats");
  formats->add_flag("--csv", csv, "timeseries.csv");
  formats->add_flag("--mat", mat, "timeseries.mat for MATLAB");
  formats->require_option(1, 2);
  export_command->callback([&] { code = export_result(folder, csv, mat); });

  std::string robot;
  CLI::App* info_command = app.add_subcommand("info", "Mass, centre of mass, composite inertia and reach of a robot");
  info_command->add_option("robot", robot, "Robot file (YAML)")->required();
  info_command->callback([&] { code = info(robot); });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version are successes; everything else is bad input.
    return app.exit(error) == 0 ? kDone : kBadInput;
  } catch (const std::exception& error) {
    fmt::print(stderr, "grapnel: error: {}\n", error.what());
    return kSimulationFailed;
  }
  // A full disk or a closed pipe behind stdout is no success.
  if ((std::fflush(stdout) != 0 || std::ferror(stdout) != 0) && code == kDone) {
    fmt::print(stderr, "grapnel: error: cannot write to standard output\n");
    return kSimulationFailed;
  }
  return code;
}
