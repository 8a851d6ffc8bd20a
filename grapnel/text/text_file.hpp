#pragma once

/// @file
/// Reads files and checks them before parsing.

#include <filesystem>
#include <optional>
#include <string>

#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Limit on the size of YAML files; larger files are rejected without reading.
inline constexpr std::size_t kLargestFile = 16u << 20;  // [bytes]
/// Limit on the size of trajectory files.
inline constexpr std::size_t kLargestTrajectory = 64u << 20;  // [bytes]
inline constexpr std::size_t kLargestPlugin = 256u << 20;     // [bytes]

/// The bytes of a file; on failure empty, with an error at `blame` (the location that names the file). `named` is the
/// path in the input file, for suggestions; it must be a regular file. Empty: the path comes from the command line, and
/// may be a pipe, which must send data within ten seconds.
std::optional<std::string> read_file(const std::filesystem::path& path, const Mark& blame, FaultList& faults,
                                     std::size_t largest = kLargestFile, const std::filesystem::path& named = {});

/// The text without a byte order mark if it is clean: UTF-8, no control characters, no carriage return that ends a line
/// alone, neither tabs nor no-break spaces in indentation. Else empty, with errors. YAML parsers would misread or
/// truncate such text.
std::optional<std::string> checked_text(const std::string& bytes, const std::shared_ptr<const std::string>& source,
                                        FaultList& faults);

}  // namespace grapnel
