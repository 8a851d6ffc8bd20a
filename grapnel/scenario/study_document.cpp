#include "grapnel/scenario/study_document.hpp"

#include <fmt/format.h>

#include <memory>

#include "grapnel/scenario/schema.hpp"
#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/text_file.hpp"

namespace grapnel {

StudyDocument read_study_document(const std::filesystem::path& path, const std::string& kind,
                                  const std::string& expected, const nlohmann::ordered_json& schema,
                                  FaultList& faults) {
  StudyDocument document;
  const auto source = std::make_shared<const std::string>(path.string());
  const auto bytes = read_file(path, {source, 0, 0}, faults);
  if (!bytes) faults.throw_if_any();
  document.bytes = *bytes;
  const auto text = checked_text(*bytes, source, faults);
  auto tree = text ? parse_document(*text, source, faults) : std::nullopt;
  if (!tree) faults.throw_if_any();
  document.root = std::move(*tree);
  if (document.root.kind == Node::Kind::null) faults.add({source, 1, 1}, "the file is empty");
  const Node* named = document.root.find("schema");
  for (const char* other : {"scenario", "robot", "study", "optimization", "campaign"}) {
    if (other != kind && named && named->is_scalar() && named->text.starts_with(fmt::format("grapnel-{}/", other)))
      faults.add(named->mark, fmt::format("this is a {} file where {} is expected", other, expected));
  }
  faults.throw_if_any();
  check_structure(document.root, schema, "the " + kind, faults);
  document.sound = faults.empty();
  fill_defaults(document.root, schema);
  return document;
}

}  // namespace grapnel
