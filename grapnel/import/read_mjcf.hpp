#pragma once

/// @file
/// Robots from MJCF files, MuJoCo's format. Mass matrix and bias of what is read are those that MuJoCo computes; what
/// would change the motion and cannot be read is a fault, all else that is passed over is a decision.
/// docs/formats/import-mjcf.md says what is taken and how.

#include <filesystem>
#include <string>

#include "grapnel/import/source_model.hpp"

namespace grapnel {

/// Reads an MJCF file and what it includes. The robot is the tree below the body with a free joint; without one, what
/// is jointed to the world. Joint coordinates are MuJoCo's; the frame of a link has its body's axes and its origin at
/// the joint. Faults go to `faults`, each with its place, after which the model is what could be read.
SourceModel read_mjcf(const std::filesystem::path& file, FaultList& faults);
/// The same of a file that has been read: `text` is its content, and `file` says where it is.
SourceModel read_mjcf(const std::filesystem::path& file, std::string text, FaultList& faults);

}  // namespace grapnel
