#pragma once

/// @file
/// Arguments of `grapnel campaign` and `grapnel map`, and of the same on many machines.

#include <CLI/CLI.hpp>
#include <string_view>

#include "commands.hpp"

namespace grapnel::app {

/// What the program was called with, so that a shell takes it again.
std::string command_line(const char* program, int argc, char** argv);
/// The same without an option `left_out` and its value.
std::string command_line_without(const char* program, int argc, char** argv, std::string_view left_out);

/// Help, version or what is wrong with the arguments, and the exit code.
int end_of_parsing(const CLI::App& app, const CLI::ParseError& error);

/// Adds those that every way to run a campaign has.
void add_campaign_arguments(CLI::App& command, CampaignRunOptions& options);
/// Adds those of one machine and of job arrays: -j, --only, --shard.
void add_machine_arguments(CLI::App& command, CampaignRunOptions& options);

}  // namespace grapnel::app
