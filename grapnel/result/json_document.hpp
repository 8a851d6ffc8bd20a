#pragma once

/// @file
/// Reads JSON files of a result folder.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace grapnel {

/// The bytes of a file. @throws std::runtime_error naming the path and the system's reason.
std::string file_bytes(const std::filesystem::path& path);

/// An object whose key `schema` is `schema`, or an `earlier` one that readers still understand; keys in the file's
/// order. @throws std::runtime_error naming the path and the error: missing, not JSON, nested too deeply, another kind
/// of file.
nlohmann::ordered_json read_json_document(const std::filesystem::path& path, const std::string& schema,
                                          const std::string& earlier = "");

/// The text at a JSON pointer such as "/scenario/name". @throws std::runtime_error naming path and key.
std::string required_text(const nlohmann::ordered_json& document, const std::string& pointer,
                          const std::filesystem::path& path);

// Files named in results: their folder relative to the result folder, so that both may be moved together.

/// The folder of a file, relative to `from`; empty if the system cannot determine it.
std::string folder_seen_from(const std::filesystem::path& from, const std::filesystem::path& file);
/// The key `file_folder` of a document; empty if it is absent.
std::string folder_of_input(const std::filesystem::path& document);
/// The path of a file from that folder and its name, relative to the current folder; the name alone if the file does
/// not exist.
std::string file_seen_from_here(const std::filesystem::path& from, const std::string& folder, const std::string& name);

// JSON documents as text for people and for comparison by programs.

/// Objects, and lists of objects or lists, take several lines; lists of numbers or names take one. Numbers read back to
/// the same double; NaN and infinities become null; bytes that are not UTF-8 become U+FFFD. A newline at the end.
std::string json_text(const nlohmann::ordered_json& document);

}  // namespace grapnel
