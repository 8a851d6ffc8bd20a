#pragma once

/// @file
/// A model directly from the output of a reader: every link is a body, and links on fixed joints are lumped with their
/// parents. Independent of assemble_robot(), so that tests check readers separately.

#include "grapnel/import/source_model.hpp"
#include "grapnel/model/model.hpp"

namespace grapnel::testing {

/// Has a free or a fixed root; bodies have the names of links, and frames are those of the source. @throws
/// std::runtime_error or ModelError for an invalid source.
Model assemble_source(const SourceModel& source, bool free_root);

}  // namespace grapnel::testing
