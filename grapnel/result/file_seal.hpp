#pragma once

/// @file
/// A checksum behind a file's last byte. HDF5 can loop without end on a damaged file, so damage has to be found before
/// HDF5 sees it; HDF5 itself ignores what follows its data, and drops it when somebody changes the file. Beside it
/// SHA-256, by which inputs are named.

#include <filesystem>
#include <string>
#include <string_view>

namespace grapnel {

/// Appends 16 bytes: "GRAPNEL1" and the 64-bit FNV-1a hash of all bytes before, little endian.
void seal(std::string& bytes);

/// Takes the seal off, if there is one; a file without one passes. Throws std::runtime_error if it does not match.
void unseal(std::string& bytes);

/// The same for files that are too large for the memory, a block at a time: appends the seal; looks whether there is
/// one that does not match. Both throw std::runtime_error with the system's reason where the file cannot be read or
/// written.
void seal_file(const std::filesystem::path& path);
void check_file_seal(const std::filesystem::path& path);

/// The same hash as 16 hexadecimal digits, the most significant first: for a key of a text that people read.
std::string checksum_text(std::string_view bytes);

// SHA-256 (FIPS 180-4), to name an input.

/// Digest of the bytes, as 64 lower-case hexadecimal digits.
std::string sha256(std::string_view bytes);

}  // namespace grapnel
