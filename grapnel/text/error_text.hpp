#pragma once

/// @file
/// Exceptions as sentences for users.

#include <exception>
#include <string>

namespace grapnel {

/// The message of an exception. Exceptions of the standard library name C++ functions: for lack of memory and for
/// failed operations on files the text names the cause and the file instead.
std::string error_text(const std::exception& error);

}  // namespace grapnel
