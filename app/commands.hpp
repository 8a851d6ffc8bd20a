#pragma once

/// @file
/// What the program's subcommands do. Each returns the exit code: 0 done, 1 the simulation or its conservation checks
/// failed or something could not be written, 2 bad input, 3 some points or cases of a study failed, 130 stopped by
/// Ctrl-C.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/describe/type.hpp"

namespace grapnel::app {

inline constexpr int kDone = 0;
inline constexpr int kSimulationFailed = 1;
inline constexpr int kBadInput = 2;
inline constexpr int kSomeFailed = 3;
inline constexpr int kInterrupted = 130;  // Ctrl-C, with everything kept

struct RunOptions {
  std::filesystem::path scenario;
  std::filesystem::path output;        // empty: named after the scenario, below out/
  std::vector<std::string> overrides;  // path=value
  bool quiet = false;
  bool no_report = false;
  bool force = false;  // results of another scenario in the folder are replaced
};
int run(const RunOptions& options);

/// Of all commands that simulate what a file asks for in many captures.
struct StudyOptions {
  std::filesystem::path study;
  std::filesystem::path output;       // empty: named after the study, below out/
  int threads = 0;                    // 0: one per processor
  std::optional<std::uint64_t> only;  // this point or case alone, as a complete run; not of searches
  bool quiet = false;
  bool no_report = false;
  std::stop_token stop = {};  // from who has signals of its own; may be without a source
};
int sweep(const StudyOptions& options);
int optimize(const StudyOptions& options);

struct CampaignRunOptions : StudyOptions {
  std::uint64_t extend = 0;  // cases to add
  std::string shard;         // "i/N", "slurm"; empty: what the environment says
  bool no_csv = false;
  bool map = false;     // the file must have a design
  std::string command;  // as it was typed
  std::string resume;   // the same without --extend: goes on once the cases have been added
};
int campaign(const CampaignRunOptions& options);

struct MergeOptions {
  std::vector<std::filesystem::path> folders;
  std::filesystem::path output;
  bool quiet = false;
  bool no_report = false;
  bool no_csv = false;
};
int merge(const MergeOptions& options);

struct ReportOptions {
  std::filesystem::path folder;
  std::filesystem::path second;  // a run to compare with; empty: none
  std::filesystem::path output;  // empty: in the folder
};
int report(const ReportOptions& options);

struct FigureOptions {
  std::filesystem::path folder;
  std::string what;              // empty: see list
  bool list = false;             // what the folder offers
  std::filesystem::path output;  // empty: figures/WHAT.pdf in the folder
  double width = 0, height = 0;  // [cm]; 0: by the figure
  std::vector<std::string> phases;
  std::optional<double> from, to;  // [s]
  int instants = 0;
  std::vector<double> times;  // [s]
  std::string view = "iso";
  std::vector<std::string> columns;
  std::string x_axis, lines_axis;
  bool heat_map = false;
  std::string command;  // as it was typed
};
int figure(const FigureOptions& options);

int check(const std::filesystem::path& scenario, const std::vector<std::string>& overrides);
/// A JSON document that is published: its schema, the tables of its page in docs/formats, and the viewer's types follow
/// from its description, by grapnel/describe/contract.hpp.
struct ResultContract {
  std::string_view kind;   ///< "campaign-report": what `grapnel schema` calls it
  std::string_view page;   ///< "campaign": docs/formats/campaign.md, and the types web/src/campaign_types.ts
  std::string_view title;  ///< of the schema
  const Type& (*document)();
};
std::span<const ResultContract> result_contracts();
/// The first line of files with types.
inline constexpr std::string_view kOriginOfTypes =
    "Made by scripts/tables from the descriptions of results in grapnel/: change those.";

/// What `grapnel schema` knows: kinds of files that are read, then those of results.
std::vector<std::string> schema_kinds();
struct SchemaOptions {
  std::string kind = "scenario";
  bool typescript = false;     // of a result: its types instead
  std::filesystem::path page;  // of a result: its page in docs/formats, with tables remade, instead; empty: not
};
int print_schema(const SchemaOptions& options);
int export_result(const std::filesystem::path& folder, bool csv, bool mat, bool glb);
int info(const std::filesystem::path& robot);

/// Arguments of `grapnel modes`.
struct ModesOptions {
  std::filesystem::path mass, stiffness;
  // Of the matrix in its file; empty: the only one, or the one with M or K first.
  std::string mass_name, stiffness_name;
  std::string units;  // LENGTH-MASS-s
  std::optional<long long> interface_node;
  std::filesystem::path interface_nodes;  // NODE, X, Y, Z
  std::filesystem::path node_places;      // likewise, of more nodes
  std::filesystem::path row_names;        // NODE.COMPONENT of every row, for matrices without names
  std::vector<int> interface_rows;        // from 1
  std::vector<double> origin{0, 0, 0};    // of the frame, for interface_nodes, in the model's units
  std::optional<int> modes;               // empty: 20, or as many as there are
  double below = 100;                     // [Hz]
  double damping = 0;
  std::vector<double> expected;  // [Hz]
  std::filesystem::path output;  // empty: the table alone
};
int modes_of_matrices(const ModesOptions& options);

/// Arguments of `grapnel import`; what they mean is said at the key `import` of scenarios.
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
  std::filesystem::path output;         // empty: named after the scenario, here
  std::vector<std::string> overrides;   // path=value
  std::vector<std::string> parameters;  // paths, or "default"
  bool base_torque = false;             // an input, in place of the base's actuators one by one
  int version = 2;                      // of FMI
};
/// Writes the scenario's capture as an FMU for co-simulation, told at its actuators.
int export_fmu(const ExportFmuOptions& options);

struct InitOptions {
  std::string name = "single-arm";
  std::filesystem::path output;  // empty: named after the template, here
  bool list = false;             // what is ready-made
};
/// Writes a scenario, a campaign or a robot to begin with. A file that is there is left alone: bad input.
int init(const InitOptions& options);

}  // namespace grapnel::app
