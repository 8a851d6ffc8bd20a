#pragma once

/// @file
/// Contracts of a JSON document written by json_of(), generated from the same description: its JSON Schema, its
/// TypeScript types, and the tables of its page in docs/formats.

#include <string>
#include <string_view>
#include <vector>

#include "grapnel/describe/type.hpp"

namespace grapnel {

/// The structures and enumerations of a value, each once: itself, then its parts in order of occurrence.
std::vector<const Type*> parts_of(const Type& type);

/// JSON Schema (draft 7). Only described keys are allowed; all are required except those that may be absent.
std::string json_schema(const Type& document, std::string_view title);

/// An interface and a list of its fields' keys, units and texts per structure, a union per enumeration. `origin`: the
/// comment at the top, without slashes.
std::string typescript_types(const Type& document, std::string_view origin);

/// The table of a structure's fields in Markdown, below a line with its name and description.
std::string markdown_table(const Type& structure);

/// A page with its tables replaced between the lines `<!-- table NAME -->` and `<!-- end of table -->`. @throws
/// std::runtime_error if a structure of the document has no such place, or a place has no structure.
std::string page_with_tables(std::string_view page, const Type& document);

}  // namespace grapnel
