#pragma once

/// @file
/// JSON files of a result folder, read back.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace grapnel {

/// The bytes of a file. @throws std::runtime_error naming the path and the system's reason.
std::string file_bytes(const std::filesystem::path& path);

/// An object whose key `schema` is `schema`, or an `earlier` one that readers still understand; keys in the file's
/// order. @throws std::runtime_error naming the path and
/// the fault: missing, no JSON, nested without end, another kind of file.
nlohmann::ordered_json read_json_document(const std::filesystem::path& path, const std::string& schema,
                                          const std::string& earlier = "");

/// The text at a JSON pointer such as "/scenario/name". @throws std::runtime_error naming path and key.
std::string required_text(const nlohmann::ordered_json& document, const std::string& pointer,
                          const std::filesystem::path& path);

// Files that results name: their folder as seen from the result folder, so that both may be moved together.

/// The folder of a file, relative to `from`; empty if the system does not know.
std::string folder_seen_from(const std::filesystem::path& from, const std::filesystem::path& file);
/// The text `file_folder` of a document that says so; empty without one.
std::string folder_of_input(const std::filesystem::path& document);
/// A file by that and its name, as a command given here names it; the name alone if the file is not there.
std::string file_seen_from_here(const std::filesystem::path& from, const std::string& folder, const std::string& name);

// JSON documents as text that people read and programs compare.

/// Objects, and lists that hold objects or lists, are spread over lines; lists of numbers or names stay on one. Numbers
/// read back to the same double, NaN and infinities become null, bytes that are not UTF-8 U+FFFD. A newline at the end.
std::string json_text(const nlohmann::ordered_json& document);

}  // namespace grapnel
