#include "output_folder.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

namespace grapnel::app {

std::string cannot_write_to(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return error.message();
  return ::access(folder.c_str(), W_OK | X_OK) == 0 ? std::string() : std::strerror(errno);
}

}  // namespace grapnel::app
