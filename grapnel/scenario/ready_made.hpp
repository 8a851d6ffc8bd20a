#pragma once

/// @file
/// Robots and targets that scenarios include by name, and scenario templates: the files of robots/, targets/ and
/// templates/, which are embedded in the program, so that it needs no data folder.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace grapnel {

struct ReadyMade {
  enum class Kind { robots, targets, templates };  ///< its source folder
  Kind kind;
  std::string_view name;  ///< of its file, without .yaml
  std::string_view text;  ///< YAML

  /// Name in messages, in place of a path: "ready-made robot ets-vii".
  std::string source() const;
  /// Its `description`, or the first sentence of its leading comment.
  std::string description() const;
};

/// In the order of the folders above, then in the order of CMakeLists.txt.
std::span<const ReadyMade> all_ready_made();
std::vector<ReadyMade> ready_made(ReadyMade::Kind kind);
/// Null if there is none of this name.
const ReadyMade* find_ready_made(ReadyMade::Kind kind, std::string_view name);

/// Whether a text can be a ready-made name rather than a path: it contains neither a dot nor a slash.
bool is_ready_made_name(std::string_view text);

/// "no ready-made target 'envisat'; did you mean 'envisat-class'?".
std::string no_ready_made(ReadyMade::Kind kind, std::string_view name);

}  // namespace grapnel
