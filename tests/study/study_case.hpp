#pragma once

/// @file
/// Studies and scenarios for tests, in a separate folder.

#include <filesystem>
#include <string>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/atomic_file.hpp"

namespace grapnel::test {

/// A folder that is deleted with the object.
class Folder : public ScratchFolder {
 public:
  std::filesystem::path write(const std::string& name, const std::string& text) const;
};

std::string read_bytes(const std::filesystem::path& path);
std::string shipped(const std::string& name);  // a file below the repository's root

/// Two 7-joint arms at two tumbling boxes, in three dimensions, without an approach: the impact at a stated
/// configuration. YAML text.
std::string impact_at_once();

}  // namespace grapnel::test
