#pragma once

/// @file
/// Fields of CSV files. Thread safety: pure functions.

#include <string>

namespace grapnel {

/// A field as RFC 4180 has it: quoted where it must be, quotes doubled.
std::string csv_quoted(const std::string& text);

/// Appends the shortest text that reads back to the same double; NaN, Inf and -Inf as MATLAB, pandas and C spell or
/// accept them.
void append_csv_number(double value, std::string& out);

}  // namespace grapnel
