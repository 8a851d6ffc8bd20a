#pragma once

/// @file
/// What the programs say. All of it goes through here: control characters from files become '?', lines are written
/// whole and in order, whether stdout and stderr are one terminal, one pipe or two files, and a stderr that cannot be
/// written to is no fault. Thread safety: any number of threads.

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "grapnel/text/faults.hpp"

namespace grapnel::app {

/// Whole lines to stdout; kept back until flush_stdout(), the next write_stderr() or the program's end.
void write_stdout(std::string_view lines);
/// Whole lines to stderr, at once, behind what was said on stdout before.
void write_stderr(std::string_view lines);
void flush_stdout();

/// A line of progress on stderr: rewritten by the next one and gone before anything else is written where stderr is a
/// terminal, a line of its own elsewhere.
void show_progress(std::string_view line);
void erase_progress();
bool stderr_is_terminal();

/// Faults of input files on stderr, one a line.
void say_faults(const std::vector<Fault>& faults);

/// Formatted text, whole lines.
template <class... Args>
void to_stdout(fmt::format_string<Args...> format, Args&&... args) {
  write_stdout(fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void to_stderr(fmt::format_string<Args...> format, Args&&... args) {
  write_stderr(fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace grapnel::app
