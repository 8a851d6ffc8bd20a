#include "grapnel/text/text_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <vector>

#include "grapnel/text/input_files.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// Names in the folder of a missing file, for "did you mean".
std::vector<std::string> neighbours(const std::filesystem::path& path) {
  std::vector<std::string> names;
  std::error_code error;
  const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  constexpr std::size_t kMost = 1000;
  for (auto it = std::filesystem::directory_iterator(folder, error);
       !error && it != std::filesystem::directory_iterator() && names.size() < kMost; it.increment(error)) {
    names.push_back(it->path().filename().string());
  }
  return names;
}

// Also C1 and characters that change the direction of writing, which make a reader see another text than the parser.
bool is_forbidden_control(std::string_view text, std::size_t i, std::size_t length) {
  const char c = text[i];
  return c != '\t' && c != '\n' && c != '\r' && is_control(text, i, length);
}

// Blanks other than ' ' and tab, which a YAML parser treats as letters; pasted from web pages and word processors.
std::size_t foreign_blank_length(std::string_view text) {
  for (const std::string_view blank : {"\u00a0", "\u2002", "\u2003", "\u2009", "\u202f", "\u3000", "\ufeff"}) {
    if (text.starts_with(blank)) return blank.size();
  }
  return 0;
}

// The name of a leading blank that is not allowed in indentation; else empty.
std::string_view wrong_blank(std::string_view text) {
  if (text[0] == '\t') return "tab";
  if (foreign_blank_length(text) == 0) return {};
  return text.starts_with("\u00a0") || text.starts_with("\u202f") ? "no-break space" : "foreign blank";
}

// Whether only blanks and a comment follow in the line.
bool begins_blank_line(std::string_view text) {
  std::size_t next = 0;
  while (next < text.size()) {
    const std::size_t foreign = foreign_blank_length(text.substr(next));
    if (foreign == 0 && text[next] != ' ' && text[next] != '\t' && text[next] != '\r') break;
    next += std::max<std::size_t>(foreign, 1);
  }
  return next == text.size() || text[next] == '\n' || text[next] == '#';
}

// Limit on the size of pipes and devices.
constexpr std::size_t kLargestPipe = 64u << 20;  // [bytes]

// Time limit for silence of a pipe [s].
constexpr int kPatience = 10;

// A file, pipe or device, read without blocking forever.
struct OpenFile {
  explicit OpenFile(const std::filesystem::path& path)
      : descriptor(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {}
  ~OpenFile() {
    if (descriptor >= 0) ::close(descriptor);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  // Number of bytes read, 0 at the end; negative: an error in errno, ETIMEDOUT without data. A pipe ends only after a
  // writer has written to it and closed it.
  ssize_t read(std::vector<char>& buffer) const {
    for (;;) {
      pollfd ready{descriptor, POLLIN, 0};
      const int count = ::poll(&ready, 1, kPatience * 1000);
      if (count == 0) errno = ETIMEDOUT;
      const ssize_t got = count > 0 ? ::read(descriptor, buffer.data(), buffer.size()) : -1;
      if (got >= 0 || (errno != EINTR && errno != EAGAIN)) return got;
    }
  }

  int descriptor;
};

}  // namespace

std::optional<std::string> read_file(const std::filesystem::path& path, const Mark& blame, FaultList& faults,
                                     std::size_t largest, const std::filesystem::path& named) {
  // An error of the file named on the command line does not repeat its name.
  const std::string name = blame.line > 0 || blame.source == nullptr || *blame.source != path.string()
                               ? " '" + path.string() + "'"
                               : std::string();
  const auto refuse = [&](const std::string& why) {
    faults.add(blame, fmt::format("cannot read the file{}: {}", name, why));
    return std::nullopt;
  };
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    const std::filesystem::path& said = named.empty() ? path : named;
    const std::string near = nearest(path.filename().string(), neighbours(path));
    const std::string why = error && error != std::errc::no_such_file_or_directory ? error.message() : "no such file";
    return refuse(why + (near.empty() ? "" : "; did you mean '" + (said.parent_path() / near).string() + "'?"));
  }
  if (std::filesystem::is_directory(status)) return refuse("it is a directory");
  // A file without a size may be endless, such as /dev/zero.
  if (!std::filesystem::is_regular_file(status)) largest = std::min(largest, kLargestPipe);
  const std::string too_large = fmt::format("it is larger than {} MB", largest >> 20);
  if (std::filesystem::is_regular_file(status) && std::filesystem::file_size(path, error) > largest) {
    return refuse(too_large);
  }
  // Pipes are accepted only from the command line (stdin, the output of a command); a pipe named in a file could block
  // forever.
  if (!named.empty() && !std::filesystem::is_regular_file(status)) return refuse("it is not a regular file");
  OpenFile file(path);
  if (file.descriptor < 0) return refuse(std::strerror(errno));
  note_input(path);
  // The size of a pipe is unknown: stop one byte beyond the limit.
  std::string bytes;
  std::vector<char> buffer(1u << 16);
  while (bytes.size() <= largest) {
    const ssize_t got = file.read(buffer);
    if (got == 0) return bytes;
    if (got < 0)
      return refuse(errno == ETIMEDOUT ? fmt::format("no data within {} s", kPatience) : std::strerror(errno));
    bytes.append(buffer.data(), static_cast<std::size_t>(got));
  }
  return refuse(too_large);
}

std::optional<std::string> checked_text(const std::string& bytes, const std::shared_ptr<const std::string>& source,
                                        FaultList& faults) {
  std::string_view text = bytes;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
    faults.add({source, 1, 1}, "the file is UTF-16; save it as UTF-8");
    return {};
  }
  const std::size_t before = faults.size();
  int line = 1, column = 1;
  bool in_indentation = true, indentation_reported = false;
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const std::size_t length = utf8_length(text, i);
    if (length == 0) {
      faults.add({source, line, column}, fmt::format("the file is not UTF-8 (byte 0x{:02x})", byte));
      return {};
    }
    if (is_forbidden_control(text, i, length)) {
      std::string bytes_of_it;
      for (std::size_t k = i; k < i + length; ++k)
        bytes_of_it += fmt::format("{:02x}", static_cast<unsigned char>(text[k]));
      faults.add({source, line, column}, fmt::format("control character 0x{} is not allowed in the file", bytes_of_it));
      return {};
    }
    if (byte == '\r' && text.substr(i + 1, 1) != "\n") {
      faults.add({source, line, column},
                 "a carriage return without a line feed; save the file with line feeds (or Windows line ends)");
      return {};
    }
    if (in_indentation && !indentation_reported) {
      const std::string_view wrong = wrong_blank(text.substr(i));
      if (!wrong.empty() && begins_blank_line(text.substr(i))) {
        in_indentation = false;
      } else if (!wrong.empty()) {
        faults.add({source, line, column}, fmt::format("{} in the indentation; indent with spaces", wrong));
        indentation_reported = true;
      }
    }
    if (byte != ' ' && byte != '\t') in_indentation = false;
    if (byte == '\n') {
      ++line, column = 1;
      in_indentation = true, indentation_reported = false;
    } else {
      ++column;
    }
    i += length;
  }
  if (faults.size() != before) return {};
  return std::string(text);
}

}  // namespace grapnel
