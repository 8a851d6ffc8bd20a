#include "output_folder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

namespace grapnel::app {
namespace {

// Makes the folder. Why nothing can be written there, before a long simulation finds out; empty if it can.
std::string cannot_write_to(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return error.message();
  return ::access(folder.c_str(), W_OK | X_OK) == 0 ? std::string() : std::strerror(errno);
}

}  // namespace

std::optional<std::filesystem::path> results_folder(const std::filesystem::path& asked,
                                                    const std::filesystem::path& file) {
  std::filesystem::path folder = asked.empty() ? std::filesystem::path("out") / file.stem() : asked;
  const std::string why = cannot_write_to(folder);
  if (why.empty()) return folder;
  fmt::print(stderr, "grapnel: error: cannot write results to '{}': {}\n", folder.string(), why);
  return std::nullopt;
}

}  // namespace grapnel::app
