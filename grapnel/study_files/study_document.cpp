#include "grapnel/study_files/study_document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/study_files/study_files.hpp"
#include "grapnel/study_files/study_units.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/write_yaml.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

struct FileKind {
  std::string name, with_article;
  const Type& type;
  Json schema = schema_of(type, "Grapnel " + name + ", version 1");

  std::string schema_text() const { return published(schema); }
};
const FileKind& study_kind() {
  static const FileKind kKind{"study", "a study", study_file_description()};
  return kKind;
}
const FileKind& campaign_kind() {
  static const FileKind kKind{"campaign", "a campaign", campaign_file_description()};
  return kKind;
}
const FileKind& optimization_kind() {
  static const FileKind kKind{"optimization", "an optimization", optimization_file_description()};
  return kKind;
}

StudyDocument read_kind(const std::filesystem::path& path, const FileKind& kind, void* file, FaultList& faults) {
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
    if (other != kind.name && named && named->is_scalar() && named->text.starts_with(fmt::format("grapnel-{}/", other)))
      faults.add(named->mark, fmt::format("this is a {} file where {} is expected", other, kind.with_article));
  }
  faults.throw_if_any();
  take_study_units(document.root, faults);
  check_structure(document.root, kind.schema, "the " + kind.name, faults);
  document.sound = faults.empty();
  read_structure(document.root, kind.type, file);
  return document;
}

}  // namespace

std::string study_schema() { return study_kind().schema_text(); }
std::string campaign_schema() { return campaign_kind().schema_text(); }
std::string optimization_schema() { return optimization_kind().schema_text(); }

StudyDocument read_document(const std::filesystem::path& path, StudyFile& file, FaultList& faults) {
  return read_kind(path, study_kind(), &file, faults);
}
StudyDocument read_document(const std::filesystem::path& path, CampaignFile& file, FaultList& faults) {
  return read_kind(path, campaign_kind(), &file, faults);
}
StudyDocument read_document(const std::filesystem::path& path, OptimizationFile& file, FaultList& faults) {
  return read_kind(path, optimization_kind(), &file, faults);
}

std::vector<Change> read_changes(const Node& mapping) {
  std::vector<Change> changes;
  for (const NodeEntry& e : mapping.entries) changes.push_back({e.key, e.mark, e.value, flow_text(e.value)});
  return changes;
}

std::vector<bool> chosen_columns(const Node& list, const std::vector<Column>& columns, FaultList& faults) {
  std::vector<std::string> names;
  for (const Column& column : columns) names.push_back(column.name);
  std::vector<bool> chosen(columns.size(), false);
  for (std::size_t c = 0; !list.is_sequence() && c < columns.size(); ++c) chosen[c] = columns[c].by_default;
  for (const Node& pattern : list.items) {
    bool any = false;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (!column_matches(pattern.text, names[c])) continue;
      chosen[c] = any = true;
    }
    if (any || columns.empty() || pattern.text.empty()) continue;
    const std::string near = nearest(pattern.text, names);
    faults.add(pattern.mark, fmt::format("no column {}{}", in_quotes(pattern.text),
                                         near.empty() ? "; without 'columns' the table has all columns except loads"
                                                      : "; did you mean " + in_quotes(near) + "?"));
  }
  return chosen;
}

void add_once(Fault fault, FaultList& faults) {
  const auto& all = faults.all();
  if (std::find(all.begin(), all.end(), fault) == all.end()) faults.add(std::move(fault));
}
void add_once(const Mark& mark, std::string message, FaultList& faults) {
  add_once(Fault{mark.source ? *mark.source : std::string(), mark.line, mark.column, std::move(message)}, faults);
}

void expect_impact(StudyMode mode, const CaptureProblem& problem, const Node& root, FaultList& faults) {
  if (mode != StudyMode::impact || problem.impact) return;
  add_once(part(root, "simulate").mark,
           fmt::format("simulate: impact needs a scenario with 'impact', {} has none", in_quotes(problem.name)),
           faults);
}

bool expect_grasp_or_target(const std::string& name, const Mark& mark, const std::string& place, bool of_grasp,
                            const CaptureProblem& problem, FaultList& faults) {
  std::vector<std::string> names;
  if (of_grasp) {
    for (const GraspSetup& grasp : problem.grasps) names.push_back(grasp.end_effector);
  } else {
    for (const TargetSetup& target : problem.targets) names.push_back(target.name);
  }
  if (name.empty() || std::find(names.begin(), names.end(), name) != names.end()) return true;
  add_once(mark,
           fmt::format("unknown {} {} in {}{}", of_grasp ? "grasp" : "target", in_quotes(name), place,
                       suggestion(name, names, of_grasp ? "end-effectors" : "targets")),
           faults);
  return false;
}

}  // namespace grapnel
