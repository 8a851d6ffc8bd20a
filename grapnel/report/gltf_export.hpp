#pragma once

/// @file
/// A capture as an animated scene that Blender and other programs play.

#include <filesystem>
#include <string>

#include "grapnel/report/run_source.hpp"

namespace grapnel {

/// At most so many keyframes, where decimate() can leave out the others.
inline constexpr std::size_t kMostKeyframes = 2000;

/// A binary glTF 2.0 file: below a root node that turns z-up into glTF's y-up a node per body (base, links, targets),
/// named as in the scenario, with its shape as a mesh and its pose in W as keyframes. Grasp points are marked on
/// targets. Samples are left out as decimate() allows; `asset.extras` says how many, by how much positions [m] and
/// angles [rad] between keyframes then differ at most from what was recorded, and by how much keyframes of equal times
/// (an impact) were moved apart [s], which glTF demands. Throws std::runtime_error naming what is missing.
std::string glb_bytes(const RunSource& run, const std::string& version);

/// Reads a run's folder, writes capture.glb there (atomically) and returns its path. Throws std::runtime_error naming
/// the file and the fault.
std::filesystem::path export_glb(const std::filesystem::path& folder, const std::string& version);

}  // namespace grapnel
