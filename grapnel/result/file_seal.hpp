#pragma once

/// @file
/// A checksum behind a file's last byte. HDF5 can loop without end on a damaged file, so damage has to be found before
/// HDF5 sees it; HDF5 itself ignores what follows its data, and drops it when somebody changes the file.

#include <string>
#include <string_view>

namespace grapnel {

/// Appends 16 bytes: "GRAPNEL1" and the 64-bit FNV-1a hash of all bytes before, little endian.
void seal(std::string& bytes);

/// Takes the seal off, if there is one; a file without one passes. Throws std::runtime_error if it does not match.
void unseal(std::string& bytes);

}  // namespace grapnel
