#pragma once

/// @file
/// Columns of loads and margins.

#include "grapnel/study/column.hpp"

namespace grapnel {

/// Whether the robot has any rating.
bool is_rated(const CaptureProblem& problem);

/// `margins/OF/QUANTITY`, of everything that has a rating, and `worst_margin` where anything has; `with_motion`: over
/// all phases, and beside them `loads/OF/QUANTITY` and `load_times/OF/QUANTITY`, which are kept only where they are
/// asked for, since cases take longer with them. Without motion margins are those of impacts.
std::vector<Column> load_columns(const CaptureProblem& problem, bool with_motion);

}  // namespace grapnel
