#include "grapnel/report/gltf_file.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <stdexcept>

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

// Numbers that glTF 2.0 gives these things.
constexpr int kFloat = 5126, kUnsignedInt = 5125, kVertexData = 34962, kIndexData = 34963;
constexpr std::uint32_t kMagic = 0x46546c67, kVersion = 2, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;

void append(std::uint32_t value, std::string& out) {
  for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(value >> shift & 0xff);
}

void pad(std::string& bytes, char with) {
  while (bytes.size() % 4 != 0) bytes += with;
}

std::string bytes_of(const std::vector<float>& values) {
  std::string bytes;
  bytes.reserve(4 * values.size());
  for (const float value : values) append(std::bit_cast<std::uint32_t>(value), bytes);
  return bytes;
}

// Least and largest value per component.
void add_bounds(const std::vector<float>& values, std::size_t width, Json& accessor) {
  std::vector<float> low(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(width)), high = low;
  for (std::size_t i = 0; i < values.size(); ++i) {
    low[i % width] = std::min(low[i % width], values[i]);
    high[i % width] = std::max(high[i % width], values[i]);
  }
  accessor["min"] = low;
  accessor["max"] = high;
}

}  // namespace

int GltfFile::add_accessor(const std::string& bytes, Json accessor, int target) {
  Json view{{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes.size()}};
  if (target != 0) view["target"] = target;
  buffer_ += bytes;
  pad(buffer_, '\0');
  accessor["bufferView"] = add("bufferViews", std::move(view));
  return add("accessors", std::move(accessor));
}

int GltfFile::add_floats(const std::vector<float>& values, int width) {
  Json accessor{{"componentType", kFloat},
                {"count", values.size() / static_cast<std::size_t>(width)},
                {"type", width == 1   ? "SCALAR"
                         : width == 3 ? "VEC3"
                                      : "VEC4"}};
  if (!values.empty()) add_bounds(values, static_cast<std::size_t>(width), accessor);
  return add_accessor(bytes_of(values), std::move(accessor), 0);
}

int GltfFile::add_vertices(const std::vector<float>& values) {
  Json accessor{{"componentType", kFloat}, {"count", values.size() / 3}, {"type", "VEC3"}};
  if (!values.empty()) add_bounds(values, 3, accessor);
  return add_accessor(bytes_of(values), std::move(accessor), kVertexData);
}

int GltfFile::add_indices(const std::vector<std::uint32_t>& values) {
  std::string bytes;
  for (const std::uint32_t value : values) append(value, bytes);
  return add_accessor(bytes, {{"componentType", kUnsignedInt}, {"count", values.size()}, {"type", "SCALAR"}},
                      kIndexData);
}

int GltfFile::add(const char* array, Json entry) {
  Json& list = document_[array];
  list.push_back(std::move(entry));
  return static_cast<int>(list.size()) - 1;
}

std::string GltfFile::bytes() const {
  Json document = document_;
  document["buffers"] = Json::array({Json{{"byteLength", buffer_.size()}}});
  // Names of bodies come from outside: bytes that are no UTF-8 are replaced.
  std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
  pad(text, ' ');
  if (12 + 8 + text.size() + 8 + buffer_.size() > std::numeric_limits<std::uint32_t>::max())
    throw std::runtime_error("more than 4 GB, which a .glb file cannot hold");
  std::string file;
  append(kMagic, file);
  append(kVersion, file);
  append(static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + buffer_.size()), file);
  append(static_cast<std::uint32_t>(text.size()), file);
  append(kJsonChunk, file);
  file += text;
  append(static_cast<std::uint32_t>(buffer_.size()), file);
  append(kBinaryChunk, file);
  return file + buffer_;
}

}  // namespace grapnel
