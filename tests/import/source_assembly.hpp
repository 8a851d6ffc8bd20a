#pragma once

/// @file
/// A model straight from what a reader hands over: every link a body, links on fixed joints lumped with what carries
/// them. Independent of assemble_robot(), so that readers are checked by themselves.

#include <string>
#include <vector>

#include "grapnel/import/source_model.hpp"
#include "grapnel/model/model.hpp"

namespace grapnel::testing {

struct AssembledSource {
  Model model;                       // frames are those of the source
  std::vector<std::string> body_of;  // per body the link that its joint carries
};

/// With a free or a fixed root. @throws std::runtime_error or ModelError where that cannot be.
AssembledSource assemble_source(const SourceModel& source, bool free_root);

}  // namespace grapnel::testing
