#pragma once

/// @file
/// Which JSON documents of results are published: their schemas, the tables of their pages in docs/formats, and the
/// viewer's types in web/src follow from their descriptions, by grapnel/describe/contract.hpp.

#include <span>
#include <string_view>

#include "grapnel/describe/type.hpp"

namespace grapnel {

struct ResultContract {
  std::string_view kind;   ///< "summary", "scene": the page is docs/formats/KIND.md, the types web/src/KIND_types.ts
  std::string_view title;  ///< of the schema
  const Type& (*document)();
};

std::span<const ResultContract> result_contracts();
/// Null if there is none of the kind.
const ResultContract* result_contract(std::string_view kind);

/// The first line of files with types.
inline constexpr std::string_view kOriginOfTypes =
    "Made by scripts/tables from the descriptions in grapnel/result: change those.";

}  // namespace grapnel
