#include "output_folder.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>
#include <system_error>

#include "terminal.hpp"

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
  to_stderr("grapnel: error: cannot write results to '{}': {}\n", folder.string(), why);
  return std::nullopt;
}

bool may_replace(const std::filesystem::path& file) {
  constexpr std::string_view kMade = "# Made by grapnel";
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return true;
  std::string first;
  if (std::filesystem::is_regular_file(file, error)) {
    std::ifstream stream(file, std::ios::binary);
    std::getline(stream, first);
  }
  if (first.starts_with(kMade)) return true;
  to_stderr("{}: error: is there already, and grapnel did not make it; choose another folder with -o\n", file.string());
  return false;
}

}  // namespace grapnel::app
