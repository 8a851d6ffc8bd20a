#pragma once

/// @file
/// Reading files and the checks that come before any parsing.

#include <filesystem>
#include <optional>
#include <string>

#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// YAML files above this size are refused unread.
inline constexpr std::size_t kLargestFile = 16u << 20;  // [bytes]
/// Trajectory files likewise.
inline constexpr std::size_t kLargestTrajectory = 64u << 20;  // [bytes]
inline constexpr std::size_t kLargestPlugin = 256u << 20;     // [bytes]

/// The bytes of a file; on failure empty, with a fault at `blame` (the place that names the file). `named` is the path
/// as the input says it, for what may have been meant; it must be a regular file. Empty: a person named it, and it may
/// be a pipe, which is given ten seconds to say something.
std::optional<std::string> read_file(const std::filesystem::path& path, const Mark& blame, FaultList& faults,
                                     std::size_t largest = kLargestFile, const std::filesystem::path& named = {});

/// The text without a byte order mark if it is clean: UTF-8, no control characters, no carriage return that ends a line
/// alone, neither tabs nor no-break spaces in indentation. Else empty, with faults. A YAML parser would misread or cut
/// off what is refused here.
std::optional<std::string> checked_text(const std::string& bytes, const std::shared_ptr<const std::string>& source,
                                        FaultList& faults);

}  // namespace grapnel
