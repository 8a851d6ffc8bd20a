#pragma once

/// @file
/// The program's manual, made from the arguments that it reads and from nothing else: a page for man, a page of the
/// documentation, and the completions of a shell.

#include <string>
#include <string_view>

namespace CLI {
class App;
}

namespace grapnel::app {

/// Exit codes, as the end of `grapnel --help` says them.
std::string_view exit_codes();

/// The manual page in man's language (roff): `man -l`.
std::string manual_page(const CLI::App& app);
/// The same as a page of the documentation, in Markdown.
std::string manual_markdown(const CLI::App& app);
/// What bash completes after the program's name: commands, their options, the values that an option can have, files of
/// the right kind.
std::string bash_completion(const CLI::App& app);

}  // namespace grapnel::app
