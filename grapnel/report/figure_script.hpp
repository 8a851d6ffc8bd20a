#pragma once

/// @file
/// gnuplot's files of a figure.

#include <filesystem>
#include <string>
#include <string_view>

#include "grapnel/report/figure.hpp"

namespace grapnel {

// Names and other external text in gnuplot scripts. It is neither executed nor interpreted as mark-up: the strings are
// single-quoted, where gnuplot expands neither backquotes, macros nor escapes, and the scripts write all texts
// `noenhanced`.

/// One line of valid UTF-8: control characters become spaces, bytes that are not UTF-8 become '?'.
std::string plain_line(std::string_view text);

/// A gnuplot string constant.
std::string gnuplot_quoted(std::string_view text);

/// The same for labels of tics, where '%' would begin a number format.
std::string gnuplot_tic_label(std::string_view text);

/// A file in gnuplot's working directory as a string constant. "./" is put before names that gnuplot takes for pipes
/// ("|rm", "<cat"), options or its special files. @throws std::invalid_argument for control characters in the name.
std::string gnuplot_file(std::string_view name);

// Runs gnuplot, without a shell.

struct GnuplotOutcome {
  bool found = true;    // whether there is a gnuplot in PATH
  int status = 0;       // 0: it drew the figure
  std::string message;  // its output
};

/// Runs gnuplot on `script`, a file of `folder`, in that folder and without the user's start-up files. @throws
/// std::runtime_error if the process cannot be started although gnuplot exists.
GnuplotOutcome run_gnuplot(const std::filesystem::path& folder, const std::string& script);

/// The data file: a head of comments, then the blocks, two empty lines between them (gnuplot's `index`).
std::string figure_data(const Figure& figure);

/// The script: `image`, `data` and the script itself are names in one folder; the image's ending chooses the terminal.
/// `output`: temporary output path in place of `image`.
/// @throws std::invalid_argument if the ending is none of .pdf, .svg, .png.
std::string figure_script(const Figure& figure, const std::string& image, const std::string& data,
                          const std::string& output = "");

}  // namespace grapnel
