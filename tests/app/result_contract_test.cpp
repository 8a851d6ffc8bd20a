// The published result pages and the viewer's types follow from the result descriptions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "commands.hpp"
#include "grapnel/describe/contract.hpp"
#include "grapnel/result/json_document.hpp"
#include "support/format_pages.hpp"

namespace grapnel::app {
namespace {

TEST(ResultContracts, PagesAndTypesAreCurrent) {
  const std::filesystem::path root = GRAPNEL_SOURCE_DIR;
  std::set<std::filesystem::path> generated;
  for (const ResultContract& contract : result_contracts()) {
    const std::string name(contract.page);
    std::vector<std::string> pages;
    for (const std::filesystem::path& path : test::format_pages(name)) {
      SCOPED_TRACE(path);
      generated.insert(path);
      pages.push_back(file_bytes(path));
      EXPECT_EQ(page_with_tables(pages.back(), contract.document()), pages.back()) << "run scripts/tables";
    }
    EXPECT_THAT(misplaced_tables(pages, contract.document()), testing::IsEmpty()) << name;
    EXPECT_EQ(typescript_types(contract.document(), kOriginOfTypes),
              file_bytes(root / "web/src" / (name + "_types.ts")))
        << "run scripts/tables";
  }
  // No other page contains a table marker: scripts/tables would not generate the table.
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root / "docs/formats")) {
    if (entry.path().extension() != ".md" || generated.contains(entry.path())) continue;
    EXPECT_EQ(file_bytes(entry.path()).find("<!-- table "), std::string::npos) << entry.path();
  }
}

}  // namespace
}  // namespace grapnel::app
