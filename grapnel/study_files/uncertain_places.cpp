#include "grapnel/study_files/uncertain_places.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// Whether a mapping, which is there, can have an orientation.
bool can_be_oriented(const Node& scenario, const std::string& path, const Mark& mark) {
  FaultList unused;
  std::vector<PathStep> steps = path_steps(scenario, path, mark, unused);
  steps.push_back({"quaternion_wxyz", 0, false});
  return place_rule(steps).is_known;
}

}  // namespace

Overlap overlap(std::span<const PathStep> place, std::span<const PathStep> other) {
  const std::size_t common = std::min(place.size(), other.size());
  const auto same = [](const PathStep& a, const PathStep& b) {
    return a.is_index == b.is_index && a.index == b.index && a.key == b.key;
  };
  if (!std::equal(place.begin(), place.begin() + static_cast<std::ptrdiff_t>(common), other.begin(), same))
    return Overlap::none;
  if (place.size() == other.size()) return Overlap::same;
  return place.size() > common ? Overlap::part : Overlap::whole;
}

UncertainPaths uncertain_paths(const UncertainFile& file, const Node& entry, const std::string& place) {
  UncertainPaths where;
  where.mark = entry.mark, where.place = place;
  const auto add = [&](const std::string& path, const Mark& mark) {
    if (path.empty()) return;
    where.paths.push_back(path);
    where.path_marks.push_back(mark);
  };
  add(file.path, part(entry, "path").mark);
  for (std::size_t i = 0; i < file.paths.size(); ++i) add(file.paths[i], part(entry, "paths").items[i].mark);
  where.is_orientation = file.rotation.has_value();
  if (where.is_orientation) {
    for (std::string& path : where.paths) {
      if (!path.ends_with(".quaternion_wxyz")) path += ".quaternion_wxyz";
    }
  }
  return where;
}

void prepare_orientations(const std::vector<UncertainPaths>& uncertain, Node& scenario, FaultList& faults) {
  for (const UncertainPaths& where : uncertain) {
    if (!where.is_orientation || where.paths.empty()) continue;
    const std::string of = where.paths[0].substr(0, where.paths[0].rfind(".quaternion_wxyz"));
    std::optional<Node> mapping = value_at(scenario, of);
    if (!mapping) continue;
    if (!mapping->is_mapping() || !can_be_oriented(scenario, of, where.path_marks[0])) {
      faults.add(where.path_marks[0],
                 fmt::format("{}: rotation is for what has an orientation, a 'quaternion_wxyz' or 'rpy', not for {} at "
                             "{}; name the mapping, such as targets.NAME.state",
                             where.place, described(*mapping), shortened(of)));
      continue;
    }
    if (mapping->find("quaternion_wxyz")) continue;
    FaultList unused;
    const auto rpy = vector_at(*mapping, "rpy").value_or(Vector3d::zero());
    const Quaterniond q = quaternion_from(rotation_from_rpy(rpy[0], rpy[1], rpy[2]));
    const Mark mark = mapping->entry("rpy") ? mapping->entry("rpy")->mark : mapping->mark;
    std::erase_if(mapping->entries, [](const NodeEntry& e) { return e.key == "rpy"; });
    mapping->entries.push_back({"quaternion_wxyz", mark, list_node(std::vector<double>{q.w, q.x, q.y, q.z}, mark)});
    apply_change(scenario, {of, mark, std::move(*mapping), {}}, unused);
  }
}

void complete_places(const std::vector<UncertainPaths>& uncertain, const Node& filled, Node& scenario) {
  for (const UncertainPaths& where : uncertain) {
    for (std::size_t p = 0; p < where.paths.size(); ++p) {
      FaultList unused;
      const Node* from = &filled;
      Node* to = &scenario;
      for (const PathStep& step : path_steps(filled, where.paths[p], where.path_marks[p], unused)) {
        if (step.is_index) {
          from = &from->items[step.index], to = &to->items[step.index];
          continue;
        }
        const NodeEntry* entry = from->entry(step.key);
        if (!entry) break;
        if (!to->find(step.key)) to->entries.push_back(*entry);
        from = &entry->value, to = to->find(step.key);
      }
    }
  }
}

bool report_unknown_keys(const UncertainPaths& where, const Node& scenario, FaultList& faults) {
  bool found = false;
  for (std::size_t p = 0; p < where.paths.size(); ++p) {
    const Mark& mark = where.path_marks[p];
    FaultList all;
    const std::vector<PathStep> steps = path_steps(scenario, where.paths[p], mark, all);
    if (steps.empty() || place_rule(steps).is_known) continue;
    // What the path would put there is checked as if the scenario had it; what is at its mark is about it.
    Node tree = scenario;
    apply_change(tree, {where.paths[p], mark, Node{}, {}}, all);
    check_structure(tree, scenario_schema_document(), "the scenario", all);
    for (const Fault& fault : all.all()) {
      const bool is_here = fault.line == mark.line && fault.column == mark.column;
      if (!is_here || !fault.message.starts_with("unknown key")) continue;
      faults.add(mark, where.place + ": " + fault.message);
      found = true;
      break;
    }
  }
  return found;
}

UncertainForm form_at(const UncertainPaths& where, const Node& scenario, FaultList& faults) {
  UncertainForm form;
  for (std::size_t p = 0; p < where.paths.size(); ++p) {
    const std::vector<PathStep> steps = path_steps(scenario, where.paths[p], where.path_marks[p], faults);
    if (steps.empty()) continue;
    const auto value = value_at(scenario, where.paths[p]);
    form.forms.push_back(value.value_or(Node{}));
    form.is_absent = form.is_absent || !value;
    if (!value) continue;
    const auto numbers = numbers_in(*value);
    if (numbers) form.nominal.insert(form.nominal.end(), numbers->begin(), numbers->end());
  }
  return form;
}

}  // namespace grapnel
