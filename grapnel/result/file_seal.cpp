#include "grapnel/result/file_seal.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace grapnel {
namespace {

constexpr std::string_view kMark = "GRAPNEL1";
constexpr std::size_t kHashSize = 8;

/// FNV-1a: every step is invertible, so that a single changed byte is always detected.
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

namespace {

// FIPS 180-4, 4.2.2: fractional parts of the cube roots of the first 64 primes.
constexpr std::array<std::uint32_t, 64> kRound{
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

using State = std::array<std::uint32_t, 8>;

// FIPS 180-4, 6.2.2, on 64 bytes.
void compress(State& state, const unsigned char* block) {
  std::array<std::uint32_t, 64> w{};
  for (int t = 0; t < 16; ++t) {
    for (int k = 0; k < 4; ++k) w[t] = (w[t] << 8) | block[4 * t + k];
  }
  for (int t = 16; t < 64; ++t) {
    const std::uint32_t s0 = std::rotr(w[t - 15], 7) ^ std::rotr(w[t - 15], 18) ^ (w[t - 15] >> 3);
    const std::uint32_t s1 = std::rotr(w[t - 2], 17) ^ std::rotr(w[t - 2], 19) ^ (w[t - 2] >> 10);
    w[t] = w[t - 16] + s0 + w[t - 7] + s1;
  }
  auto [a, b, c, d, e, f, g, h] = state;
  for (int t = 0; t < 64; ++t) {
    const std::uint32_t sum1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
    const std::uint32_t t1 = h + sum1 + ((e & f) ^ (~e & g)) + kRound[t] + w[t];
    const std::uint32_t sum0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
    const std::uint32_t t2 = sum0 + ((a & b) ^ (a & c) ^ (b & c));
    h = g, g = f, f = e, e = d + t1, d = c, c = b, b = a, a = t1 + t2;
  }
  state[0] += a, state[1] += b, state[2] += c, state[3] += d;
  state[4] += e, state[5] += f, state[6] += g, state[7] += h;
}

}  // namespace

std::string sha256(std::string_view bytes) {
  State state{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a, 0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::string tail(bytes.substr(bytes.size() / 64 * 64));
  const std::string_view whole = bytes.substr(0, bytes.size() - tail.size());
  // Padding: a one bit, zeros, and the length in bits as 64 bits, to a multiple of 64 bytes.
  tail += '\x80';
  while (tail.size() % 64 != 56) tail += '\0';
  const std::uint64_t bits = static_cast<std::uint64_t>(bytes.size()) * 8;
  for (int shift = 56; shift >= 0; shift -= 8) tail += static_cast<char>((bits >> shift) & 0xff);

  for (const std::string_view part : {whole, std::string_view(tail)}) {
    for (std::size_t i = 0; i < part.size(); i += 64) {
      std::array<unsigned char, 64> block{};
      for (std::size_t k = 0; k < 64; ++k) block[k] = static_cast<unsigned char>(part[i + k]);
      compress(state, block.data());
    }
  }
  std::string hex;
  for (const std::uint32_t word : state) {
    for (int shift = 28; shift >= 0; shift -= 4) hex += "0123456789abcdef"[(word >> shift) & 0xf];
  }
  return hex;
}

}  // namespace grapnel
