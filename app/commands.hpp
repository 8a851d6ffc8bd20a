#pragma once

/// @file
/// The program's subcommands. Each returns the exit code: 0 success; 1 the simulation or its conservation checks
/// failed, a log disagrees, or a file could not be written; 2 bad input; 3 some points or cases of a study failed; 130
/// stopped by Ctrl-C.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/campaign/campaign_folder.hpp"
#include "grapnel/compare/log_folder.hpp"
#include "grapnel/describe/type.hpp"

namespace grapnel::app {

constexpr int code_of(Ending ending) { return static_cast<int>(ending); }
inline constexpr int kDone = code_of(Ending::done);
inline constexpr int kSimulationFailed = code_of(Ending::failed);
inline constexpr int kBadInput = code_of(Ending::bad_input);
inline constexpr int kInterrupted = code_of(Ending::interrupted);  // Ctrl-C

struct RunOptions {
  std::filesystem::path scenario;
  std::filesystem::path output;        // empty: named after the scenario, in out/
  std::vector<std::string> overrides;  // path=value
  bool quiet = false;
  bool no_report = false;
  bool force = false;  // replaces results of another scenario in the folder
  bool margins = false;
  bool watch = false;  // live page
};
int run(const RunOptions& options);

/// Options of all commands that simulate many captures from one file.
struct StudyOptions : FolderOptions {
  std::filesystem::path study;
  std::filesystem::path output;       // empty: named after the study, in out/
  std::optional<std::uint64_t> only;  // this point or case only, as a complete run; not for optimizations
  bool watch = false;                 // live page; not for identifications
};
int sweep(StudyOptions options);
int optimize(StudyOptions options);
/// Identifies parameters of a scenario from logs. The simulation failed: the model disagrees with the logs.
int identify(StudyOptions options);

struct CampaignRunOptions : CampaignFolderOptions {
  std::filesystem::path study;
  std::filesystem::path output;
  std::optional<std::uint64_t> only;
  std::string shard;   // "i/N", "slurm"; empty: from the environment
  bool map = false;    // the file must have a design
  bool watch = false;  // live page
};
int campaign(CampaignRunOptions options);
/// Prints the program version, the file and its digest on stdout unless quiet.
void print_campaign(const Campaign& campaign, const CampaignRunOptions& options);

struct MergeOptions : CampaignFolderOptions {
  std::vector<std::filesystem::path> folders;
  std::filesystem::path output;
};
int merge(MergeOptions options);

struct ReportOptions {
  std::filesystem::path folder;
  std::filesystem::path second;  // a run to compare with; empty: none
  std::filesystem::path output;  // empty: in the folder
  bool index = false;            // the page over all results in the folder
};
int report(const ReportOptions& options);

struct CompareOptions : LogFolderOptions {
  RunAndLog input;  // mapping: empty: columns with the names of series of the run
};
/// Compares a run with a log of measurements. The simulation failed: a quantity disagrees.
int compare(const CompareOptions& options);

struct ImpulsesOptions : LogFolderOptions {
  RunAndLog input;
  std::filesystem::path scenario;      // empty: as the run stored it
  std::vector<std::string> overrides;  // "path=value"
  std::vector<std::string> at;         // "time" or "time:duration" of contacts; empty: detected
  std::optional<double> window;        // [s]; absent: chosen
  double false_alarms = 0.01;          // expected in the log
};
/// Impulses at grasps from a log of measurements. The simulation failed: the momentum balance is violated.
int impulses(const ImpulsesOptions& options);

struct LinearizeCommandOptions {
  std::filesystem::path scenario;
  std::filesystem::path output;        // .json or .mat; empty: the text only
  std::vector<std::string> overrides;  // path=value
  double at = 0;                       // [s]
  std::optional<double> sample_time;   // [s]
  double delay = 0;                    // [s]
  bool quiet = false;
};
/// The linear model of a scenario at a time, and the stability of its controllers.
int linearize(const LinearizeCommandOptions& options);

struct SensitivitiesCommandOptions {
  std::filesystem::path file;          // scenario or campaign
  std::filesystem::path output;        // folder; empty: the text only
  std::vector<std::string> by, of;     // paths, and patterns of columns, separated by commas; empty: default ones
  std::vector<std::string> overrides;  // path=value
  bool impact_only = false;            // simulate the impact only
  bool plan_once = false;              // every run follows the plan of the scenario
  int threads = 0;                     // 0: one per processor
  bool quiet = false;
};
/// Derivatives of the outcomes of a capture by values of its scenario, and first-order uncertainty of a campaign.
int sensitivities(const SensitivitiesCommandOptions& options);

struct FigureOptions {
  std::filesystem::path folder;
  std::string what;              // empty: see list
  bool list = false;             // print the figures that the folder offers
  std::filesystem::path output;  // empty: figures/WHAT.pdf in the folder
  double width = 0, height = 0;  // [cm]; 0: chosen for the figure
  std::vector<std::string> phases;
  std::optional<double> from, to;  // [s]
  int instants = 0;
  std::vector<double> times;  // [s]
  std::string view = "iso";
  std::vector<std::string> columns;
  std::string x_axis, lines_axis;
  bool heat_map = false;
  std::string command;  // command line as typed
};
int figure(const FigureOptions& options);

int check(const std::filesystem::path& scenario, const std::vector<std::string>& overrides);
/// A published JSON document. grapnel/describe/contract.hpp derives its schema, the tables of its pages in
/// docs/formats, and the viewer's types from its description.
struct ResultContract {
  std::string_view kind;   ///< name of the kind for `grapnel schema`, e.g. "campaign-report"
  std::string_view page;   ///< page name, e.g. "campaign": docs/formats/campaign.md, the pages in
                           ///< docs/formats/campaign, and web/src/campaign_types.ts
  std::string_view title;  ///< of the schema
  const Type& (*document)();
};
std::span<const ResultContract> result_contracts();
/// The first line of generated files with types.
inline constexpr std::string_view kOriginOfTypes =
    "Made by scripts/tables from the descriptions of results in grapnel/; edit those.";

/// The kinds of files that `grapnel schema` accepts: input files, then results.
std::vector<std::string> schema_kinds();
struct SchemaOptions {
  std::string kind = "scenario";
  bool typescript = false;     // print the TypeScript types of a result instead
  std::filesystem::path page;  // print this page of docs/formats with regenerated tables instead; empty: not
};
int print_schema(const SchemaOptions& options);
/// The formats of grapnel export.
struct ExportOptions {
  bool csv = false, mat = false, glb = false, mcap = false;
};
int export_result(const std::filesystem::path& folder, const ExportOptions& options);
int info(const std::filesystem::path& robot);

/// Arguments of `grapnel modes`.
struct ModesOptions {
  std::filesystem::path mass, stiffness;
  // Names of the matrices in their files; empty: the only matrix, or the one with M or K first.
  std::string mass_name, stiffness_name;
  std::string units;  // LENGTH-MASS-s
  std::optional<long long> interface_node;
  std::filesystem::path interface_nodes;  // NODE, X, Y, Z
  std::filesystem::path node_places;      // NODE, X, Y, Z of more nodes
  std::filesystem::path row_names;        // NODE.COMPONENT of each row, for matrices without names
  std::vector<int> interface_rows;        // from 1
  std::vector<double> origin{0, 0, 0};    // of the frame, for interface_nodes, in the model's units
  std::optional<int> modes;               // empty: 20, or all modes of a smaller model
  double below = 100;                     // [Hz]
  double damping = 0;
  std::vector<double> expected;  // [Hz]
  std::filesystem::path output;  // empty: print the table only
};
int modes_of_matrices(const ModesOptions& options);

/// Arguments of `grapnel import`; the key `import` of scenarios documents their meaning.
struct ImportCommandOptions {
  std::filesystem::path model;   // .urdf or .xml
  std::filesystem::path output;  // the robot file
  std::string base, bus, mount, prefix;
  std::vector<std::string> packages, locked, wheels, end_effectors;  // NAME=FOLDER, JOINT=VALUE, names
  bool repair_inertia = false;
};
int import_robot_file(const ImportCommandOptions& options);

struct ExportFmuOptions {
  std::filesystem::path scenario;
  std::filesystem::path output;         // empty: named after the scenario, in the current folder
  std::vector<std::string> overrides;   // path=value
  std::vector<std::string> parameters;  // paths, or "default"
  bool base_torque = false;             // a torque input instead of the base's actuators
  int version = 2;                      // version of FMI
};
/// Writes the scenario's capture as an FMU for co-simulation whose inputs command the actuators.
int export_fmu(const ExportFmuOptions& options);

struct InitOptions {
  std::string name = "single-arm";
  std::filesystem::path output;  // empty: named after the template, in the current folder
  bool list = false;             // print the ready-made robots and targets
};
/// Writes a scenario, a campaign or a robot to start from. An existing file is not replaced: bad input.
int init(const InitOptions& options);

}  // namespace grapnel::app
