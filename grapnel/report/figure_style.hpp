#pragma once

/// @file
/// Colours and dashes of figures.

#include <string>

namespace grapnel {

/// Colours that colour-blind readers can tell apart (after Okabe and Ito), "#0072b2".
const char* series_color(int index);

/// gnuplot's dash type of the index-th kind of line: solid, dashed, dotted, ...
const char* series_dash(int index);

/// A line's style: "lc rgb '#0072b2' dt solid lw 1.3".
std::string line_style(const std::string& color, int dash, double width = 1.3);

/// The colour mixed with white: 1 the colour itself, 0 white.
std::string lightened(const std::string& color, double share);

/// The colour with an opacity in gnuplot's way, "#AARRGGBB" (AA = 00 is opaque).
std::string translucent(const std::string& color, double opacity);

inline constexpr const char* kInk = "#222222";
inline constexpr const char* kMuted = "#666666";
inline constexpr const char* kBaseColor = "#5c6670";
inline constexpr const char* kTargetColor = "#b8770b";

}  // namespace grapnel
