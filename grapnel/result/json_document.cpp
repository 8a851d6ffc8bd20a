#include "grapnel/result/json_document.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace grapnel {

namespace {

using Json = nlohmann::ordered_json;

// Files of Grapnel have at most ten levels. Deeper nesting could exhaust the stack when the document is written again.
constexpr int kDeepest = 64;

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& fault) {
  throw std::runtime_error(path.string() + ": " + fault);
}

Json parsed(const std::string& text, const std::filesystem::path& path) {
  const Json::parser_callback_t check_depth = [&](int depth, Json::parse_event_t, Json&) {
    if (depth > kDeepest) fail(path, "damaged: nested deeper than " + std::to_string(kDeepest) + " levels");
    return true;
  };
  try {
    return Json::parse(text, check_depth);
  } catch (const Json::exception& error) {
    const std::string what = error.what();  // "[json.exception.parse_error.101] parse error at line 3, column 7: ..."
    const std::size_t at = what.find("] ");
    fail(path, "not JSON: " + (at == std::string::npos ? what : what.substr(at + 2)));
  }
}

}  // namespace

std::string file_bytes(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) fail(path, error.message());
  if (!std::filesystem::is_regular_file(status)) fail(path, "not a file");  // reading a pipe would block
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail(path, std::generic_category().message(errno));
  // Reads large blocks to the end, because the file may change its size during reading.
  constexpr std::size_t kPiece = std::size_t{1} << 16;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  std::string bytes;
  std::size_t read = 0;
  if (!error) bytes.resize(static_cast<std::size_t>(size) + 1);
  try {
    for (;;) {
      if (bytes.size() <= read) bytes.resize(read + kPiece);
      stream.read(bytes.data() + read, static_cast<std::streamsize>(bytes.size() - read));
      read += static_cast<std::size_t>(stream.gcount());
      if (stream.eof()) break;
      if (!stream) fail(path, "the file cannot be read");
    }
  } catch (const std::ios_base::failure&) {
    fail(path, "the file cannot be read");
  }
  bytes.resize(read);
  return bytes;
}

std::string folder_seen_from(const std::filesystem::path& from, const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return {};
  const std::filesystem::path folder = std::filesystem::absolute(file, error).parent_path();
  const std::filesystem::path seen = std::filesystem::proximate(folder, from, error);
  return error ? std::string() : seen.generic_string();
}

std::string folder_of_input(const std::filesystem::path& document) {
  try {
    return Json::parse(file_bytes(document)).value("file_folder", "");
  } catch (const std::exception&) {  // the folder is only shown in a command on the page
    return {};
  }
}

std::string file_seen_from_here(const std::filesystem::path& from, const std::string& folder, const std::string& name) {
  std::error_code error;
  const std::filesystem::path file = from / folder / std::filesystem::path(name).filename();
  if (folder.empty() || !std::filesystem::is_regular_file(file, error)) return name;
  const std::filesystem::path seen = std::filesystem::proximate(file, error);
  return error ? name : seen.generic_string();
}

Json read_json_document(const std::filesystem::path& path, const std::string& schema, const std::string& earlier) {
  Json document = parsed(file_bytes(path), path);
  if (!document.is_object()) fail(path, "not a JSON object");
  const auto found = document.find("schema");
  if (found == document.end() || !found->is_string()) fail(path, "key 'schema' is missing; it should be " + schema);
  const std::string is = found->get<std::string>();
  if (is != schema && (earlier.empty() || is != earlier)) fail(path, "schema is '" + is + "', not " + schema);
  return document;
}

std::string required_text(const Json& document, const std::string& pointer, const std::filesystem::path& path) {
  const Json::json_pointer at(pointer);
  if (!document.contains(at)) fail(path, "key '" + pointer.substr(1) + "' is missing");
  const Json& value = document.at(at);
  if (!value.is_string()) fail(path, "key '" + pointer.substr(1) + "' is not a text");
  return value.get<std::string>();
}

namespace {

using Json = nlohmann::ordered_json;

void print(const Json& json, const std::string& indent, std::string& out) {
  const bool nested =
      std::any_of(json.begin(), json.end(), [](const Json& item) { return item.is_structured(); }) || json.is_object();
  if (!json.is_structured() || json.empty()) {
    out += json.dump(-1, ' ', false, Json::error_handler_t::replace);
    return;
  }
  const char* brackets = json.is_object() ? "{}" : "[]";
  const std::string inner = indent + "  ";
  out += brackets[0];
  bool first = true;
  for (const auto& [key, value] : json.items()) {
    if (!first) out += nested ? "," : ", ";
    first = false;
    if (nested) out += "\n" + inner;
    if (json.is_object()) out += Json(key).dump(-1, ' ', false, Json::error_handler_t::replace) + ": ";
    print(value, inner, out);
  }
  if (nested) out += "\n" + indent;
  out += brackets[1];
}

}  // namespace

std::string json_text(const Json& document) {
  std::string text;
  print(document, "", text);
  return text + "\n";
}

}  // namespace grapnel
