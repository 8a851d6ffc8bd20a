#pragma once

/// @file
/// Figures of a result folder, with their files.

#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/report/figure.hpp"
#include "grapnel/report/figures.hpp"

namespace grapnel {

/// What a folder offers: that of a run or of a sweep. Throws std::runtime_error naming what is missing or damaged.
std::vector<FigureOffer> figure_offers(const std::filesystem::path& folder);

/// The figure. Throws std::runtime_error, saying what the folder offers if it does not offer this, or naming the fault
/// of a file; std::invalid_argument for a request that makes no sense.
Figure make_figure(const FigureRequest& request);

/// Where the files of a figure are.
struct FigureFiles {
  std::filesystem::path image, data, script;
  bool drawn = false;  // false: there is no gnuplot, data and script are there
};

/// Writes data and script beside `image` (.pdf, .svg or .png) and lets gnuplot draw it. Throws std::runtime_error if
/// gnuplot fails, with what it says.
FigureFiles write_figure(const Figure& figure, const std::filesystem::path& image);

}  // namespace grapnel
