#pragma once

/// @file
/// The page's program and style (web/), bundled and embedded when Grapnel was built.

#include <string_view>

namespace grapnel {

struct Viewer {
  std::string_view script, style;
  bool empty() const { return script.empty(); }
};

/// Empty in programs that were built without Node.js.
Viewer embedded_viewer();

}  // namespace grapnel
