#include "grapnel/text/input_files.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <vector>

#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

struct Identity {
  dev_t device;
  ino_t inode;
  bool operator==(const Identity&) const = default;
};

struct Input {
  Identity identity;
  fs::path shown, absolute;  // a controller may change the working directory
};

std::mutex mutex;
std::vector<std::vector<Input>> inputs;  // per scope; guarded by mutex

std::optional<struct stat> status_of(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return status;
}

std::optional<Identity> identity_of(const fs::path& path) {
  const auto status = status_of(path);
  return status ? std::optional(Identity{status->st_dev, status->st_ino}) : std::nullopt;
}

const char* kind_of(mode_t mode) {
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

// The input that is this file: the inode of a removed file may belong to another file.
std::optional<fs::path> input_at(const Identity& identity) {
  const std::lock_guard lock(mutex);
  if (inputs.empty()) return std::nullopt;
  for (const Input& input : inputs.back()) {
    if (input.identity == identity && identity_of(input.absolute) == identity) return input.shown;
  }
  return std::nullopt;
}

}  // namespace

InputFiles::InputFiles() {
  const std::lock_guard lock(mutex);
  inputs.emplace_back();
}

InputFiles::~InputFiles() {
  const std::lock_guard lock(mutex);
  inputs.pop_back();
}

void note_input(const fs::path& path) {
  const auto status = status_of(path);
  if (!status || !S_ISREG(status->st_mode)) return;
  std::error_code error;
  Input input{{status->st_dev, status->st_ino}, path, fs::absolute(path, error)};
  const std::lock_guard lock(mutex);
  if (inputs.empty()) return;
  const bool is_known = std::any_of(inputs.back().begin(), inputs.back().end(), [&](const Input& one) {
    return one.identity == input.identity && one.absolute == input.absolute;
  });
  if (!is_known) inputs.back().push_back(std::move(input));
}

std::string why_not_replace(const fs::path& path) {
  const auto status = status_of(path);
  if (!status || S_ISDIR(status->st_mode)) return {};  // a directory is never replaced
  if (!S_ISREG(status->st_mode))
    return fmt::format("it is {}, which the output would replace", kind_of(status->st_mode));
  const auto input = input_at({status->st_dev, status->st_ino});
  if (!input) return {};
  if (*input == path) return "it is an input of this command";
  return fmt::format("it is the input {} of this command", "'" + printable_line(input->string()) + "'");
}

fs::path input_below(const fs::path& folder) {
  std::error_code error;
  const fs::path top = fs::weakly_canonical(folder, error);
  if (error) return {};
  const std::lock_guard lock(mutex);
  if (inputs.empty()) return {};
  for (const Input& input : inputs.back()) {
    const fs::path file = fs::weakly_canonical(input.absolute, error);
    if (error) continue;
    if (std::mismatch(top.begin(), top.end(), file.begin(), file.end()).first == top.end()) return input.shown;
  }
  return {};
}

}  // namespace grapnel
