// What is published of results, pages and the viewer's types, follows from their descriptions.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "commands.hpp"
#include "grapnel/describe/contract.hpp"
#include "grapnel/result/json_document.hpp"

namespace grapnel::app {
namespace {

TEST(ResultContracts, PagesAndTypesAreCurrent) {
  const std::filesystem::path root = GRAPNEL_SOURCE_DIR;
  for (const ResultContract& contract : result_contracts()) {
    const std::string name(contract.page);
    const std::string page = file_bytes(root / "docs/formats" / (name + ".md"));
    EXPECT_EQ(page_with_tables(page, contract.document()), page) << "run scripts/tables";
    EXPECT_EQ(typescript_types(contract.document(), kOriginOfTypes),
              file_bytes(root / "web/src" / (name + "_types.ts")))
        << "run scripts/tables";
  }
}

}  // namespace
}  // namespace grapnel::app
