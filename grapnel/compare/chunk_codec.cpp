#include "grapnel/compare/chunk_codec.hpp"

#include <bzlib.h>
#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <boost/crc.hpp>
#include <limits>
#include <stdexcept>

#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

constexpr std::uint64_t kLargestChunk = std::uint64_t{1} << 30;  // decompressed [bytes]
constexpr std::size_t kFirstBlock = std::size_t{1} << 20;        // [bytes]

// One step of a decompressor: bytes that it consumed and produced.
struct CodecStep {
  std::size_t consumed = 0, produced = 0;
  bool at_end = false;
};

// Runs `step(input, room)` until the declared size is there. One byte more than declared is asked for, so that longer
// contents are detected.
template <class Step>
std::string unpacked(std::string_view bytes, std::uint64_t size, Step step) {
  std::string out;
  std::size_t filled = 0;
  const auto most = static_cast<std::size_t>(size) + 1;
  bool at_end = false;
  while (!at_end && filled < most) {
    if (filled == out.size()) out.resize(std::min(most, std::max(kFirstBlock, 2 * filled)));
    const CodecStep done = step(bytes, out.data() + filled, out.size() - filled);
    bytes.remove_prefix(done.consumed), filled += done.produced, at_end = done.at_end;
    if (!at_end && done.consumed == 0 && done.produced == 0) break;
  }
  if (filled != size)
    throw std::runtime_error(fmt::format("a chunk has {} decompressed bytes{}, must have {}", filled,
                                         filled == most ? " or more" : "", size));
  out.resize(filled);
  return out;
}

std::string unpacked_lz4(std::string_view bytes, std::uint64_t size) {
  struct Context {
    LZ4F_dctx* p = nullptr;
    Context() {
      if (LZ4F_isError(LZ4F_createDecompressionContext(&p, LZ4F_VERSION))) throw std::bad_alloc();
    }
    ~Context() { LZ4F_freeDecompressionContext(p); }
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;
  } context;
  return unpacked(bytes, size, [&](std::string_view in, char* out, std::size_t room) {
    std::size_t consumed = in.size(), produced = room;
    const std::size_t left = LZ4F_decompress(context.p, out, &produced, in.data(), &consumed, nullptr);
    if (LZ4F_isError(left))
      throw std::runtime_error(fmt::format("a chunk is not valid lz4: {}", LZ4F_getErrorName(left)));
    return CodecStep{consumed, produced, left == 0 && consumed == in.size()};
  });
}

std::string unpacked_zstd(std::string_view bytes, std::uint64_t size) {
  struct Context {
    ZSTD_DCtx* p = ZSTD_createDCtx();
    Context() {
      if (!p) throw std::bad_alloc();
    }
    ~Context() { ZSTD_freeDCtx(p); }
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;
  } context;
  return unpacked(bytes, size, [&](std::string_view in, char* out, std::size_t room) {
    ZSTD_inBuffer input{in.data(), in.size(), 0};
    ZSTD_outBuffer output{out, room, 0};
    const std::size_t left = ZSTD_decompressStream(context.p, &output, &input);
    if (ZSTD_isError(left))
      throw std::runtime_error(fmt::format("a chunk is not valid zstd: {}", ZSTD_getErrorName(left)));
    return CodecStep{input.pos, output.pos, left == 0 && input.pos == in.size()};
  });
}

std::string unpacked_bz2(std::string_view bytes, std::uint64_t size) {
  struct Context {
    bz_stream stream{};
    Context() {
      if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw std::bad_alloc();
    }
    ~Context() { BZ2_bzDecompressEnd(&stream); }
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;
  } context;
  return unpacked(bytes, size, [&](std::string_view in, char* out, std::size_t room) {
    bz_stream& s = context.stream;
    const auto most_in = static_cast<unsigned>(std::min<std::size_t>(in.size(), 1u << 30)),
               most_out = static_cast<unsigned>(std::min<std::size_t>(room, 1u << 30));
    s.next_in = const_cast<char*>(in.data()), s.avail_in = most_in;  // bzlib does not write to it
    s.next_out = out, s.avail_out = most_out;
    const int code = BZ2_bzDecompress(&s);
    if (code != BZ_OK && code != BZ_STREAM_END)
      throw std::runtime_error(fmt::format("a chunk is not valid bz2 (code {})", code));
    return CodecStep{most_in - s.avail_in, most_out - s.avail_out, code == BZ_STREAM_END};
  });
}

}  // namespace

std::string decompressed(std::string_view compression, std::string_view bytes, std::uint64_t size) {
  if (size > kLargestChunk)
    throw std::runtime_error(
        fmt::format("a chunk declares {} decompressed bytes, must have at most {}", size, kLargestChunk));
  if (compression == "lz4") return unpacked_lz4(bytes, size);
  if (compression == "zstd") return unpacked_zstd(bytes, size);
  if (compression == "bz2") return unpacked_bz2(bytes, size);
  if (!compression.empty() && compression != "none")
    throw std::runtime_error(fmt::format("unknown compression {} of a chunk", in_quotes(std::string(compression))));
  if (bytes.size() != size)
    throw std::runtime_error(fmt::format("a chunk has {} bytes, must have {}", bytes.size(), size));
  return std::string(bytes);
}

std::uint32_t crc32_of(std::string_view bytes) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

}  // namespace grapnel
