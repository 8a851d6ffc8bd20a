#pragma once

/// @file
/// A checksum after a file's last byte. HDF5 can loop endlessly on a damaged file, so damage must be detected before
/// HDF5 opens it. HDF5 ignores bytes after its data, and drops them when the file is changed. Also SHA-256, which
/// identifies inputs.

#include <filesystem>
#include <string>
#include <string_view>

namespace grapnel {

/// Appends 16 bytes: "GRAPNEL1" and the 64-bit FNV-1a hash of all bytes before, little endian.
void seal(std::string& bytes);

/// Removes the seal, if present; a file without a seal passes. Throws std::runtime_error if the seal does not match.
void unseal(std::string& bytes);

/// The same for files that exceed the memory, one block at a time: the first appends the seal, the second checks an
/// existing seal. Both throw std::runtime_error with the system's reason if the file cannot be read or written.
void seal_file(const std::filesystem::path& path);
void check_file_seal(const std::filesystem::path& path);

/// The same hash as 16 hexadecimal digits, the most significant first: for a key of a text that people read.
std::string checksum_text(std::string_view bytes);

// SHA-256 (FIPS 180-4), to name an input.

/// Digest of the bytes, as 64 lower-case hexadecimal digits.
std::string sha256(std::string_view bytes);

}  // namespace grapnel
