#pragma once

/// @file
/// The version of the library. Public, kept stable.

namespace grapnel {

/// "0.2.0".
const char* version();

}  // namespace grapnel
