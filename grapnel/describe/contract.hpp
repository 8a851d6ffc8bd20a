#pragma once

/// @file
/// What others need to know of a JSON document that json_of() writes, made from the same description: its JSON Schema,
/// its TypeScript types, and the tables of its page in docs/formats.

#include <string>
#include <string_view>
#include <vector>

#include "grapnel/describe/type.hpp"

namespace grapnel {

/// The structures and enumerations that a value is made of, each once: itself, then its parts in the order in which
/// they are met.
std::vector<const Type*> parts_of(const Type& type);

/// JSON Schema (draft 7). No keys but the described ones; all of them but those that may be absent.
std::string json_schema(const Type& document, std::string_view title);

/// An interface and a list of its fields' keys, units and texts per structure, a union per enumeration. `origin`: the
/// comment at the top, without slashes.
std::string typescript_types(const Type& document, std::string_view origin);

/// The table of a structure's fields in Markdown, below a line with its name and what it is.
std::string markdown_table(const Type& structure);

/// A page with its tables remade: what stands between the lines `<!-- table NAME -->` and `<!-- end of table -->`.
/// @throws std::runtime_error where a structure of the document has no such place, or a place no structure.
std::string page_with_tables(std::string_view page, const Type& document);

}  // namespace grapnel
