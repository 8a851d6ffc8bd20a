#include "grapnel/text/error_text.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <new>
#include <stdexcept>

namespace grapnel {

std::string error_text(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
      dynamic_cast<const std::length_error*>(&error) != nullptr)
    return "there is not enough memory";
  const auto* const file = dynamic_cast<const std::filesystem::filesystem_error*>(&error);
  if (file == nullptr) return error.what();
  const std::string second = file->path2().empty() ? "" : fmt::format(" and '{}'", file->path2().string());
  return fmt::format("cannot use '{}'{}: {}", file->path1().string(), second, file->code().message());
}

}  // namespace grapnel
