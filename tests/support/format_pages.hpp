#pragma once

/// @file
/// Pages of docs/formats. A page NAME.md has its details in the pages of the folder NAME.

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

namespace grapnel::test {

/// docs/formats/NAME.md, then the pages of docs/formats/NAME, if any, in the order of their names.
inline std::vector<std::filesystem::path> format_pages(const std::string& name) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(GRAPNEL_SOURCE_DIR) / "docs/formats";
  std::vector<fs::path> pages{folder / (name + ".md")};
  if (!fs::is_directory(folder / name)) return pages;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / name)) {
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  }
  std::sort(pages.begin() + 1, pages.end());
  return pages;
}

}  // namespace grapnel::test
