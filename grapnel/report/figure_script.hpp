#pragma once

/// @file
/// gnuplot's files of a figure.

#include <string>

#include "grapnel/report/figure.hpp"

namespace grapnel {

/// The data file: a head of comments, then the blocks, two empty lines between them (gnuplot's `index`).
std::string figure_data(const Figure& figure);

/// The script: `image`, `data` and the script itself are names in one folder; the image's ending chooses the terminal.
/// `output`: where the image is drawn instead, for the time being.
/// @throws std::invalid_argument if the ending is none of .pdf, .svg, .png.
std::string figure_script(const Figure& figure, const std::string& image, const std::string& data,
                          const std::string& output = "");

}  // namespace grapnel
