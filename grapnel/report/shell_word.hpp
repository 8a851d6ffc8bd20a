#pragma once

/// @file
/// Commands that a reader copies into a shell.

#include <string>

namespace grapnel {

/// A word as a shell reads it back: quoted where it must be.
std::string shell_word(const std::string& text);

}  // namespace grapnel
