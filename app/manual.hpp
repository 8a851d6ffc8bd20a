#pragma once

/// @file
/// The program's manual, generated from its argument parser: a man page, a page of the documentation, and shell
/// completions.

#include <string>
#include <string_view>

namespace CLI {
class App;
}

namespace grapnel::app {

/// Exit codes, as printed at the end of `grapnel --help`.
std::string_view exit_codes();

/// The manual page in roff, for `man -l`.
std::string manual_page(const CLI::App& app);
/// The manual as a page of the documentation, in Markdown.
std::string manual_markdown(const CLI::App& app);
/// Completion script for bash: commands, options, values of options, and files of the right kind.
std::string bash_completion(const CLI::App& app);

}  // namespace grapnel::app
