#pragma once

/// @file
/// Where the mesh files of URDF and MJCF models are on this machine.

#include <filesystem>
#include <string>

#include "grapnel/import/assemble.hpp"

namespace grapnel {

/// A mesh file that is there, or why there is none.
struct FoundMesh {
  std::filesystem::path file;  // empty: none
  std::string why_not;         // "it is a .dae file; STL and OBJ are read"
};

/// The file that a source names: package://NAME/rest and its likes by the folders that the user gave, else in a folder
/// of that name beside the source or above it, else in the folders above it as if one of these were the package;
/// file://, absolute paths, paths relative to the source.
FoundMesh find_mesh(const std::string& named, const ImportOptions& options);

}  // namespace grapnel
