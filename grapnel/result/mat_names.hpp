#pragma once

/// @file
/// Names that MATLAB accepts for the fields of a struct; for the MAT writer.

#include <set>
#include <string>

namespace grapnel {

/// `name` as MATLAB's makeValidName would have it, nearly: letters, digits and _, beginning with a letter (else an x is
/// put before it), no keyword, at most 63 characters.
std::string matlab_name(const std::string& name);

/// The same, and unlike all in `taken` (by _2, _3, ... at its end), to which it is added.
std::string unique_matlab_name(const std::string& name, std::set<std::string>& taken);

}  // namespace grapnel
