#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>
#include <string>

#include "arguments.hpp"
#include "commands.hpp"
#include "grapnel/text/input_files.hpp"
#include "manual.hpp"
#include "plugin_supervisor.hpp"
#include "terminal.hpp"

namespace {

using namespace grapnel::app;

// Parses the arguments; commands.hpp declares the subcommands.
int program(int argc, char** argv) {
  const grapnel::InputFiles inputs;
  CLI::App app{"Grapnel: simulates the capture of a tumbling object by a space robot"};
  app.name("grapnel");
  app.require_subcommand(1);
  app.set_version_flag("--version", "grapnel " GRAPNEL_VERSION);
  app.footer(std::string(exit_codes()));
  int code = kDone;

  RunOptions run_options;
  CLI::App* run_command = app.add_subcommand("run", "Simulate one capture; writes its results and report.html");
  run_command->add_option("scenario", run_options.scenario, "Scenario file (YAML)")->required();
  run_command->add_option("-o,--output", run_options.output,
                          "Result folder (default: out/ and the scenario file's name without .yaml)");
  run_command->add_option("--set", run_options.overrides, "Replace a value: path=value, e.g. approach.duration=10")
      ->allow_extra_args(false);
  run_command->add_flag("--force", run_options.force, "Replace the results of another scenario in the folder");
  run_command->add_flag("--margins", run_options.margins,
                        "Also linearize at the start and end of every phase: stability and margins of the controllers");
  run_command->add_flag("--no-report", run_options.no_report, "Write no report.html");
  run_command->add_flag("--quiet", run_options.quiet, "Print errors and warnings only");
  add_watch_flag(*run_command, run_options.watch);
  run_command->callback([&] { code = run(run_options); });

  StudyOptions sweep_options;
  CLI::App* sweep_command = app.add_subcommand(
      "sweep", "Simulate a capture at every point of a grid; writes table.csv, table.h5, study.json and report.html");
  sweep_command->add_option("study", sweep_options.study, "Study file (YAML)")->required();
  sweep_command->add_option("-o,--output", sweep_options.output,
                            "Result folder (default: out/ and the study file's name without .yaml; with "
                            "--only NAME-point-N)");
  sweep_command->add_option("-j,--jobs", sweep_options.threads, "Threads (default: one per processor)")
      ->check(CLI::Range(1, 4096));
  sweep_command->add_option("--only", sweep_options.only,
                            "Simulate only this point, as a complete run with report.html");
  sweep_command->add_flag("--no-report", sweep_options.no_report, "Write no report.html");
  sweep_command->add_flag("--quiet", sweep_options.quiet, "Print errors and warnings only");
  add_watch_flag(*sweep_command, sweep_options.watch);
  sweep_command->callback([&] { code = sweep(sweep_options); });

  CampaignRunOptions campaign_options;
  campaign_options.command = command_line("grapnel", argc, argv);
  campaign_options.resume = command_line_without("grapnel", argc, argv, "--extend");
  CLI::App* campaign_command = app.add_subcommand(
      "campaign", "Simulate captures with uncertain values; rerun the command to resume a stopped campaign");
  add_campaign_arguments(*campaign_command, campaign_options);
  add_machine_arguments(*campaign_command, campaign_options);
  add_watch_flag(*campaign_command, campaign_options.watch);
  campaign_command->callback([&] { code = campaign(campaign_options); });

  CLI::App* map_command = app.add_subcommand(
      "map", "Map the probability of success over two design parameters: one campaign per pair of values");
  map_command->alias("envelope");  // former name
  add_campaign_arguments(*map_command, campaign_options);
  add_machine_arguments(*map_command, campaign_options);
  add_watch_flag(*map_command, campaign_options.watch);
  map_command->callback([&] {
    campaign_options.map = true;
    code = campaign(campaign_options);
  });

  MergeOptions merge_options;
  CLI::App* merge_command =
      app.add_subcommand("merge", "Merge the parts of a campaign from several folders, and write its results");
  merge_command->add_option("folders", merge_options.folders, "Folders of one campaign")->required();
  merge_command
      ->add_option("-o,--output", merge_options.output, "Folder for the merged campaign; may be one of the folders")
      ->required();
  merge_command->add_flag("--no-report", merge_options.no_report, "Write no report.html");
  merge_command->add_flag("--no-csv", merge_options.no_csv, "Write no table.csv");
  merge_command->add_flag("--quiet", merge_options.quiet, "Print errors and warnings only");
  merge_command->callback([&] { code = merge(merge_options); });

  StudyOptions optimize_options;
  CLI::App* optimize_command = app.add_subcommand(
      "optimize", "Optimize a scenario's parameters; writes best.yaml, comparison.json, evaluations.csv, report.html");
  optimize_command->add_option("study", optimize_options.study, "Optimization file (YAML)")->required();
  optimize_command->add_option("-o,--output", optimize_options.output,
                               "Result folder (default: out/ and the study file's name without .yaml)");
  optimize_command->add_option("-j,--jobs", optimize_options.threads, "Threads (default: one per processor)")
      ->check(CLI::Range(1, 4096));
  optimize_command->add_flag("--no-report", optimize_options.no_report, "Write no report.html");
  optimize_command->add_flag("--quiet", optimize_options.quiet, "Print errors and warnings only");
  add_watch_flag(*optimize_command, optimize_options.watch);
  optimize_command->callback([&] { code = optimize(optimize_options); });

  ReportOptions report_options;
  CLI::App* report_command = app.add_subcommand("report", "Write report.html from results; for two runs a comparison");
  report_command->add_option("folder", report_options.folder, "Result folder of run, sweep, optimize, campaign or map")
      ->required();
  CLI::Option* second_run = report_command->add_option("second", report_options.second,
                                                       "Result folder of a run to compare with (default: none)");
  report_command
      ->add_flag("--index", report_options.index,
                 "Write index.html: an overview of all results in the folder and the folders below it, newest first")
      ->excludes(second_run);
  report_command->add_option(
      "-o,--output", report_options.output,
      "File (default: report.html in the folder; for a comparison report-vs-SECOND.html; index.html "
      "with --index)");
  report_command->callback([&] { code = report(report_options); });

  CompareOptions compare_options;
  CLI::App* compare_command = app.add_subcommand(
      "compare",
      "Compare a run with a log of measurements; writes comparison.json, comparison.csv and comparison.html");
  compare_command->add_option("run", compare_options.input.run, "Result folder of run")->required();
  compare_command
      ->add_option("log", compare_options.input.log, "File with measurements (CSV, HDF5, MAT, MCAP or rosbag)")
      ->required();
  compare_command->add_option("--map", compare_options.input.mapping,
                              "Mapping file (YAML): which columns of the log measure which series of the run "
                              "(default: columns with the names of series)");
  compare_command->add_option("-o,--output", compare_options.folder,
                              "Result folder (default: compare-LOG in the run's folder)");
  compare_command->add_flag("--quiet", compare_options.quiet, "Print errors and warnings only");
  compare_command->callback([&] { code = compare(compare_options); });

  ImpulsesOptions impulses_options;
  CLI::App* impulses_command = app.add_subcommand(
      "impulses",
      "Estimate the impulses at grasps and the momentum from a log; writes impulses.json, two CSV files and a page");
  impulses_command->add_option("run", impulses_options.input.run, "Result folder of run")->required();
  impulses_command
      ->add_option("log", impulses_options.input.log, "File with measurements (CSV, HDF5, MAT, MCAP or rosbag)")
      ->required();
  impulses_command->add_option("--map", impulses_options.input.mapping,
                               "Mapping file (YAML): which columns of the log measure which series of the run, and "
                               "their uncertainties (default: columns with the names of series)");
  impulses_command
      ->add_option("--at", impulses_options.at,
                   "Time of a contact [s of the run], or TIME:DURATION; repeatable (default: detected)")
      ->allow_extra_args(false);
  impulses_command
      ->add_option("--window", impulses_options.window,
                   "Length of the polynomials before and after a contact [s] (default: chosen)")
      ->check(CLI::PositiveNumber);
  impulses_command
      ->add_option("--false-alarms", impulses_options.false_alarms,
                   "Bound on the expected number of contacts in the log that are noise alone")
      ->capture_default_str()
      ->check(CLI::Range(1e-12, 0.5));
  impulses_command->add_option("--scenario", impulses_options.scenario,
                               "Scenario with the model (default: the one that the run's folder contains)");
  impulses_command
      ->add_option("--set", impulses_options.overrides,
                   "Change of the model: path=value, such as targets.debris.mass=12")
      ->allow_extra_args(false);
  impulses_command->add_option("-o,--output", impulses_options.folder,
                               "Result folder (default: impulses-LOG in the run's folder)");
  impulses_command->add_flag("--quiet", impulses_options.quiet, "Print errors and warnings only");
  impulses_command->callback([&] { code = impulses(impulses_options); });

  StudyOptions identify_options;
  CLI::App* identify_command = app.add_subcommand(
      "identify", "Identify parameters of a scenario from logs; writes identification.json, fitted.yaml, comparisons");
  identify_command->add_option("study", identify_options.study, "Identification file (YAML)")->required();
  identify_command->add_option("-o,--output", identify_options.output,
                               "Result folder (default: out/ and the study file's name without .yaml)");
  identify_command->add_option("-j,--jobs", identify_options.threads, "Threads (default: one per processor)")
      ->check(CLI::Range(1, 4096));
  identify_command->add_flag("--no-report", identify_options.no_report, "Write no comparison pages");
  identify_command->add_flag("--quiet", identify_options.quiet, "Print errors and warnings only");
  identify_command->callback([&] { code = identify(identify_options); });

  LinearizeCommandOptions linearize_options;
  CLI::App* linearize_command = app.add_subcommand(
      "linearize",
      "Print the linear model of a scenario at a time: eigenvalues, and the stability margins of its controllers");
  linearize_command->add_option("scenario", linearize_options.scenario, "Scenario file (YAML)")->required();
  linearize_command->add_option("--at", linearize_options.at, "Time of the operating point [s] (default: 0)")
      ->check(CLI::NonNegativeNumber);
  linearize_command->add_option("-o,--output", linearize_options.output,
                                "File for the matrices, their names and units: .mat or .json (default: none)");
  linearize_command
      ->add_option("--sample-time", linearize_options.sample_time,
                   "Sample time of the sampled model [s] (default: control.period of the scenario, if any)")
      ->check(CLI::PositiveNumber);
  linearize_command->add_option("--delay", linearize_options.delay, "Delay of the sampled model [s] (default: 0)")
      ->check(CLI::NonNegativeNumber);
  linearize_command->add_option("--set", linearize_options.overrides, "Replace a value: path=value")
      ->allow_extra_args(false);
  linearize_command->add_flag("--quiet", linearize_options.quiet, "Print errors and warnings only");
  linearize_command->callback([&] { code = linearize(linearize_options); });

  SensitivitiesCommandOptions sensitivities_options;
  CLI::App* sensitivities_command = app.add_subcommand(
      "sensitivities",
      "Print derivatives of the outcomes of a capture by values of its scenario; of a campaign also their first-order "
      "uncertainty");
  sensitivities_command->add_option("file", sensitivities_options.file, "Scenario or campaign file (YAML)")->required();
  sensitivities_command
      ->add_option(
          "--by", sensitivities_options.by,
          "Paths of the scenario's values, separated by commas, as of --set (default: masses, inertias, spins, "
          "closing speed, impact parameters and gains)")
      ->allow_extra_args(false);
  sensitivities_command
      ->add_option("--of", sensitivities_options.of,
                   "Outcomes: columns of studies, separated by commas, e.g. grasps/*/impulse_magnitude (default: the "
                   "main ones)")
      ->allow_extra_args(false);
  sensitivities_command->add_option("-o,--output", sensitivities_options.output,
                                    "Folder for sensitivities.json and sensitivities.csv (default: none)");
  sensitivities_command->add_option("-j,--jobs", sensitivities_options.threads, "Threads (default: one per processor)")
      ->check(CLI::Range(1, 4096));
  sensitivities_command->add_flag("--impact", sensitivities_options.impact_only,
                                  "Simulate the impact only, at the planned final configuration (scenario)");
  sensitivities_command->add_flag("--plan-once", sensitivities_options.plan_once,
                                  "Plan the approach once; every run follows that plan (scenario)");
  sensitivities_command->add_option("--set", sensitivities_options.overrides, "Replace a value: path=value (scenario)")
      ->allow_extra_args(false);
  sensitivities_command->add_flag("--quiet", sensitivities_options.quiet, "Print errors and warnings only");
  sensitivities_command->callback([&] { code = sensitivities(sensitivities_options); });

  FigureOptions figure_options;
  CLI::App* figure_command =
      app.add_subcommand("figure", "Draw a figure for a paper, with its data and gnuplot script");
  figure_command->add_option("folder", figure_options.folder, "Result folder of run, sweep, campaign or map")
      ->required();
  auto* what = figure_command->add_option("--what", figure_options.what, "Which figure, e.g. joints, momentum, strobe");
  figure_command->add_flag("--list", figure_options.list, "Print which figures the folder offers")->excludes(what);
  figure_command->add_option("-o,--output", figure_options.output,
                             "File: .pdf, .svg or .png (default: figures/WHAT.pdf in the folder)");
  figure_command
      ->add_option("--width", figure_options.width, "Width [cm] (default: 8.8; 17.8 with panels side by side)")
      ->check(CLI::Range(3.0, 100.0));
  figure_command->add_option("--height", figure_options.height, "Height [cm] (default: chosen for the figure)")
      ->check(CLI::Range(2.0, 100.0));
  figure_command->add_option("--phase", figure_options.phases, "Only this phase; may be repeated (default: all)")
      ->allow_extra_args(false);
  figure_command->add_option("--from", figure_options.from,
                             "Start of the time range [s] (default: the start of the run)");
  figure_command->add_option("--to", figure_options.to, "End of the time range [s] (default: the end of the run)");
  figure_command->add_option("--instants", figure_options.instants, "strobe: number of instants per panel (default: 6)")
      ->check(CLI::Range(1, 100));
  figure_command
      ->add_option("--times", figure_options.times,
                   "strobe: list of instants, e.g. 0,10,20 [s] (default: evenly spaced)")
      ->delimiter(',')
      ->allow_extra_args(false);
  figure_command->add_option("--view", figure_options.view, "strobe: viewing direction (default: iso)")
      ->check(CLI::IsMember({"x", "y", "z", "iso"}));
  figure_command
      ->add_option(
          "--column", figure_options.columns,
          "impulse-map, distribution: column of the table; may be repeated (default: the impulses of the grasps; the "
          "numbers that criteria limit)")
      ->allow_extra_args(false);
  figure_command->add_option("--x", figure_options.x_axis,
                             "impulse-map, success-map: horizontal axis (default: the axis with the most values)");
  figure_command->add_option("--lines", figure_options.lines_axis,
                             "impulse-map, success-map: axis with one line per value (default: the first other axis)");
  figure_command->add_flag("--heat-map", figure_options.heat_map,
                           "impulse-map, success-map: draw a colour map over two axes instead of lines");
  figure_command->callback([&] {
    figure_options.command = command_line("grapnel", argc, argv);
    code = figure(figure_options);
  });

  std::string scenario;
  std::vector<std::string> overrides;
  CLI::App* check_command = app.add_subcommand("check", "Check a scenario and report all errors");
  check_command->add_option("scenario", scenario, "Scenario file (YAML)")->required();
  check_command->add_option("--set", overrides, "Replace a value: path=value")->allow_extra_args(false);
  check_command->callback([&] { code = check(scenario, overrides); });

  SchemaOptions schema_options;
  CLI::App* schema_command = app.add_subcommand("schema", "Print the JSON Schema of a file format");
  schema_command
      ->add_option("kind", schema_options.kind, fmt::format("{} (default: scenario)", fmt::join(schema_kinds(), ", ")))
      ->check(CLI::IsMember(schema_kinds()));
  auto* typescript =
      schema_command->add_flag("--typescript", schema_options.typescript, "Print TypeScript types of a result instead");
  schema_command
      ->add_option("--page", schema_options.page, "Print this page of docs/formats with regenerated tables instead")
      ->excludes(typescript);
  schema_command->callback([&] { code = print_schema(schema_options); });

  std::string folder;
  ExportOptions export_options;
  CLI::App* export_command = app.add_subcommand("export", "Write a result folder's time series in other formats");
  export_command->add_option("folder", folder, "Result folder of grapnel run")->required();
  auto* formats = export_command->add_option_group("formats");
  formats->add_flag("--csv", export_options.csv, "timeseries.csv");
  formats->add_flag("--mat", export_options.mat, "timeseries.mat for MATLAB");
  formats->add_flag("--mcap", export_options.mcap, "timeseries.mcap for Foxglove");
  formats->add_flag("--glb", export_options.glb,
                    "capture.glb: an animated scene (glTF 2.0) for Blender and other viewers");
  formats->require_option(1, 4);
  export_command->callback([&] { code = export_result(folder, export_options); });

  ExportFmuOptions fmu_options;
  CLI::App* fmu_command = app.add_subcommand(
      "export-fmu", "Export a scenario's capture as an FMU: a plant whose actuators another tool commands");
  fmu_command->add_option("scenario", fmu_options.scenario, "Scenario file (YAML)")->required();
  fmu_command->add_option("-o,--output", fmu_options.output,
                          "File (default: the scenario file's name with .fmu, in the current folder)");
  fmu_command->add_option("--fmi", fmu_options.version, "Version of the Functional Mock-up Interface (default: 2)")
      ->check(CLI::IsMember({2, 3}));
  fmu_command
      ->add_option("--parameter", fmu_options.parameters,
                   "Path of a number of the scenario that becomes a parameter; may be repeated (default: those at "
                   "initial, targets, contact, impact and loads)")
      ->allow_extra_args(false);
  fmu_command->add_flag("--base-torque", fmu_options.base_torque,
                        "Make the torque on the base an input, instead of its wheels and thrusters");
  fmu_command->add_option("--set", fmu_options.overrides, "Replace a value: path=value")->allow_extra_args(false);
  fmu_command->callback([&] { code = export_fmu(fmu_options); });

  InitOptions init_options;
  CLI::App* init_command =
      app.add_subcommand("init", "Write a commented template, or list ready-made robots and targets");
  auto* template_name = init_command->add_option(
      "name", init_options.name, "single-arm, dual-arm, closed-loop, campaign or robot (default: single-arm)");
  init_command->add_option("-o,--output", init_options.output, "File (default: NAME.yaml)");
  init_command->add_flag("--list", init_options.list, "Print the ready-made robots, targets and templates")
      ->excludes(template_name);
  init_command->callback([&] { code = init(init_options); });

  std::string robot;
  CLI::App* info_command =
      app.add_subcommand("info", "Print mass, centre of mass, composite inertia and reach of a robot");
  info_command
      ->add_option("robot", robot,
                   "Robot file (YAML), a model in URDF or MJCF, or the name of a ready-made robot or target")
      ->required();
  info_command->callback([&] { code = info(robot); });

  ImportCommandOptions import_options;
  CLI::App* import_command = app.add_subcommand("import", "Convert a model in URDF or MJCF to a robot file");
  import_command->add_option("model", import_options.model, "Model file (.urdf, .xml)")->required();
  import_command->add_option("-o,--output", import_options.output, "Robot file (YAML) to write")->required();
  import_command->add_option("--base", import_options.base, "Link that becomes the base (default: the root)");
  import_command->add_option(
      "--bus", import_options.bus,
      "Satellite on which the model is mounted as an arm: a robot file (YAML), or the name of a ready-made "
      "robot");
  import_command->add_option("--mount", import_options.mount,
                             "Place on the bus, e.g. '{link: panel, position: [1, 0, 0], rpy: [0, 0, 1.57]}' (default: "
                             "the origin of its base)");
  import_command->add_option("--prefix", import_options.prefix, "With --bus: prefix of all names of the arm");
  import_command
      ->add_option(
          "--package", import_options.packages,
          "NAME=FOLDER: location of a ROS package; may be repeated (default: searched beside and above the model)")
      ->allow_extra_args(false);
  import_command
      ->add_option("--lock", import_options.locked,
                   "JOINT=VALUE: lock a joint at this position [rad or m]; may be repeated")
      ->allow_extra_args(false);
  import_command
      ->add_option("--wheel", import_options.wheels, "Joint on the base that becomes a reaction wheel; may be repeated")
      ->allow_extra_args(false);
  import_command
      ->add_option("--end-effector", import_options.end_effectors,
                   "Link or frame that becomes an end-effector; may be repeated (default: the outermost ones)")
      ->allow_extra_args(false);
  import_command->add_flag("--repair-inertia", import_options.repair_inertia,
                           "Replace physically impossible inertias by the nearest possible ones");
  import_command->callback([&] { code = import_robot_file(import_options); });

  ModesOptions modes_options;
  CLI::App* modes_command = app.add_subcommand(
      "modes",
      "Compute modes of vibration of a link or panel from mass and stiffness matrices of a finite-element model");
  modes_command
      ->add_option("--mass", modes_options.mass,
                   "File of the mass matrix: .mtx (Matrix Market, Abaqus), .csv, CalculiX's .mas, Nastran's DMIG "
                   "(.pch, .bdf) or "
                   ".op4")
      ->required();
  modes_command
      ->add_option("--stiffness", modes_options.stiffness, "File of the stiffness matrix; may be the same file")
      ->required();
  modes_command
      ->add_option("--units", modes_options.units,
                   "Units of the model, LENGTH-MASS-s: m-kg-s, mm-t-s, in-slinch-s, ...")
      ->required();
  modes_command->add_option("--interface", modes_options.interface_node,
                            "Node with six degrees of freedom where the body is attached; origin of the body's frame");
  modes_command->add_option(
      "--interface-nodes", modes_options.interface_nodes,
      "File of nodes that form the rigid interface where the body is attached: lines NODE, X, Y, Z");
  modes_command
      ->add_option("--origin", modes_options.origin,
                   "X Y Z of the frame's origin, with --interface-nodes, in the model's units (default: 0 0 0)")
      ->expected(3);
  modes_command
      ->add_option("--interface-rows", modes_options.interface_rows,
                   "For matrices without row names: the six rows of the interface's translations and rotations "
                   "(default: 1 2 3 4 5 6)")
      ->expected(6);
  modes_command->add_option("--row-names", modes_options.row_names,
                            "File with the names of the rows, one line NODE.COMPONENT per row (default: the matrix's "
                            "file name with the ending .dof, if it exists)");
  modes_command->add_option("--node-places", modes_options.node_places,
                            "File of more nodes, in the format of --interface-nodes; they locate shells and beams "
                            "that CalculiX expanded to solids, and are not part of the interface");
  modes_command->add_option("--mass-name", modes_options.mass_name,
                            "Name of the mass matrix in a file with several matrices");
  modes_command->add_option("--stiffness-name", modes_options.stiffness_name, "Likewise");
  modes_command
      ->add_option("--modes", modes_options.modes,
                   "Maximum number of modes (default: 20, or all modes of a smaller model)")
      ->check(CLI::Range(1, 50));
  modes_command->add_option("--below", modes_options.below, "Modes below this frequency [Hz] (default: 100)")
      ->check(CLI::PositiveNumber);
  modes_command->add_option("--damping", modes_options.damping, "Damping ratio of all modes (default: 0)")
      ->check(CLI::Range(0.0, 1.0));
  modes_command->add_option("--expect", modes_options.expected,
                            "Expected frequencies [Hz] of the first modes; a difference of more than 1 % is an error");
  modes_command->add_option("-o,--output", modes_options.output,
                            "File (YAML) for mass, com, inertia and modes (default: print the table only)");
  modes_command->callback([&] { code = modes_of_matrices(modes_options); });

  bool as_markdown = false;
  CLI::App* manual_command = app.add_subcommand("manual", "Print the manual page: grapnel manual | man -l -");
  manual_command->add_flag("--markdown", as_markdown, "Print it in Markdown instead");
  manual_command->callback([&] { write_stdout(as_markdown ? manual_markdown(app) : manual_page(app)); });

  std::string shell = "bash";
  CLI::App* completion_command =
      app.add_subcommand("completion", "Print completions for a shell: eval \"$(grapnel completion bash)\"");
  completion_command->add_option("shell", shell, "Which shell (default: bash)")->check(CLI::IsMember({"bash"}));
  completion_command->callback([&] { write_stdout(bash_completion(app)); });

  require_finite_numbers(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version are successes; other parse results are bad input.
    return end_of_parsing(app, error);
  } catch (const std::exception& error) {
    return unexpected_error(error);
  }
  if (print_plugin_errors() && code == kDone) code = kSimulationFailed;
  // A full disk or a closed pipe on stdout is an error.
  if ((std::fflush(stdout) != 0 || std::ferror(stdout) != 0) && code == kDone) {
    to_stderr("grapnel: error: cannot write to standard output\n");
    return kSimulationFailed;
  }
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  prepare_process();
  supervise_plugins();
  return end_of_program(program(argc, argv));
}
