#include "grapnel/result/file_seal.hpp"

#include <cstdint>
#include <stdexcept>

namespace grapnel {
namespace {

constexpr std::string_view kMark = "GRAPNEL1";
constexpr std::size_t kHashSize = 8;

/// FNV-1a: every step is invertible, so that a single changed byte always shows.
std::string hash_of(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : bytes) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001b3u;
  }
  std::string text;
  for (std::size_t i = 0; i < kHashSize; ++i) text += static_cast<char>((hash >> (8 * i)) & 0xff);
  return text;
}

}  // namespace

void seal(std::string& bytes) {
  const std::string hash = hash_of(bytes);
  bytes.append(kMark).append(hash);
}

void unseal(std::string& bytes) {
  if (bytes.size() < kMark.size() + kHashSize) return;
  const std::size_t size = bytes.size() - kMark.size() - kHashSize;
  const std::string_view all(bytes);
  if (all.substr(size, kMark.size()) != kMark) return;
  if (all.substr(size + kMark.size()) != hash_of(all.substr(0, size))) {
    throw std::runtime_error("damaged: its checksum does not match");
  }
  bytes.resize(size);
}

}  // namespace grapnel
