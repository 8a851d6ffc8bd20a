#include "grapnel/result/file_seal.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace grapnel {
namespace {

constexpr std::string_view kMark = "GRAPNEL1";
constexpr std::size_t kHashSize = 8;

/// FNV-1a: every step is invertible, so that a single changed byte always shows.
class Hash {
 public:
  void add(std::string_view bytes) {
    for (const char c : bytes) {
      hash_ ^= static_cast<unsigned char>(c);
      hash_ *= 0x100000001b3u;
    }
  }
  std::uint64_t value() const { return hash_; }
  std::string text() const {
    std::string text;
    for (std::size_t i = 0; i < kHashSize; ++i) text += static_cast<char>((hash_ >> (8 * i)) & 0xff);
    return text;
  }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

std::string hash_of(std::string_view bytes) {
  Hash hash;
  hash.add(bytes);
  return hash.text();
}

[[noreturn]] void fail() { throw std::runtime_error(std::generic_category().message(errno)); }

/// Of the first `size` bytes of a file.
Hash hash_of_file(std::ifstream& file, std::uintmax_t size) {
  constexpr std::uintmax_t kBlock = 1 << 20;
  std::string block;
  Hash hash;
  for (std::uintmax_t left = size; left > 0; left -= block.size()) {
    block.resize(static_cast<std::size_t>(std::min(kBlock, left)));
    if (!file.read(block.data(), static_cast<std::streamsize>(block.size()))) fail();
    hash.add(block);
  }
  return hash;
}

}  // namespace

std::string checksum_text(std::string_view bytes) {
  Hash hash;
  hash.add(bytes);
  std::string text;
  for (int digit = 15; digit >= 0; --digit) text += "0123456789abcdef"[(hash.value() >> (4 * digit)) & 0xf];
  return text;
}

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

void seal_file(const std::filesystem::path& path) {
  std::string end(kMark);
  {
    std::ifstream file(path, std::ios::binary);
    if (!file) fail();
    end += hash_of_file(file, std::filesystem::file_size(path)).text();
  }
  std::ofstream file(path, std::ios::binary | std::ios::app);
  file.write(end.data(), static_cast<std::streamsize>(end.size()));
  file.close();
  if (!file) fail();
}

void check_file_seal(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) fail();
  const std::uintmax_t all = std::filesystem::file_size(path);
  if (all < kMark.size() + kHashSize) return;
  const std::uintmax_t size = all - kMark.size() - kHashSize;
  std::string end(kMark.size() + kHashSize, ' ');
  if (!file.seekg(static_cast<std::streamoff>(size)) ||
      !file.read(end.data(), static_cast<std::streamsize>(end.size())) || !file.seekg(0))
    fail();
  if (!end.starts_with(kMark)) return;
  if (end.substr(kMark.size()) != hash_of_file(file, size).text())
    throw std::runtime_error("damaged: its checksum does not match");
}

}  // namespace grapnel
