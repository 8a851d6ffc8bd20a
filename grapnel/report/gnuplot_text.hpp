#pragma once

/// @file
/// Names and other foreign text in gnuplot scripts. Nothing in them is executed or set as mark-up: the strings are
/// single-quoted, where gnuplot expands neither backquotes, macros nor escapes, and the scripts write all texts
/// `noenhanced`.

#include <string>
#include <string_view>

namespace grapnel {

/// One line of valid UTF-8: control characters become spaces, bytes that are no UTF-8 become '?'.
std::string plain_line(std::string_view text);

/// A gnuplot string constant.
std::string gnuplot_quoted(std::string_view text);

/// The same for labels of tics, where '%' would begin a number format.
std::string gnuplot_tic_label(std::string_view text);

/// A file in gnuplot's working directory as a string constant. "./" is put before names that gnuplot takes for pipes
/// ("|rm", "<cat"), options or its special files. @throws std::invalid_argument for control characters in the name.
std::string gnuplot_file(std::string_view name);

}  // namespace grapnel
