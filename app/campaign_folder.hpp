#pragma once

/// @file
/// A campaign and its folder: how computing begins, and what is made of the rows at the end.

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

/// The campaign of the file; empty if there is none, which is said on stderr if `say`.
std::optional<Campaign> campaign_from_file(const CampaignRunOptions& options, bool say = true);

/// Program, file and its digest, on stdout unless quiet.
void say_campaign(const Campaign& campaign, const CampaignRunOptions& options);

/// What of the campaign is there already. `part`: of it, if not all.
void print_start(const ShardStore& store, const std::string& part);

/// That it was stopped, and how it goes on, on stderr.
void say_stopped(const std::filesystem::path& folder, std::uint64_t done, std::uint64_t total,
                 const std::string& command);

/// The campaign has the cases that the store has.
void take_total(Campaign& campaign, const ShardStore& store);

/// The exit code of `work`, or that of what it throws, which is said on stderr: a folder in use and disks are 1,
/// another campaign's folder and one with a damaged manifest are 2. `command` goes on.
int with_store_errors(const std::filesystem::path& folder, const std::string& command,
                      const std::function<int()>& work);

struct CampaignResults {
  bool quiet = false;
  bool no_report = false;
  bool no_csv = false;
  int threads = 1;
};

/// Writes table.h5, table.csv, campaign.json, the complete runs of the cases that are to be kept so (series/case-K) and
/// report.html, and prints what came out. Returns the exit code. @throws std::exception (disk)
int write_campaign_results(const Campaign& campaign, const std::filesystem::path& folder, const CampaignResults& what,
                           StopSignal& stop);

/// What the program was called with, so that a shell takes it again.
std::string command_line(const char* program, int argc, char** argv);
/// The same without an option `left_out` and its value.
std::string command_line_without(const char* program, int argc, char** argv, std::string_view left_out);

/// Help, version or what is wrong with the arguments, and the exit code.
int end_of_parsing(const CLI::App& app, const CLI::ParseError& error);

/// Every option that takes numbers with fractions refuses what is no finite number: nan, inf, 1e999. Called once all
/// options are there.
void require_finite_numbers(CLI::App& app);

/// An exception that no command expects, on stderr as a sentence. Returns the exit code.
int unexpected_error(const std::exception& error);

/// Says what went wrong when controllers were destroyed. Whether anything did.
bool say_plugin_faults();

/// Adds those that every way to run a campaign has.
void add_campaign_arguments(CLI::App& command, CampaignRunOptions& options);
/// Adds those of one machine and of job arrays: -j, --only, --shard.
void add_machine_arguments(CLI::App& command, CampaignRunOptions& options);

}  // namespace grapnel::app
