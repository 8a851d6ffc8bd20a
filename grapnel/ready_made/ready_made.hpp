#pragma once

/// @file
/// Robots and targets that scenarios include by name, and scenarios to begin with: the files of robots/, targets/ and
/// templates/, which are part of the program, so that it needs no folder of data beside it.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace grapnel {

struct ReadyMade {
  enum class Kind { robots, targets, templates };  ///< the folder it comes from
  Kind kind;
  std::string_view name;  ///< of its file, without .yaml
  std::string_view text;  ///< YAML

  /// As messages name it where a file's path would stand: "ready-made robot ets-vii".
  std::string source() const;
  /// What it says of itself: its `description`, or the first sentence of the comment that it begins with.
  std::string description() const;
};

/// In the order of the folders above, then as they are listed.
std::span<const ReadyMade> all_ready_made();
std::vector<ReadyMade> ready_made(ReadyMade::Kind kind);
/// Null if there is none of this name.
const ReadyMade* find_ready_made(ReadyMade::Kind kind, std::string_view name);

/// Whether a text can be the name of something ready-made rather than a path: neither a dot nor a slash is in it.
bool is_ready_made_name(std::string_view text);

/// "no ready-made target 'envisat'; did you mean 'envisat-class'?".
std::string no_ready_made(ReadyMade::Kind kind, std::string_view name);

}  // namespace grapnel
