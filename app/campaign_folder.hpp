#pragma once

/// @file
/// A campaign and its result folder: the start of the computation, and the results written from its rows.

#include <CLI/CLI.hpp>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "commands.hpp"
#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/shard_store.hpp"
#include "terminal.hpp"

namespace grapnel::app {

/// Reads a campaign file. Empty if it has errors, which are printed on stderr if `say`.
std::optional<Campaign> campaign_from_file(const CampaignRunOptions& options, bool say = true);

/// Prints the program version, the file and its digest on stdout unless quiet.
void print_campaign(const Campaign& campaign, const CampaignRunOptions& options);

/// Prints how many cases are complete. `part`: the part of the campaign; empty: all.
void print_start(const ShardStore& store, const std::string& part);

/// Prints on stderr that the campaign was stopped, and the command that resumes it.
void print_stopped(const std::filesystem::path& folder, std::uint64_t done, std::uint64_t total,
                   const std::string& command);

/// Sets the number of cases of the campaign to that of the store.
void take_total(Campaign& campaign, const ShardStore& store);

/// Returns the exit code of `work`, or that of its exception, which is printed on stderr: 1 for a folder in use and for
/// disk errors, 2 for the folder of another campaign or with a damaged manifest. `command` resumes the campaign.
int with_store_errors(const std::filesystem::path& folder, const std::string& command,
                      const std::function<int()>& work);

struct CampaignResults {
  bool quiet = false;
  bool no_report = false;
  bool no_csv = false;
  int threads = 1;
};

/// Writes table.h5, table.csv, campaign.json, the complete runs to be kept (series/case-K) and report.html, and prints
/// a summary. Returns the exit code. @throws std::exception (disk)
int write_campaign_results(const Campaign& campaign, const std::filesystem::path& folder, const CampaignResults& what,
                           StopSignal& stop);

/// The command line of this call, quoted for a shell.
std::string command_line(const char* program, int argc, char** argv);
/// The same without the option `left_out` and its value.
std::string command_line_without(const char* program, int argc, char** argv, std::string_view left_out);

/// Prints help, the version or the error in the arguments. Returns the exit code.
int end_of_parsing(const CLI::App& app, const CLI::ParseError& error);

/// Makes all options with fractional numbers reject nan, inf and 1e999. Call after the last option has been added.
void require_finite_numbers(CLI::App& app);

/// Prints an exception that no command handles on stderr. Returns the exit code.
int unexpected_error(const std::exception& error);

/// Prints the errors that occurred while controllers were destroyed. Returns whether there were any.
bool print_plugin_errors();

/// Adds the options shared by all commands that run campaigns.
void add_campaign_arguments(CLI::App& command, CampaignRunOptions& options);
/// Adds the options for one machine and for job arrays: -j, --only, --shard.
void add_machine_arguments(CLI::App& command, CampaignRunOptions& options);

}  // namespace grapnel::app
