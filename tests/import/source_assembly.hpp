#pragma once

/// @file
/// A model straight from what a reader hands over: every link a body, links on fixed joints lumped with what carries
/// them. Independent of assemble_robot(), so that readers are checked by themselves.

#include "grapnel/import/source_model.hpp"
#include "grapnel/model/model.hpp"

namespace grapnel::testing {

/// With a free or a fixed root; bodies have the names of links, frames are those of the source. @throws
/// std::runtime_error or ModelError where that cannot be.
Model assemble_source(const SourceModel& source, bool free_root);

}  // namespace grapnel::testing
