#pragma once

/// @file
/// A study's table in a few lines for a terminal.

#include <string>

#include "grapnel/study/study_table.hpp"

namespace grapnel {

/// Points and how they ended, the axes, least and greatest of what people look for first, and the reasons of points
/// that are not ok, the most frequent first.
std::string study_summary(const StudyTable& table);

}  // namespace grapnel
