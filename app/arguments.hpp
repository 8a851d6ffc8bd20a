#pragma once

/// @file
/// Arguments shared by the programs and by their commands, and the ends of the programs.

#include <CLI/CLI.hpp>

#include <string>
#include <string_view>

#include "commands.hpp"

namespace grapnel::app {

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
/// Adds --watch, which excludes --quiet and, where the command has it, --only. Call after these.
void add_watch_flag(CLI::App& command, bool& watch);
/// Adds the options for one machine and for job arrays: -j, --only, --shard.
void add_machine_arguments(CLI::App& command, CampaignRunOptions& options);

}  // namespace grapnel::app
